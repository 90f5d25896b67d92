"""Plain descriptions of what a sensor has measured. Windows draw them, and recordings convert them for viewers.

A spec makes one from each message of its sensor, so a painter needs to know no kind of sensor.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vrg.geometry import ahead
from vrg.types import Pose, Vector

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


@dataclass(frozen=True)
class Rays:
    """Thin beams from one place, at even steps.

    Args:
        mount: the pose of the place in the robot's frame, m and rad.
        first: the angle of the first beam from the heading of the mount, rad. step: the angle between beams, rad.
        ranges: how far each beam reached, m; 0 where it has measured nothing.
        range_max: what it reads where it met nothing, m.
    """

    mount: Pose
    first: float
    step: float
    ranges: Sequence[float]
    range_max: float

    @property
    def bearings(self) -> "npt.NDArray[np.float64]":
        """The direction of each beam in the robot's frame: shape (beams,), rad."""
        import numpy as np  # noqa: PLC0415 - a recorder needs no numpy

        return self.mount.theta + self.first + self.step * np.arange(len(self.ranges), dtype=np.float64)


@dataclass(frozen=True)
class Cones:
    """Cones in each of which something is at a distance, wherever in the cone.

    Args:
        places: the pose of each apex in the robot's frame, m and rad. angle: the whole angle of the cones, rad.
        ranges: the distance in each cone, m. range_max: what it is where there is nothing, m.
    """

    places: Sequence[Pose]
    angle: float
    ranges: Sequence[float]
    range_max: float

    def outline(self, number: int, points: int) -> list[Vector]:
        """The apex of a cone, and `points` points of the arc at its distance, in the robot's frame, m."""
        place, distance = self.places[number], self.ranges[number]
        bearings = [place.theta + self.angle * (k / (points - 1) - 0.5) for k in range(points)]
        arc = [ahead(place.x, place.y, bearing, distance) for bearing in bearings]
        return [(place.x, place.y), *arc]


@dataclass(frozen=True)
class Ticks:
    """Marks around the body, evenly spaced: the first is straight ahead, the others follow counter-clockwise.

    Args:
        on: True for each mark that is set.
    """

    on: Sequence[bool]


@dataclass(frozen=True)
class Image:
    """An image of a camera. png: its file, PNG, RGB with 8 bits a channel."""

    png: bytes


@dataclass(frozen=True)
class Place:
    """A place on the earth. latitude, longitude: rad, WGS 84; None where it is not known."""

    latitude: float | None
    longitude: float | None


Depiction = Rays | Cones | Ticks | Image | Place
"""A measurement of a sensor, in one of the forms that windows and viewers draw."""
