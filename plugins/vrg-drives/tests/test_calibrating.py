"""The calibration of a robot whose drives are emulated, by a person who may err, on a bus within this process."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.errors import RobotError
from vrg.hal.can.base import WheelAxis
from vrg.hal.can.calibration import Calibration
from vrg.hal.can.link import Link
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.train import DriveTrain, TrainState
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.workshop.simulation import Port
from vrg.hal.models import robot_model
from vrg.hal.simulated_clock import SimulatedClock
from vrg.testing.can.bench import RATIO, Drives, Lab
from vrg.types import Pose, Twist
from vrg_drives.bringup.calibrating import Plan, _Runner, calibrate, corrected_ratio, corrected_track

LINK = Link(interface="virtual", channel="calibrating")
P2AT = robot_model("P2AT")
QUICK = Plan(speed=0.5, way=0.3, turn=math.pi / 4)


@dataclass
class Clerk:
    """Answers as it was told to; `None` stands for what is expected."""

    agrees_to: list[bool]
    measured: list[float | None]
    heard: list[str] = field(default_factory=list)

    def ready(self, words: str) -> None:
        self.heard.append(words)

    def agrees(self, question: str) -> bool:
        self.heard.append(question)
        return self.agrees_to.pop(0)

    def measures(self, question: str, expected: float) -> float:
        self.heard.append(question)
        answer = self.measured.pop(0)
        return expected if answer is None else answer

    def shows(self, words: str) -> None:
        self.heard.append(words)


@pytest.fixture
def drives() -> Iterator[Drives]:
    with Drives("odrive", link=LINK) as drives:
        yield drives


@pytest.fixture
def train(drives: Drives) -> Iterator[DriveTrain]:
    axes = [WheelAxis(0, 0, ratio=RATIO), WheelAxis(1, 1, ratio=RATIO)]
    train = DriveTrain("r", Lab.simulation, LINK, PROTOCOLS.get("odrive"), axes, P2AT)
    train.connect()
    yield train
    train.close()


def turns(drives: Drives) -> float:
    """The farthest that a motor stands from where it began, turns."""
    return max(abs(drive.motor.position) for drive in drives.drives)


def run(train: DriveTrain, clerk: Clerk) -> Calibration:
    return calibrate(train, P2AT, clerk, QUICK)


def test_a_typing_error_is_told_asked_again_and_moves_nothing(train: DriveTrain, drives: Drives) -> None:
    clerk = Clerk([True, True, True, True], [0.01, 1000.0, None, None])
    found = run(train, clerk)
    refused = [words for words in clerk.heard if words.startswith("Expected")]
    assert len(refused) == 2
    assert "got 0.01" in refused[0]
    assert "got 1000" in refused[1]
    assert found.axes[0].ratio == pytest.approx(RATIO)
    assert found.track == pytest.approx(P2AT.drivetrain.effective_track)
    assert turns(drives) < 4 * RATIO


def test_what_is_not_confirmed_is_asked_again(train: DriveTrain) -> None:
    clerk = Clerk([True, True, False, True, True], [0.4, None, None])
    assert run(train, clerk).axes[1].ratio == pytest.approx(RATIO)
    assert any("Is 0.4 right?" in words for words in clerk.heard)


def test_a_wheel_that_turns_the_other_way(train: DriveTrain) -> None:
    found = run(train, Clerk([True, False, True, True], [None, None]))
    assert [found.axes[node].direction for node in (0, 1)] == [1, -1]


@pytest.mark.parametrize(("braking", "least", "most"), [(0.03, 5.0, math.inf), (1.0, 0.1, 0.5)])
def test_how_it_rolls_on_with_its_motors_off_is_measured(
    train: DriveTrain, drives: Drives, braking: float, least: float, most: float
) -> None:
    """Some drives short their motor's phases, others let it coast."""
    for drive in drives.drives:
        drive.motor.model = replace(drive.motor.model, braking=braking)
    clerk = Clerk([True] * 4, [None, None])
    found = run(train, clerk)
    assert found.applied(P2AT).brake == pytest.approx(found.motion.get("brake", P2AT.brake))
    assert least < found.applied(P2AT).brake <= min(most, P2AT.brake)
    assert found.axes[0].ratio == pytest.approx(RATIO), "the way that it has rolled is measured with the rest"
    assert any("With its motors off it came to rest from 0.5 m/s in" in words for words in clerk.heard), clerk.heard


