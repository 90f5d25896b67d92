"""VRG in processes that lack what Linux alone has, as `sitecustomize` here takes it from them."""

import os
import subprocess
import sys
from pathlib import Path

from vrg.testing.tiny import TINY

SYSTEMS = ("darwin", "win32")


def python_on(system: str, home: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python as on another system, and let whatever it starts run so; a folder has what it keeps for its user."""
    environment = os.environ | {"VRG_SYSTEM": system, "PYTHONPATH": str(Path(__file__).parent)}
    environment |= {"XDG_STATE_HOME": str(home), "COLUMNS": "200"}
    command = [sys.executable, "-P", *arguments]
    return subprocess.run(command, cwd=home, env=environment, capture_output=True, text=True, check=False)


def play_and_judge(system: str, home: Path, *how: str) -> subprocess.CompletedProcess[str]:
    """Play a match of which one strategy is a file, let its record be judged, and return how it was played."""
    (home / "circler.py").write_text(
        "from vrg.agents import Strategy, Twist\n\n\n"
        "class Circler(Strategy):\n    def act(self, view):\n        return Twist(v=0.5, w=1.0)\n"
    )
    match = TINY.replace('name = "ann"', 'name = "ann"\nstrategy = "circler.py:Circler"')
    (home / "tiny.toml").write_text(match)
    played = python_on(system, home, "-m", "vrg", "play", "tiny.toml", "--headless", *how)
    assert played.returncode == 0, played.stdout + played.stderr
    (run,) = (home / "runs").iterdir()
    judged = python_on(system, home, "-m", "vrg", "run", "judge", str(run))
    assert judged.returncode == 0, judged.stdout + judged.stderr
    assert "no disagreement" in judged.stdout
    return played
