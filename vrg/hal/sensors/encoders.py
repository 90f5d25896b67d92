"""Encoders, which count the turns of the wheels."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import Recorded, SensorSpec


class Encoders(SensorMessage, frozen=True, kw_only=True):
    """The counts of the encoders of the left and of the right wheels since the start. Forward is positive.

    Args:
        left, right: the encoder's ticks; the model's spec tells how many make a turn of a wheel.
    """

    kind = "encoders"

    left: int
    right: int


@dataclass(frozen=True, kw_only=True)
class EncodersSpec(SensorSpec):
    """An incremental encoder on each side of the robot.

    Args:
        ticks: the encoder's ticks per turn of a wheel.
    """

    message = Encoders
    simulation = "vrg.hal.sim.sensors.encoders:EncodersSimulation"
    recorded = Recorded.NONE

    ticks: Annotated[int, Meta(ge=1, le=10**9)]
