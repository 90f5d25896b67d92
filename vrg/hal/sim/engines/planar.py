"""The planar engine: bodies with acceleration limits that slip nowhere, whose footprints never overlap.

It is fast enough for thousands of matches. Wheels do not slip on open ground; the skid of a real body is in the model's
drivetrain. Bodies that run into something slide along it. Of two bodies the one with less force gives way: a body
holds with the full friction of its wheels, and drives at the other with DRIVE of it. So a body that stands or brakes
holds against an equal one. Bodies of the same force share the push. A kinematic body never gives way: the other body
takes the whole push, as far as walls and its neighbours leave room.
"""

import math

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel
from vrg.hal.sim.engines.engine import DRIVE, Engine, Floats, bumper_bit
from vrg.hal.sim.map import Map
from vrg.hal.sim.shapes import Box, Gap, box_gap, circle_gap
from vrg.regions import Circle
from vrg.types import Twist

CONTACT = 0.005
"""The distance in m below which a bumper is pressed."""
SLACK = 1e-9
"""The distance in m that is left between bodies that were pushed apart, so that rounding makes no overlap."""
_PUSH = 0.2
"""The longest push of a robot in one step, m."""
PUSH_ROUNDS = 6
"""The number of attempts to push bodies apart, before those that still overlap are put back where they came from."""
_SHOVE = _PUSH / (2 * PUSH_ROUNDS)
"""The longest push of a robot in one attempt, m, in a world with kinematic bodies: one may appear inside another."""


