"""The calibration of a robot, step by step: it drives, a person measures. The shell is `vrg can calibrate`."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from vrg.errors import RobotError
from vrg.hal.can.base import WheelAxis
from vrg.hal.can.calibration import AxisCalibration, Calibration
from vrg.hal.can.plausibility import STANDSTILL_SHARE
from vrg.hal.can.train import DriveTrain, TrainState
from vrg.hal.models import RobotModel
from vrg.types import Twist

_PERIOD = 0.05
"""s between commands."""
_ARMING = 2.0
"""s that the motors may take to be armed."""
FROZEN = 0.5
"""s between two looks of a program from which on it did not run: motors that it started or drove stay off."""
_SETTLE = 0.5
"""s that the robot is given to come to rest before the odometry is read."""
_STANDS = 0.01
"""m/s below which a robot whose motors are off has come to rest."""
_LONGEST = 120.0
"""s after which a run is given up."""
LARGEST_CORRECTION = 2.0
"""The largest factor between a person's measurement and the odometry. The ratio of the gear is in its data sheet, and
only the wheel's radius is unsure."""
_ROLLS = 1.0
"""m free ahead of the robot, beyond its way, in which it rolls out."""
_LEAST = 1e-3
"""The way in m below which a robot has not rolled on."""
_SHOWN = 0.75
"""Turns of a wheel after which everybody has seen which way it turns."""
_ALLOWANCE = 1.5
"""The factor by which a wheel may turn farther than it should before a run is given up."""


class Person(Protocol):
    """The person who stands beside the robot."""

    def ready(self, words: str) -> None:
        """Ask them to do something, and return once it is done."""

    def agrees(self, question: str) -> bool:
        """Ask a question that is answered by yes or no."""

    def measures(self, question: str, expected: float) -> float:
        """Ask for a number, which is near `expected`."""

    def shows(self, words: str) -> None:
        """Tell them something."""


@dataclass(frozen=True)
class Plan:
    """The distance and the speed of a run.

    Args:
        speed: of the wheels over the ground, m/s. way: straight ahead, m. turn: on the spot, rad.
    """

    speed: float = 0.2
    way: float = 1.5
    turn: float = 4 * math.pi


def calibrate(train: DriveTrain, model: RobotModel, person: Person, plan: Plan) -> Calibration:
    """Find directions, ratios, effective track and brake of a connected robot. Leaves its motors off.

    Args:
        train: connected. model: of the robot. person: measures. plan: how far and how fast.

    Raises:
        RobotError: a fault has latched, or the robot does not move. ValueError: a measurement that cannot be.
    """
    steps = _Steps(train, model, person, plan)
    try:
        steps.find_directions()
        steps.find_ratios()
        motion = steps.find_brake()
        track = steps.find_track()
        ratios = ", ".join(f"{axis.ratio:.5g}" for axis in train.wheel_axes)
        person.shows(f"effective track {track:.4g} m, ratios {ratios}")
        axes = {
            a.node: AxisCalibration(direction=a.direction, ratio=a.ratio, serial=train.serials[a.node])
            for a in train.wheel_axes
        }
        return Calibration(robot=train.name, track=track, axes=axes, motion=motion)
    finally:
        train.disarm()


