"""The calibration of a robot, step by step: it drives, a person measures. The shell is `vrg can calibrate`."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from vrg.errors import RobotError
from vrg.hal.can.base import WheelAxis
from vrg.hal.can.calibration import AxisCalibration, Calibration, corrected_ratio, corrected_track
from vrg.hal.can.train import DriveTrain, TrainState
from vrg.hal.models import RobotModel

_PERIOD = 0.05
"""s between commands."""
_ARMING = 2.0
"""s that the motors may take to be armed."""
_SETTLE = 0.5
"""s that the robot is given to come to rest before the odometry is read."""
_LONGEST = 120.0
"""s after which a run is given up."""


class Person(Protocol):
    """The person who stands beside the robot."""

    def ready(self, words: str) -> None:
        """Ask them to do something, and return once it is done."""

    def agrees(self, question: str) -> bool:
        """Ask a question that is answered by yes or no."""

    def measures(self, question: str, expected: float) -> float:
        """Ask for a number, which is `expected` where they have nothing better."""

    def told(self, words: str) -> None:
        """Tell them something."""


@dataclass(frozen=True)
class Plan:
    """How far and how fast.

    Args:
        speed: of the wheels over the ground, m/s. way: straight ahead, m. turn: on the spot, rad.
    """

    speed: float = 0.2
    way: float = 1.5
    turn: float = 4 * math.pi


def calibrate(train: DriveTrain, model: RobotModel, person: Person, plan: Plan) -> Calibration:
    """Find directions, ratios and effective track of a connected robot. Leaves its motors off.

    Args:
        train: connected. model: of the robot. person: measures. plan: how far and how fast.

    Raises:
        RobotError: a fault has latched, or the robot does not move. ValueError: a measurement that cannot be.
    """
    runner = _Runner(train, model)
    try:
        person.ready("Jack the robot up, so that no wheel touches the ground. Keep clear of the wheels.")
        slow = plan.speed / (2 * math.pi * model.wheel_radius)
        directions = {}
        for axis in train.wheel_axes:
            runner.spin(axis, slow * axis.ratio * axis.direction, 2.0)
            side = "left" if axis.left else "right"
            ahead = person.agrees(f"Motor {axis.node}, {side}: did its wheel turn as it does when driving ahead?")
            directions[axis.node] = axis.direction if ahead else -axis.direction
        train.rewire({axis.node: (directions[axis.node], axis.ratio) for axis in train.wheel_axes})

        person.ready(f"Put it on the ground with {plan.way + 0.5:g} m free ahead, and mark where it stands.")
        by_odometry = runner.drive_until(1.0, 1.0, plan.speed, lambda s: abs(s.odometry.x) >= plan.way)
        way = math.hypot(by_odometry.odometry.x, by_odometry.odometry.y)
        really = person.measures(f"By its odometry it went {way:.3f} m. How far did it really go, in m?", way)
        ratios = {axis.node: corrected_ratio(axis.ratio, way, really) for axis in train.wheel_axes}
        train.rewire({node: (directions[node], ratio) for node, ratio in ratios.items()})

        person.ready("It is going to turn on the spot, counter-clockwise. Mark where it points.")
        turned = 0.0
        heading = 0.0

        def enough(state: TrainState) -> bool:
            nonlocal turned, heading
            turned += math.remainder(state.odometry.theta - heading, 2 * math.pi)
            heading = state.odometry.theta
            return turned >= plan.turn

        last = runner.drive_until(-1.0, 1.0, plan.speed, enough)
        enough(last)
        degrees = math.degrees(turned)
        asked = f"By its odometry it turned {degrees:.1f} degrees. How many did it really turn?"
        track = corrected_track(model.effective_track, turned, math.radians(person.measures(asked, degrees)))
        person.told(f"effective track {track:.4g} m, ratios {', '.join(f'{r:.5g}' for r in ratios.values())}")
        axes = {n: AxisCalibration(direction=directions[n], ratio=ratios[n]) for n in directions}
        return Calibration(robot=train.name, track=track, axes=axes)
    finally:
        train.disarm()


class _Runner:
    """Drives a robot by ticks of its own: nobody else drives it."""

    def __init__(self, train: DriveTrain, model: RobotModel) -> None:
        self._train = train
        self._model = model

    def spin(self, axis: WheelAxis, velocity: float, seconds: float) -> None:
        """Turn one motor at `velocity` turn/s for a while."""
        self._arm()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._command(lambda: self._train.spin(axis.node, velocity))
            time.sleep(_PERIOD)
        self._rest()

    def drive_until(self, left: float, right: float, speed: float, done: Callable[[TrainState], bool]) -> TrainState:
        """Drive with both sides at `speed` m/s, signed by `left` and `right`, until `done`; how it then rests."""
        self._train.restart_odometry()
        self._arm()
        rate = speed / self._model.wheel_radius
        deadline = time.monotonic() + _LONGEST
        while not done(self._state()):
            if time.monotonic() > deadline:
                raise RobotError(f"{self._train.name}: the odometry did not get there within {_LONGEST:g} s")
            self._command(lambda: self._train.drive(left * rate, right * rate))
            time.sleep(_PERIOD)
        return self._rest()

    def _command(self, send: Callable[[], None]) -> None:
        """Send a command. Where the drives' watchdog has met one that was late, arm again, as a player does."""
        try:
            send()
        except RobotError:
            self._arm()

    def _arm(self) -> None:
        """Arm the motors, again and again: on a busy computer the drives' watchdog may switch them off meanwhile.

        Raises:
            RobotError: a fault has latched, or they are not armed in time.
        """
        deadline = time.monotonic() + _ARMING
        while not self._state().armed:
            if time.monotonic() > deadline:
                raise RobotError(f"{self._train.name}: the motors were not armed within {_ARMING:g} s")
            self._train.arm()
            self._train.stand()
            time.sleep(_PERIOD)

    def _rest(self) -> TrainState:
        end = time.monotonic() + _SETTLE
        while time.monotonic() < end:
            self._train.stand()
            time.sleep(_PERIOD)
        state = self._state()
        self._train.disarm()
        return state

    def _state(self) -> TrainState:
        state = self._train.state()
        if state.fault:
            raise RobotError(f"{self._train.name}: {state.fault}")
        return state
