"""Actuators at the digital outputs of CiA 402 drives, on simulated time."""

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, cast

import pytest
from cia402_wire import Wire

from vrg.errors import ConfigError, RobotError
from vrg.hal.actuators import Dribbler, Gripper, Kicker
from vrg.hal.can.axis import ProtocolOptions
from vrg.hal.can.driver import CanDriver
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.settings import CanSettings
from vrg.hal.driver import COMMAND_TIMEOUT, DriverContext
from vrg.hal.models import robot_model
from vrg.testing.can.bench import CanBench, Drives, Lab, settings
from vrg.testing.driver import DriverContract
from vrg.types import STILL, Twist
from vrg_drives.cia402.codec import Object
from vrg_drives.cia402.drive import Cia402Drive

LINK = Link(interface="virtual", channel="outputs")
HANDY = replace(
    robot_model("P2AT"),
    name="handy",
    actuators=(Kicker(most=6.0, width=0.1, pause=0.5), Gripper(width=0.3), Dribbler(width=0.2, pull=2.0)),
)
OUTPUTS = {
    "kicker": {"drive": 1, "bit": 16, "pulse": 0.01},
    "gripper": {"drive": 2, "bit": 17},
    "dribbler": {"drive": 2, "bit": 31},
}
KICK, GRIP, ROLL = 1 << 16, 1 << 17, 1 << 31
LATE = 0.012
"""s after the end of a pulse within which the receive thread has switched it off: encoders speak every 0.01 s."""


@pytest.fixture(autouse=True)
def drives() -> Iterator[list[Cia402Drive]]:
    with Drives("cia402", [1, 2], link=LINK) as attached:
        yield cast("list[Cia402Drive]", attached.drives)


@pytest.fixture
def robot() -> Iterator[CanDriver]:
    with driver() as made:
        go(made)
        yield made


def driver(**wiring: object) -> CanDriver:
    options = settings("cia402", [1], [2], LINK, **{"outputs": OUTPUTS, **wiring})
    return CanDriver(DriverContext(name="r", model=HANDY, options=options, now=lambda: 0.0), Lab.simulation)


def go(robot: CanDriver, seconds: float = 0.0) -> None:
    """Arm it, and command it for a while."""
    while not robot.read().armed:
        robot.arm()
        Lab.simulation.clock.sleep(0.05)
    passed(seconds, lambda: robot.drive(STILL))


def passed(
    seconds: float, act: Callable[[], object] = lambda: None, watched: Sequence[tuple[Cia402Drive, int]] = ()
) -> list[float]:
    """Let time pass in steps of 1 ms, and act every 50 ms; for how long each watched output was on, s."""
    on = [0.0] * len(watched)
    for step in range(round(seconds * 1000)):
        if step % 50 == 0:
            act()
        Lab.simulation.clock.sleep(0.001)
        on = [before + 0.001 * bool(drive.outputs & bit) for before, (drive, bit) in zip(on, watched, strict=True)]
    return on


class TestADriverWithOutputs(DriverContract):
    """The suite of every driver, with a robot that has some."""

    @pytest.fixture
    def bench(self) -> Iterator[CanBench]:
        with CanBench("cia402", [1], [2], link=LINK, model=HANDY, outputs=OUTPUTS) as made:
            assert made.driver.uses == set(OUTPUTS)
            yield made


def test_a_kick_is_one_pulse(robot: CanDriver, drives: list[Cia402Drive]) -> None:
    first, second = drives
    assert (robot.uses, first.outputs, second.outputs) == ({"kicker", "gripper", "dribbler"}, 0, 0)
    assert first.objects[Object.DIGITAL_OUTPUTS, 2] == KICK, "nothing else follows the bus"
    robot.use("kicker", 4.0)
    (on,) = passed(0.3, lambda: robot.drive(STILL), [(first, KICK)])
    assert 0.009 <= on <= 0.01 + LATE
    robot.use("kicker", 4.0)
    assert passed(0.1, lambda: robot.drive(STILL), [(first, KICK)]) == [0.0], "it needs its pause"
    passed(0.2, lambda: robot.drive(STILL))
    robot.use("kicker", 4.0)
    assert passed(0.1, lambda: robot.drive(STILL), [(first, KICK)])[0] > 0.0
    robot.use("kicker", 0.0)
    assert passed(0.1, watched=[(first, KICK)]) == [0.0]


def test_a_pulse_ends_though_frames_to_the_drives_are_lost(robot: CanDriver, drives: list[Cia402Drive]) -> None:
    rng, wire = random.Random(3), Lab.simulation.wire(LINK)
    wire.tamper = lambda frame, from_drive: [] if not from_drive and rng.random() < 0.3 else [(0.0, frame)]
    for _ in range(10):
        robot.use("kicker", 4.0)
        (on,) = passed(0.7, lambda: robot.drive(STILL), [(drives[0], KICK)])
        assert on <= 0.2


def test_a_pulse_ends_when_this_computer_fails(robot: CanDriver, drives: list[Cia402Drive]) -> None:
    """Nothing comes from it any more just after the output was switched on: the drive's watchdog ends it."""
    robot.drive(STILL)
    robot.use("kicker", 4.0)
    Lab.simulation.clock.sleep(0.002)
    assert drives[0].outputs == KICK

    def dead(frame: Frame, from_drive: bool) -> list[tuple[float, Frame]]:
        return [(0.0, frame)] if from_drive else []

    Lab.simulation.wire(LINK).tamper = dead
    (on,) = passed(1.0, watched=[(drives[0], KICK)])
    assert 0.1 < on <= COMMAND_TIMEOUT + 0.01


