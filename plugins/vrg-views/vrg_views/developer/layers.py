"""The layers of the field: what robots sense, what players see, and where physical robots were measured."""

import math
from collections.abc import Iterable, Iterator
from typing import Final

from vrg.colours import Rgb, mix
from vrg.figures import Shape
from vrg.games import game_of
from vrg.geometry import circumradius, compose, corners, ellipse
from vrg.hal.sensors.depiction import Cones, Rays, Ticks
from vrg.types import Pose, Uncertainty, Vector
from vrg.ui import palette
from vrg_views.developer.insight import SEEN, Insight, Reading, Seen

SCANS, SENSORS, SIGHTINGS, MEASURED = "scans", "sensors", "sightings", "measured"
"""The layers, by the names of their switches."""
_DOT: Final = 0.03
"""The radius of a dot, m."""
_ARC: Final = 5
"""The number of points on the arc of a sonar's cone, and on that of a mark around a body."""
_AROUND: Final = 1.3
"""The radius of the marks around a body, in circumradii of it."""


def shapes(insight: Insight) -> dict[str, list[Shape]]:
    """All layers by name, in the map's frame. Of the selected player the ground that its laser finds free is there."""
    game = game_of(insight.scene.game)
    colours = {body.name: game.style(body.role, body.state).colour for body in insight.scene.bodies}
    found: dict[str, list[Shape]] = {SCANS: [], SENSORS: [], SIGHTINGS: [], MEASURED: []}
    for reading in insight.readings:
        layer = SCANS if isinstance(reading.depiction, Rays) else SENSORS
        found[layer] += _reading(reading, colours.get(reading.name, palette.ECHO))
    for seen in insight.sightings:
        found[SIGHTINGS] += _sighting(seen, colours.get(seen.player, palette.ECHO), insight.now)
    found[MEASURED] += _measured(insight)
    return found


def _reading(reading: Reading, colour: Rgb) -> Iterator[Shape]:
    match reading.depiction:
        case Rays() as rays:
            eye, ends, met = beam_ends(rays, reading.pose)
            yield Shape(_rounded([eye, *ends]), fill=palette.SCAN)
            yield Shape(_rounded(met), fill=colour, radius=_DOT)
        case Cones() as cones:
            for number, distance in enumerate(cones.ranges):
                if distance < cones.range_max:
                    places = [compose(reading.pose, Pose(x, y, 0.0)) for x, y in cones.outline(number, _ARC)]
                    yield _line([(place.x, place.y) for place in places[1:]], colour)
        case Ticks() as ticks:
            radius, step = _AROUND * circumradius(reading.robot.size), math.tau / max(1, len(ticks.on))
            for number in (number for number, on in enumerate(ticks.on) if on):
                bearings = [reading.pose.theta + step * (number + 0.7 * (k / (_ARC - 1) - 0.5)) for k in range(_ARC)]
                x, y = reading.pose.x, reading.pose.y
                yield _line([(x + radius * math.cos(b), y + radius * math.sin(b)) for b in bearings], palette.CAUTION)


def beam_ends(rays: Rays, pose: Pose) -> tuple[Vector, list[Vector], list[Vector]]:
    """The place of a laser, the ends of all its beams, and the ends of those that have met something.

    Args:
        pose: of the robot.
    """
    eye, bearings = compose(pose, rays.mount), rays.bearings + pose.theta
    ends = [
        (eye.x + length * math.cos(b), eye.y + length * math.sin(b))
        for length, b in zip(rays.ranges, bearings, strict=True)
    ]
    met = [end for end, length in zip(ends, rays.ranges, strict=True) if 0.0 < length < rays.range_max]
    return (eye.x, eye.y), ends, met


def _sighting(seen: Seen, colour: Rgb, now: float) -> Iterator[Shape]:
    s = seen.sighting
    share = min(1.0, max(0.0, (now - s.time) / SEEN))
    faded = mix(colour, palette.FIELD, 0.85 * share)
    yield Shape(_rounded([(s.x, s.y)]), fill=faded, radius=_DOT)
    yield _line(ellipse(s.x, s.y, Uncertainty(s.xx, s.xy, s.yy, 0.0)), faded, closed=True)


def _measured(insight: Insight) -> Iterator[Shape]:
    """Robots outlined where they were measured, with lines to where they are, and ellipses where they may be."""
    for body in insight.scene.bodies:
        measured = insight.measured.get(body.name)
        if measured is None:
            continue
        pose, known = measured.body.pose, measured.body.uncertainty
        yield _line(corners(pose, body.length, body.width), palette.CAUTION, closed=True)
        yield _line([(pose.x, pose.y), (body.pose.x, body.pose.y)], palette.CAUTION)
        if known is not None:
            yield _line(ellipse(pose.x, pose.y, known), palette.CAUTION, closed=True)


def _line(points: Iterable[Vector], colour: Rgb, *, closed: bool = False) -> Shape:
    return Shape(_rounded(points), line=colour, width=1.5, closed=closed)


def _rounded(points: Iterable[Vector]) -> tuple[Vector, ...]:
    """Points of the map, rounded to centimetres."""
    return tuple((round(x, 2), round(y, 2)) for x, y in points)
