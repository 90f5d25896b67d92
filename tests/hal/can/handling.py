"""How tests handle a robot with CAN drives: arm it, drive it, see that a fault stops it, let it recover."""

from collections.abc import Callable
from contextlib import suppress

import pytest

from vrg.errors import RobotError
from vrg.testing.can.bench import PATIENCE, DeviceBench, Drives
from vrg.testing.driver import STANDSTILL_SPEED
from vrg.types import Twist

AHEAD = Twist(0.33, 0.0)


def wait(bench: DeviceBench, condition: Callable[[], object], what: str) -> None:
    """Let time pass until the condition holds."""
    deadline = bench.now + PATIENCE
    while not condition():
        assert bench.now < deadline, f"waited {PATIENCE:g} s for {what}"
        bench.advance(0.05)


def armed(bench: DeviceBench) -> None:
    """Connected and armed, as a player does it."""
    bench.device.start()
    bench.advance(0.1)
    wait(bench, lambda: is_armed(bench), "an armed robot")


def is_armed(bench: DeviceBench) -> bool:
    """Ask for it, as a player does at every tick, where it is not armed yet."""
    if not bench.device.read().armed:
        bench.device.arm()
    return bench.device.read().armed


def driving(bench: DeviceBench) -> None:
    """Connected, armed and under way."""
    armed(bench)
    gets_going(bench)


def gets_going(bench: DeviceBench) -> None:
    """Drive as a player does until it is under way."""
    drive_until(bench, lambda: bench.speed > 0.3, "it does not drive")


def notices(bench: DeviceBench) -> None:
    """Drive on as a player does until there is a fault."""
    drive_until(bench, lambda: bench.trouble, "nobody notices")


def drive_until(bench: DeviceBench, condition: Callable[[], object], otherwise: str) -> None:
    """Drive as a player does until the condition holds."""
    deadline = bench.now + PATIENCE
    while not condition():
        assert bench.now < deadline, f"{otherwise}: {bench.device.read()}"
        drive_on(bench)


def drive_on(bench: DeviceBench, twist: Twist = AHEAD, seconds: float = 0.1) -> None:
    """What a player goes on doing: drive, or arm where it is not armed."""
    with suppress(RobotError):
        if bench.device.read().armed:
            bench.device.drive(twist)
        else:
            bench.device.arm()
    bench.advance(seconds)


def assert_latched(bench: DeviceBench, drives: Drives, words: str) -> None:
    """The fault is told, every motor stands, and it stays so although the player goes on."""
    wait(bench, lambda: bench.trouble, "a fault")
    fault = bench.trouble
    assert words in fault
    assert bench.device.read().latched
    wait(bench, lambda: at_rest(drives), "the motors to stand")
    for _ in range(8):
        drive_on(bench)
    assert at_rest(drives)
    # A drive that sends rubbish may say that it is on, which is told in place of whatever has latched before.
    on = "node 0: it is on, though it was ordered to be off: cut the power of its motor"
    assert bench.device.read().fault in (fault, on)
    with pytest.raises(RobotError):
        bench.device.drive(AHEAD)


def at_rest(drives: Drives) -> bool:
    """Whether every emulated motor stands."""
    return all(abs(drive.motor.velocity) < 0.5 for drive in drives.drives)


def recovers(bench: DeviceBench) -> None:
    """An official's word clears it, and the robot drives again once it is armed."""
    bench.recover()
    wait(bench, lambda: bench.device.read().fault is None, "the fault to be cleared")
    bench.advance(0.6)
    assert not bench.device.read().armed, "recovering does not arm"
    assert abs(bench.speed) < STANDSTILL_SPEED
    gets_going(bench)
    assert bench.device.read().fault is None
