"""The marks where players line up at one end of a field."""

import math
from collections.abc import Mapping

from vrg.geometry import wrap
from vrg.regions import Rectangle
from vrg.types import Pose


def line_up(players: Mapping[str, Pose], zone: Rectangle, field: Rectangle, spacing: float) -> dict[str, Pose]:
    """Return marks in a row across an end zone, facing the middle of the field.

    Players keep their order across the field, so that their ways do not cross. If one row is too short for all of them,
    they stand in several rows.

    Args:
        players: the present pose of each player.
        zone: the end zone. field: the whole field.
        spacing: the largest extent of a body, m. One row is used only if its marks are more than 1.5 times this apart.
    """
    along_y = zone.x_max - zone.x_min >= field.x_max - field.x_min
    low, high = (zone.x_min, zone.x_max) if along_y else (zone.y_min, zone.y_max)
    near, far = (zone.y_min, zone.y_max) if along_y else (zone.x_min, zone.x_max)
    at_low_end = near <= (field.y_min if along_y else field.x_min)
    theta = math.pi / 2 if along_y else 0.0
    if not at_low_end:
        theta = wrap(theta + math.pi)
    order = sorted(players, key=lambda n: (players[n].x if along_y else players[n].y, n))
    per_row = max(1, int((high - low) / (1.5 * spacing)) - 1)
    rows = -(-len(order) // per_row) or 1
    marks = {}
    for i, name in enumerate(order):
        across = low + (high - low) * (i + 1) / (len(order) + 1)
        depth = near + (far - near) * (i % rows + 1) / (rows + 1)
        marks[name] = Pose(across, depth, theta) if along_y else Pose(depth, across, theta)
    return marks