class _Steps:
    """The steps. The train itself then uses what the first two find."""

    def __init__(self, train: DriveTrain, model: RobotModel, person: Person, plan: Plan) -> None:
        self._train = train
        self._model = model
        self._person = person
        self._plan = plan
        self._runner = _Runner(train, model, person)

    def find_directions(self) -> None:
        """Turn each motor alone and ask which way its wheel turns."""
        self._person.ready("Jack the robot up, so that no wheel touches the ground. Keep clear of the wheels.")
        slow = self._plan.speed / (2 * math.pi * self._model.drivetrain.wheel_radius)
        found = {}
        for axis in self._train.wheel_axes:
            self._runner.spin(axis, slow * axis.ratio * axis.direction, 2.0)
            drivetrain = self._model.drivetrain
            v, _, across = drivetrain.rates[axis.axis]
            way = "ahead" if v > 0 else "back" if v else "to the left" if across > 0 else "to the right"
            where = f"Motor {axis.node}, {drivetrain.axes[axis.axis]}"
            ahead = self._person.agrees(f"{where}: did its wheel turn as it does when driving {way}?")
            found[axis.node] = (axis.direction if ahead else -axis.direction, axis.ratio)
        self._train.rewire(found)

    def find_ratios(self) -> None:
        """Drive straight ahead and ask how far it went."""
        person, plan = self._person, self._plan
        person.ready(
            f"Put it on the ground with {plan.way + _ROLLS:g} m free ahead, and mark where it stands. At the end its "
            "motors are switched off as it drives, and it rolls out."
        )
        ahead = Twist(plan.speed, 0.0)
        last = self._runner.drive_until(
            ahead, plan.way / plan.speed, lambda state: abs(state.odometry.x) >= plan.way, roll=True
        )
        way = math.hypot(last.odometry.x, last.odometry.y)
        before = {axis.node: axis.ratio for axis in self._train.wheel_axes}

        def corrected(measured: float) -> dict[int, float]:
            return {node: corrected_ratio(ratio, way, measured) for node, ratio in before.items()}

        def outcome(measured: float) -> str:
            new, old = ([f"{r:.5g}" for r in ratios.values()] for ratios in (corrected(measured), before))
            return f"The ratios are then {', '.join(new)}, where they were {', '.join(old)}"

        asked = f"By its odometry it went {way:.3f} m. How far did it really go, in m?"
        found = corrected(_measured(person, asked, way, outcome))
        self._train.rewire({axis.node: (axis.direction, found[axis.node]) for axis in self._train.wheel_axes})

    def find_brake(self) -> dict[str, float]:
        """The deceleration with the motors off, m/s^2, where it is less than that of the model."""
        speed, way, seconds = self._runner.rolled
        brake = speed**2 / max(2 * way, _LEAST)
        self._person.shows(
            f"With its motors off it came to rest from {speed:.2g} m/s in {seconds:.2g} s and {way:.2g} m."
        )
        return {"brake": brake} if brake < self._model.brake else {}

    def find_track(self) -> float:
        """Turn on the spot and ask how far it turned; the effective track, m."""
        person, plan, before = self._person, self._plan, self._model.drivetrain.effective_track
        person.ready("It is going to turn on the spot, counter-clockwise. Mark where it points.")
        turned = 0.0
        heading = 0.0

        def enough(state: TrainState) -> bool:
            nonlocal turned, heading
            turned += math.remainder(state.odometry.theta - heading, 2 * math.pi)
            heading = state.odometry.theta
            return turned >= plan.turn

        rate = plan.speed * 2 / before
        enough(self._runner.drive_until(Twist(0.0, rate), plan.turn / rate, enough))
        degrees = math.degrees(turned)

        def outcome(measured: float) -> str:
            return (
                f"The effective track is then {corrected_track(before, degrees, measured):.4g} m, it was {before:.4g} m"
            )

        asked = f"By its odometry it turned {degrees:.1f} degrees. How many degrees did it really turn?"
        return corrected_track(before, degrees, _measured(person, asked, degrees, outcome))


def _measured(person: Person, question: str, expected: float, outcome: Callable[[float], str]) -> float:
    """Ask for a number until one comes that can be, and that the person has confirmed.

    Args:
        outcome: what follows from the number, in words.
    """
    least, most = expected / LARGEST_CORRECTION, expected * LARGEST_CORRECTION
    while True:
        answer = person.measures(question, expected)
        if not least <= answer <= most:
            person.shows(
                f"Expected {least:.4g} to {most:.4g}, got {answer:g}. If {answer:g} is right, the gear's ratio in the "
                "wiring is wrong: stop with Ctrl-C, correct it, and begin again."
            )
        elif person.agrees(f"{outcome(answer)}. Is {answer:g} right?"):
            return answer


def look_again(train: DriveTrain, before: float) -> float:
    """Return the time of this look, s, after the one before.

    Raises:
        RobotError: this program has not run in between. The motors are switched off: nobody may stand clear any more.
    """
    now = train.clock.now()
    if now - before > FROZEN:
        train.disarm()
        raise RobotError(f"this program did not run for {now - before:.1f} s: its motors stay off", train.name)
    return now


def bring_up(train: DriveTrain, patience: float, interrupted: Callable[[], bool] = lambda: False) -> bool:
    """Arm the motors of a robot that no referee holds, at rest.

    Args:
        patience: s to wait in all. interrupted: whether a person has ended it meanwhile.

    Returns:
        whether they are armed; False where that took too long, or was interrupted.

    Raises:
        RobotError: a fault has latched, the emergency stop is engaged, or this program has not run for a while
            meanwhile: what was frozen starts nothing by itself.
    """
    clock = train.clock
    looked = clock.now()
    deadline = looked + patience
    refused: RobotError | None = None
    while not interrupted():
        state = train.state()
        looked = look_again(train, looked)  # also where they were armed meanwhile, or a fault followed from that
        if state.fault:
            raise RobotError(state.fault, train.name)
        if state.armed:
            return True
        if looked > deadline:
            if refused is not None:
                raise refused
            return False
        try:
            train.arm()  # a start may take several commands
            train.stop()
            refused = None
        except RobotError as error:
            # On a busy computer the newest report of a drive may be old for a moment.
            if state.estop:
                raise
            refused = error
        clock.sleep(_PERIOD)
    return False


