"""A commander in a process of its own, with a virtual gamepad, in a match of processes."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from tests.system.harness import Match, wait_until
from tests.system.test_leases import STILL, lease_match
from vrg.bus.pacing import LEASE

pytestmark = pytest.mark.system

REDS = ("red1", "red2", "red3", "red4")
DIRECTIONS = (
    pygame.CONTROLLER_BUTTON_DPAD_UP,
    pygame.CONTROLLER_BUTTON_DPAD_RIGHT,
    pygame.CONTROLLER_BUTTON_DPAD_DOWN,
    pygame.CONTROLLER_BUTTON_DPAD_LEFT,
)
TICK = 0.1
"""The match time in s between two ticks of a player."""
BRAKING = 1.5
"""The match time in s in which a robot stands after its last command: the lease, a tick of its player, and brakes."""


class Coach:
    """The hands of the person with the gamepad."""

    def __init__(self, match: Match, folder: Path, team: str = "red") -> None:
        self._log = folder / f"commander-{team}.log"
        root = Path(__file__).parents[2]
        paths = [str(root), *filter(None, [os.environ.get("PYTHONPATH")])]
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "tests.system.commander_process", match.endpoint, match.keys.match, team],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=root,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
                text=True,
            )

    def said(self) -> str:
        return self._log.read_text()

    def do(self, *lines: str) -> None:
        assert self.process.stdin is not None
        for line in lines:
            self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def press(self, button: int) -> None:
        self.do(f"button {button} 1")

    def let_go(self, button: int) -> None:
        self.do(f"button {button} 0")


@contextlib.contextmanager
def coach(match: Match, folder: Path) -> Iterator[Coach]:
    found = Coach(match, folder)
    try:
        wait_until(lambda: "ready" in found.said(), "the commander's window")
        # The first press only takes the gamepad into use.
        found.press(pygame.CONTROLLER_BUTTON_A)
        found.let_go(pygame.CONTROLLER_BUTTON_A)
        yield found
    finally:
        found.process.kill()
        found.process.wait()


def drive(coach: Coach, match: Match, index: int) -> None:
    """Select a player and drive it ahead."""
    name = REDS[index]
    coach.press(DIRECTIONS[index])
    coach.let_go(DIRECTIONS[index])
    coach.press(pygame.CONTROLLER_BUTTON_RIGHTSHOULDER)
    coach.do(f"axis {pygame.CONTROLLER_AXIS_LEFTY} -1.0")
    match.observer.wait_moving(name)
    match.observer.wait_until(lambda: match.observer.mode(name) == "Manual", f"{name} to say so")


def test_a_commander_that_dies_or_loses_its_gamepad_while_it_drives(tmp_path: Path) -> None:
    (tmp_path / "still.py").write_text(STILL, encoding="utf-8")
    with Match(tmp_path, lease_match(REDS), movers=()) as match:
        observer = match.observer
        with coach(match, tmp_path) as hands:
            for index, name in enumerate(REDS):
                drive(hands, match, index)
                others = [other for other in REDS if other != name]
                assert observer.standing(*others), "it drives one player alone"
                # The same button again gives it back.
                hands.press(DIRECTIONS[index])
                hands.let_go(DIRECTIONS[index])
                observer.wait_until(lambda name=name: observer.mode(name) != "Manual", f"{name} to be given back")
                observer.wait_until(lambda name=name: observer.standing(name), f"{name} to stand")
            drive(hands, match, 1)
            hands.do("unplug")
            observer.wait_until(lambda: observer.mode("red2") != "Manual", "red2 to be given back")
            observer.wait_until(lambda: observer.standing("red2"), "red2 to stand")
        with coach(match, tmp_path) as hands:
            drive(hands, match, 2)
            before = len(observer.heard.poses)
            hands.process.send_signal(signal.SIGKILL)
            observer.wait_until(lambda: observer.mode("red3") != "Manual", "red3 to be in its own control")
            observer.wait_until(lambda: observer.standing("red3"), "red3 to stand")
            # The commander is dead: its newest command has arrived by now. Whoever holds no lease any more says so at
            # its next tick, however late that comes.
            last = max(manual.stamp for manual in observer.heard.manuals["red3"])
            driven = max(r.stamp for r in observer.heard.reports["red3"] if r.body.manual)
            assert driven <= last + LEASE + TICK
            moved = observer.last_motion("red3", before)
            assert moved is not None
            assert moved <= last + BRAKING


@pytest.mark.thorough
def test_priorities_reach_the_team_and_end_with_the_commander(tmp_path: Path) -> None:
    text = lease_match(REDS).replace('[teams.red]\nstrategy = "still.py:Still"', '[teams.red]\nstrategy = "team-flag"')
    (tmp_path / "still.py").write_text(STILL, encoding="utf-8")
    with Match(tmp_path, text, movers=()) as match:
        observer = match.observer

        def jobs() -> set[str]:
            return {observer.mode(name).rpartition("/")[2] for name in REDS}

        observer.wait_until(lambda: jobs() == {"Guard"}, "all to guard, as their strategy says")
        with coach(match, tmp_path) as hands:
            hands.press(pygame.CONTROLLER_BUTTON_Y)
            observer.wait_until(lambda: jobs() == {"Attack"}, "Hail Mary: all attack")
            refused = match.vrg("show", "commander", "green", match.keys.match, "--router", match.endpoint)
            assert refused.returncode == 1
            hands.process.kill()
        observer.wait_until(lambda: jobs() == {"Guard"}, "their own strategy to count again")
