"""What a robot says of itself at one instant: its state, and a sample of each of its sensors."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.encoders import Encoders
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.hal.sensors.touch import Touch

S = TypeVar("S", bound=SensorMessage)


@dataclass(frozen=True, slots=True)
class Readings:
    """What a robot says of itself. A sensor that it lacks, or that has said nothing yet, has no sample.

    Args:
        stamp: match time at which the robot was last heard, s. age: s of match time since then.
        armed: its motors accept commands. estop: the emergency stop is latched.
        fault: what is wrong, in words.
        latched: the fault, or an emergency stop that was pressed at the robot itself, stays until a person clears it.
        samples: the newest one of each sensor.
    """

    stamp: float
    age: float
    armed: bool
    estop: bool
    fault: str | None = None
    latched: bool = False
    samples: Sequence[Sample[SensorMessage]] = ()

    def latest(self, kind: type[S], name: str | None = None) -> Sample[S] | None:
        """The newest sample of a sensor, by the class of its message: `readings.latest(Laser)`.

        Args:
            name: of the sensor on its robot, where there are several of a kind; the first one if it is missing.

        Returns:
            None where the robot has no such sensor, or where it has said nothing yet.
        """
        for sample in self.samples:
            if isinstance(sample.value, kind) and name in (None, sample.name):
                return sample  # type: ignore[return-value]
        return None

    @property
    def laser(self) -> Sample[Laser] | None:
        """The newest scan of the first laser."""
        return self.latest(Laser)

    @property
    def ins(self) -> Sample[Ins] | None:
        """Where the robot is on the map by its own measurement."""
        return self.latest(Ins)

    @property
    def odometry(self) -> Sample[Odometry] | None:
        """How far the robot has come by its wheels, and how fast it goes."""
        return self.latest(Odometry)

    @property
    def encoders(self) -> Sample[Encoders] | None:
        """What the wheels' encoders have counted."""
        return self.latest(Encoders)

    @property
    def touch(self) -> Sample[Touch] | None:
        """Which bumpers are pressed."""
        return self.latest(Touch)

    @property
    def battery(self) -> Sample[Battery] | None:
        """How much charge is left."""
        return self.latest(Battery)
