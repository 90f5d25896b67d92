"""An author with rules: each loss has a reason, and each reason a remedy.

It is run in a folder with `report.json` and, once there is one, its entry as `player.py`, which it writes anew.
"""

import json
import sys
from pathlib import Path
from string import Template


def main() -> None:
    """Write the next version."""
    report = json.loads(Path("report.json").read_text())
    kept = Path("ideas.json")
    ideas = json.loads(kept.read_text()) if kept.exists() else {"SPEED": 0.4, "FEAR": 0.0, "LEAD": 0.0, "seen": 0}
    why = "the first idea"
    new = [game for game in report["games"] if game["number"] > ideas["seen"]]
    for side, rule, name, step, words in (
        ("minnows", "tag", "FEAR", 3.0, "its minnows were tagged"),
        ("sharks", "game_over", "LEAD", 0.4, "minnows got past its sharks"),
    ):
        lost = [game for game in new if game["side"] == side and game["result"] == "lost"]
        if any(call["rule"] == rule for game in lost for call in game["calls"]):
            ideas[name] += step
            ideas["SPEED"] = min(0.7, ideas["SPEED"] + 0.1)
            why = f"{words} in {len(lost)} of {len(new)} games"
    ideas["seen"] = max([ideas["seen"], *(game["number"] for game in new)])
    kept.write_text(json.dumps(ideas))
    print(why, ideas)
    numbers = {name: f"{ideas[name]:g}" for name in ("SPEED", "FEAR", "LEAD")}
    template = Template(Path(sys.argv[1]).read_text())
    text = template.substitute(numbers, AUTHOR="Ann", VERSION=len(report["versions"]) + 1, WHY=why)
    if why != "the first idea" or not Path("player.py").exists():
        Path("player.py").write_text(text)


if __name__ == "__main__":
    main()
