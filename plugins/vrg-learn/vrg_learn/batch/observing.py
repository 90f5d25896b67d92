"""The observation of one player, laid out as vrg_learn.observation lays out that of a player in a match."""

import math

from vrg_learn.batch.records import Floats, Singles
from vrg_learn.observation import own, place, turned

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
    """Write what a player measures of itself, and return the number of values; see `vrg_learn.observation.own`."""
    values = own(x, y, cos, sin, v, w, (box[0], box[1], box[2], box[3]), scale)
    for k in range(OWN):
        out[k] = clipped(values[k])
    return OWN


def write_place(out: Singles, at: int, dx: float, dy: float, cos: float, sin: float, scale: float) -> int:
    """Write from number `at` on where a place is from a player, and return the next number.

    The arguments are those of `vrg_learn.observation.place`.
    """
    ahead, aside, far, near = place(dx, dy, cos, sin, scale)
    out[at], out[at + 1], out[at + 2], out[at + 3] = ahead, aside, min(1.0, far), near
    return at + PLACE


def write_others(
    out: Singles,
    at: int,
    me: int,
    here: tuple[float, float, float, float, float],
    poses: Floats,
    turns: Floats,
    velocities: Floats,
    flags: Floats,
    v_max: float,
    scale: float,
    gaps: Floats,
) -> None:
    """Write from number `at` on what a player knows of the others, the nearest first.

    Args:
        me: its row. here: its own x, y, speed, and the cosine and sine of its heading.
        poses: shape (players, 3), as they are published. turns: the cosine and sine of each heading.
        velocities: shape (players, 2), m/s. flags: shape (players, flags). scale: 1 / reach, 1/m.
        gaps: shape (players,): room to work in.
    """
    x, y, v, cos, sin = here
    count, width, fastest = len(poses), OTHER + flags.shape[1], 2.0 * v_max
    for n in range(count):
        dx, dy = poses[n, 0] - x, poses[n, 1] - y
        gaps[n] = dx * dx + dy * dy
    gaps[me] = math.inf
    for n in range(count):
        if n == me:
            continue
        nearer = 0
        for other in range(n):
            nearer += gaps[other] <= gaps[n]
        for other in range(n + 1, count):
            nearer += gaps[other] < gaps[n]
        i = write_place(out, at + nearer * width, poses[n, 0] - x, poses[n, 1] - y, cos, sin, scale)
        along, across = turned(velocities[n, 0], velocities[n, 1], cos, sin)
        out[i], out[i + 1] = clipped((along - v) / fastest), clipped(across / fastest)
        out[i + 2], out[i + 3] = turned(turns[n, 0], turns[n, 1], cos, sin)
        for k in range(flags.shape[1]):
            out[i + OTHER - PLACE + k] = flags[n, k]
