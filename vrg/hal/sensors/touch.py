"""Bumpers, which feel contact."""

import math
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.depiction import Ticks
from vrg.hal.sensors.spec import Recorded, SensorSpec


class Touch(SensorMessage, frozen=True, kw_only=True):
    """The bumpers that are pressed.

    Args:
        pressed: one value a bumper, True if it is in contact. The first bumper is straight ahead, the others follow
            counter-clockwise.
    """

    kind = "touch"

    pressed: tuple[bool, ...]

    @property
    def words(self) -> str:
        """The directions of the pressed bumpers, in degrees to the left of straight ahead."""
        step = 360.0 / max(1, len(self.pressed))
        places = [f"{math.remainder(n * step, 360.0):+.0f}°" for n, pressed in enumerate(self.pressed) if pressed]
        return f"pressed at {', '.join(places)}" if places else f"none of {len(self.pressed)} pressed"


@dataclass(frozen=True, kw_only=True)
class TouchSpec(SensorSpec):
    """A ring of bumpers around the body.

    Args:
        count: the number of bumpers, evenly spaced. The first is straight ahead, the others follow counter-clockwise.
    """

    message = Touch
    simulation = "vrg.hal.sim.sensors.simple:TouchSimulation"
    recorded = Recorded.CHANGES
    depiction = Ticks

    count: Annotated[int, Meta(ge=1, le=64)]

    def depict(self, reading: Touch) -> Ticks:
        """The bumpers, those that are pressed set."""
        return Ticks(reading.pressed)
