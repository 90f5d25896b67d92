"""Receivers of the Global Positioning System."""

import math
from dataclasses import dataclass
from typing import Annotated, Final

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.depiction import Place
from vrg.hal.sensors.spec import Rate, SensorSpec
from vrg.portable.scalars import cos_sin
from vrg.types import Count, Deviation, Metres, Vector

SATELLITES_FOR_A_FIX: Final = 4
"""A receiver has four unknowns: three coordinates and its clock's error."""

# WGS 84: the semi-major axis in m, and the square of the first eccentricity (NGA.STND.0036, 2014).
_AXIS: Final = 6_378_137.0
_ECCENTRICITY_SQUARED: Final = 6.694_379_990_14e-3


class Gps(SensorMessage, frozen=True, kw_only=True):
    """The position of the robot on the earth.

    Args:
        latitude, longitude: rad, WGS 84, north and east are positive; None without a fix.
        satellites: the number of satellites that are received.
    """

    kind = "gps"

    latitude: Annotated[float, Meta(ge=-math.pi / 2, le=math.pi / 2)] | None
    longitude: Annotated[float, Meta(ge=-math.pi, le=math.pi)] | None
    satellites: Count

    @property
    def fix(self) -> bool:
        """True if the position is known."""
        return self.latitude is not None and self.longitude is not None

    @property
    def words(self) -> str:
        """The place in degrees, and the number of satellites."""
        place = "no fix" if self.latitude is None else f"{math.degrees(self.latitude):.7f}°"
        east = "" if self.longitude is None else f", {math.degrees(self.longitude):.7f}°"
        return f"{place}{east}, {self.satellites} satellites"


@dataclass(frozen=True, kw_only=True)
class GpsSpec(SensorSpec):
    """A GPS receiver. The defaults are estimates for a cheap one without corrections.

    Args:
        height: the height of the antenna above ground, m.
        position_noise: standard deviation of the error to the east and of that to the north, m.
        correlation: the time in s within which the error changes.
        mask: the elevation below which satellites are not received, rad.
    """

    message = Gps
    simulation = "vrg.hal.sim.sensors.gps:GpsSimulation"
    synthesised = True
    depiction = Place

    height: Metres = 0.5
    position_noise: Deviation = 1.5
    correlation: Annotated[float, Meta(gt=0.0, le=3600.0)] = 60.0
    mask: Annotated[float, Meta(ge=0.0, le=math.pi / 2)] = math.radians(10)
    rate: Rate = 1.0

    def depict(self, reading: Gps) -> Place:
        """The place on the earth."""
        return Place(reading.latitude, reading.longitude)


def to_wgs84(place: Vector, origin: tuple[float, float]) -> tuple[float, float]:
    """The latitude and the longitude of a place on a map, rad.

    It uses the radii of curvature at the origin, so it is exact to a millimetre within a kilometre of it.

    Args:
        place: m east and north of the origin. origin: its latitude and longitude, rad.
    """
    east, north = _metres_per_radian(origin[0])
    return origin[0] + place[1] / north, origin[1] + place[0] / east


def from_wgs84(latitude: float, longitude: float, origin: tuple[float, float]) -> Vector:
    """The place on a map, m east and north of its origin: the inverse of `to_wgs84`."""
    east, north = _metres_per_radian(origin[0])
    return (longitude - origin[1]) * east, (latitude - origin[0]) * north


def _metres_per_radian(latitude: float) -> tuple[float, float]:
    """The length of a radian of longitude and of one of latitude, m."""
    cos, sin = cos_sin(latitude)
    root = math.sqrt(1 - _ECCENTRICITY_SQUARED * sin * sin)
    return _AXIS / root * cos, _AXIS * (1 - _ECCENTRICITY_SQUARED) / (root * root * root)
