"""A commander in a process of its own, with a virtual gamepad, in a match of processes."""

import contextlib
import signal
from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from tests.system.test_leases import LED, STILL, lease_match
from vrg.bus.pacing import LEASE
from vrg.testing.processes.match import LiveMatch
from vrg.testing.processes.programs import Helper, helper
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

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


def press(hands: Helper, button: int) -> None:
    """Press a button of the gamepad and let go of it."""
    hands.do(f"button {button} 1", f"button {button} 0")


@contextlib.contextmanager
def coach(match: LiveMatch, folder: Path) -> Iterator[Helper]:
    """The hands of the person with the gamepad."""
    where = (match.endpoint, match.keys.match, "red")
    with helper(Path(__file__).with_name("commander_process.py"), *where, log=folder / "commander.log") as hands:
        wait_until(lambda: "ready" in hands.said(), "the commander's window")
        press(hands, pygame.CONTROLLER_BUTTON_A)  # the first press only takes the gamepad into use
        yield hands


def drive(hands: Helper, match: LiveMatch, index: int) -> None:
    """Select a player and drive it ahead."""
    name = LED[index]
    press(hands, DIRECTIONS[index])
    hands.do(f"button {pygame.CONTROLLER_BUTTON_RIGHTSHOULDER} 1", f"axis {pygame.CONTROLLER_AXIS_LEFTY} -1.0")
    match.observer.wait_moving(name)
    match.observer.wait_until(lambda: match.observer.mode(name) == "Manual", f"{name} to say so")


def test_a_commander_that_dies_or_loses_its_gamepad_while_it_drives(tmp_path: Path) -> None:
    (tmp_path / "still.py").write_text(STILL, encoding="utf-8")
    with LiveMatch(tmp_path, lease_match(), movers=()) as match:
        observer = match.observer
        with coach(match, tmp_path) as hands:
            for index, name in enumerate(LED):
                drive(hands, match, index)
                others = [other for other in LED if other != name]
                assert observer.standing(*others), "it drives one player alone"
                # The same button again gives it back.
                press(hands, DIRECTIONS[index])
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
