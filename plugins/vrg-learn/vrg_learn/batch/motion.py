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
from vrg.hal.sim.shapes import Box, Outline, apart, box_gap, circle_gap
from vrg.portable.arrays import cos_sin_array
from vrg.portable.scalars import cos_sin, within_a_quarter
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
    obstacle, which is what odometry measures. In the others a collision is resolved.
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
        shifts=(float, players, 2),
        braking=(bool, players),
        near=(bool, players, players),
        **dict.fromkeys(("at_wall", "stuck", "back", "moved", "blocked", "shifted"), (bool, players)),
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


X, Y, THETA, V, W, LIMIT, REACH, ROOM = range(8)
"""The rows of what `advance` works in: poses, v and w, how much an axis may speed up or slow down in a step, rad/s, and
`reach` and `room` of robots. Then come those of the
poses before a step, of the cosines and sines of headings, and four for each axis."""
BEFORE, COSINE, AXES = 8, 11, 13


def advance(
    low: int, high: int, motions: Records, robots: Records, still: Flags, walls: Walls, dt: float, steps: int
) -> None:
    """Advance the matches of these numbers by some steps of dt seconds.

    The robots of all of them are put side by side, so that the processor works on several at a time.

    Args:
        still: of each match, whether it is left as it is.
    """
    axes = motions.speeds.shape[2]
    count, taken = motions.speeds.shape[1], 0
    # Rows of 4 KB would all want the same place in the cache.
    work, rows = np.empty((AXES + 4 * axes, (high - low) * count + 8)), np.empty(high - low, dtype=np.int64)
    for b in range(low, high):
        if not still[b]:
            gather(motions[b], robots[b], work, taken * count, dt)
            rows[taken] = b
            taken += 1
    slid = np.zeros(taken, dtype=np.bool_)
    for _ in range(steps):
        drive_on(work, taken * count, axes, dt)
        for k in range(taken):
            slid[k] = False
            if is_due(work, k * count, count) and look_around(work, k * count, count, walls) < CONTACT:
                m, r = motions[rows[k]], robots[rows[k]]
                scatter(m, work, k * count, False)
                slid[k] = collide(m, r, walls, dt)
                if slid[k]:
                    gather(m, r, work, k * count, dt)
        for i in range(taken * count):
            work[THETA, i] -= np.rint(work[THETA, i] / (2 * math.pi)) * (2 * math.pi)
    for k in range(taken):
        scatter(motions[rows[k]], work, k * count, slid[k])


def gather(m: Record, r: Record, work: Floats, at: int, dt: float) -> None:
    """Put the robots of a match into the columns from `at` on."""
    for n in range(len(m.room)):
        i = at + n
        work[X, i], work[Y, i], work[THETA, i] = m.poses[n, 0], m.poses[n, 1], m.poses[n, 2]
        work[V, i], work[W, i] = m.rolled[n, 0], m.rolled[n, 1]
        work[BEFORE, i], work[BEFORE + 1, i], work[BEFORE + 2, i] = m.before[n, 0], m.before[n, 1], m.before[n, 2]
        work[LIMIT, i] = (r.brake[n] if m.braking[n] else r.slew[n]) * dt
        work[REACH, i], work[ROOM, i] = r.reach[n], m.room[n]
        for axis in range(m.speeds.shape[1]):
            row = AXES + 4 * axis
            work[row, i], work[row + 1, i] = m.speeds[n, axis], m.targets[n, axis]
            work[row + 2, i], work[row + 3, i] = r.motions[n, axis, 0], r.motions[n, axis, 1]


def scatter(m: Record, work: Floats, at: int, slid: bool) -> None:
    """Take the robots of a match out of the columns from `at` on.

    Args:
        slid: whether the last step has ended with a push, after which the velocities are other ones.
    """
    for n in range(len(m.room)):
        i = at + n
        m.poses[n, 0], m.poses[n, 1], m.poses[n, 2] = work[X, i], work[Y, i], work[THETA, i]
        m.before[n, 0], m.before[n, 1], m.before[n, 2] = work[BEFORE, i], work[BEFORE + 1, i], work[BEFORE + 2, i]
        m.rolled[n, 0], m.rolled[n, 1], m.room[n] = work[V, i], work[W, i], work[ROOM, i]
        for axis in range(m.speeds.shape[1]):
            m.speeds[n, axis] = work[AXES + 4 * axis, i]
        if not slid:
            m.velocities[n, 0], m.velocities[n, 1], m.velocities[n, 2] = work[V, i], work[W, i], 0.0


