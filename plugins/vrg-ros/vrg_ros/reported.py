"""The messages of a robot that runs ROS 2, as samples of its sensors, each with its age.

Ages are judged by the stamps of the messages, and no message is younger than the time since it came. So one that was
held up on its way is as old as it is, and a driver that repeats an old one is found out. A robot's clock may be any
that runs as fast as real time: what counts is how much later than the quickest of the last minutes a message came. A
simulated clock stops and falls behind, so by its stamps only repeated messages are found out. The scan and the charge
are taken to be stamped by the same clock.
"""

import math
from array import array
from collections import deque
from collections.abc import Mapping
from typing import Any, Final

from vrg.bus.clock_tracker import ClockOffset
from vrg.bus.codec import checked
from vrg.bus.messages import SensorMessage
from vrg.errors import MessageError
from vrg.geometry import compose, inverse, wrap
from vrg.hal.models import RobotModel
from vrg.hal.sensors.battery import Battery, BatterySpec
from vrg.hal.sensors.laser import RANGES_LIMIT, Laser, LaserSpec
from vrg.hal.sensors.odometry import Odometry, OdometrySpec
from vrg.hal.sensors.spec import Sample, SensorSpec
from vrg.types import Pose, Twist

Fields = Mapping[str, Any]

OFFSET_WINDOW: Final = 300.0
"""The time in s for which the quickest message counts: clocks that differ by 100 ppm are 30 ms apart by then."""
SET_BACK: Final = 10.0
"""By how much a stamp is smaller than the last one, s, if the clock was set back, and the message is not just late."""
MAX_GAP: Final = 1.0
"""The longest time in s for which a robot is taken to have driven between two messages. Without any it is stopped."""
FULL: Final = 1.5
"""The greatest charge that is a share: a fresh battery may have a little more than it is taken to hold."""
WAY_SLACK: Final = 0.2
TURN_SLACK: Final = 0.5
"""The way in m, and the turn in rad, by which odometry may be ahead of what the robot can drive."""
OFTEN: Final = (3, 5.0)
"""This many restarts of odometry in this many seconds have a cause, such as two nodes that publish it."""


def seconds(stamp: Fields) -> float:
    """A time of a message, s."""
    return float(stamp["sec"] + stamp["nanosec"] * 1e-9)


