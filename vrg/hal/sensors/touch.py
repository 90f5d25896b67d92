"""Bumpers."""

from dataclasses import dataclass

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import SensorSpec


class Touch(SensorMessage, frozen=True, kw_only=True):
    """Which bumpers are pressed.

    Args:
        pressed: each bumper, the first ahead, counter-clockwise; True = in contact.
    """

    kind = "touch"

    pressed: tuple[bool, ...]


@dataclass(frozen=True, kw_only=True)
class TouchSpec(SensorSpec):
    """A ring of bumpers.

    Args:
        count: number of bumpers, evenly around the body, the first ahead, counter-clockwise.
    """

    message = Touch
    simulation = "vrg.hal.sim.sensors.touch:TouchSimulation"

    count: int