def drive_on(work: Floats, robots: int, axes: int, dt: float) -> None:
    """Let so many robots drive for a step, as if nothing stood in their way.

    The loops are short, as compilers only make vectors of such that name few arrays.
    """
    x, y, theta, v, w, limit, reach, room = work[0], work[1], work[2], work[3], work[4], work[5], work[6], work[7]
    cosines, sines = work[COSINE], work[COSINE + 1]
    work[V : W + 1, :robots] = 0.0
    for axis in range(axes):
        row = AXES + 4 * axis
        speeds, targets, ahead, turn = work[row], work[row + 1], work[row + 2], work[row + 3]
        for i in range(robots):
            change = targets[i] - speeds[i]
            change = limit[i] if change > limit[i] else change
            speeds[i] += -limit[i] if change < -limit[i] else change
        for i in range(robots):
            v[i] += ahead[i] * speeds[i]
        for i in range(robots):
            w[i] += turn[i] * speeds[i]
    work[BEFORE : BEFORE + 3, :robots] = work[X : THETA + 1, :robots]
    for i in range(robots):
        quarters, cos, sin = within_a_quarter(theta[i] + w[i] * dt * 0.5)
        # As cos_sin does, without branches, for any angle that a heading has.
        quarter = quarters - 4.0 * np.floor(quarters * 0.25)
        odd = abs(quarter - 2.0) == 1.0
        cosines[i] = (-1.0 if abs(quarter - 1.5) == 0.5 else 1.0) * (sin if odd else cos)
        sines[i] = (-1.0 if quarter >= 2.0 else 1.0) * (cos if odd else sin)
    for i in range(robots):
        x[i] += v[i] * dt * cosines[i]
        y[i] += v[i] * dt * sines[i]
    for i in range(robots):
        theta[i] += w[i] * dt
        room[i] -= abs(v[i] * dt) + abs(w[i] * dt) * reach[i]


def is_due(work: Floats, at: int, robots: int) -> bool:
    """True if a robot of a match may touch something, by the way that it has gone."""
    due = False
    for i in range(at, at + robots):
        due = due or work[ROOM, i] < 0.0
    return due


def look_around(work: Floats, at: int, robots: int, walls: Walls) -> float:
    """Measure the room of the robots of a match.

    Returns:
        the least gap between the circle around one and anything, m.

    Args:
        at, robots: their columns: from which one on, and how many.
    """
    x, y, reach = work[X, at : at + robots], work[Y, at : at + robots], work[REACH, at : at + robots]
    room, gaps = work[ROOM, at : at + robots], work[COSINE, at : at + robots]
    for n in range(robots):
        room[n] = math.inf
    for k in range(len(walls.boxes)):
        far, aside, cos, sin = walls.boxes[k, 0], walls.boxes[k, 1], walls.turns[k, 0], walls.turns[k, 1]
        length, width = walls.boxes[k, 3] / 2, walls.boxes[k, 4] / 2
        for n in range(robots):
            dx, dy = x[n] - far, y[n] - aside
            u, v = abs(dx * cos + dy * sin) - length, abs(dy * cos - dx * sin) - width
            u, v = u if u > 0.0 else 0.0, v if v > 0.0 else 0.0
            gaps[n] = math.sqrt(u * u + v * v)
        for n in range(robots):
            room[n] = gaps[n] if gaps[n] < room[n] else room[n]
    for k in range(len(walls.circles)):
        for n in range(robots):
            dx, dy = x[n] - walls.circles[k, 0], y[n] - walls.circles[k, 1]
            room[n] = min(room[n], math.sqrt(dx * dx + dy * dy) - walls.circles[k, 2])
    least = math.inf
    for n in range(robots):
        room[n] -= reach[n]
        least = min(least, room[n])
    for n in range(1, robots):
        here_x, here_y, own = x[n], y[n], reach[n]
        for other in range(n):
            dx, dy = here_x - x[other], here_y - y[other]
            gaps[other] = math.sqrt(dx * dx + dy * dy) - own - reach[other]
        nearest = math.inf
        for other in range(n):
            half = gaps[other] / 2
            room[other] = half if half < room[other] else room[other]
            nearest = gaps[other] if gaps[other] < nearest else nearest
        least, room[n] = min(least, nearest), min(room[n], nearest / 2)
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


def collide(m: Record, r: Record, walls: Walls, dt: float) -> bool:
    """Push overlapping bodies of one match apart, put back those that overlap anyway, and return whether any was.

    The room of all of them has just been measured.
    """
    count = len(m.room)
    for n in range(count):
        tight = m.room[n] < CONTACT
        m.at_wall[n] = tight and wall_gap(m, r, walls, n) < CONTACT
        for other in range(n):
            m.near[other, n] = tight and m.room[other] < CONTACT and robot_gap(m, r, n, other) < CONTACT
    if not find_stuck(m, r, walls):
        return False
    push_apart(m, r, walls)
    m.back[:] = False
    fresh = True
    while fresh and find_stuck(m, r, walls):
        fresh = False
        for n in range(count):
            if m.stuck[n] and not m.back[n]:
                m.poses[n, 0], m.poses[n, 1], m.poses[n, 2] = m.before[n, 0], m.before[n, 1], m.before[n, 2]
                m.back[n], fresh = True, True
    for n in range(count):
        if m.moved[n] or m.back[n]:
            slide(m, r, n, m.before, dt)
    m.room[:] = 0.0
    return True


