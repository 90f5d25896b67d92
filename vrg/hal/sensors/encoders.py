"""Encoders, which count the turns of the wheels."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import Recorded, SensorSpec


class Encoders(SensorMessage, frozen=True, kw_only=True):
    """The counts of the encoders since the start.

    Args:
        counts: the ticks of each axis of the drivetrain, such as left and right, in its order; the model's spec tells
            how many make a turn of a wheel. Those of a left or right wheel grow as the robot drives ahead.
    """

    kind = "encoders"
    version = 2

    counts: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class EncodersSpec(SensorSpec):
    """An incremental encoder on each axis of the drivetrain.

    Args:
        ticks: the encoder's ticks per turn of a wheel.
    """

    message = Encoders
    simulation = "vrg.hal.sim.sensors.simple:EncodersSimulation"
    recorded = Recorded.NONE

    ticks: Annotated[int, Meta(ge=1, le=10**9)]