class Reported:
    """Takes in the messages of one robot.

    Args:
        model: its description. frame: the frame of its body; empty takes any.
        scan_yaw: the heading of its laser's frame on the robot, rad.
        simulated: it stamps by a clock that may stop or fall behind real time.
    """

    def __init__(self, model: RobotModel, frame: str = "", scan_yaw: float = 0.0, *, simulated: bool = False) -> None:
        self._model, self._scan_yaw = model, scan_yaw
        self.frame = frame
        """The frame of its body; if it was not given, that of its odometry."""
        self._given = frame
        self._simulated = simulated
        self._clock = ClockOffset() if simulated else ClockOffset(OFFSET_WINDOW, stopped=math.inf)
        self._newest: dict[type[SensorSpec], tuple[float, float, SensorMessage]] = {}
        """The newest of each sensor: its stamp by the robot's clock, when it came by ours, and what it holds."""
        self._last: tuple[float, Pose] | None = None
        """The last odometry as it came: its stamp and its pose."""
        self._pose = Pose(0.0, 0.0, 0.0)
        self._beginnings: deque[float] = deque(maxlen=OFTEN[0])
        """The times at which the odometry has started again, s."""
        self._per_cent = False

    def forget(self) -> None:
        """Forget what the sensors have measured, as the robot is connected again. Its way goes on where it was."""
        self._newest.clear()
        self._beginnings.clear()

    def time(self, now: float) -> float:
        """The time of the robot's own clock at the monotonic time `now`, s; 0 while it is not known."""
        return self._clock.match_time(now) or 0.0

    def age(self, now: float) -> float:
        """The age of the newest odometry, s; infinite before the first."""
        found = self._newest.get(OdometrySpec)
        return math.inf if found is None else self._age(*found[:2], now)

    def delay(self) -> float:
        """The age of the newest odometry when it came, s; 0 before the first."""
        found = self._newest.get(OdometrySpec)
        return 0.0 if found is None else self._age(*found[:2], found[1])

    def jumps(self, now: float) -> bool:
        """True if the odometry has started again too often of late."""
        return len(self._beginnings) == OFTEN[0] and now - self._beginnings[0] < OFTEN[1]

    def odometry(self, message: Fields, now: float) -> bool:
        """Take in nav_msgs/Odometry, at the monotonic time `now`, s. Return True if it has started again.

        Raises:
            MessageError: a number is out of bounds or not finite, it has no stamp, or it is of another frame.
        """
        at, frame = seconds(message["header"]["stamp"]), message["child_frame_id"]
        linear, angular = message["twist"]["twist"]["linear"], message["twist"]["twist"]["angular"]
        pose = _flat(message["pose"]["pose"])
        if self._given and frame != self._given:
            raise MessageError(f"expected odometry of the frame {self._given}, got {frame[:80]!r}: see `frame`")
        if at <= 0.0:
            raise MessageError("expected odometry with a time stamp, got none: its age cannot be judged")
        # In the bounds of messages of a match.
        measured = checked(Odometry(pose=pose, twist=Twist(linear["x"], angular["z"], linear["y"])))
        if self._last is not None and self._last[0] - SET_BACK < at <= self._last[0]:
            return False  # it repeats itself, or was overtaken
        self.frame = self._given or frame
        self._clock.heard(at, now)
        anew = self._continue(at, pose)
        self._last = at, pose
        self._newest[OdometrySpec] = at, now, Odometry(pose=self._pose, twist=measured.twist)
        if anew:
            self._beginnings.append(now)
        return anew

    def scan(self, message: Fields, now: float) -> None:
        """Take in sensor_msgs/LaserScan.

        A beam that met nothing reads the longest range, one that met something too near to be measured the shortest,
        and one that has measured nothing, or what is to be discarded, 0.

        Args:
            now: the monotonic time, s.

        Raises:
            MessageError: it is none that a laser can make.
        """
        longest, shortest = float(message["range_max"]), float(message["range_min"])
        first, step, count = message["angle_min"] + self._scan_yaw, message["angle_increment"], len(message["ranges"])
        good = math.isfinite(first + step) and step and 0 < count <= RANGES_LIMIT
        if not (good and 0.0 < longest < math.inf and -math.inf < shortest < longest):
            raise MessageError(
                f"expected a scan of 1 to {RANGES_LIMIT} beams with finite angles and bounds, got {count} from {first} "
                f"in steps of {step}, and ranges from {shortest} to {longest}"
            )
        # REP 117: -inf is nearer than the sensor can measure, inf is nothing within its range, NaN is no measurement;
        # nor are ranges beyond its bounds, which are discarded. Zero is, too, as drivers report it for no measurement.
        read = {math.inf: longest, -math.inf: max(0.0, shortest)}
        ranges = array(
            "f", (read.get(r, r if shortest <= r <= longest and r > 0.0 else 0.0) for r in message["ranges"])
        )
        scan = checked(Laser(angle_min=wrap(first), angle_step=step, range_max=longest, data=ranges.tobytes()))
        self._newest[LaserSpec] = seconds(message["header"]["stamp"]), now, scan

    def battery(self, message: Fields, now: float) -> None:
        """Take in sensor_msgs/BatteryState. A charge that is not known is left out.

        Some drivers report per cent: a robot does so from the first value above FULL on.

        Args:
            now: the monotonic time, s.
        """
        charge = message["percentage"]
        if not 0.0 <= charge <= 100.0:
            return
        self._per_cent |= charge > FULL
        at = seconds(message["header"]["stamp"])
        self._newest[BatterySpec] = at, now, Battery(charge=charge / 100.0 if self._per_cent else min(1.0, charge))

    def samples(self, now: float, match_time: float) -> list[Sample[SensorMessage]]:
        """A sample of each sensor that the model has and the robot has reported.

        Args:
            now: monotonic time, s. match_time: the same instant as match time, by which samples are stamped, s.
        """
        found = []
        for kind, (at, came, value) in self._newest.items():
            if (spec := self._model.sensor(kind)) is not None:
                age = self._age(at, came, now)
                found.append(Sample(match_time - age, age, value, spec.name))
        return found

    def _age(self, at: float, came: float, now: float) -> float:
        return max(0.0, now - came) if self._simulated else max(0.0, now - came, self.time(now) - at)

    def _continue(self, at: float, pose: Pose) -> bool:
        """Bring the pose since the first odometry up to a newer one. Return True if that has started again.

        The pose turns beyond pi. Where the robot's own starts again, the robot is taken to stand where it was.
        """
        if self._last is None:
            return False
        before, last = self._last
        time, moved = at - before, compose(inverse(last), pose)
        most = min(time, MAX_GAP)
        far = math.hypot(moved.x, moved.y) > 2.0 * self._model.v_max * most + WAY_SLACK
        if time < 0.0 or far or abs(moved.theta) > 2.0 * self._model.w_max * most + TURN_SLACK:
            return True
        there = compose(self._pose, moved)
        self._pose = Pose(there.x, there.y, self._pose.theta + moved.theta)
        return False


def _flat(pose: Fields) -> Pose:
    """A pose on the ground.

    Raises:
        MessageError: its orientation is no quaternion of a rotation.
    """
    x, y, z, w = (pose["orientation"][name] for name in "xyzw")
    if not 0.8 < x * x + y * y + z * z + w * w < 1.2:
        raise MessageError(f"expected a quaternion of length 1, got x {x}, y {y}, z {z}, w {w}")
    heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return Pose(pose["position"]["x"], pose["position"]["y"], heading)
