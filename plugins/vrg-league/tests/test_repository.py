"""A league in a git repository: what the services run, run in clones of a bare one."""

import shutil
import subprocess
from pathlib import Path

import pytest
from experiments import OWN, with_vrg

from vrg.launch.sandbox.seal import missing
from vrg.testing.requirements import missing as lacking
from vrg.testing.tiny import TINY

DEPLOY = Path(__file__).parents[1] / "deploy" / "repository"


def ran(folder: Path, *command: str) -> "subprocess.CompletedProcess[str]":
    """A command in a clone."""
    names = ("GIT_AUTHOR_NAME", "GIT_COMMITTER_NAME", "GIT_AUTHOR_EMAIL", "GIT_COMMITTER_EMAIL")
    variables = with_vrg() | dict.fromkeys(names, "t") | {"VRG_MATCH": "tiny.toml", "VRG_GAMES": "2"}
    return subprocess.run(command, cwd=folder, env=variables, check=False, capture_output=True, text=True)


def clone(place: Path, name: str) -> Path:
    assert ran(place, "git", "clone", "-q", "origin.git", name).returncode == 0
    return place / name


def commit(folder: Path, **entries: str) -> None:
    (folder / "entries").mkdir(exist_ok=True)
    for name, code in entries.items():
        (folder / "entries" / f"{name}.py").write_text(code)
    for command in ("git add -A", "git commit -qm change"):
        assert ran(folder, *command.split()).returncode == 0


@pytest.mark.thorough
def test_a_league_is_checked_and_played_and_kept_in_a_repository(tmp_path: Path) -> None:
    if (why := missing()) is not None:
        lacking(why)
    assert ran(tmp_path, "git", "init", "-q", "--bare", "-b", "main", "origin.git").returncode == 0
    first = clone(tmp_path, "first")
    shutil.copytree(DEPLOY, first / "league")
    (first / "tiny.toml").write_text(TINY)
    commit(first, ann=f"{OWN}return STILL\n", bob=f"{OWN}return Twist(0.5, 0.0)\n")
    assert ran(first, "git", "push", "-q", "origin", "HEAD:main").returncode == 0
    played = ran(first, "league/league.sh", "play")
    assert "2 games played, 2 in all" in played.stdout, played.stdout + played.stderr
    assert (first / "public" / "index.html").is_file()

    second = clone(tmp_path, "second")
    commit(second, cem="def", dora=f"{OWN}return STILL\n")
    checked = ran(second, "league/league.sh", "check", "origin/main")
    assert checked.returncode == 1
    assert "cem.py: cannot be read as Python" in checked.stdout
    assert "it can play in a league" in checked.stdout
    assert "ann.py" not in checked.stdout, "what has not changed is not checked"
    again = ran(second, "league/league.sh", "play")
    assert "2 games played, 4 in all" in again.stdout, again.stdout + again.stderr
    log = ran(second, "git", "log", "--oneline", "origin/league").stdout
    assert len(log.splitlines()) == 2, log
