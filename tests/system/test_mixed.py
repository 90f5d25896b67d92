"""Matches of physical and virtual robots: real processes, emulated drives, CAN frames in multicast on the loopback."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import psutil
import pytest

from tests.system.conftest import FAULTS, STUCK_ONCE
from tests.system.tap import Tap
from vrg.hal.can.odrive import messages
from vrg.testing.can.vcan import UDP, require_loopback
from vrg.testing.processes.arena import Arena
from vrg.testing.processes.match import MINNOWS, LiveMatch, match_text

pytestmark = pytest.mark.system

WIRING = {"ann": (0, 1), "bob": (2, 3)}
OTHER_GROUP = "239.74.163.9"
"""The bus of robots that speak another protocol: two protocols cannot share one."""


def mixed_match(folder: Path) -> str:
    """Long, with two of four robots on the bus.

    On a busy machine a player that is started again may be silent for so long that it would be out until the next pass.

    Args:
        folder: that of the strategy of bob, which can be made to hang.
    """
    text = match_text("mixed-long", length=190.0, width=60.0, zone=6.0, wiring=WIRING)
    return 'sandbox = false\non_fault = "halt"\n' + text.replace(
        'name = "bob"', f'name = "bob"\nstrategy = "{folder}/stuck.py:Stuck"'
    )


@pytest.fixture(scope="module", autouse=True)
def loopback() -> None:
    require_loopback()


@pytest.fixture(scope="module")
def strategies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the strategy that can be made to hang."""
    folder = tmp_path_factory.mktemp("strategies")
    (folder / "stuck.py").write_text(STUCK_ONCE)
    return folder


@pytest.fixture
def mixed(arena: Arena, strategies: Path) -> LiveMatch:
    """The shared match, in play, with every minnow moving."""
    match = arena.shared(mixed_match(strategies))
    plays_on(match, *MINNOWS)
    return match


@pytest.fixture
def tap() -> Iterator[Tap]:
    with Tap(UDP) as tap:
        yield tap


def stays(match: LiveMatch, tap: Tap, *nodes: int) -> None:
    """The motors stand for a while, although everybody goes on."""
    began = len(match.observer.heard.poses)
    match.observer.time_passes(1.0, "standing")
    assert tap.standing(*nodes)
    assert len(match.observer.heard.poses) > began


def plays_on(match: LiveMatch, *names: str) -> None:
    """Wait until these move; whenever play is halted meanwhile, an official recovers the robots and resumes it.

    A new player may be too late for its robot's pose to be in time: whether that halts play is a matter of speed.
    """
    observer = match.observer

    def moving() -> bool:
        observer.go_on()
        return observer.playing and observer.moving(*names)

    observer.wait_until(moving, f"{', '.join(names)} to move again", patience=90.0)


def test_bodies_are_told_apart_and_time_is_real(mixed: LiveMatch) -> None:
    observer = mixed.observer
    physical = {body.name: body.physical for body in observer.heard.poses[-1].body.bodies}
    assert physical == {"shark": False, "ann": True, "bob": True, "cid": False}
    assert observer.heard.clocks[-1].body.rate == 1.0
    assert not observer.heard.robots["ann"], "the world simulates no state of a physical robot"
    assert observer.heard.robots["cid"]


@FAULTS
def test_the_drives_stop_the_motors_of_a_player_that_fails(mixed: LiveMatch, tap: Tap, fault: signal.Signals) -> None:
    observer = mixed.observer
    old = mixed.child("ann")
    observer.wait_until(lambda: abs(tap.velocity(0)) > 5 and abs(tap.velocity(1)) > 5, "ann's motors to turn")
    before = observer.body("ann").pose
    old.send_signal(fault)
    failed = time.monotonic()
    observer.wait_until(lambda: tap.standing(0, 1), "ann's motors to stand")
    watchdog = messages.AxisError.WATCHDOG_TIMER_EXPIRED
    observer.wait_until(lambda: tap.errors(0) & watchdog and tap.errors(1) & watchdog, "the drives to say why")
    sent = tap.setpoints(0, failed)
    assert sent <= 1, f"{sent} setpoints came from a process that does nothing"
    mixed.wait_replaced("ann", old)
    plays_on(mixed, "ann", "bob")
    now = observer.body("ann").pose
    assert abs(now.x - before.x) < 5.0, "the new player knows where its robot is"
    assert before.y - 60.0 < now.y < before.y + 5.0


