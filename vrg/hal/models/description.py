"""The description of a robot, which every backend, the world and the rules use."""

from dataclasses import dataclass
from typing import TypeVar

from vrg.hal.actuators import Actuator
from vrg.hal.models.drivetrain import Drivetrain, Multirotor
from vrg.hal.sensors.spec import SensorSpec
from vrg.types import Twist, Vector

P = TypeVar("P", bound=SensorSpec)


@dataclass(frozen=True, kw_only=True)
class RobotModel:
    """A robot, on wheels or in the air.

    Args:
        name: the model's name in match files.
        length: length of the body, m. width: width of the body, m. height: height of the body, m.
        mass: mass with the battery and the sensors, kg.
        drivetrain: how its motors move it.
        v_max: top speed ahead, m/s. w_max: top turn rate, rad/s.
        a_max: acceleration, m/s^2. brake: deceleration with locked wheels, used by watchdogs and stops, m/s^2.
        delay: from a command to when its motors act on it, s.
        slowing: the deceleration while it is commanded to slow down, m/s^2; that of `a_max` if it is None.
        battery_wh: energy of a full battery, Wh. idle_w: power of the electronics, W. rolling: rolling resistance, as a
            fraction of the weight. drive_efficiency: mechanical power divided by electrical power.
        sensors: the specs of its sensors.
        source: where the figures come from.
        actuators: what it has besides motors, such as a kicker or a gripper.
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
    delay: float = 0.0
    slowing: float | None = None
    actuators: tuple[Actuator, ...] = ()

    @property
    def size(self) -> Vector:
        """The length and width of the body, m."""
        return self.length, self.width

    @property
    def flies(self) -> Multirotor | None:
        """Its drivetrain if it flies, or else None."""
        return self.drivetrain if isinstance(self.drivetrain, Multirotor) else None

    @property
    def climb_max(self) -> float:
        """The top speed up and down, m/s; 0 if it does not fly."""
        return 0.0 if self.flies is None else self.flies.climb

    @property
    def scanner(self) -> SensorSpec | None:
        """The spec of its first sensor with a sweep, such as a laser range finder; None where it has none."""
        return next((spec for spec in self.sensors if spec.sweep is not None), None)

    def sensor(self, kind: type[P]) -> P | None:
        """The spec of its first sensor of a kind, given by the spec's class, or None where it has none."""
        return next((spec for spec in self.sensors if isinstance(spec, kind)), None)

    def actuator(self, name: str) -> Actuator | None:
        """The actuator of this name, or None where it has none."""
        return next((actuator for actuator in self.actuators if actuator.name == name), None)

    def spec(self, kind: str, name: str) -> SensorSpec | None:
        """The spec of the sensor of this kind and this name on the robot, or None where it has none."""
        return next((spec for spec in self.sensors if (spec.kind, spec.name) == (kind, name)), None)

    def limited(self, twist: Twist, v_max: float | None = None) -> Twist:
        """Return the motion, slowed down so that no axis turns faster than at `v_max` straight ahead.

        Args:
            v_max: m/s; the model's own top speed if it is None or higher than that.
        """
        return self.drivetrain.limited(twist, self.v_max if v_max is None else min(v_max, self.v_max))
