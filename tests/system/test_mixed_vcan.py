"""Matches of physical and virtual robots on a CAN interface of the kernel."""

import subprocess
from collections.abc import Callable

import pytest

from tests.system.conftest import Arena
from tests.system.harness import Match, match_text
from tests.system.tap import Tap
from tests.vcan import IN_REAL_TIME, INTERFACE, VCAN
from vrg.hal.can.link import Link
from vrg.hal.can.odrive import messages

pytestmark = [pytest.mark.thorough, pytest.mark.system, pytest.mark.vcan]

WIRING = {"ann": (0, 1), "bob": (2, 3)}


@IN_REAL_TIME
def test_an_emergency_stop_and_an_interface_that_goes_down(start: Callable[..., Match]) -> None:
    match = start(match_text("mixed-vcan", length=190.0, width=60.0, zone=6.0, wiring=WIRING, link=VCAN))
    observer = match.observer
    with Tap(VCAN) as tap:
        match.command("estop", "--reason", "test")
        observer.wait_until(
            lambda: tap.count(0, messages.Command.ESTOP) and tap.count(3, messages.Command.ESTOP), "Estop frames"
        )
        observer.wait_until(lambda: tap.standing(0, 1, 2, 3), "all motors to stand")
        match.command("estop", "--release")
        match.resume()
        observer.wait_until(lambda: observer.moving("ann", "bob"), "both to move again")
        subprocess.run(["ip", "link", "set", INTERFACE, "down"], check=True)
        try:
            observer.wait_until(lambda: "the interface is down" in (observer.state.halted or ""), "the halt")
        finally:
            subprocess.run(["ip", "link", "set", INTERFACE, "up"], check=True)
        observer.wait_until(lambda: tap.standing(0, 1, 2, 3), "the motors to stand")
        match.command("official", "recover")
        match.resume()
        observer.wait_until(lambda: observer.moving("ann", "bob"), "both to move again")


def test_a_bus_that_is_missing_is_said_at_once(arena: Arena, tmp_path_factory: pytest.TempPathFactory) -> None:
    arena.clear()
    folder = tmp_path_factory.mktemp("missing")
    link = Link(channel="vcan9")
    match = Match(folder, match_text("mixed-missing", length=13.0, width=9.0, zone=2.5, wiring=WIRING, link=link))
    try:
        assert match.launcher.wait(120.0) == 1
        assert "vcan9: no such CAN interface on this machine" in match.said()
    finally:
        match.close()
