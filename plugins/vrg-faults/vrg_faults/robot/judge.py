"""The rules that must hold whatever happens, judged by the true motion of the motors."""

import math
from collections import deque
from collections.abc import Callable, Sequence

from vrg.geometry import wrap
from vrg.hal.can.judges.off import COAST_TIMEOUT
from vrg.hal.can.workshop.emulated import EmulatedDrive
from vrg.hal.models import RobotModel
from vrg.hal.readings import Readings
from vrg.hal.sensors.odometry import Odometry
from vrg.testing.can_robot import RATIO
from vrg.types import Pose, Twist

REPORT = 0.9
"""s within which a motor that does something else than it was asked is reported."""
STOP_TIMEOUT = 0.8
"""s within which the motors stand once they must: a watchdog of 0.25 s, an order repeated after 0.2 s, and brakes."""
TURNING_SPEED = 2.0
"""turn/s above which a motor turns."""
_MEMORY = 1.0
"""s for which a command may still be the one that a motor follows, as frames may be late."""
_FRESH = 0.3
"""s up to which a reading counts; a player stops by an older one, and reports it."""


_AT_ONCE = 0.03
"""s after it was read for which what the robot tells can be compared with what its motors do."""
_LATE, _JUMP = 0.35, 0.1
"""s by which a frame may be late, and the m and rad by which odometry may be off from one reading to the next."""


class WrongError(Exception):
    """Something is not as it must be."""


class Judge:
    """Judges the true motion of the motors.

    Args:
        model: of the robot. drives: its left and its right drive. now: returns simulated time, s.
    """

    def __init__(self, model: RobotModel, drives: Sequence[EmulatedDrive], now: Callable[[], float]) -> None:
        self._model = model
        self._drives = drives
        self._now = now
        self._sent: deque[tuple[float, tuple[float, float]]] = deque()
        self._since: dict[str, float] = {}
        self._pose: tuple[Pose, float] | None = None
        self._readings: Readings | None = None
        self._read_at = -math.inf

    @property
    def reported(self) -> bool:
        """True if the newest readings report that something is wrong, or are too old to be driven by."""
        readings = self._readings
        return readings is None or readings.fault is not None or readings.estop or readings.age > _FRESH

    @property
    def fault(self) -> str:
        """The fault in the newest readings, in words."""
        return "" if self._readings is None else self._readings.fault or ""

    def ticked(self, readings: Readings | None, sent: Twist) -> None:
        """The player has read the robot, and sent a twist."""
        self._readings, self._read_at = readings, self._now()
        left, right = self._model.drivetrain.speeds(sent)
        self._sent.append((self._now(), (left / math.tau * RATIO, right / math.tau * RATIO)))
        self._check_pose()

    def begin(self) -> None:
        """Another process of the player has begun: nothing was read yet."""
        self._readings = self._pose = None

    def forgive(self) -> None:
        """Judge again from here."""
        self._since.clear()

    def look(self, *, awake: bool, strangers: bool) -> None:
        """Judge what the motors do now.

        Args:
            awake: the player runs, and what the robot tells is heard.
            strangers: another node sends on the bus, so that a motor may follow them until that is noticed.

        Raises:
            WrongError: something has not held for too long.
        """
        reported = awake and self.reported
        self._forget()
        for index, drive in enumerate(self._drives):
            velocity = drive.motor.velocity
            asked = [0.0, *(wheels[index] for _, wheels in self._sent)]
            slack = TURNING_SPEED + 0.3 * max(map(abs, asked))
            obeys = min(asked) - slack <= velocity <= max(asked) + slack
            words = f"motor {drive.node} turns at {velocity:.1f} turn/s, asked for {asked[-1]:.1f}, and nobody says so"
            within = REPORT + (COAST_TIMEOUT if drive.motor.stuck else 0.0)
            self._must(f"obeys {index}", obeys or reported or strangers, within, words)
        # No order stops one that is stuck.
        stands = strangers or all(
            drive.motor.stuck or abs(drive.motor.velocity) <= TURNING_SPEED for drive in self._drives
        )
        words = f"a motor still turns although this is reported: {self.fault or 'stop'}"
        self._must("stops", not reported or stands or "it is on, though" in self.fault, STOP_TIMEOUT, words)
        self._must("alone", awake or stands, STOP_TIMEOUT, "a motor turns although its player commands nothing")
        silent = awake and self._readings is not None and self._readings.age > _FRESH
        self._must("says why", not silent or bool(self.fault), REPORT, "nothing is read any more, and no fault told")
        self._compare(reported or strangers)

    def _forget(self) -> None:
        """Drop commands that no motor follows any more. The last one before counts until the next has arrived."""
        oldest = self._now() - _MEMORY
        while len(self._sent) > 1 and self._sent[1][0] < oldest:
            self._sent.popleft()
        if self._sent and self._sent[-1][0] < oldest:
            self._sent.clear()

    def _check_pose(self) -> None:
        odometry = None if self._readings is None else self._readings.latest(Odometry)
        if odometry is None:
            return
        pose, now = odometry.value.pose, self._now()
        if self._pose is not None:
            before, then = self._pose
            way, turn = math.hypot(pose.x - before.x, pose.y - before.y), abs(wrap(pose.theta - before.theta))
            seconds = now - then + _LATE
            # NaN is not less than anything.
            if not (way <= _JUMP + self._model.v_max * seconds and turn <= _JUMP + self._model.w_max * seconds):
                raise WrongError(f"the pose by odometry has jumped by {way:.2f} m and {turn:.2f} rad")
        self._pose = pose, now

    def _compare(self, excused: bool) -> None:
        """Compare the robot's newest report of its wheels with their motion."""
        odometry = None if self._readings is None else self._readings.latest(Odometry)
        if odometry is None or self._now() > self._read_at + _AT_ONCE:
            return
        told = [wheel / math.tau * RATIO for wheel in self._model.drivetrain.speeds(odometry.value.twist)]
        true = [drive.motor.velocity for drive in self._drives]
        off = max(abs(a - b) for a, b in zip(told, true, strict=True))
        words = f"the wheels are told to turn by {off:.1f} turn/s of a motor otherwise than they do"
        self._must("tells the truth", off <= 4.0 + 0.3 * max(map(abs, true)) or excused, REPORT, words)

    def _must(self, what: str, holds: bool, within: float, words: str) -> None:
        """Raise if something has not held for too long."""
        now = self._now()
        if holds:
            self._since.pop(what, None)
        elif now - self._since.setdefault(what, now) > within:
            raise WrongError(f"{words}, for {within:g} s")
