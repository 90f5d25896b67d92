"""What every sensor has in common: its place in a robot model, and a sample of it at the player."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Generic, TypeVar

from msgspec import Meta, Struct

from vrg.bus.messages import SensorMessage
from vrg.types import Fraction

Rate = Annotated[float, Meta(gt=0.0, le=50.0)]
"""Readings per second of match time. A world makes 50 ticks a second, and a sensor has at most one reading in each."""

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
    """

    message: ClassVar[type[SensorMessage]]
    simulation: ClassVar[str] = ""
    synthesised: ClassVar[bool] = False

    name: str = "main"
    rate: Rate = 10.0
    drop_out: Fraction = 0.0

    @property
    def kind(self) -> str:
        """The word that stands for this kind of sensor in keys."""
        return self.message.kind

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
