"""What a robot that runs ROS 2 has reported, as samples of its sensors, each with its age.

Ages are judged by the stamps of the messages, not by when they came. So a message that was held up on its way is as old
as it is, and a driver that repeats an old one is found out. A robot's clock may be any: what counts is how much later
than the quickest of the last seconds a message came. The scan and the charge are stamped by the same clock.
"""

import math
from array import array
from collections.abc import Mapping
from typing import Any, Final

from vrg.bus.messages import SensorMessage
from vrg.errors import MessageError
from vrg.geometry import compose, inverse, wrap
from vrg.hal.models import RobotModel
from vrg.hal.sensors.battery import Battery, BatterySpec
from vrg.hal.sensors.laser import RANGES_LIMIT, Laser, LaserSpec
from vrg.hal.sensors.odometry import Odometry, OdometrySpec
from vrg.hal.sensors.spec import Sample, SensorSpec
from vrg.localisation.clock import ClockOffset
from vrg.types import Pose, Twist

Fields = Mapping[str, Any]

JUMP: Final = (0.2, 0.5)
"""How far, m and rad, the odometry may jump beyond what the robot can drive meanwhile, without being a new one."""


def seconds(stamp: Fields) -> float:
    """A time of a message, s."""
    return float(stamp["sec"] + stamp["nanosec"] * 1e-9)


class Reported:
    """Takes in the messages of one robot.

    Args:
        name: of the robot, for messages. model: its description. frame: the frame of its body; empty takes any.
        scan_yaw: the heading of its laser's frame on the robot, rad.
    """

    def __init__(self, name: str, model: RobotModel, frame: str = "", scan_yaw: float = 0.0) -> None:
        self._name, self._model, self._scan_yaw = name, model, scan_yaw
        self.frame = frame
        """The frame of its body; if it was not given, that of its odometry."""
        self._given = frame
        self._clock = ClockOffset(stopped=math.inf)
        self._newest: dict[type[SensorSpec], tuple[float, SensorMessage]] = {}
        """The newest of each sensor, with its stamp by the robot's clock."""
        self._last: tuple[float, Pose] | None = None
        """The last odometry as it came: its stamp and its pose."""
        self._pose = Pose(0.0, 0.0, 0.0)
        self.begun_anew = 0
        """How often the odometry has begun anew."""

    def stamp(self, now: float) -> Fields:
        """The time of the robot's own clock at the monotonic time `now`, s, as a message has it."""
        time = self._clock.match_time(now)
        nanoseconds = 0 if time is None else round(max(0.0, time) * 1e9)
        return {"sec": nanoseconds // 1_000_000_000, "nanosec": nanoseconds % 1_000_000_000}

    def age(self, now: float) -> float:
        """The age of the newest odometry, s; infinite before the first."""
        found = self._newest.get(OdometrySpec)
        return math.inf if found is None else self._age(found[0], now)

    def odometry(self, message: Fields, now: float) -> None:
        """Take in nav_msgs/Odometry, at the monotonic time `now`, s.

        Raises:
            MessageError: a number is not finite, it has no stamp, or it is of another frame.
        """
        at, frame = seconds(message["header"]["stamp"]), message["child_frame_id"]
        position, turn = message["pose"]["pose"]["position"], message["pose"]["pose"]["orientation"]
        linear, angular = message["twist"]["twist"]["linear"], message["twist"]["twist"]["angular"]
        heading = math.atan2(
            2.0 * (turn["w"] * turn["z"] + turn["x"] * turn["y"]), 1.0 - 2.0 * (turn["y"] ** 2 + turn["z"] ** 2)
        )
        pose = Pose(position["x"], position["y"], heading)
        twist = Twist(linear["x"], angular["z"], linear["y"])
        if self._given and frame != self._given:
            raise MessageError(f"expected odometry of the frame {self._given}, got {frame!r}: see `frame`")
        if at <= 0.0:
            raise MessageError("expected odometry with a time stamp, got none: its age cannot be judged")
        if not (twist.is_finite and math.isfinite(pose.x + pose.y + pose.theta)):
            raise MessageError(f"expected odometry of finite numbers, got {pose} and {twist}")
        self.frame = self._given or frame
        self._clock.heard(at, now)
        if self._last is not None and at <= self._last[0] < at + 1.0:
            return  # it repeats itself, or comes late
        self._pose = self._continued(at, pose)
        self._last = at, pose
        self._newest[OdometrySpec] = at, Odometry(pose=self._pose, twist=twist)

    def scan(self, message: Fields) -> None:
        """Take in sensor_msgs/LaserScan. A beam that met nothing, or that cannot be trusted, reads the longest range.

        Raises:
            MessageError: it is none that a laser can make.
        """
        longest, shortest = float(message["range_max"]), float(message["range_min"])
        angles = message["angle_min"] + self._scan_yaw, message["angle_increment"]
        if not (math.isfinite(sum(angles)) and 0.0 < longest < math.inf and len(message["ranges"]) <= RANGES_LIMIT):
            raise MessageError(f"expected a scan of finite angles and ranges, got {angles} and {longest}")
        # REP 117: -inf is nearer than the sensor can measure, inf is nothing within its range, NaN is no measurement.
        ranges = array("f", (r if shortest <= r <= longest else longest for r in message["ranges"]))
        for index, distance in enumerate(message["ranges"]):
            if distance == -math.inf:
                ranges[index] = max(0.0, shortest)
        scan = Laser(angle_min=wrap(angles[0]), angle_step=angles[1], range_max=longest, data=ranges.tobytes())
        self._newest[LaserSpec] = seconds(message["header"]["stamp"]), scan

    def battery(self, message: Fields) -> None:
        """Take in sensor_msgs/BatteryState. Without a charge it is left out; above 1 it is taken to be in per cent."""
        charge = message["percentage"]
        if math.isfinite(charge):
            charge = charge / 100.0 if charge > 1.0 else charge
            at = seconds(message["header"]["stamp"])
            self._newest[BatterySpec] = at, Battery(charge=min(1.0, max(0.0, charge)))

    def samples(self, now: float, match_time: float) -> list[Sample[SensorMessage]]:
        """A sample of each sensor that the model has and the robot has reported.

        Args:
            now: monotonic time, s. match_time: the same instant as match time, by which samples are stamped, s.
        """
        found = []
        for kind, (at, value) in self._newest.items():
            if (spec := self._model.sensor(kind)) is not None:
                age = self._age(at, now)
                found.append(Sample(match_time - age, age, value, spec.name))
        return found

    def _age(self, at: float, now: float) -> float:
        time = self._clock.match_time(now)
        return math.inf if time is None else max(0.0, time - at)

    def _continued(self, at: float, pose: Pose) -> Pose:
        """The pose since the first odometry: it goes on where the robot's own begins anew, and turns beyond pi."""
        if self._last is None:
            return self._pose
        before, last = self._last
        moved = compose(inverse(last), pose)
        gone, turned, time = math.hypot(moved.x, moved.y), wrap(moved.theta), abs(at - before)
        if gone > 2.0 * self._model.v_max * time + JUMP[0] or abs(turned) > 2.0 * self._model.w_max * time + JUMP[1]:
            self.begun_anew += 1
            return self._pose
        there = compose(self._pose, moved)
        return Pose(there.x, there.y, self._pose.theta + turned)
