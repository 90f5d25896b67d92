"""The base of all specs: a sensor's place in a robot model, and how it is recorded and drawn. And a sample of it."""

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any, ClassVar, Generic, TypeVar

from msgspec import Meta, Struct

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.depiction import Depiction
from vrg.types import Fraction, Pose

Rate = Annotated[float, Meta(gt=0.0, le=50.0)]
"""Readings per second of match time. A world makes 50 ticks a second, and a sensor has at most one reading in each."""


class Recorded(Enum):
    """The readings of a sensor that a recording holds.

    Sonars, GPS receivers and bumpers add a fifth to a recording with lasers. Odometry, encoders and INS would each add
    a tenth or more, for what the poses tell too, so they are left out.
    """

    ALL = "all"
    CHANGES = "changes"
    """Each that differs from the one before."""
    NONE = "none"


@dataclass(frozen=True)
class Sweep:
    """The sector within which a range finder looks along thin beams.

    Args:
        mount: the pose of the range finder in the robot's frame, m and rad.
        fov: the angle that the beams cover, symmetric about the heading of the mount, rad. range_max: their length, m.
    """

    mount: Pose
    fov: float
    range_max: float


S_co = TypeVar("S_co", bound=SensorMessage, covariant=True)


@dataclass(frozen=True, kw_only=True)
class SensorSpec:
    """The spec of one sensor of a robot model.

    A match file may change every field that is a number (see `vrg.hal.models.settings`). The annotation of a field
    gives its bounds, for example `Annotated[float, msgspec.Meta(ge=0.0)]`. A subclass whose fields must fit together
    checks that in `__post_init__` and raises ValueError.

    Args:
        name: the sensor's name on its robot, unique among the sensors of its kind.
        rate: readings per second of match time. The world rounds the time between two readings to whole ticks.
        drop_out: the share of readings that never come, 0 to 1. A world without noise has no drop-outs.

    Attributes:
        message: the class of the message that carries one reading.
        simulation: `module:Class` of its simulation in the world, a `vrg.hal.sim.sensors.base.SensorSimulation`; only
            the world imports it. Empty where the world cannot simulate the sensor.
        synthesised: True if the world also simulates it for a physical robot that lacks it, from the robot's pose.
        recorded: which of its readings a recording holds.
        depiction: the type of what `depict` returns; None if its readings are shown in words only.
        range_finder: True if it measures ranges. A match with `lasers = false` leaves it out.
    """

    message: ClassVar[type[SensorMessage]]
    simulation: ClassVar[str] = ""
    synthesised: ClassVar[bool] = False
    recorded: ClassVar[Recorded] = Recorded.ALL
    depiction: ClassVar[type[Depiction] | None] = None
    range_finder: ClassVar[bool] = False

    name: str = "main"
    rate: Rate = 10.0
    drop_out: Fraction = 0.0

    @property
    def kind(self) -> str:
        """The word that stands for this kind of sensor in keys."""
        return self.message.kind

    @property
    def sweep(self) -> Sweep | None:
        """The sector in which it sees others along thin beams, which it then depicts as `Rays`; None if it does not.

        Games whose players find others by ranges ask for this.
        """
        return None

    def depict(self, reading: Any) -> Depiction | None:
        """The depiction of a reading of this sensor; None if the reading does not fit this spec.

        Args:
            reading: of the class `message`.
        """
        return None

    def due_every(self, dt: float) -> int:
        """The number of ticks of `dt` seconds from one reading to the next, at least 1."""
        return max(1, round(1 / (self.rate * dt)))


class Sample(Struct, Generic[S_co], frozen=True, gc=False):
    """One reading, as it is given to a player.

    Args:
        stamp: the match time of the measurement, s. age: the match time since then, s.
        value: the sensor's message.
        name: the sensor's name on its robot.
    """

    stamp: float
    age: float
    value: S_co
    name: str = "main"
