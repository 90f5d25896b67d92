"""The description of a robot, which every backend, the world and the rules use."""

from dataclasses import dataclass
from typing import TypeVar

from vrg.hal.models.drivetrain import Drivetrain
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sensors.touch import TouchSpec
from vrg.types import Twist, Vector

P = TypeVar("P", bound=SensorSpec)


@dataclass(frozen=True, kw_only=True)
class RobotModel:
    """A robot on wheels.

    Args:
        name: the model's name in match files.
        length: length of the body, m. width: width of the body, m. height: height of the body, m.
        mass: mass with the battery and the sensors, kg.
        drivetrain: how its motors move it.
        v_max: top speed ahead, m/s. w_max: top turn rate, rad/s.
        a_max: acceleration, m/s^2. brake: deceleration with locked wheels, used by watchdogs and stops, m/s^2.
        battery_wh: energy of a full battery, Wh. idle_w: power of the electronics, W. rolling: rolling resistance, as a
            fraction of the weight. drive_efficiency: mechanical power divided by electrical power.
        sensors: the specs of its sensors.
        source: where the figures come from.
        colour: the colour of its body in the pictures of cameras: red, green and blue, 0 to 255.
    """

    name: str
    length: float
    width: float
    height: float
    mass: float
    drivetrain: Drivetrain
    v_max: float
    w_max: float
    a_max: float
    brake: float
    battery_wh: float
    idle_w: float
    rolling: float
    drive_efficiency: float
    sensors: tuple[SensorSpec, ...]
    source: str
    colour: tuple[int, int, int] = (175, 30, 30)

    @property
    def size(self) -> Vector:
        """The length and width of the body, m."""
        return self.length, self.width

    @property
    def laser(self) -> LaserSpec | None:
        """The spec of its first laser range finder, or None where it has none."""
        return self.sensor(LaserSpec)

    @property
    def bumpers(self) -> int:
        """The number of bumpers of its first ring, 0 where it has none."""
        touch = self.sensor(TouchSpec)
        return 0 if touch is None else touch.count

    def sensor(self, kind: type[P]) -> P | None:
        """The spec of its first sensor of a kind, given by the spec's class, or None where it has none."""
        return next((spec for spec in self.sensors if isinstance(spec, kind)), None)

    def limited(self, twist: Twist, v_max: float | None = None) -> Twist:
        """Return the motion, slowed down so that no axis turns faster than at `v_max` straight ahead.

        Args:
            v_max: m/s; the model's own top speed if it is None or higher than that.
        """
        return self.drivetrain.limited(twist, self.v_max if v_max is None else min(v_max, self.v_max))
