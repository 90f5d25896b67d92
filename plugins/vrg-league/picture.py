"""Makes leaderboard.png: plays a tournament of a class, and takes its page as Debian's Chromium shows it.

Usage: `.venv/bin/python plugins/vrg-league/picture.py`.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from vrg.templates import filled

HERE = Path(__file__).resolve().parent
CLASS = ("ann", "bob", "cem", "Anna Maria", "eve", "finn", "gül", "Team Red", "ida", "jan")
"""The players of the tournament whose leaderboard is shown. They differ in their sharks, and in how minnows flee."""


def leaderboard(path: Path, folder: Path) -> None:
    """Write the leaderboard of a tournament, as Debian's Chromium shows it."""
    files = folder / "class"
    files.mkdir()
    written = (
        filled("player.py.template", class_name="Ann"),
        (HERE.parents[1] / "examples" / "first_player.py").read_text(encoding="utf-8"),
    )
    for number, name in enumerate(CLASS):
        text = re.sub(r"(?m)^FEAR = .*", f"FEAR = {1.0 + number / 2}", written[number % 2])
        (files / f"{name}.py").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "vrg", "tournament", str(files), "--match", "sharks-and-minnows", "--games", "4"]
    cup = folder / "cup"
    more = ["--no-lasers", "--no-sandbox", "--output", str(cup)]
    subprocess.run([*command, *more], check=True, stdout=subprocess.DEVNULL)
    browser = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1280,720"]
    subprocess.run([*browser, f"--screenshot={path}", (cup / "leaderboard.html").as_uri()], check=True)
    Image.open(path).convert("RGB").quantize(32).save(path, optimize=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        leaderboard(HERE / "leaderboard.png", Path(place))