@pytest.mark.parametrize("method", ["drive", "spin"])
def test_one_that_was_frozen_goes_on_when_the_person_agrees(train: DriveTrain, drives: Drives, method: str) -> None:
    """Ctrl-Z while it drives: it stands, nothing moves before Enter is pressed, and that may take a while."""
    act, stood = getattr(train, method), list[float]()

    def freeze_once(*arguments: object) -> None:
        if not stood and max(map(abs, train.state().angles)) > 0.1:
            assert isinstance(train._bus, Port)
            train._bus.freeze()
            Lab.simulation.clock.sleep(2.5)
            stood.append(drives.drives[0].motor.position)
            train._bus.thaw()
        act(*arguments)

    class Waits(Clerk):
        def ready(self, words: str) -> None:
            super().ready(words)
            if "continues from here" in words:
                train.clock.sleep(150.0)
                stood.append(drives.drives[0].motor.position)

    setattr(train, method, freeze_once)
    clerk = Waits([True] * 4, [None, None])
    assert run(train, clerk).axes[0].ratio == pytest.approx(RATIO)
    assert stood[1] == pytest.approx(stood[0], abs=0.5)


def test_a_wheel_that_is_blocked_ends_it(train: DriveTrain, drives: Drives) -> None:
    drives.drives[0].receive(encode_fault(0, FaultRequest(FaultKind.BLOCK)), train.clock.now())
    with pytest.raises(RobotError, match="r: node 0: it stands still, though asked for"):
        run(train, Clerk([True, True, True, True], [None, None]))
    assert turns(drives) < RATIO


def test_a_wheel_that_hardly_turns_is_told_before_anybody_is_asked(train: DriveTrain, drives: Drives) -> None:
    drives.drives[0].receive(encode_fault(0, FaultRequest(FaultKind.BLOCK)), train.clock.now())
    clerk = Clerk([], [])
    with pytest.raises(RobotError, match=r"motor 0 was asked for 1.* turn/s and has hardly turned its wheel"):
        calibrate(train, P2AT, clerk, replace(QUICK, speed=0.025))
    assert not any("did its wheel turn" in words for words in clerk.heard)


class Circling:
    """A robot that is asked to go straight ahead and goes in a circle: its odometry never gets there."""

    name = "r"
    clock = SimulatedClock()
    wheel_axes = (WheelAxis(0, 0), WheelAxis(1, 1))

    def __init__(self) -> None:
        self.angle = 0.0

    def state(self) -> TrainState:
        pose = Pose(0.2 * math.sin(self.angle), 0.0, 0.0)
        return TrainState(0.0, (0.0, 0.0), (self.angle, self.angle), pose, True, None, False, None, math.inf)

    def drive(self, twist: Twist) -> None:
        self.angle += P2AT.drivetrain.speeds(twist)[0]

    def restart_odometry(self) -> None:
        pass


def test_a_run_that_does_not_get_there_is_given_up_by_the_turns_of_the_wheels() -> None:
    robot = Circling()
    runner = _Runner(robot, P2AT, Clerk([], []))  # type: ignore[arg-type]
    with pytest.raises(RobotError, match="its wheels have turned farther than the way takes"):
        runner.drive_until(Twist(0.3, 0.0), 4.0, lambda state: state.odometry.x > 1.0)
    assert 10.0 < robot.angle < 20.0


@given(st.floats(1, 200), st.floats(0.5, 20), st.floats(0.8, 1.2))
def test_what_is_corrected_measures_right(known: float, really: float, error: float) -> None:
    """What turned the same would then be told to have gone, or turned by, the measured way."""
    by_odometry = really * error
    for correct in (corrected_ratio, corrected_track):
        turned = by_odometry * known
        assert turned / correct(known, by_odometry, really) == pytest.approx(really)


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan")])
def test_measurements_that_cannot_be(bad: float) -> None:
    with pytest.raises(ValueError, match="expected"):
        corrected_ratio(50.0, 1.0, bad)
    with pytest.raises(ValueError, match="expected"):
        corrected_track(0.5, 1.0, bad)
