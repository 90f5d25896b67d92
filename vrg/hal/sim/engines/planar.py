"""The planar engine: bodies with acceleration limits that slip nowhere, whose footprints never overlap.

It is fast enough for thousands of matches. Wheels do not slip on open ground; the skid of a real body is in the model's
drivetrain. Bodies that run into something slide along it. The body with less force gives way: a body
holds with the full friction of its wheels, and drives at the other with DRIVE of it. So a body that stands or brakes
holds against an equal one. Bodies of the same force share the push. A kinematic body never gives way: the other body
takes the whole push, as far as walls and its neighbours leave room.
"""

import math
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from vrg.hal.sim.compiled import kernel
from vrg.hal.sim.engines.engine import CONTACT, DRIVE, Engine, Floats, Push, Start, bumper_bit
from vrg.hal.sim.engines.pushing import PUSH_ROUNDS, Walls, body, line, separate, wall_gap
from vrg.hal.sim.map import Map
from vrg.hal.sim.shapes import Gap, apart, box_gap, outline
from vrg.portable.arrays import cos_sin_array, hypot
from vrg.portable.scalars import atan2
from vrg.types import Twist

_PUSH = 0.2
"""The longest push of a robot in one step, m."""
_SHOVE = _PUSH / (2 * PUSH_ROUNDS)
"""The longest push of a robot in one attempt, m, in a world with kinematic bodies: one may appear inside another."""

Pairs = list[tuple[int, int]]
"""Rows of robots, each with that of another robot, or with the number of a wall."""
Rows = npt.NDArray[np.intp]
Flags = npt.NDArray[np.bool_]


