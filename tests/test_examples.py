"""The examples do what the README says of them."""

import json
import os
from pathlib import Path

from mcap.reader import make_reader

from vrg.testing.command_line import invoke

ROOT = Path(__file__).parents[1]


def test_a_match_with_players_of_ones_own_is_played(tmp_path: Path) -> None:
    match = str(ROOT / "examples" / "my_match.toml")
    done = invoke("play", match, "--in-process", "--engine", "planar", "--runs", str(tmp_path))
    assert done.exit_code == 0, done.output
    run = next(tmp_path.iterdir())
    result = json.loads((run / "result.json").read_text())
    assert result["ended"] == "game over"
    assert {"journal.jsonl", "recording.mcap", "trajectories.png", "match.toml"} <= set(os.listdir(run))
    with (run / "recording.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    topics = {channel.topic for channel in summary.channels.values()}
    robot = next(topic.split("/")[2] for topic in topics if topic.endswith("/report"))
    recorded = {"/poses", "/referee/state", f"/player/{robot}/report"}
    assert {"/view/field", "/view/scene", f"/view/robot/{robot}", f"/view/{robot}/laser/front", *recorded} <= topics
    layout = json.loads((run / "foxglove-layout.json").read_text())
    assert any(robot in line["value"] for line in layout["configById"]["Plot!speed"]["paths"])


def test_the_player_in_the_readme_is_the_example(tmp_path: Path) -> None:
    readme = (ROOT / "README.md").read_text()
    code = readme.split("```python\n")[1].split("```")[0]
    (tmp_path / "circler.py").write_text(code)
    text = (ROOT / "examples" / "my_match.toml").read_text().replace("my_minnow.py:WallHugger", "circler.py:Circler")
    (tmp_path / "match.toml").write_text(text)
    done = invoke("check", str(tmp_path / "match.toml"))
    assert done.exit_code == 0, done.exception
