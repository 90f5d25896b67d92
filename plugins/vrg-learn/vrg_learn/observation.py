"""Lays out what a player sees as one vector of float32, the same for all games: a pure function of its view.

First comes what is the player's own: its heading and velocity, how far it is from the borders of the field, the numbers
and the places of the game, and for some games a scan; then a slot for each other player, the nearest first. The slots
of those whose places are unknown are last, and all zeros.
"""

import math
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from vrg.agents.strategy import View
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.portable.scalars import cos_sin, hypot
from vrg.regions import Bounds
from vrg.types import STILL
from vrg_learn.learning import Learning

if TYPE_CHECKING:
    from collections.abc import Sequence

SECTORS: Final = 32
"""The number of equal sectors of a laser's field of view, of each of which the nearest range counts."""
_OWN = ("cos heading", "sin heading", "v", "w")
_RAW_OWN = ("x", "y", "heading", "v", "w")
_BORDERS = ("to x_min", "to x_max", "to y_min", "to y_max")
_PLACE = ("cos bearing", "sin bearing", "distance", "nearness")
_RAW_PLACE = ("dx", "dy")
_SLOT = (*_PLACE, "velocity ahead", "velocity to the left", "cos heading", "sin heading")
_RAW_SLOT = ("known", "dx", "dy", "velocity ahead", "velocity to the left", "heading")

Own = tuple[float, float, float, float, float, float, float, float]
Vector = npt.NDArray[np.float32]
"""An array of one dimension."""


def names(learning: Learning, players: int, *, raw: bool = False) -> list[str]:
    """The name of each value of an observation, in order.

    Args:
        learning: of the game. players: how many there are in the match. raw: as for `observe`.
    """
    found = [*(_RAW_OWN if raw else _OWN), *_BORDERS, *learning.numbers]
    found += [f"{place}: {part}" for place in learning.places for part in (_RAW_PLACE if raw else _PLACE)]
    if learning.scan:
        found += [f"scan {sector}" for sector in range(SECTORS)]
    slot = (*(_RAW_SLOT if raw else _SLOT), *learning.flags)
    return found + [f"other {number}: {part}" for number in range(1, players) for part in slot]


def observe(view: View, learning: Learning, *, raw: bool = False) -> Vector:
    """Return what a player sees, shape (n,): the values that `names` names.

    Distances are divided by the diagonal of the field, velocities by the robot's top speeds (those of others, relative
    to the own, by twice the top speed), and all is within [-1, 1]. Nearness is 1 / (1 + d) at a distance of d m.

    Args:
        learning: of the game.
        raw: True gives SI units in place of that: m, rad, m/s and rad/s, and vectors in the own frame in place of
            bearings. The numbers and flags of the game are the same.
    """
    look = learning.look(view)
    pose, robot = view.pose, view.robot
    x, y = pose.x, pose.y
    cos, sin = cos_sin(pose.theta)
    odometry = view.readings.latest(Odometry)
    twist = STILL if odometry is None else odometry.value.twist
    x_min, y_min, x_max, y_max = look.bounds
    scale = 1.0 / hypot(x_max - x_min, y_max - y_min)
    if raw:
        values = [x, y, pose.theta, twist.v, twist.w, x - x_min, x_max - x, y - y_min, y_max - y, *look.numbers]
    else:
        values = [*own(x, y, cos, sin, twist.v / robot.v_max, twist.w / robot.w_max, look.bounds, scale), *look.numbers]
    for px, py in look.places:
        dx, dy = px - x, py - y
        values += (dx * cos + dy * sin, dy * cos - dx * sin) if raw else place(dx, dy, cos, sin, scale)
    if learning.scan:
        values += _scan(view, raw=raw)
    # Two at the same distance come in the order of the match file.
    slots: list[tuple[float, int, Sequence[float]]] = []
    players, velocities, me, fastest = view.referee.players, view.velocities, view.me.name, 2.0 * robot.v_max
    for number, other in enumerate(players):
        there = other.pose
        if there is None or other.name == me:
            continue
        dx, dy = there.x - x, there.y - y
        vx, vy = velocities.get(other.name, (0.0, 0.0))
        along, across = cos * vx + sin * vy - twist.v, cos * vy - sin * vx - twist.side
        slot: Sequence[float]
        if raw:
            turn = math.remainder(there.theta - pose.theta, math.tau)
            slot = 1.0, dx * cos + dy * sin, dy * cos - dx * sin, along, across, turn
        else:
            heading = turned(*cos_sin(there.theta), cos, sin)
            slot = *place(dx, dy, cos, sin, scale), along / fastest, across / fastest, *heading
        slots.append((dx * dx + dy * dy, number, (*slot, *look.flags(other))))
    slots.sort()
    for _, _, slot in slots:
        values += slot
    width = len(_RAW_SLOT if raw else _SLOT) + len(learning.flags)
    values += [0.0] * (width * (len(players) - 1 - len(slots)))
    seen = np.array(values, dtype=np.float32)
    if not raw:
        np.minimum(seen, 1.0, out=seen)
        np.maximum(seen, -1.0, out=seen)
    return seen


def own(x: float, y: float, cos: float, sin: float, v: float, w: float, bounds: Bounds, scale: float) -> Own:
    """The eight values that a player measures of itself.

    Args:
        x, y: its place, m. cos, sin: of its heading. v, w: shares of its robot's top speed and turn rate.
        bounds: of the field, m. scale: 1 / reach, 1/m.
    """
    x_min, y_min, x_max, y_max = bounds
    return cos, sin, v, w, (x - x_min) * scale, (x_max - x) * scale, (y - y_min) * scale, (y_max - y) * scale


def place(dx: float, dy: float, cos: float, sin: float, scale: float) -> tuple[float, float, float, float]:
    """The four values for a place; what is here is straight ahead.

    Args:
        dx, dy: the way there in the map's frame, m. cos, sin: of the own heading. scale: 1 / reach, 1/m.
    """
    distance = hypot(dx, dy)
    here = distance == 0.0
    part = 1.0 / (1.0 if here else distance)
    ahead, aside = turned(dx, dy, cos, sin)
    return 1.0 if here else ahead * part, 0.0 if here else aside * part, distance * scale, 1.0 / (1.0 + distance)


def turned(x: float, y: float, cos: float, sin: float) -> tuple[float, float]:
    """A vector of the map's frame in the frame of a player.

    Args:
        cos, sin: of its heading.
    """
    return x * cos + y * sin, y * cos - x * sin


def _scan(view: View, *, raw: bool) -> list[float]:
    """The nearest range in each sector of the laser, as a fraction of its range or in m; zeros without a laser."""
    sample = view.readings.latest(Laser)
    if sample is None or not sample.value.data:
        return [0.0] * SECTORS
    scan = sample.value
    ranges = np.where(scan.ranges > 0.0, scan.ranges, scan.range_max)  # what is not measured is not near
    last = max(1, len(ranges) - 1)
    # A beam at the border of two sectors belongs to the second one.
    starts = np.minimum(-(-np.arange(SECTORS) * last // SECTORS), len(ranges) - 1)
    nearest = np.minimum.reduceat(ranges, starts)
    found: list[float] = (nearest if raw else nearest / scan.range_max).tolist()
    return found