def find_stuck(m: Record, r: Record, walls: Walls) -> bool:
    """Find the bodies of one match that overlap with a wall or with another body, and return whether there are any."""
    count, found = len(m.room), False
    m.stuck[:] = False
    for n in range(count):
        if m.at_wall[n]:
            for k in range(len(walls.boxes)):
                m.stuck[n] |= not apart(line(m, r, n), wall(walls, k), 0.0)
            for k in range(len(walls.circles)):
                x, y, radius = walls.circles[k]
                m.stuck[n] |= circle_gap(body(m.poses, r.sizes, n), Circle(x, y, radius)).distance < 0.0
        for other in range(n + 1, count):
            if m.near[n, other] and not apart(line(m, r, n), line(m, r, other), 0.0):
                m.stuck[n] = m.stuck[other] = True
        found |= m.stuck[n] != 0
    return found


def line(m: Record, r: Record, n: int) -> Outline:
    """The outline of a body."""
    cos, sin = cos_sin(m.poses[n, 2])
    return m.poses[n, 0], m.poses[n, 1], cos, sin, r.sizes[n, 0] / 2, r.sizes[n, 1] / 2


def wall(walls: Walls, k: int) -> Outline:
    """The outline of a wall."""
    x, y, _, length, width = walls.boxes[k]
    return x, y, walls.turns[k, 0], walls.turns[k, 1], length / 2, width / 2


def push_apart(m: Record, r: Record, walls: Walls) -> None:
    """Move overlapping bodies out of each other along the shortest way, and find which have moved.

    All pushes of an attempt are computed before any is applied.
    """
    count = len(m.room)
    m.moved[:], m.blocked[:] = False, False
    for _ in range(PUSH_ROUNDS):
        m.shifts[:], m.shifted[:] = 0.0, False
        for n in range(count):
            if m.at_wall[n]:
                shift_from_walls(m, r, walls, n)
                m.blocked[n] |= m.shifted[n]
        for n in range(count):
            for other in range(n + 1, count):
                if m.near[n, other] and not apart(line(m, r, n), line(m, r, other), 0.0):
                    shift_from_each_other(m, r, n, other)
        over = True
        for n in range(count):
            if m.shifted[n]:
                m.poses[n, 0] += m.shifts[n, 0]
                m.poses[n, 1] += m.shifts[n, 1]
                m.moved[n], over = True, False
        if over:
            break


def shift_from_walls(m: Record, r: Record, walls: Walls, n: int) -> None:
    """Add the pushes that separate a body from the walls."""
    for k in range(len(walls.boxes)):
        if not apart(line(m, r, n), wall(walls, k), 0.0):
            x, y, heading, length, width = walls.boxes[k]
            gap = box_gap(body(m.poses, r.sizes, n), Box(x, y, heading, length, width))
            shift(m, n, gap.distance, gap.nx, gap.ny, 1.0)
    for k in range(len(walls.circles)):
        x, y, radius = walls.circles[k]
        gap = circle_gap(body(m.poses, r.sizes, n), Circle(x, y, radius))
        shift(m, n, gap.distance, gap.nx, gap.ny, 1.0)


def shift_from_each_other(m: Record, r: Record, n: int, other: int) -> None:
    """Add the pushes that separate two bodies. One that is blocked holds against one that is not, and blocks it."""
    gap = box_gap(body(m.poses, r.sizes, n), body(m.poses, r.sizes, other))
    if gap.distance >= 0.0:
        return
    if m.blocked[n] != m.blocked[other]:
        share = 1.0 if m.blocked[other] else 0.0
        m.blocked[n] = m.blocked[other] = True
    else:
        own = force(m, r, n, gap.nx, gap.ny, gap.x, gap.y, 1.0)
        its = force(m, r, other, gap.nx, gap.ny, gap.x, gap.y, -1.0)
        share = 0.5 if own == its else (1.0 if own < its else 0.0)
    shift(m, n, gap.distance, gap.nx, gap.ny, share)
    shift(m, other, gap.distance, gap.nx, gap.ny, share - 1.0)


def shift(m: Record, n: int, distance: float, nx: float, ny: float, share: float) -> None:
    """Add a share of the push that separates a body from another shape, if they overlap."""
    if distance < 0.0 and share != 0.0:
        push = (SLACK - distance) * share
        m.shifts[n, 0] += push * nx
        m.shifts[n, 1] += push * ny
        m.shifted[n] = True


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
