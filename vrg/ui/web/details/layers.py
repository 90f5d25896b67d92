"""The layers of the field: what robots sense, what players see, and where physical robots were measured."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from vrg.colours import Rgb, hexadecimal
from vrg.games import game_of
from vrg.geometry import circumradius, compose, ellipse
from vrg.hal.sensors.depiction import Cones, Rays, Ticks
from vrg.types import Pose, Uncertainty, Vector
from vrg.ui import palette
from vrg.ui.web.details.insight import SEEN, Insight, Reading, Seen

SCANS, SENSORS, SIGHTINGS, MEASURED = "scans", "sensors", "sightings", "measured"
"""The layers, by the names of their switches."""
DOTS, LINE, AREA = "dots", "line", "area"
"""The kinds of shapes: points, a line through them, or the filled polygon of them."""
_ARC: Final = 5
"""The number of points on the arc of a sonar's cone, and on that of a mark around a body."""
_AROUND: Final = 1.3
"""The radius of the marks around a body, in circumradii of it."""


@dataclass(frozen=True)
class Shape:
    """A shape on the field.

    Args:
        layer: the one that it belongs to. kind: DOTS, LINE or AREA. colour: such as `#56b4e9`.
        points: x and y in the map's frame, m, rounded to centimetres.
    """

    layer: str
    kind: str
    points: list[Vector]
    colour: str


def shapes(insight: Insight) -> list[Shape]:
    """All layers. Of the selected player the ground that its laser finds free is among them."""
    game = game_of(insight.scene.game)
    colours = {body.name: game.style(body.role, body.state).colour for body in insight.scene.bodies}
    found: list[Shape] = []
    for reading in insight.readings:
        found += _reading(reading, colours.get(reading.name, palette.ECHO))
    for seen in insight.sightings:
        found += _sighting(seen, colours.get(seen.player, palette.ECHO), insight.now)
    return [*found, *_measured(insight)]


def _reading(reading: Reading, colour: Rgb) -> Iterator[Shape]:
    match reading.depiction:
        case Rays() as rays:
            eye, ends, met = beam_ends(rays, reading.pose)
            yield _shape(SCANS, AREA, [eye, *ends], palette.SCAN)
            yield _shape(SCANS, DOTS, met, colour)
        case Cones() as cones:
            for number, distance in enumerate(cones.ranges):
                if distance < cones.range_max:
                    places = [compose(reading.pose, Pose(x, y, 0.0)) for x, y in cones.outline(number, _ARC)]
                    yield _shape(SENSORS, LINE, [(place.x, place.y) for place in places[1:]], colour)
        case Ticks() as ticks:
            radius, step = _AROUND * circumradius(reading.robot.size), math.tau / max(1, len(ticks.on))
            for number in (number for number, on in enumerate(ticks.on) if on):
                bearings = [reading.pose.theta + step * (number + 0.7 * (k / (_ARC - 1) - 0.5)) for k in range(_ARC)]
                x, y = reading.pose.x, reading.pose.y
                arc = [(x + radius * math.cos(b), y + radius * math.sin(b)) for b in bearings]
                yield _shape(SENSORS, LINE, arc, palette.CAUTION)


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
    faded = palette.mix(colour, palette.FIELD, 0.85 * share)
    yield _shape(SIGHTINGS, DOTS, [(s.x, s.y)], faded)
    yield _closed(SIGHTINGS, ellipse(s.x, s.y, Uncertainty(s.xx, s.xy, s.yy, 0.0)), faded)


def _measured(insight: Insight) -> Iterator[Shape]:
    """Robots outlined where they were measured, with lines to where they are, and ellipses where they may be."""
    for body in insight.scene.bodies:
        measured = insight.measured.get(body.name)
        if measured is None:
            continue
        pose, known = measured.body.pose, measured.body.uncertainty
        half, aside = body.length / 2, body.width / 2
        corners = [compose(pose, Pose(x, y, 0.0)) for x, y in ((half, aside), (-half, aside), (-half, -aside))]
        corners.append(compose(pose, Pose(half, -aside, 0.0)))
        yield _closed(MEASURED, [(corner.x, corner.y) for corner in corners], palette.CAUTION)
        yield _shape(MEASURED, LINE, [(pose.x, pose.y), (body.pose.x, body.pose.y)], palette.CAUTION)
        if known is not None:
            yield _closed(MEASURED, ellipse(pose.x, pose.y, known), palette.CAUTION)


def _closed(layer: str, corners: list[Vector], colour: Rgb) -> Shape:
    return _shape(layer, LINE, [*corners, corners[0]], colour)


def _shape(layer: str, kind: str, points: Iterable[Vector], colour: Rgb) -> Shape:
    return Shape(layer, kind, [(round(x, 2), round(y, 2)) for x, y in points], hexadecimal(colour))
