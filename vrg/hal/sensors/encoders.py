"""Wheel encoders."""

from dataclasses import dataclass

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import SensorSpec


class Encoders(SensorMessage, frozen=True, kw_only=True):
    """What the encoders of the left and the right wheels have counted since the start, forward positive.

    Args:
        left, right: ticks; the model's spec tells how many make a turn.
    """

    kind = "encoders"

    left: int
    right: int


@dataclass(frozen=True, kw_only=True)
class EncodersSpec(SensorSpec):
    """An incremental encoder on each side.

    Args:
        ticks: per turn of a wheel.
    """

    message = Encoders
    simulation = "vrg.hal.sim.sensors.encoders:EncodersSimulation"

    ticks: int