class PlanarEngine(Engine):
    """An engine that moves bodies in the plane as their axes turn, and keeps their footprints apart.

    Most steps need no collision check at all. Each robot has two budgets: the way that it can go before it could touch
    anything. One is the whole gap to the nearest wall, the other half the gap to the nearest robot, both measured from
    the robot's circumscribed circle. A robot is checked only when one of its budgets is used up.
    """

    def __init__(self, map_: Map, robots: Sequence[Start]) -> None:
        super().__init__(map_, robots)
        self._outlines = [outline(box) for box in map_.boxes]
        """The data of the walls and obstacles that are boxes, which come first in `_walls`."""
        boxes = np.array([(b.x, b.y, b.heading, b.length / 2, b.width / 2) for b in map_.boxes]).reshape(-1, 5)
        self._box_at, self._box_half = boxes[:, :2].copy(), boxes[:, 3:].copy()
        self._box_cos, self._box_sin = np.array(cos_sin_array(boxes[:, 2]))
        self._walls = Walls(
            [(b.x, b.y, b.heading, b.length, b.width) for b in map_.boxes],
            [(cos, sin) for _, _, cos, sin, _, _ in self._outlines],
            [(c.x, c.y, c.radius) for c in map_.circles],
        )
        self._robots = SimpleNamespace(
            sizes=[model.size for model in self.models],
            grip=[model.brake * model.mass for model in self.models],
            rates=[model.drivetrain.rates for model in self.models],
            kinematic=self.kinematic.tolist(),
        )
        self._motions: Floats = np.zeros((self.speeds.shape[1], len(robots), 3))
        """The effect of each axis (first index) of each robot on its v, its w and its speed to the left."""
        for row, model in enumerate(self.models):
            self._motions[: len(model.drivetrain.axes), row] = np.transpose(model.drivetrain.motions)
        self._reach: Floats = np.array([math.hypot(m.length, m.width) / 2 for m in self.models])
        self._budgets: Floats = np.zeros((2, len(robots)))
        """The way in m that each robot can go before it could touch a wall (first row) or a robot (second row)."""
        self._any_kinematic = bool(self.kinematic.any())
        self._contacts: set[tuple[int, int, int]] = set()
        # Without kinematic bodies no robot is pushed farther than it has driven in this step, so a robot that is out of
        # reach before the push is out of reach after it.
        self._margin, self._shove = (CONTACT + _PUSH, _SHOVE) if self._any_kinematic else (CONTACT, math.inf)
        """The distance in m below which bodies may touch in a step; the longest push of a robot in an attempt, m."""
        self._forget()

    def step(self, dt: float) -> None:
        """Advance by dt seconds."""
        if not self.names:
            return
        # The wheels of kinematic bodies do not turn, so `_advance` gives them no speed.
        carried = self.velocities[self.kinematic] if self._any_kinematic else None
        before = self.poses.copy()
        if self._advance(dt):
            self._collide(before, dt)
            self._wrap()
        if carried is not None:
            self.velocities[self.kinematic] = carried

    def _advance(self, dt: float) -> bool:
        """Move all bodies as their axes turn. Return True if a budget is used up; headings may then be beyond pi."""
        poses, velocities, speeds = self.poses, self.velocities, self.speeds
        if kernel is not None:
            return kernel.advance(
                dt, self._targets, speeds, self._slew, self._slowing, self._sideways,
                self._motions, self._reach, velocities, poses, self.angles, self._budgets,
            )  # fmt: skip
        self._accelerate(dt)
        # Not as a product of matrices, whose last bits differ from computer to computer.
        np.multiply(self._motions[0], speeds[:, :1], out=velocities)
        for axis in range(1, len(self._motions)):
            velocities += self._motions[axis] * speeds[:, axis : axis + 1]
        (way, turned, aside), (x, y, heading) = (velocities * dt).T, poses.T
        middle = heading + turned * 0.5
        cos, sin = cos_sin_array(middle)
        x += way * cos
        y += way * sin
        far = np.abs(way) + np.abs(turned) * self._reach
        if self._any_sideways:
            x -= aside * sin
            y += aside * cos
            far += np.abs(aside)
        heading += turned
        self.angles += speeds * dt
        self._budgets -= far
        if self._budgets.min() < 0.0:
            return True
        self._wrap()
        return False

    def _wrap(self) -> None:
        heading = self.poses[:, 2]
        if np.abs(heading).max() > math.pi:
            heading -= np.round(heading / (2 * math.pi)) * (2 * math.pi)

    def close(self) -> None:
        """Do nothing: this engine holds nothing that must be released."""

    def _placed(self, row: int) -> None:
        self._forget()

    @property
    def masses(self) -> list[float]:
        """That with which a robot that may only speed up by `a_max` presses as hard as its motors can, kg."""
        return [model.mass * max(1.0, DRIVE * model.brake / model.a_max) for model in self.models]

    def _pushed(self, push: Push) -> None:
        # Wheels hold it against what they cannot do.
        drivetrain = self.models[push.row].drivetrain
        v, w, side = self.velocities[push.row].tolist()
        axes = drivetrain.speeds(Twist(v, w, side if drivetrain.holonomic else 0.0))
        self.speeds[push.row, : len(axes)] = axes
        held = drivetrain.twist(axes)
        self.velocities[push.row] = held.v, held.w, held.side
        if push.dx or push.dy:
            self._budgets[:, push.row] = -1.0

    def _moved(self, row: int, way: float, turn: float) -> None:
        self._budgets[1, row] -= way + turn * self._reach[row]

    def _forget(self) -> None:
        """Check every robot at the next step, whatever was near it."""
        self._budgets[:] = -1.0
        self._budgets[0, self.kinematic] = math.inf
        self._contacts.clear()
        self.touch = [0] * len(self.touch)

    def _collide(self, before: Floats, dt: float) -> None:
        """Push overlapping bodies apart, note which bumpers are pressed, and compute new budgets."""
        walls, pairs, at_walls, at_robots = self._candidates()
        if not (walls or pairs or self._contacts):
            return
        at_wall, touching = self._nearer(CONTACT, walls, pairs)
        if at_wall or touching:
            moved = self._separate(walls, pairs, before, dt)
            if moved:
                at_wall, touching = self._nearer(CONTACT, walls, pairs)
        self._contacts = {
            c for c in self._contacts if not (at_walls[c[0]] if c[1] < 0 else at_robots[c[0]] or at_robots[c[1]])
        }
        at, robots = self._here(), self._robots
        for row, static in at_wall:
            self._note(at, wall_gap(at, robots, self._walls, row, static), row, -1)
        for row, other in touching:
            gap = box_gap(body(at, robots, row), body(at, robots, other))
            self._note(at, gap, row, other)
            self._note(at, gap, other, row)
            if gap.distance < 0.0 and (self.kinematic[row] or self.kinematic[other]):
                self._budgets[1, row] = -1.0  # it is pushed on at the next step, also if both stand still
        self.touch = [0] * len(self.names)
        for row, _, bit in self._contacts:
            self.touch[row] |= bit

    def _candidates(self) -> tuple[Pairs, Pairs, Flags, Flags]:
        """The (robot, wall) and (robot, robot) pairs near enough to touch, and which robots were checked for them.

        A robot near one whose budget is used up is checked too, because it may be pushed.
        """
        if kernel is not None:
            flags = np.empty(self._budgets.shape, dtype=bool)
            found = kernel.candidates(
                self._margin, _PUSH, self.poses, self._reach, self.kinematic,
                self._box_at, self._box_half, self._box_cos, self._box_sin, self.map.discs, self._budgets, flags,
            )  # fmt: skip
            return *found, *flags
        at_walls, checked = self._budgets < 0.0
        pairs: set[tuple[int, int]] = set()
        rows = checked.nonzero()[0]
        while len(rows):
            near = self._near_robots(rows)
            if not near.any():
                break
            firsts, others = near.nonzero()
            pairs.update(zip(rows[firsts].tolist(), others.tolist(), strict=True))
            due = near.any(axis=0) & ~checked
            checked = checked | due
            rows = due.nonzero()[0]
        if pairs:
            at_walls = at_walls.copy()
            paired = np.array(list(pairs))[:, 0]
            at_walls[paired] |= self._budgets[0, paired] < _PUSH
        walls: Pairs = []
        if len(rows := at_walls.nonzero()[0]):
            firsts, statics = self._near_statics(rows).nonzero()
            walls = list(zip(rows[firsts].tolist(), statics.tolist(), strict=True))
        ordered = sorted(pair for pair in pairs if pair[0] < pair[1])
        return walls, ordered, at_walls, checked

    def _near_statics(self, rows: Rows) -> Flags:
        """Whether each wall and obstacle is in reach of these robots, and their new budgets: shape (rows, statics)."""
        gaps = self._static_distances(self.poses[rows, :1], self.poses[rows, 1:2]) - self._reach[rows, np.newaxis]
        self._budgets[0, rows] = np.maximum(gaps.min(axis=1, initial=math.inf), 0.0)
        return gaps < self._margin

    def _near_robots(self, rows: Rows) -> Flags:
        """Whether each robot is in reach of these, and their new budgets: shape (rows, robots).

        The budgets of the others are lowered where they exceed half the gap to one of these.
        """
        x, y, reach = self.poses[:, 0], self.poses[:, 1], self._reach
        gaps = hypot(x - x[rows, np.newaxis], y - y[rows, np.newaxis])
        gaps -= reach + reach[rows, np.newaxis]
        gaps[np.arange(len(rows)), rows] = math.inf
        if self._any_kinematic:
            gaps[np.ix_(self.kinematic[rows], self.kinematic)] = math.inf
        half = np.maximum(gaps, 0.0) / 2
        budgets = self._budgets[1]
        np.minimum(budgets, half.min(axis=0), out=budgets)
        budgets[rows] = half.min(axis=1)
        return gaps < self._margin

    def _nearer(self, distance: float, walls: Pairs, pairs: Pairs) -> tuple[Pairs, Pairs]:
        """Those of the (robot, wall) and (robot, robot) pairs whose outlines are less than `distance` apart, m."""
        if not (walls or pairs):
            return [], []
        at, robots = self._here(), self._robots
        lines = {row: line(at, robots, row) for row in {row for row, _ in walls}.union(*pairs)}
        boxes = len(self._outlines)
        return [
            (row, static)
            for row, static in walls
            if not (
                apart(lines[row], self._outlines[static], distance)
                if static < boxes
                else wall_gap(at, robots, self._walls, row, static).distance >= distance
            )
        ], [(row, other) for row, other in pairs if not apart(lines[row], lines[other], distance)]

    def _static_distances(self, x: Floats, y: Floats) -> Floats:
        """The distance from points, shape (points, 1), to each wall and obstacle, m: shape (points, statics)."""
        dx, dy = x - self._box_at[:, 0], y - self._box_at[:, 1]
        u = np.abs(dx * self._box_cos + dy * self._box_sin) - self._box_half[:, 0]
        v = np.abs(dy * self._box_cos - dx * self._box_sin) - self._box_half[:, 1]
        boxes = hypot(np.maximum(u, 0.0), np.maximum(v, 0.0))
        discs = self.map.discs
        return np.concatenate((boxes, hypot(x - discs[:, 0], y - discs[:, 1]) - discs[:, 2]), axis=1)

    def _separate(self, walls: Pairs, pairs: Pairs, before: Floats, dt: float) -> bool:
        """Push overlapping bodies apart, and return whether any was moved."""
        kinematic, count = self._robots.kinematic, len(self.names)
        free = [(n, o) for n, o in pairs if not (kinematic[n] or kinematic[o])] if self._any_kinematic else pairs
        motion = SimpleNamespace(
            poses=self.poses.tolist(),
            before=before.tolist(),
            velocities=self.velocities.tolist(),
            speeds=self.speeds.tolist(),
            braking=self._braking.tolist(),
            shifts=[[0.0, 0.0] for _ in range(count)],
            **{name: [False] * count for name in ("moved", "shifted", "blocked", "stuck", "back")},
        )
        if not separate(motion, self._robots, self._walls, walls, pairs, free, dt, self._shove):
            return False
        self.poses[:], self.velocities[:], self.speeds[:] = motion.poses, motion.velocities, motion.speeds
        self._budgets[:, motion.moved] = 0.0
        return True

    def _here(self) -> SimpleNamespace:
        """The poses of the robots, as `pushing` has them."""
        return SimpleNamespace(poses=self.poses.tolist())

    def _note(self, at: SimpleNamespace, gap: Gap, row: int, other: int) -> None:
        if gap.distance < CONTACT:
            x, y, theta = at.poses[row]
            bearing = atan2(gap.y - y, gap.x - x) - theta
            self._contacts.add((row, other, bumper_bit(self.models[row], bearing)))