class PlanarEngine(Engine):
    """An engine that moves bodies in the plane as their axes turn, and keeps their footprints apart.

    Most steps need no collision check at all. Each robot has two budgets: the way that it can go before it could touch
    anything. One is the whole gap to the nearest wall, the other half the gap to the nearest robot, both measured from
    the robot's circumscribed circle. A robot is checked only when one of its budgets is used up.
    """

    def __init__(self, map_: Map) -> None:
        super().__init__(map_)
        self._statics: list[Box | Circle] = [*map_.boxes, *map_.circles]
        boxes = np.array([(b.x, b.y, b.heading, b.length / 2, b.width / 2) for b in map_.boxes]).reshape(-1, 5)
        self._box_at, self._box_half = boxes[:, :2], boxes[:, 3:]
        self._box_cos, self._box_sin = np.cos(boxes[:, 2]), np.sin(boxes[:, 2])
        self._motions: Floats = np.zeros((2, 0, 3))
        """The effect of each axis (first index) of each robot on its v, its w and its speed to the left."""
        self._reach: Floats = np.zeros(0)
        self._budgets: Floats = np.zeros((2, 0))
        """The way in m that each robot can go before it could touch a wall (first row) or a robot (second row)."""
        self._any_kinematic = False
        self._contacts: set[tuple[int, int, int]] = set()
        self._margin = CONTACT
        """The distance in m below which two bodies may touch in this step."""
        self._shove = math.inf
        """The longest push of a robot in one attempt, m."""

    def step(self, dt: float) -> None:
        """Advance by dt seconds."""
        if not self.names:
            return
        poses, velocities = self.poses, self.velocities
        self.speeds = speeds = self._accelerate(dt)
        # The wheels of kinematic bodies do not turn, so the lines below would give them no speed.
        carried = velocities[self.kinematic] if self._any_kinematic else None
        # Not as a product of matrices, whose last bits differ from computer to computer.
        np.multiply(self._motions[0], speeds[:, :1], out=velocities)
        for axis in range(1, len(self._motions)):
            velocities += self._motions[axis] * speeds[:, axis : axis + 1]
        before = poses.copy()
        (way, turned, aside), (x, y, heading) = (velocities * dt).T, poses.T
        middle = heading + turned * 0.5
        cos, sin = np.cos(middle), np.sin(middle)
        x += way * cos
        y += way * sin
        far = np.abs(way) + np.abs(turned) * self._reach
        if self._holonomic:
            x -= aside * sin
            y += aside * cos
            far += np.abs(aside)
        heading += turned
        self.angles += speeds * dt
        self._budgets -= far
        if self._budgets.min() < 0.0:
            self._collide(before, dt)
        if carried is not None:
            velocities[self.kinematic] = carried
        if np.abs(heading).max() > math.pi:
            heading -= np.round(heading / (2 * math.pi)) * (2 * math.pi)

    def close(self) -> None:
        """Do nothing: this engine holds nothing that must be released."""

    def _added(self, row: int) -> None:
        self._forget(self.models, self.kinematic)

    def _removed(self, row: int) -> None:
        self._forget(self.models[:row] + self.models[row + 1 :], np.delete(self.kinematic, row))

    def _placed(self, row: int) -> None:
        self._forget(self.models, self.kinematic)

    def _moved(self, row: int, way: float, turn: float) -> None:
        self._budgets[1, row] -= way + turn * self._reach[row]

    def _forget(self, models: list[RobotModel], kinematic: npt.NDArray[np.bool_]) -> None:
        """Compute everything that depends on the list of robots anew, and check every robot at the next step."""
        self._motions = np.zeros((self.speeds.shape[1], len(models), 3))
        for row, model in enumerate(models):
            self._motions[: len(model.drivetrain.axes), row] = np.transpose(model.drivetrain.motions)
        self._reach = np.array([math.hypot(m.length, m.width) / 2 for m in models])
        self._budgets = np.full((2, len(models)), -1.0)
        self._budgets[0, kinematic] = math.inf
        # Without kinematic bodies no robot is pushed farther than it has driven in this step, so a robot that is out of
        # reach before the push is out of reach after it.
        self._any_kinematic = bool(kinematic.any())
        self._margin, self._shove = (CONTACT + _PUSH, _SHOVE) if self._any_kinematic else (CONTACT, math.inf)
        self._contacts.clear()
        self.touch = [0] * len(self.touch)

    def _collide(self, before: Floats, dt: float) -> None:
        """Push overlapping bodies apart, note which bumpers are pressed, and compute new budgets."""
        walls, pairs, at_walls, at_robots = self._candidates()
        if not (walls or pairs or self._contacts):
            return
        if self._overlapping(walls, pairs):
            free = {pair for pair in pairs if not self.kinematic[list(pair)].any()}
            moved = self._push_apart(walls, pairs)
            if len(free) < len(pairs):
                # Walls and neighbours are resolved last, so a body that is caught overlaps with the kinematic body.
                moved |= self._push_apart(walls, free)
            moved |= self._put_back(walls, free, before)
            for row in moved:
                self._slide(row, before, dt)
                self._budgets[:, row] = 0.0
        self._contacts = {
            c for c in self._contacts if not (c[0] in at_walls if c[1] < 0 else c[0] in at_robots or c[1] in at_robots)
        }
        for row, shape in walls:
            self._note(self._gap(row, shape), row, -1)
        for row, other in pairs:
            gap = box_gap(self._body(row), self._body(other))
            self._note(gap, row, other)
            self._note(gap, other, row)
            if gap.distance < 0.0 and (self.kinematic[row] or self.kinematic[other]):
                self._budgets[1, row] = -1.0  # it is pushed on at the next step, also if both stand still
        self.touch = [0] * len(self.names)
        for row, _, bit in self._contacts:
            self.touch[row] |= bit

    def _candidates(self) -> tuple[list[tuple[int, Box | Circle]], set[tuple[int, int]], set[int], set[int]]:
        """The (robot, wall) and (robot, robot) pairs near enough to touch, and the robots that were checked for them.

        A robot near one whose budget is used up is checked too, because it may be pushed.
        """
        due = (self._budgets[1] < 0.0).nonzero()[0].tolist()
        at_walls = set((self._budgets[0] < 0.0).nonzero()[0].tolist())
        at_robots: set[int] = set()
        pairs: set[tuple[int, int]] = set()
        while due:
            row = due.pop()
            if row not in at_robots:
                at_robots.add(row)
                for other in self._near_robots(row):
                    pairs.add((min(row, other), max(row, other)))
                    due.append(other)
                    at_walls |= {n for n in (row, other) if self._budgets[0, n] < _PUSH}
        walls = [(row, self._statics[n]) for row in sorted(at_walls) for n in self._near_statics(row)]
        return walls, pairs, at_walls, at_robots

    def _near_statics(self, row: int) -> list[int]:
        """The walls and obstacles in reach of a robot, by index. It also sets the robot's new budget."""
        x, y, _ = self.poses[row].tolist()
        gaps = self._static_distances(x, y) - self._reach[row]
        self._budgets[0, row] = max(0.0, gaps.min()) if len(gaps) else math.inf
        near: list[int] = (gaps < self._margin).nonzero()[0].tolist()
        return near

    def _near_robots(self, row: int) -> list[int]:
        """The robots in reach of a robot, by row. It also sets the robot's new budget.

        The budgets of the others are lowered where they exceed half the gap to this robot.
        """
        poses, budgets = self.poses, self._budgets[1]
        gaps = np.hypot(poses[:, 0] - poses[row, 0], poses[:, 1] - poses[row, 1])
        gaps -= self._reach + self._reach[row]
        gaps[row] = math.inf
        if self.kinematic[row]:
            gaps[self.kinematic] = math.inf
        half = np.maximum(gaps, 0.0) / 2
        np.minimum(budgets, half, out=budgets)
        budgets[row] = half.min()
        near: list[int] = (gaps < self._margin).nonzero()[0].tolist()
        return near

    def _overlapping(self, walls: list[tuple[int, Box | Circle]], pairs: set[tuple[int, int]]) -> set[int]:
        """The robots whose footprints overlap with a wall or with another footprint."""
        rows = {row for row, shape in walls if self._gap(row, shape).distance < 0.0}
        for pair in pairs:
            if box_gap(self._body(pair[0]), self._body(pair[1])).distance < 0.0:
                rows |= set(pair)
        return rows

    def _static_distances(self, x: float, y: float) -> Floats:
        """The distance from a point to each wall and obstacle, m."""
        dx, dy = x - self._box_at[:, 0], y - self._box_at[:, 1]
        u = np.abs(dx * self._box_cos + dy * self._box_sin) - self._box_half[:, 0]
        v = np.abs(dy * self._box_cos - dx * self._box_sin) - self._box_half[:, 1]
        boxes = np.hypot(np.maximum(u, 0.0), np.maximum(v, 0.0))
        discs = self.map.discs
        return np.concatenate((boxes, np.hypot(x - discs[:, 0], y - discs[:, 1]) - discs[:, 2]))

    def _push_apart(self, walls: list[tuple[int, Box | Circle]], pairs: set[tuple[int, int]]) -> set[int]:
        """Move overlapping bodies out of each other along the shortest way, and return those that moved.

        All pushes of an attempt are computed before any is applied, so that the order of the robots does not matter.
        """
        moved: set[int] = set()
        blocked: set[int] = set()  # by a wall, or by a body that a wall blocks
        for _ in range(PUSH_ROUNDS):
            shifts: dict[int, list[float]] = {}
            for row, shape in walls:
                self._shift(shifts, row, self._gap(row, shape), 1.0)
            blocked |= shifts.keys()
            for row, other in sorted(pairs):
                gap = box_gap(self._body(row), self._body(other))
                if gap.distance < 0.0:
                    share = self._share(row, other, gap, blocked)
                    self._shift(shifts, row, gap, share)
                    self._shift(shifts, other, gap, share - 1.0)
            if not shifts:
                break
            for row, (x, y) in shifts.items():
                length = math.hypot(x, y)
                shorter = min(1.0, self._shove / length) if length else 1.0
                dx, dy = x * shorter, y * shorter
                self.poses[row, 0] += dx
                self.poses[row, 1] += dy
                moved.add(row)
        return moved

    @staticmethod
    def _shift(shifts: dict[int, list[float]], row: int, gap: Gap, share: float) -> None:
        if gap.distance < 0.0 and share:
            push = (SLACK - gap.distance) * share
            shift = shifts.setdefault(row, [0.0, 0.0])
            shift[0] += push * gap.nx
            shift[1] += push * gap.ny

    def _share(self, row: int, other: int, gap: Gap, blocked: set[int]) -> float:
        """The fraction of a push that the first of two robots takes, 0 to 1.

        A blocked robot holds against one that is not, and blocks it.
        """
        if self.kinematic[row] or self.kinematic[other]:
            return 0.0 if self.kinematic[row] else 1.0
        if (row in blocked) != (other in blocked):
            share = float(other in blocked)
            blocked |= {row, other}
            return share
        force, force_of_other = self._force(row, gap, 1.0), self._force(other, gap, -1.0)
        return 0.5 if force == force_of_other else float(force < force_of_other)

    def _force(self, row: int, gap: Gap, side: float) -> float:
        """The force in N with which a robot drives at another one or holds against it.

        Args:
            side: 1 if the normal of the gap points to this robot, -1 if it points to the other.
        """
        model = self.models[row]
        grip = model.brake * model.mass
        if self._braking[row]:
            return grip
        (x, y, theta), (v, w, aside) = self.poses[row].tolist(), self.velocities[row].tolist()
        cos, sin = math.cos(theta), math.sin(theta)
        vx, vy = v * cos - aside * sin - w * (gap.y - y), v * sin + aside * cos + w * (gap.x - x)
        return grip * DRIVE if side * (vx * gap.nx + vy * gap.ny) < -SLACK else grip

    def _put_back(self, walls: list[tuple[int, Box | Circle]], pairs: set[tuple[int, int]], before: Floats) -> set[int]:
        """Put bodies that still overlap back where they came from, where none of them overlapped."""
        back: set[int] = set()
        while stuck := self._overlapping(walls, pairs) - back:
            for row in stuck:
                self.poses[row] = before[row]
            back |= stuck
        return back

    def _slide(self, row: int, before: Floats, dt: float) -> None:
        """Set a robot's velocity to what is left of it after a push, and its wheel speeds to match."""
        x, y, heading = (self.poses[row] - before[row]).tolist()
        theta = float(self.poses[row, 2])
        cos, sin = math.cos(theta), math.sin(theta)
        ahead, _, aside = self.velocities[row].tolist()
        v, side = slowed((x * cos + y * sin) / dt, ahead), slowed((y * cos - x * sin) / dt, aside)
        self.velocities[row] = v, heading / dt, side
        drivetrain = self.models[row].drivetrain
        self.speeds[row, : len(drivetrain.axes)] = drivetrain.speeds(Twist(v, heading / dt, side))

    def _note(self, gap: Gap, row: int, other: int) -> None:
        if gap.distance < CONTACT:
            x, y, theta = self.poses[row].tolist()
            bearing = math.atan2(gap.y - y, gap.x - x) - theta
            self._contacts.add((row, other, bumper_bit(self.models[row], bearing)))

    def _gap(self, row: int, shape: Box | Circle) -> Gap:
        body = self._body(row)
        return box_gap(body, shape) if isinstance(shape, Box) else circle_gap(body, shape)

    def _body(self, row: int) -> Box:
        model = self.models[row]
        x, y, heading = self.poses[row].tolist()
        return Box(x, y, heading, model.length, model.width)


def slowed(speed: float, driven: float) -> float:
    """A speed after a push: it may slow a body down or stop it, but never drives its wheels."""
    return max(0.0, min(speed, driven)) if driven > 0 else min(0.0, max(speed, driven))