class _Runner:
    """Drives a robot by ticks of its own: no other program drives it."""

    def __init__(self, train: DriveTrain, model: RobotModel, person: Person) -> None:
        self._train = train
        self._clock = train.clock
        self._model = model
        self._person = person
        self.rolled = (0.0, 0.0, 0.0)
        """The speed at which motors were switched off last, m/s, and how far and for how long it went on, m and s."""
        self._sent = 0.0
        """When the last command was sent, or the motors were armed, s."""

    def spin(self, axis: WheelAxis, velocity: float, seconds: float) -> None:
        """Turn one motor at `velocity` turn/s for a while, or for _SHOWN turns of its wheel."""
        self._train.restart_odometry()
        self._arm()
        end = self._clock.now() + seconds
        # The angle of an axis is the mean of its motors.
        share = 1 / sum(other.axis == axis.axis for other in self._train.wheel_axes)
        limit = 2 * math.pi * _SHOWN * share
        while self._clock.now() < end and max(map(abs, self._state().angles)) < limit:
            end += self._command(lambda: self._train.spin(axis.node, velocity))
            self._clock.sleep(_PERIOD)
        turned = max(map(abs, self._rest().angles))
        asked = min(limit, 2 * math.pi * abs(velocity / axis.ratio) * seconds * share)
        if turned < STANDSTILL_SHARE * asked:
            raise RobotError(
                f"motor {axis.node} was asked for {velocity:.3g} turn/s and has hardly turned its wheel: is it "
                "blocked, or does its drive not turn so slowly? Try a higher --speed",
                self._train.name,
            )

    def drive_until(
        self, twist: Twist, seconds: float, done: Callable[[TrainState], bool], *, roll: bool = False
    ) -> TrainState:
        """Drive by a motion until `done`; how it then rests.

        Args:
            seconds: how long it should take, s. If the wheels turn much farther than in this time, it is given up.
            roll: switch the motors off while it drives, and let it roll out.
        """
        self._train.restart_odometry()
        self._arm()
        farthest = _ALLOWANCE * seconds * max(map(abs, self._model.drivetrain.speeds(twist))) + 1.0
        deadline = self._clock.now() + _LONGEST
        while not done(self._state()):
            if self._clock.now() > deadline:
                raise RobotError(f"the odometry did not get there within {_LONGEST:g} s", self._train.name)
            if max(map(abs, self._state().angles)) > farthest:
                raise RobotError(
                    "its wheels have turned farther than the way takes, but its odometry is not there: were the "
                    "questions about directions answered correctly?",
                    self._train.name,
                )
            deadline += self._command(lambda: self._train.drive(twist))
            self._clock.sleep(_PERIOD)
        return self._roll_out() if roll else self._rest()

    def _roll_out(self) -> TrainState:
        began, now = self._state(), self._clock.now()
        self._train.disarm()
        state = began
        while self._speed(state) > _STANDS and self._clock.now() - now < _LONGEST:
            self._clock.sleep(_PERIOD)
            state = self._state()
        way = math.dist((began.odometry.x, began.odometry.y), (state.odometry.x, state.odometry.y))
        self.rolled = (self._speed(began), way, self._clock.now() - now)
        return state

    def _speed(self, state: TrainState) -> float:
        """The speed by the encoders, m/s."""
        return abs(self._model.drivetrain.twist(state.speeds).v)

    def _command(self, send: Callable[[], None]) -> float:
        """Send a command. Where one was late, so that the motors are off, they are armed again if the person agrees.

        Returns:
            the time in s for which the robot stood because of that.
        """
        began = self._sent
        try:
            send()
        except RobotError as error:
            self._state()
            self._person.ready(f"{error}. Keep clear: the robot continues from here.")
            self._arm()
            return self._sent - began
        self._sent = self._clock.now()
        return 0.0

    def _arm(self) -> None:
        """Arm the motors.

        Raises:
            RobotError: a fault has latched, or they are not armed in time.
        """
        if not bring_up(self._train, _ARMING):
            raise RobotError(f"the motors were not armed within {_ARMING:g} s", self._train.name)
        self._sent = self._clock.now()

    def _rest(self) -> TrainState:
        end = self._clock.now() + _SETTLE
        while self._clock.now() < end:
            self._train.stop()
            self._clock.sleep(_PERIOD)
        state = self._state()
        self._train.disarm()
        return state

    def _state(self) -> TrainState:
        state = self._train.state()
        if state.fault:
            raise RobotError(state.fault, self._train.name)
        return state


def corrected_ratio(ratio: float, by_odometry: float, by_tape: float) -> float:
    """The ratio after a straight run of `by_tape` m that the odometry took for `by_odometry` m.

    Raises:
        ValueError: one of them is not positive.
    """
    if not (by_odometry > 0 and by_tape > 0):
        raise ValueError(f"expected ways above 0 m, got {by_odometry} and {by_tape}")
    return ratio * by_odometry / by_tape


def corrected_track(track: float, by_odometry: float, really: float) -> float:
    """The effective track after a turn on the spot of `really` rad that the odometry took for `by_odometry` rad.

    Raises:
        ValueError: one of them is zero or not finite, or they differ in sign.
    """
    if not (math.isfinite(by_odometry) and math.isfinite(really) and by_odometry * really > 0):
        raise ValueError(f"expected two turns to the same side, got {by_odometry} and {really} rad")
    return track * by_odometry / really
