"""The marks where players line up at one end of a field."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from vrg.coordinator.placing import assigned
from vrg.coordinator.rulebook import Contestant
from vrg.geometry import circumradius, wrap
from vrg.regions import Rectangle
from vrg.types import Pose, Vector

SPACING_FACTOR = 1.5
"""The part of a row for one body, as a multiple of its largest extent."""


@dataclass(frozen=True)
class LargestBody:
    """The size of the largest body.

    Args:
        side: its longest side, m. across: its diagonal, m: at this distance two centres are never too near.
    """

    side: float
    across: float

    @classmethod
    def of(cls, contestants: Sequence[Contestant]) -> "LargestBody":
        """The extent of the largest of these; 0 without any."""
        sizes = [c.size for c in contestants] or [(0.0, 0.0)]
        return cls(max(map(max, sizes)), 2 * max(map(circumradius, sizes)))


def line_up(
    players: Mapping[str, Pose],
    zone: Rectangle,
    field: Rectangle,
    extent: LargestBody,
    obstacles: Sequence[Vector] = (),
) -> dict[str, Pose]:
    """Return marks in a row across an end zone, facing the middle of the field.

    Their ways do not cross. If one row is too short for all of them, they stand in several rows.

    Args:
        players: the present pose of each player.
        zone: the end zone. field: the whole field.
        extent: of the bodies. One row is used only if its marks are more than 1.5 times the longest side apart.
        obstacles: the places of bodies that stay where they are. No mark is so near that two touch, if there is room.
    """
    # With marks for more players than there are, those that are taken can be left out.
    for more in range(len(obstacles) * 4 + 1):
        marks = rows_of(len(players) + more, zone, field, extent)
        free = [
            mark for mark in marks if all(math.dist((mark.x, mark.y), place) > extent.across for place in obstacles)
        ]
        if len(free) >= len(players):
            break
    else:
        free = list(rows_of(len(players), zone, field, extent))
    return assigned(players, free)


def in_order(players: Mapping[str, Pose], zone: Rectangle, field: Rectangle, extent: LargestBody) -> dict[str, Pose]:
    """Marks across an end zone for players in their order across the field; arguments as for `line_up`."""
    along_y = _along_y(zone, field)
    order = sorted(players, key=lambda n: (players[n].x if along_y else players[n].y, n))
    return dict(zip(order, rows_of(len(order), zone, field, extent), strict=True))


def crowded(players: int, zone: Rectangle, field: Rectangle, extent: LargestBody) -> bool:
    """True if this many players, or fewer, do not all have a mark in an end zone at which they touch no other."""
    return any(_collide(rows_of(count, zone, field, extent), extent) for count in range(2, players + 1))


def _collide(marks: Sequence[Pose], extent: LargestBody) -> bool:
    places = [(mark.x, mark.y) for mark in marks]
    return any(math.dist(a, b) < extent.across for i, a in enumerate(places) for b in places[:i])


@lru_cache(maxsize=64)
def rows_of(count: int, zone: Rectangle, field: Rectangle, extent: LargestBody) -> tuple[Pose, ...]:
    """The given number of marks, in their order across the field, in as few rows as possible.

    All minnows ask for the same marks at each tick, and for many of them it takes long to see that none are too near.
    """
    across = zone.x_max - zone.x_min if _along_y(zone, field) else zone.y_max - zone.y_min
    per_row = max(1, int(across / (SPACING_FACTOR * extent.side)) - 1)
    fewest = -(-count // per_row) or 1
    for rows in (*range(fewest, count + 1), *range(fewest - 1, 0, -1)):
        marks = _marks(count, rows, zone, field)
        if not _collide(marks, extent):
            return marks
    return _marks(count, fewest, zone, field)


def _marks(count: int, rows: int, zone: Rectangle, field: Rectangle) -> tuple[Pose, ...]:
    """So many marks in so many rows: one goes to the first row, the next to the second, and so on."""
    along_y = _along_y(zone, field)
    low, high = (zone.x_min, zone.x_max) if along_y else (zone.y_min, zone.y_max)
    near, far = (zone.y_min, zone.y_max) if along_y else (zone.x_min, zone.x_max)
    at_low_end = near <= (field.y_min if along_y else field.x_min)
    theta = math.pi / 2 if along_y else 0.0
    if not at_low_end:
        theta = wrap(theta + math.pi)
    marks = []
    for i in range(count):
        across = (low + high) / 2 + (high - low) * (2 * i + 1 - count) / (2 * count + 2)
        depth = near + (far - near) * (i % rows + 1) / (rows + 1)
        marks.append(Pose(across, depth, theta) if along_y else Pose(depth, across, theta))
    return tuple(marks)


def _along_y(zone: Rectangle, field: Rectangle) -> bool:
    """True if minnows cross along y: an end zone is then as wide as the field."""
    return zone.x_max - zone.x_min >= field.x_max - field.x_min
