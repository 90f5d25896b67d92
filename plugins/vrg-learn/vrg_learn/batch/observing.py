"""The observation of one player, laid out as vrg_learn.observation lays out that of a player in a match."""

import math

from vrg_learn.batch.records import Floats, Numbers, Singles, insert

OWN = 8
"""The number of values about the player itself, before the game's numbers."""
PLACE = 4
"""The number of values about each place."""
OTHER = 8
"""The number of values about each other player, before its flags."""


def length(numbers: int, places: int, players: int, flags: int) -> int:
    """The number of values of an observation."""
    return OWN + numbers + PLACE * places + (players - 1) * (OTHER + flags)


def clipped(value: float) -> float:
    """The value within -1 to 1."""
    return min(1.0, max(-1.0, value))


def write_own(
    out: Singles, x: float, y: float, cos: float, sin: float, v: float, w: float, box: Floats, scale: float
) -> int:
    """Write what a player measures of itself, and return the number of values.

    Args:
        cos, sin: of its heading. v, w: shares of its model's top speed and turn rate.
        box: the field, x_min, y_min, x_max, y_max in m. scale: 1 / reach, 1/m.
    """
    out[0], out[1], out[2], out[3] = cos, sin, clipped(v), clipped(w)
    out[4], out[5] = clipped((x - box[0]) * scale), clipped((box[2] - x) * scale)
    out[6], out[7] = clipped((y - box[1]) * scale), clipped((box[3] - y) * scale)
    return OWN


def write_place(out: Singles, at: int, dx: float, dy: float, cos: float, sin: float, scale: float) -> int:
    """Write from number `at` on where a place is from a player, as bearing and closeness; return the next number.

    Args:
        dx, dy: the way there in the map's frame, m. cos, sin: of the player's heading. scale: 1 / reach, 1/m.
    """
    far = math.sqrt(dx * dx + dy * dy)
    part = 1.0 / far if far > 0.0 else 0.0
    out[at], out[at + 1] = (dx * cos + dy * sin) * part, (dy * cos - dx * sin) * part
    if far == 0.0:
        out[at] = 1.0
    out[at + 2], out[at + 3] = min(1.0, far * scale), 1.0 / (1.0 + far)
    return at + PLACE


def write_others(
    out: Singles,
    at: int,
    me: int,
    own: tuple[float, float, float, float, float],
    poses: Floats,
    turns: Floats,
    velocities: Floats,
    flags: Floats,
    v_max: float,
    scale: float,
    order: Numbers,
    gaps: Floats,
) -> None:
    """Write from number `at` on what a player knows of the others, the nearest first.

    Args:
        me: its row. own: its own x, y, speed, and the cosine and sine of its heading.
        poses: shape (players, 3), as they are published. turns: the cosine and sine of each heading.
        velocities: shape (players, 2), m/s. flags: shape (players, flags). scale: 1 / reach, 1/m.
        order, gaps: shape (players,): room to work in.
    """
    x, y, v, cos, sin = own
    others = 0
    for n in range(len(poses)):
        if n == me:
            continue
        dx, dy = poses[n, 0] - x, poses[n, 1] - y
        insert(gaps, order, others, dx * dx + dy * dy, n)
        others += 1
    share, vx, vy = 0.5 / v_max, v * cos, v * sin
    for slot in range(others):
        n = order[slot]
        at = write_place(out, at, poses[n, 0] - x, poses[n, 1] - y, cos, sin, scale)
        dvx, dvy = velocities[n, 0] - vx, velocities[n, 1] - vy
        out[at], out[at + 1] = clipped((dvx * cos + dvy * sin) * share), clipped((dvy * cos - dvx * sin) * share)
        out[at + 2] = turns[n, 0] * cos + turns[n, 1] * sin
        out[at + 3] = turns[n, 1] * cos - turns[n, 0] * sin
        at += OTHER - PLACE
        for k in range(flags.shape[1]):
            out[at + k] = flags[n, k]
        at += flags.shape[1]
