"""The motion of the robots of one match: the planar engine's arithmetic on arrays, as functions that can be compiled.

It is that of vrg.hal.sim.engines.planar, for robots that cannot drive sideways in a world without kinematic bodies, and
those that overlap are separated by the very functions of that engine. The two agree to the last bit.
"""

import math
from collections.abc import Sequence

import numpy as np

from vrg.errors import ConfigError
from vrg.geometry import circumradius
from vrg.hal.models import RobotModel
from vrg.hal.models.drivetrain import LIMIT_ROUNDING
from vrg.hal.sim.engines.engine import CONTACT
from vrg.hal.sim.engines.pushing import Walls, separate
from vrg.hal.sim.map import Map
from vrg.portable.arrays import cos_sin_array
from vrg.portable.scalars import cos_sin
from vrg_learn.batch.records import Flags, Floats, Numbers, Record, Records, records


def robots(models: Sequence[RobotModel], matches: int) -> Records:
    """The same robots in each of this many matches.

    Fields, each with a row for each player: `sizes`: length and width, m; `reach`: the radius of the circle around the
    body, m; `rates` and `motions`, shape (axes, 3): `Drivetrain.rates`, and the effect of each axis on the twist;
    `commands`: the rates by which commands are followed, those of the model also where the robot turns otherwise;
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
        commands=(float, count, axes, 3),
        fastest=(float, count),
        slew=(float, count),
        brake=(float, count),
        grip=(float, count),
        v_max=(float, count),
        w_max=(float, count),
        kinematic=(bool, count),
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
        found.rates[:, n, :own] = found.commands[:, n, :own] = drivetrain.rates
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
    the axes have, and aim for, rad/s; `braking`: True for locked wheels; `room`, shape (2, players): the way in m that
    the robot can go before it could touch another one, or a wall; `rolled`: v and w as the wheels have turned in the
    last step, also against an obstacle, which is what odometry measures. In the others a collision is resolved.
    """
    found = records(
        matches,
        poses=(float, players, 3),
        before=(float, players, 3),
        velocities=(float, players, 3),
        rolled=(float, players, 2),
        speeds=(float, players, axes),
        targets=(float, players, axes),
        room=(float, 2, players),
        shifts=(float, players, 2),
        braking=(bool, players),
        **dict.fromkeys(("stuck", "back", "moved", "blocked", "shifted"), (bool, players)),
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
        fastest = max(fastest, abs(r.commands[row, axis, 0] * v + r.commands[row, axis, 1] * w))
    scale = 1.0 if fastest <= limit * LIMIT_ROUNDING else limit / fastest
    v, w = v * scale, w * scale
    for axis in range(m.targets.shape[1]):
        m.targets[row, axis] = r.commands[row, axis, 0] * v + r.commands[row, axis, 1] * w
    m.braking[row] = False


def lock(m: Record, row: int) -> None:
    """Lock the wheels of a robot."""
    m.targets[row, :] = 0.0
    m.braking[row] = True


X, Y, THETA, V, W, LIMIT, REACH, ROOM, WALL = range(9)
"""The rows of what `advance` works in: poses, v and w, how much an axis may speed up or slow down in a step, rad/s,
`reach`, and `room` beside robots and beside walls. Then come those of the poses before a step, of the cosines and sines
of headings, and four for each axis."""
BEFORE, COSINE, AXES = 9, 12, 14


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
    at_walls = np.empty((count * (len(walls.boxes) + len(walls.circles)), 2), dtype=np.int64)
    pairs = np.empty((count * count, 2), dtype=np.int64)
    for _ in range(steps):
        drive_on(work, taken * count, axes, dt)
        for k in range(taken):
            slid[k] = False
            if is_due(work, k * count, count):
                walled, paired = look_around(work, k * count, count, walls, at_walls, pairs)
                if walled + paired > 0:
                    m, r, near = motions[rows[k]], robots[rows[k]], pairs[:paired]
                    scatter(m, work, k * count, False)
                    slid[k] = separate(m, r, walls, at_walls[:walled], near, near, dt, math.inf)
                    if slid[k]:
                        follow(m, work, k * count)
        for i in range(taken * count):
            work[THETA, i] -= np.rint(work[THETA, i] / (2 * math.pi)) * (2 * math.pi)
    for k in range(taken):
        scatter(motions[rows[k]], work, k * count, slid[k])


def gather(m: Record, r: Record, work: Floats, at: int, dt: float) -> None:
    """Put the robots of a match into the columns from `at` on."""
    for n in range(len(m.poses)):
        i = at + n
        work[X, i], work[Y, i], work[THETA, i] = m.poses[n, 0], m.poses[n, 1], m.poses[n, 2]
        work[LIMIT, i] = (r.brake[n] if m.braking[n] else r.slew[n]) * dt
        work[REACH, i], work[ROOM, i], work[WALL, i] = r.reach[n], m.room[0, n], m.room[1, n]
        for axis in range(m.speeds.shape[1]):
            row = AXES + 4 * axis
            work[row, i], work[row + 1, i] = m.speeds[n, axis], m.targets[n, axis]
            work[row + 2, i], work[row + 3, i] = r.motions[n, axis, 0], r.motions[n, axis, 1]


def scatter(m: Record, work: Floats, at: int, slid: bool) -> None:
    """Take the robots of a match out of the columns from `at` on.

    Args:
        slid: whether the last step has ended with a push, after which the velocities are other ones.
    """
    for n in range(len(m.poses)):
        i = at + n
        m.poses[n, 0], m.poses[n, 1], m.poses[n, 2] = work[X, i], work[Y, i], work[THETA, i]
        m.before[n, 0], m.before[n, 1], m.before[n, 2] = work[BEFORE, i], work[BEFORE + 1, i], work[BEFORE + 2, i]
        m.rolled[n, 0], m.rolled[n, 1] = work[V, i], work[W, i]
        m.room[0, n], m.room[1, n] = work[ROOM, i], work[WALL, i]
        for axis in range(m.speeds.shape[1]):
            m.speeds[n, axis] = work[AXES + 4 * axis, i]
        if not slid:
            m.velocities[n, 0], m.velocities[n, 1], m.velocities[n, 2] = work[V, i], work[W, i], 0.0


def follow(m: Record, work: Floats, at: int) -> None:
    """Put into the columns from `at` on what a push has changed."""
    for n in range(len(m.poses)):
        if m.moved[n]:
            i = at + n
            way = abs(m.poses[n, 0] - work[X, i]) + abs(m.poses[n, 1] - work[Y, i])
            work[X, i], work[Y, i], work[THETA, i] = m.poses[n, 0], m.poses[n, 1], m.poses[n, 2]
            work[ROOM, i] -= way
            work[WALL, i] -= way
            for axis in range(m.speeds.shape[1]):
                work[AXES + 4 * axis, i] = m.speeds[n, axis]


def drive_on(work: Floats, robots: int, axes: int, dt: float) -> None:
    """Let so many robots drive for a step, as if nothing stood in their way.

    The loops are short, as compilers only make vectors of such that name few arrays.
    """
    x, y, theta, v, w, limit = work[0], work[1], work[2], work[3], work[4], work[5]
    reach, room, wall = work[REACH], work[ROOM], work[WALL]
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
        cosines[i], sines[i] = cos_sin(theta[i] + w[i] * dt * 0.5)
    for i in range(robots):
        x[i] += v[i] * dt * cosines[i]
        y[i] += v[i] * dt * sines[i]
    for i in range(robots):
        theta[i] += w[i] * dt
    for i in range(robots):
        way = abs(v[i] * dt) + abs(w[i] * dt) * reach[i]
        room[i] -= way
        wall[i] -= way


def is_due(work: Floats, at: int, robots: int) -> bool:
    """True if a robot of a match may touch something, by the way that it has gone."""
    due = False
    for i in range(at, at + robots):
        due = due or work[ROOM, i] < 0.0 or work[WALL, i] < 0.0
    return due


def look_around(work: Floats, at: int, robots: int, walls: Walls, at_walls: Numbers, pairs: Numbers) -> tuple[int, int]:
    """Measure the room of the robots of a match, and find what is so near that it may touch.

    Args:
        at, robots: their columns: from which one on, and how many.
        at_walls, pairs: where robots are written with a wall, and with another robot; see `separate`.

    Returns:
        how many rows of them are written.
    """
    x, y, reach = work[X, at : at + robots], work[Y, at : at + robots], work[REACH, at : at + robots]
    room, wall, gaps = work[ROOM, at : at + robots], work[WALL, at : at + robots], work[COSINE, at : at + robots]
    walled, paired, tight = 0, 0, False
    for n in range(robots):
        tight = tight or wall[n] < CONTACT
        room[n] = math.inf
    if tight:
        measure_walls(x, y, reach, wall, gaps, walls)
        for n in range(robots):
            if wall[n] < CONTACT:
                for k in range(len(walls.boxes) + len(walls.circles)):
                    at_walls[walled, 0], at_walls[walled, 1] = n, k
                    walled += 1
    for n in range(robots):
        for other in range(n + 1, robots):
            dx, dy = x[n] - x[other], y[n] - y[other]
            gaps[other] = math.sqrt(dx * dx + dy * dy) - reach[n] - reach[other]
        least = 2.0 * room[n]
        for other in range(n + 1, robots):
            half = gaps[other] / 2
            room[other] = half if half < room[other] else room[other]
            least = gaps[other] if gaps[other] < least else least
        room[n] = least / 2
        if least < CONTACT:
            for other in range(n + 1, robots):
                if gaps[other] < CONTACT:
                    pairs[paired, 0], pairs[paired, 1] = n, other
                    paired += 1
    return walled, paired


def measure_walls(x: Floats, y: Floats, reach: Floats, wall: Floats, gaps: Floats, walls: Walls) -> None:
    """Measure the gaps between the circles around robots and the nearest wall, m; negative if they overlap.

    Args:
        x, y, reach: of the robots, m. wall: where the gaps are written. gaps: room to work in.
    """
    for n in range(len(x)):
        wall[n] = math.inf
    for k in range(len(walls.boxes)):
        far, aside, cos, sin = walls.boxes[k, 0], walls.boxes[k, 1], walls.turns[k, 0], walls.turns[k, 1]
        length, width = walls.boxes[k, 3] / 2, walls.boxes[k, 4] / 2
        for n in range(len(x)):
            dx, dy = x[n] - far, y[n] - aside
            u, v = abs(dx * cos + dy * sin) - length, abs(dy * cos - dx * sin) - width
            u, v = u if u > 0.0 else 0.0, v if v > 0.0 else 0.0
            gaps[n] = math.sqrt(u * u + v * v)
        for n in range(len(x)):
            wall[n] = gaps[n] if gaps[n] < wall[n] else wall[n]
    for k in range(len(walls.circles)):
        for n in range(len(x)):
            dx, dy = x[n] - walls.circles[k, 0], y[n] - walls.circles[k, 1]
            wall[n] = min(wall[n], math.sqrt(dx * dx + dy * dy) - walls.circles[k, 2])
    for n in range(len(x)):
        wall[n] -= reach[n]
