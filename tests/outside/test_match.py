"""A match of real processes in which everything but VRG itself is somebody else's, down to the robot."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from vrg.games import GAMES
from vrg.recording.reader import read_tracks
from vrg.testing.processes.match import LiveMatch
from vrg.testing.waiting import DEADLINE

pytestmark = [pytest.mark.system, pytest.mark.thorough]

LONGER = (
    ('map = "island"', 'map = "open"'),
    ("x = 4.0", "x = 90.0"),
    ("y = 0.0\n", 'y = 0.0\n[backends.hover]\nfault_file = "broken"\n'),
    ("x = -4.0", 'backend = "hover"\nx = -60.0'),
    ("x = -5.0", "x = -60.0"),
)
"""What makes a long race of the one of the package, with a robot that its driver drives."""


@pytest.fixture
def race(tmp_path: Path, installed: None) -> Iterator[LiveMatch]:
    text = GAMES.get("race").default_match().read_text()
    for old, new in LONGER:
        assert text.count(old) == 1
        text = text.replace(old, new)
    with LiveMatch(tmp_path, text, movers=("amber", "jade"), options=["--show", "crier=oyez"]) as match:
        yield match


def test_a_robot_of_somebody_elses_driver_obeys_the_match(race: LiveMatch, tmp_path: Path) -> None:
    observer = race.observer
    assert {body.name: body.physical for body in observer.heard.poses[-1].body.bodies} == {"amber": True, "jade": False}

    # A process of a kind of the package's is one of the match's own, and another one is opened beside it.
    shown = f"the calls of race, by {race.endpoint}"
    observer.wait_until(lambda: shown in race.said(), "the launcher to print where it is")
    command = [sys.executable, "-m", "vrg", "show", "crier", str(race.run.match_file), "--router", race.endpoint]
    with (tmp_path / "cries").open("wb") as cries:
        crier = subprocess.Popen(command, stdout=cries, stderr=subprocess.STDOUT)

    # The referee's gate: a halt stops it whatever its player does.
    race.command("official", "halt")
    observer.wait_until(lambda: observer.standing("amber", "jade"), "both to stand in the halt")
    race.resume()

    # The emergency stop, and its release.
    race.command("estop")
    observer.wait_until(lambda: observer.standing("amber", "jade"), "both to stand in the emergency stop")
    observer.wait_until(lambda: not observer.heard.robots["jade"][-1].body.armed, "the motors to be off")
    race.command("estop", "--release")
    race.resume()

    # A fault of the robot halts the match until the robot has recovered.
    (tmp_path / "broken").touch()
    observer.wait_until(lambda: "the fault file is there" in (observer.state.halted or ""), "the halt by the fault")
    observer.wait_until(lambda: observer.standing("amber", "jade"), "both to stand")
    (tmp_path / "broken").unlink()
    refused = race.vrg("official", "resume")
    assert refused.returncode != 0
    assert "the fault file is there" in refused.stdout + refused.stderr
    race.command("official", "recover", "amber")
    race.resume()

    # Its pose is where it was carried, once an official has said so.
    race.command("official", "halt")
    observer.wait_until(lambda: observer.standing("amber", "jade"), "both to stand")
    race.command("official", "place", "amber", "--pose", "86", "3", "0")
    observer.wait_until(lambda: abs(observer.body("amber").pose.x - 86.0) < 0.1, "the match to know where it is")
    race.resume()
    observer.wait_until(lambda: observer.body("amber").pose.x > 86.5, "it to go on from there")

    observer.wait_until(lambda: "hear ye: " in (tmp_path / "cries").read_text(), "the calls to be cried")
    crier.send_signal(signal.SIGINT)
    assert crier.wait(DEADLINE) == 130, (tmp_path / "cries").read_text()

    assert race.wait_ended() == 0
    assert "oyez: " in race.log("crier")
    assert "amber at the finish" in race.said()
    assert set(read_tracks(race.run.recording)) == {"amber", "jade"}
