"""A match in lockstep over several machines, each with an sshd of its own, is the same as in one process."""

import hashlib
import os
import re
import signal
import subprocess
from pathlib import Path

import psutil
import pytest

from tests.system.lab import VRG, Lab, laboratory
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

MATCH = """
name = "spread"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
seed = 5
lasers = false
[rules]
x = [-5.0, 5.0]
y = [-8.0, 8.0]
passes = 1
pass_limit = 10.0
"""
PLAYERS = (("shark", "shark", 0.0, -7.0), ("annika", "minnow", -3.0, 7.0), ("bob", "minnow", 3.0, 7.0))
ANNIKA = """
from vrg.agents import Action, Strategy, Twist
class Annika(Strategy):
    def act(self, view):
        print("annika decides")
        return Action(Twist(0.4, 0.1), "Circle")
"""
PATIENCE = 300.0


def played(folder: Path, lab: Lab, *options: str) -> subprocess.Popen[str]:
    command = [VRG, "play", "match.toml", "--headless", "--no-record", "--runs", "runs", *options]
    return subprocess.Popen(
        command, cwd=folder, env={**os.environ, **lab.environment}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True,
    )  # fmt: skip


def run_of(process: subprocess.Popen[str], folder: Path) -> Path:
    """The run folder of a match that ends well."""
    output = process.communicate(timeout=PATIENCE)[0]
    assert process.returncode == 0, output
    found = re.search(r"Recorded in (\S+):", output)
    assert found, output
    return folder / found[1]


def write(folder: Path, lab: Lab) -> None:
    players = [
        f'[[players]]\nname = "{name}"\nrole = "{role}"\nx = {x}\ny = {y}\nmachine = "{machine}"\n'
        for (name, role, x, y), machine in zip(PLAYERS, lab.hosts, strict=True)
    ]
    text = MATCH + lab.tables() + "".join(players)
    own = 'name = "annika"\nstrategy = "annika.py:Annika"'
    (folder / "match.toml").write_text(text.replace('name = "annika"', own))
    (folder / "annika.py").write_text(ANNIKA)


def test_it_is_the_same_over_three_machines_and_where_a_process_was_killed(tmp_path: Path) -> None:
    with laboratory(tmp_path / "lab", "h1", "h2", "h3") as lab:
        write(tmp_path, lab)
        alone = run_of(played(tmp_path, lab, "--in-process"), tmp_path)
        spread = run_of(played(tmp_path, lab, "--lockstep", "--deadline", "4"), tmp_path)
        digests = {hashlib.sha256((run / "journal.jsonl").read_bytes()).hexdigest() for run in (alone, spread)}
        assert len(digests) == 1
        assert "annika decides" in (spread / "logs" / "annika.log").read_text()

        wait_until(lambda: not strategies("annika"), "the end of the processes of the match before")
        before = set((tmp_path / "runs").iterdir())
        process = played(tmp_path, lab, "--lockstep", "--deadline", "4", "--rate", "1")
        # It takes ten times as long.
        wait_until(lambda: seconds_of(tmp_path, before) >= 3, "three seconds of the match", patience=PATIENCE)
        strategies("annika")[0].send_signal(signal.SIGKILL)
        killed = run_of(process, tmp_path)
        assert '"type":"missed"' in (killed / "steps.jsonl").read_text()
        again = subprocess.run(
            [VRG, "run", "repeat", str(killed)], cwd=tmp_path, capture_output=True, text=True, check=False,
            timeout=PATIENCE,
        )  # fmt: skip
        assert again.returncode == 0, again.stdout + again.stderr
        assert "The same" in again.stdout
        wait_until(lambda: not strategies("annika"), "nothing to be left on any machine")


def seconds_of(folder: Path, before: set[Path]) -> int:
    """How many seconds of the newest match have been played."""
    logs = [run / "steps.jsonl" for run in set((folder / "runs").iterdir()) - before]
    return sum(len(log.read_text().splitlines()) for log in logs if log.exists())


def strategies(player: str) -> list[psutil.Process]:
    """The processes in which the strategy of a player decides. No other test may have a player of this name."""
    # One that has gone meanwhile has no command line.
    running = psutil.process_iter(["cmdline"])
    return [p for p in running if " ".join(p.info["cmdline"] or ()).startswith(f"vrg strategy {player} in ")]