def test_a_player_that_freezes_ends_no_pulse_late(robot: CanDriver, drives: list[Cia402Drive]) -> None:
    robot.use("kicker", 4.0)
    (on,) = passed(1.0, watched=[(drives[0], KICK)])
    assert on <= 0.01 + LATE


@pytest.mark.parametrize("stop", ["stop", "disarm", "emergency_stop"])
def test_a_gripper_keeps_what_it_holds_and_a_dribbler_stops(
    robot: CanDriver, drives: list[Cia402Drive], stop: str
) -> None:
    robot.use("gripper", 1.0)

    def roll() -> None:
        robot.use("dribbler", 0.5)
        robot.drive(Twist(0.2, 0.0))

    gripped, rolled = passed(1.0, roll, [(drives[1], GRIP), (drives[1], ROLL)])
    assert (gripped, rolled) == (pytest.approx(1.0, abs=0.02), pytest.approx(1.0, abs=0.02))
    getattr(robot, stop)()
    gripped, rolled = passed(1.0, robot.stop, [(drives[1], GRIP), (drives[1], ROLL)])
    assert gripped == pytest.approx(1.0)
    assert rolled <= (COMMAND_TIMEOUT if stop == "stop" else 0.0) + LATE
    if stop == "stop":
        robot.use("gripper", 0.0)
        assert passed(0.1, watched=[(drives[1], GRIP)])[0] <= 0.002


def test_after_a_recovery_nothing_is_on(robot: CanDriver, drives: list[Cia402Drive]) -> None:
    robot.use("gripper", 1.0)
    go(robot, 0.2)
    assert drives[1].outputs == GRIP
    robot.recover()
    assert passed(0.2, watched=[(drives[1], GRIP)]) == [0.0]


def test_one_that_is_not_armed_uses_nothing(drives: list[Cia402Drive]) -> None:
    with driver() as robot:
        with pytest.raises(RobotError, match="arm the robot first"):
            robot.use("kicker", 4.0)
        go(robot)
        with pytest.raises(RobotError, match=r"expected an actuator at an output \(kicker, gripper, dribbler\), got"):
            robot.use("horn", 1.0)
        robot.emergency_stop()
        with pytest.raises(RobotError, match="emergency stop"):
            robot.use("gripper", 1.0)
        assert [drive.outputs for drive in drives] == [0, 0]


def test_a_drive_without_outputs_is_told() -> None:
    wire = Wire()
    wire.drive.objects.remove(Object.DIGITAL_OUTPUTS)
    wire.axis.outputs = KICK
    with pytest.raises(RobotError, match=r"node 5: expected digital outputs with a mask .* wire the actuator"):
        wire.running()
    wire.axis.outputs = 0
    wire.running()


def test_a_drive_keeps_its_outputs_while_it_is_off_but_not_in_a_fault() -> None:
    wire = Wire()
    wire.axis.outputs = KICK | GRIP
    wire.running()
    wire.axis.output(KICK | ROLL)
    wire.advance(0.01)
    assert wire.drive.outputs == KICK, "the others are not wired"
    wire.axis.idle()
    wire.advance(1.0)
    assert wire.drive.outputs == KICK
    wire.drive._fail(0x2310)
    assert wire.drive.outputs == 0


def wired(outputs: dict[str, Any], protocol: str = "cia402", **model: object) -> CanDriver:
    options = settings(protocol, [1], [2], LINK, outputs=outputs)
    return CanDriver(DriverContext(name="r", model=replace(HANDY, **model), options=options), Lab.simulation)


@pytest.mark.parametrize(
    ("outputs", "words"),
    [
        (
            {"kicker": {"drive": 1, "bit": 3, "pulse": 0.01}},
            "digital output of cia402: expected 16 to 31",
        ),
        ({"kicker": {"drive": 1, "bit": 32, "pulse": 0.01}}, "bit: expected at most 31, got 32"),
        (
            {"kicker": {"drive": 3, "bit": 16, "pulse": 0.01}},
            r"outputs\.kicker: drive: expected one of \[1, 2\], got 3",
        ),
        ({"kicker": {"drive": 1, "bit": 16}}, "kicker: expected a `pulse` in s"),
        ({"gripper": {"drive": 1, "bit": 16, "pulse": 0.1}}, "gripper: expected no `pulse`"),
        ({"grabber": {"drive": 1, "bit": 16}}, "grabber: expected one of kicker, gripper, dribbler, got 'grabber'"),
        (
            OUTPUTS | {"kicker": {"drive": 2, "bit": 17, "pulse": 0.1}},
            "expected an output of its own",
        ),
    ],
)
def test_what_is_wrong_with_outputs_is_said(outputs: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        wired(outputs)


@pytest.mark.parametrize(
    ("protocol", "words"),
    [
        (
            "odrive",
            "CANSimple has no message for the GPIOs of an ODrive. Wire the actuator to a drive that has",
        ),
        ("moteus", "VRG knows of no digital outputs in this protocol"),
        ("vesc", "VRG knows of no digital outputs in this protocol"),
    ],
)
def test_a_protocol_without_outputs_is_refused(protocol: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        wired({"gripper": {"drive": 1, "bit": 16}}, protocol)


def test_an_axis_without_outputs_switches_none() -> None:
    from vrg.hal.can.odrive.axis import OdriveAxis  # noqa: PLC0415 - as a protocol is loaded

    axis = OdriveAxis(0, lambda *_, **__: None, Lab.simulation.clock, ProtocolOptions.model_validate({}))
    with pytest.raises(RobotError, match="CANSimple"):
        axis.output(1)


def test_a_check_of_real_drives_names_what_it_cannot_know() -> None:
    found = CanSettings.read("can", settings("cia402", [1], [2], LINK, outputs=OUTPUTS)).unverified(["r"])
    assert any("the output of its gripper goes off if this computer fails" in line for line in found)
