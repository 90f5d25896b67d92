"""The motion of the robots of one match: the planar engine's arithmetic on arrays, as functions that can be compiled.

It is that of vrg.hal.sim.engines.planar, with the geometry of that engine itself, for robots that cannot drive sideways
in a world without kinematic bodies. The two agree to the last bit.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vrg.errors import ConfigError
from vrg.geometry import circumradius
from vrg.hal.models import RobotModel
from vrg.hal.models.drivetrain import LIMIT_ROUNDING
from vrg.hal.sim.engines.engine import CONTACT, DRIVE
from vrg.hal.sim.engines.planar import PUSH_ROUNDS, SLACK, slowed
from vrg.hal.sim.map import Map
from vrg.hal.sim.shapes import Box, box_gap, circle_gap
from vrg.portable.arrays import cos_sin_array
from vrg.portable.scalars import cos_sin
from vrg.regions import Circle
from vrg_learn.batch.records import Flags, Floats, Record, Records, records


class Walls(NamedTuple):
    """The walls and obstacles of a map.

    Args:
        boxes: shape (boxes, 5): x, y, heading, length, width, in m and rad.
        turns: the cosine and the sine of each heading. circles: shape (circles, 3): x, y, radius, m.
    """

    boxes: Floats
    turns: Floats
    circles: Floats


def robots(models: Sequence[RobotModel], matches: int) -> Records:
    """The same robots in each of this many matches.

    Fields, each with a row for each player: `sizes`: length and width, m; `reach`: the radius of the circle around the
    body, m; `rates` and `motions`, shape (axes, 3): `Drivetrain.rates`, and the effect of each axis on the twist;
    `fastest`: the speed of the fastest axis for 1 m/s ahead, rad/m; `slew` and `brake`: how fast the axes can speed up,
    and slow down with locked wheels, rad/s^2; `grip`: the force of locked wheels, N; `v_max`, m/s; `w_max`, rad/s.

    Raises:
        ValueError: one can drive sideways.
    """
    if strange := [model.name for model in models if model.drivetrain.holonomic]:
        raise ValueError(f"expected robots that cannot drive sideways, got {', '.join(sorted(set(strange)))}")
    count, axes = len(models), max(len(model.drivetrain.axes) for model in models)
    found = records(
        matches,
        sizes=(float, count, 2),
        reach=(float, count),
        rates=(float, count, axes, 3),
        motions=(float, count, axes, 3),
        fastest=(float, count),
        slew=(float, count),
        brake=(float, count),
        grip=(float, count),
        v_max=(float, count),
        w_max=(float, count),
    )
    for n, model in enumerate(models):
        if model.delay or model.slowing is not None:
            raise ConfigError(
                f"{model.name}: expected robots without motion.delay and motion.slowing in a batch, got one"
            )
        drivetrain = model.drivetrain
        own = len(drivetrain.axes)
        found.sizes[:, n] = model.size
        found.reach[:, n] = circumradius(model.size)
        found.rates[:, n, :own] = drivetrain.rates
        found.motions[:, n, :own] = np.transpose(drivetrain.motions)
        found.fastest[:, n] = max(abs(ahead) for ahead, _, _ in drivetrain.rates)
        found.slew[:, n] = model.a_max / drivetrain.wheel_radius
        found.brake[:, n] = model.brake / drivetrain.wheel_radius
        found.grip[:, n] = model.brake * model.mass
        found.v_max[:, n], found.w_max[:, n] = model.v_max, model.w_max
    return found


def motions(matches: int, players: int, axes: int) -> Records:
    """The motion of the robots of this many matches: at rest at the origin, with locked wheels.

    Fields, each with a row for each player: `poses` and `before`: x, y in m and the heading in rad, now and before the
    last step; `velocities`: v in m/s, w in rad/s, and the speed to the left in m/s; `speeds` and `targets`: those that
    the axes have, and aim for, rad/s; `braking`: True for locked wheels; `room`: the way in m that the robot can go
    before it could touch anything; `rolled`: v and w as the wheels have turned in the last step, also against an
    obstacle, which is what odometry measures.
    """
    found = records(
        matches,
        poses=(float, players, 3),
        before=(float, players, 3),
        velocities=(float, players, 3),
        rolled=(float, players, 2),
        speeds=(float, players, axes),
        targets=(float, players, axes),
        room=(float, players),
        braking=(bool, players),
    )
    found.braking[:] = True
    return found


def walls_of(map_: Map) -> Walls:
    """The walls and obstacles of a map."""
    boxes = np.array([(b.x, b.y, b.heading, b.length, b.width) for b in map_.boxes]).reshape(-1, 5)
    circles = np.array([(c.x, c.y, c.radius) for c in map_.circles]).reshape(-1, 3)
    return Walls(boxes, np.stack(cos_sin_array(boxes[:, 2]), axis=1), circles)


def put(m: Record, row: int, x: float, y: float, theta: float) -> None:
    """Put a robot somewhere, at rest."""
    m.poses[row, 0], m.poses[row, 1], m.poses[row, 2] = x, y, theta
    m.velocities[row, :] = 0.0
    m.rolled[row, :] = 0.0
    m.speeds[row, :] = 0.0
    m.targets[row, :] = 0.0
    m.braking[row] = True
    m.room[:] = 0.0


def command(m: Record, r: Record, row: int, v: float, w: float, v_max: float) -> None:
    """Let a robot aim for a twist, slowed down so that no axis turns faster than at `v_max` straight ahead."""
    limit, fastest = r.fastest[row] * max(0.0, v_max), 0.0
    for axis in range(m.targets.shape[1]):
        fastest = max(fastest, abs(r.rates[row, axis, 0] * v + r.rates[row, axis, 1] * w))
    scale = 1.0 if fastest <= limit * LIMIT_ROUNDING else limit / fastest
    v, w = v * scale, w * scale
    for axis in range(m.targets.shape[1]):
        m.targets[row, axis] = r.rates[row, axis, 0] * v + r.rates[row, axis, 1] * w
    m.braking[row] = False


def lock(m: Record, row: int) -> None:
    """Lock the wheels of a robot."""
    m.targets[row, :] = 0.0
    m.braking[row] = True


def advance(m: Record, r: Record, walls: Walls, dt: float) -> None:
    """Advance one match by dt seconds."""
    count, axes = m.speeds.shape
    due = False
    for n in range(count):
        limit = (r.brake[n] if m.braking[n] else r.slew[n]) * dt
        v, w = 0.0, 0.0
        for axis in range(axes):
            change = m.targets[n, axis] - m.speeds[n, axis]
            speed = m.speeds[n, axis] + max(-limit, min(limit, change))
            m.speeds[n, axis] = speed
            v += r.motions[n, axis, 0] * speed
            w += r.motions[n, axis, 1] * speed
        m.velocities[n, 0], m.velocities[n, 1], m.velocities[n, 2] = v, w, 0.0
        m.rolled[n, 0], m.rolled[n, 1] = v, w
        way, turned = v * dt, w * dt
        x, y, theta = m.poses[n, 0], m.poses[n, 1], m.poses[n, 2]
        m.before[n, 0], m.before[n, 1], m.before[n, 2] = x, y, theta
        middle = theta + turned * 0.5
        cos, sin = cos_sin(middle)
        m.poses[n, 0] = x + way * cos
        m.poses[n, 1] = y + way * sin
        m.poses[n, 2] = theta + turned
        m.room[n] -= abs(way) + abs(turned) * r.reach[n]
        due |= m.room[n] < 0.0
    if due and look_around(m, r, walls) < CONTACT:
        collide(m, r, walls, dt)
    for n in range(count):
        if abs(m.poses[n, 2]) > math.pi:
            m.poses[n, 2] -= round(m.poses[n, 2] / (2 * math.pi)) * (2 * math.pi)


def look_around(m: Record, r: Record, walls: Walls) -> float:
    """Measure the room of all robots, and return the least gap between the circle around one and anything, m."""
    count, least = len(m.room), math.inf
    for n in range(count):
        gap = wall_gap(m, r, walls, n)
        least = min(least, gap)
        m.room[n] = gap
    for n in range(count):
        for other in range(n):
            gap = robot_gap(m, r, n, other)
            least = min(least, gap)
            m.room[n], m.room[other] = min(m.room[n], gap / 2), min(m.room[other], gap / 2)
    return least


def robot_gap(m: Record, r: Record, n: int, other: int) -> float:
    """The gap between the circles around two bodies, m; negative if they overlap."""
    dx, dy = m.poses[n, 0] - m.poses[other, 0], m.poses[n, 1] - m.poses[other, 1]
    gap: float = math.sqrt(dx * dx + dy * dy) - r.reach[n] - r.reach[other]
    return gap


def wall_gap(m: Record, r: Record, walls: Walls, n: int) -> float:
    """The gap between the circle around a body and the nearest wall, m; negative if they overlap."""
    least, x, y = math.inf, m.poses[n, 0], m.poses[n, 1]
    for k in range(len(walls.boxes)):
        dx, dy, cos, sin = x - walls.boxes[k, 0], y - walls.boxes[k, 1], walls.turns[k, 0], walls.turns[k, 1]
        u = max(0.0, abs(dx * cos + dy * sin) - walls.boxes[k, 3] / 2)
        v = max(0.0, abs(dy * cos - dx * sin) - walls.boxes[k, 4] / 2)
        least = min(least, math.sqrt(u * u + v * v))
    for k in range(len(walls.circles)):
        dx, dy = x - walls.circles[k, 0], y - walls.circles[k, 1]
        least = min(least, math.sqrt(dx * dx + dy * dy) - walls.circles[k, 2])
    gap: float = least - r.reach[n]
    return gap


def body(poses: Floats, sizes: Floats, n: int) -> Box:
    """The outline of a body."""
    return Box(poses[n, 0], poses[n, 1], poses[n, 2], sizes[n, 0], sizes[n, 1])


def collide(m: Record, r: Record, walls: Walls, dt: float) -> None:
    """Push overlapping bodies of one match apart, and put back those that overlap anyway."""
    poses, sizes, before = m.poses, r.sizes, m.before
    count = len(poses)
    at_wall = np.zeros(count, dtype=np.bool_)
    near = np.zeros((count, count), dtype=np.bool_)
    for n in range(count):
        at_wall[n] = wall_gap(m, r, walls, n) < CONTACT
        for other in range(n):
            near[other, n] = robot_gap(m, r, n, other) < CONTACT
    stuck = overlapping(poses, sizes, walls, at_wall, near)
    if not stuck.any():
        return
    moved = push_apart(m, r, walls, at_wall, near)
    back = np.zeros(count, dtype=np.bool_)
    while True:
        stuck = overlapping(poses, sizes, walls, at_wall, near)
        fresh = False
        for n in range(count):
            if stuck[n] and not back[n]:
                poses[n, :] = before[n]
                back[n], fresh = True, True
        if not fresh:
            break
    for n in range(count):
        if moved[n] or back[n]:
            slide(m, r, n, before, dt)
            m.room[:] = 0.0


def overlapping(poses: Floats, sizes: Floats, walls: Walls, at_wall: Flags, near: Flags) -> Flags:
    """The bodies of one match that overlap with a wall or with another body."""
    count = len(poses)
    found = np.zeros(count, dtype=np.bool_)
    for n in range(count):
        if at_wall[n]:
            for k in range(len(walls.boxes)):
                x, y, heading, length, width = walls.boxes[k]
                found[n] |= box_gap(body(poses, sizes, n), Box(x, y, heading, length, width)).distance < 0.0
            for k in range(len(walls.circles)):
                x, y, radius = walls.circles[k]
                found[n] |= circle_gap(body(poses, sizes, n), Circle(x, y, radius)).distance < 0.0
        for other in range(n + 1, count):
            if near[n, other] and box_gap(body(poses, sizes, n), body(poses, sizes, other)).distance < 0.0:
                found[n] = found[other] = True
    return found


def push_apart(m: Record, r: Record, walls: Walls, at_wall: Flags, near: Flags) -> Flags:
    """Move overlapping bodies out of each other along the shortest way, and return which have moved.

    All pushes of an attempt are computed before any is applied.
    """
    count = len(m.poses)
    moved, blocked = np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    for _ in range(PUSH_ROUNDS):
        shifts, shifted = np.zeros((count, 2)), np.zeros(count, dtype=np.bool_)
        for n in range(count):
            if at_wall[n]:
                shift_from_walls(m.poses, r.sizes, walls, n, shifts, shifted)
                blocked[n] |= shifted[n]
        for n in range(count):
            for other in range(n + 1, count):
                if near[n, other]:
                    shift_from_each_other(m, r, n, other, blocked, shifts, shifted)
        if not shifted.any():
            break
        for n in range(count):
            if shifted[n]:
                m.poses[n, 0] += shifts[n, 0]
                m.poses[n, 1] += shifts[n, 1]
                moved[n] = True
    return moved


def shift_from_walls(poses: Floats, sizes: Floats, walls: Walls, n: int, shifts: Floats, shifted: Flags) -> None:
    """Add the pushes that separate a body from the walls."""
    for k in range(len(walls.boxes)):
        x, y, heading, length, width = walls.boxes[k]
        gap = box_gap(body(poses, sizes, n), Box(x, y, heading, length, width))
        shift(shifts, shifted, n, gap.distance, gap.nx, gap.ny, 1.0)
    for k in range(len(walls.circles)):
        x, y, radius = walls.circles[k]
        gap = circle_gap(body(poses, sizes, n), Circle(x, y, radius))
        shift(shifts, shifted, n, gap.distance, gap.nx, gap.ny, 1.0)


def shift_from_each_other(
    m: Record, r: Record, n: int, other: int, blocked: Flags, shifts: Floats, shifted: Flags
) -> None:
    """Add the pushes that separate two bodies. One that is blocked holds against one that is not, and blocks it."""
    gap = box_gap(body(m.poses, r.sizes, n), body(m.poses, r.sizes, other))
    if gap.distance >= 0.0:
        return
    if blocked[n] != blocked[other]:
        share = 1.0 if blocked[other] else 0.0
        blocked[n] = blocked[other] = True
    else:
        own = force(m, r, n, gap.nx, gap.ny, gap.x, gap.y, 1.0)
        its = force(m, r, other, gap.nx, gap.ny, gap.x, gap.y, -1.0)
        share = 0.5 if own == its else (1.0 if own < its else 0.0)
    shift(shifts, shifted, n, gap.distance, gap.nx, gap.ny, share)
    shift(shifts, shifted, other, gap.distance, gap.nx, gap.ny, share - 1.0)


def shift(shifts: Floats, shifted: Flags, n: int, distance: float, nx: float, ny: float, share: float) -> None:
    """Add a share of the push that separates a body from another shape, if they overlap."""
    if distance < 0.0 and share != 0.0:
        push = (SLACK - distance) * share
        shifts[n, 0] += push * nx
        shifts[n, 1] += push * ny
        shifted[n] = True


def force(m: Record, r: Record, n: int, nx: float, ny: float, x: float, y: float, side: float) -> float:
    """The force in N with which a body drives at another one, or holds against it, at the point (x, y)."""
    if m.braking[n]:
        return float(r.grip[n])
    px, py, theta = m.poses[n]
    v, w, aside = m.velocities[n]
    cos, sin = cos_sin(theta)
    vx, vy = v * cos - aside * sin - w * (y - py), v * sin + aside * cos + w * (x - px)
    drives = side * (vx * nx + vy * ny) < -SLACK
    return float(r.grip[n] * DRIVE if drives else r.grip[n])


def slide(m: Record, r: Record, n: int, before: Floats, dt: float) -> None:
    """Set a body's velocity to what is left of it after a push, and the speeds of its axes to match."""
    x, y = m.poses[n, 0] - before[n, 0], m.poses[n, 1] - before[n, 1]
    turn, theta = (m.poses[n, 2] - before[n, 2]) / dt, m.poses[n, 2]
    cos, sin = cos_sin(theta)
    v = slowed((x * cos + y * sin) / dt, m.velocities[n, 0])
    side = slowed((y * cos - x * sin) / dt, m.velocities[n, 2])
    m.velocities[n, 0], m.velocities[n, 1], m.velocities[n, 2] = v, turn, side
    for axis in range(m.speeds.shape[1]):
        ahead, rate, across = r.rates[n, axis]
        m.speeds[n, axis] = ahead * v + rate * turn + across * side