@pytest.mark.thorough
def test_a_player_in_an_endless_loop_drives_no_motor_and_hears_the_emergency_stop(
    mixed: LiveMatch, tap: Tap, strategies: Path
) -> None:
    """Its player, which hears the CAN bus and the match, switches off what the drives' watchdogs have not."""
    observer = mixed.observer
    old = mixed.child("bob")
    (strategies / "hang").touch()
    observer.wait_until((strategies / "was_stuck").exists, "bob to be stuck")
    stuck = time.monotonic()
    observer.estop()

    def gone() -> bool:
        return not old.is_running() or old.status() == psutil.STATUS_ZOMBIE

    orders = [messages.Command.ESTOP for _ in WIRING["bob"]]
    observer.wait_until(
        lambda: all(map(tap.count, WIRING["bob"], orders)) or gone(), "an Estop frame for each motor of bob"
    )
    assert not gone(), "the player whose strategy hangs has sent them"
    observer.wait_until(lambda: tap.standing(2, 3), "bob's motors to stand")
    assert tap.setpoints(2, stuck) == 0
    mixed.wait_replaced("bob", old)
    # Who is not there yet does not hear the release.
    reports = len(observer.heard.reports["bob"])
    observer.wait_until(lambda: len(observer.heard.reports["bob"]) > reports, "the new bob to report")
    mixed.command("estop", "--release")
    plays_on(mixed, "ann", "bob")


def test_the_emergency_stop_reaches_the_drives_and_is_released_by_hand(mixed: LiveMatch, tap: Tap) -> None:
    observer = mixed.observer
    mixed.command("estop", "--reason", "test")
    observer.wait_until(
        lambda: tap.count(0, messages.Command.ESTOP) and tap.count(3, messages.Command.ESTOP), "Estop frames"
    )
    observer.wait_until(lambda: tap.standing(0, 1, 2, 3), "all motors to stand")
    estop = messages.AxisError.ESTOP_REQUESTED
    observer.wait_until(lambda: all(tap.errors(n) & estop for n in range(4)), "every drive to have latched it")
    stays(mixed, tap, 0, 1, 2, 3)
    mixed.command("estop", "--release")
    observer.wait_until(lambda: not any(tap.errors(n) & estop for n in range(4)), "every drive to be released")
    stays(mixed, tap, 0, 1, 2, 3)
    plays_on(mixed, "ann", "bob")


def test_drives_that_die_are_missed_and_come_back_after_a_recovery(mixed: LiveMatch, tap: Tap) -> None:
    observer = mixed.observer
    old = mixed.child("drives")
    old.kill()
    # A new process may be there before the heartbeats of the old one are missed; its drives are idle.
    observer.wait_until(
        lambda: any("ann: node" in why for why in (observer.state.halted or "", *observer.state.waiting)), "a halt"
    )
    observer.wait_until(observer.standing, "all robots to stand")
    mixed.wait_replaced("drives", old)
    observer.wait_until(lambda: tap.standing(0, 1, 2, 3), "the new drives to be heard")
    stays(mixed, tap, 0, 1, 2, 3)
    mixed.command("official", "recover")
    mixed.resume()
    plays_on(mixed, "ann", "bob")


@pytest.mark.thorough
def test_a_second_player_of_a_live_robot_is_refused_and_the_robot_notices_nothing(
    mixed: LiveMatch, tap: Tap, tmp_path: Path
) -> None:
    """It claims its name before it opens the bus: a second program that speaks to the drives would stop the robot."""
    observer = mixed.observer
    reports, since = len(observer.heard.reports["ann"]), len(tap.frames)
    command = [sys.executable, "-m", "vrg", "node", "player", "ann", str(mixed.run.match_file)]
    where = ["--router", mixed.endpoint, "--run", str(tmp_path / "other")]
    # It loads at a low priority: what is tested is not whether the machine is too busy for the first one. At the lowest
    # it would not load at all beside others.
    second = subprocess.Popen(["nice", "-n", "8", *command, *where], stderr=subprocess.PIPE, text=True)
    try:
        observer.wait_until(lambda: second.poll() is not None, "the second player to end", patience=240.0)
    finally:
        second.kill()
        _, said = second.communicate()
    assert second.returncode == 1
    assert "match 'mixed-long' already has a player named 'ann'" in said
    observer.time_passes(1.0, "the first one plays on")
    observer.wait_until(lambda: len(observer.heard.reports["ann"]) > reports + 5, "reports of the first one")
    assert [r.body.fault for r in observer.heard.reports["ann"][reports:] if r.body.latched] == []
    for node in WIRING["ann"]:
        assert tap.count(node, messages.Command.SET_INPUT_VEL, since) > 5
        assert tap.count(node, messages.Command.VERSION, since) == 0, f"somebody has met node {node}"
    plays_on(mixed, "ann")


@pytest.mark.thorough
def test_a_wrong_id_is_said_before_anything_moves(arena: Arena, tmp_path: Path) -> None:
    arena.clear()
    text = match_text("mixed-wrong", length=13.0, width=9.0, zone=2.5, wiring={"ann": (0, 1)}, can="emulate = false")
    with closing(LiveMatch(tmp_path, text)) as match:
        assert match.launcher.wait(120.0) == 1
    on = f"{UDP.interface}:{UDP.channel}"
    assert f"expected a heartbeat of odrive nodes 0, 1 on {on} within 3 s, got none" in match.said()
