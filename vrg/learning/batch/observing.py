"""The observation of one player of one match, laid out as vrg.learning.observation lays out that of a player in a match."""

import math

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Vector32 = npt.NDArray[np.float32]

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


def write_own(out: Vector32, x: float, y: float, cos: float, sin: float, v: float, w: float, box: Floats) -> int:
    """Write what a player measures of itself, and return the number of values.

    Args:
        cos, sin: of its heading. v, w: shares of its model's top speed and turn rate.
        box: the field, x_min, y_min, x_max, y_max in m.
    """
    dx, dy = box[2] - box[0], box[3] - box[1]
    reach = math.sqrt(dx * dx + dy * dy)
    out[0], out[1], out[2], out[3] = cos, sin, clipped(v), clipped(w)
    out[4], out[5] = clipped((x - box[0]) / reach), clipped((box[2] - x) / reach)
    out[6], out[7] = clipped((y - box[1]) / reach), clipped((box[3] - y) / reach)
    return OWN


def write_place(out: Vector32, at: int, dx: float, dy: float, cos: float, sin: float, reach: float) -> int:
    """Write from number `at` on where a place is from a player, as bearing and closeness; return the next number.

    Args:
        dx, dy: the way there in the map's frame, m. cos, sin: of the player's heading.
    """
    far = math.sqrt(dx * dx + dy * dy)
    if far > 0.0:
        out[at], out[at + 1] = (dx * cos + dy * sin) / far, (dy * cos - dx * sin) / far
    else:
        out[at], out[at + 1] = 1.0, 0.0
    out[at + 2], out[at + 3] = min(1.0, far / reach), math.exp(-far)
    return at + PLACE


def write_others(
    out: Vector32,
    at: int,
    me: int,
    own: tuple[float, float, float, float, float],
    poses: Floats,
    turns: Floats,
    velocities: Floats,
    flags: Floats,
    v_max: float,
    reach: float,
) -> None:
    """Write from number `at` on what a player knows of the others, the nearest first.

    Args:
        me: its row. own: its own x, y, speed, and the cosine and sine of its heading.
        poses: shape (players, 3), as they are published. turns: the cosine and sine of each heading.
        velocities: shape (players, 2), m/s. flags: shape (players, flags).
    """
    count, width = len(poses), OTHER + flags.shape[1]
    x, y, v, cos, sin = own
    for n in range(count):
        if n == me:
            continue
        dx, dy = poses[n, 0] - x, poses[n, 1] - y
        gap = dx * dx + dy * dy
        slot = 0
        for other in range(count):
            ox, oy = poses[other, 0] - x, poses[other, 1] - y
            nearer = ox * ox + oy * oy
            slot += other != me and other != n and (nearer < gap or (nearer == gap and other < n))
        start = at + slot * width
        write_place(out, start, dx, dy, cos, sin, reach)
        vx, vy = velocities[n, 0] - v * cos, velocities[n, 1] - v * sin
        out[start + 4] = clipped((vx * cos + vy * sin) / (2.0 * v_max))
        out[start + 5] = clipped((vy * cos - vx * sin) / (2.0 * v_max))
        out[start + 6] = turns[n, 0] * cos + turns[n, 1] * sin
        out[start + 7] = turns[n, 1] * cos - turns[n, 0] * sin
        for k in range(flags.shape[1]):
            out[start + OTHER + k] = flags[n, k]
