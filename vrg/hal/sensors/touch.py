"""Bumpers, which feel contact."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import SensorSpec


class Touch(SensorMessage, frozen=True, kw_only=True):
    """Which bumpers are pressed.

    Args:
        pressed: one value a bumper, True if it is in contact. The first bumper is straight ahead, the others follow
            counter-clockwise.
    """

    kind = "touch"

    pressed: tuple[bool, ...]


@dataclass(frozen=True, kw_only=True)
class TouchSpec(SensorSpec):
    """A ring of bumpers around the body.

    Args:
        count: the number of bumpers, evenly spaced. The first is straight ahead, the others follow counter-clockwise.
    """

    message = Touch
    simulation = "vrg.hal.sim.sensors.touch:TouchSimulation"

    count: Annotated[int, Meta(ge=1, le=64)]
