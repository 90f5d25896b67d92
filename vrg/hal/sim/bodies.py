"""Passive bodies: balls that roll, boxes that slide, and what robots do to them. The same for every engine.

An engine moves the robots; then this moves the bodies among them. What a body does to a robot goes back to the engine
as a change of the robot's velocity, which its motors then work against: so a robot pushes a box as long as its motors
overcome the friction, and a robot with a heavy box speeds up more slowly. A tracked body is where it was seen: it
pushes others with its mass, and stops them, but nothing moves it.

The floor slows a disc, which rolls, by friction times gravity. An outline slides: its friction is that of the limit
surface as an ellipsoid (R. D. Howe and M. R. Cutkosky, "Practical force-motion models for sliding manipulation", 1996),
which couples sliding and turning. Contacts are without friction and have Newton's restitution; impulses are found one
after the other, again and again (E. Catto, "Iterative dynamics with temporal coherence", 2005).
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from vrg.geometry import wrap
from vrg.hal.actuators import Gripper
from vrg.hal.models import RobotModel
from vrg.hal.sim.config import BodySetup
from vrg.hal.sim.contact import Placed, contacts, form_of, rectangle
from vrg.hal.sim.engines.engine import DRIVE, Engine, Push, bumper_bit
from vrg.hal.sim.front import Grip, Pull, carry, dribble, graspable, relative
from vrg.hal.sim.map import Map
from vrg.hal.sim.rigid import Rigid, Touch, between, body_of, friction_radius, robot_of
from vrg.hal.sim.robot import GRAVITY
from vrg.portable.scalars import atan2, cos_sin, hypot, square
from vrg.types import Pose, Twist, Vector

Floats = npt.NDArray[np.float64]

_ROUNDS = 50
"""The number of times that each contact's impulse, and each overlap, is looked at again at most. It takes many where
something light is between two heavy ones."""
_SETTLED = 1e-6
"""The change of an impulse in N s below which it is found."""
_SLACK = 1e-9
"""The distance in m that is left between bodies that were pushed apart, so that rounding makes no overlap."""
_MOST_OVERLAP = 1e-4
"""The overlap in m that may be left where something light is pressed; beyond it there is no room: robots go back."""
_NEAR = 0.02
"""The distance in m below which bodies may be pushed into each other."""
_SLIP = 5e-3
"""The overlap in m with what does not give way from which on a held body slips out of the gripper."""
_MOST_STEPS = 20
"""The number of steps at most into which a tick is divided, so that nothing small and fast passes through a robot."""


class Bodies:
    """The passive bodies of a world.

    Args:
        map_: the walls. setups: the bodies. engine: moves the robots.

    Attributes:
        names: the names of the bodies. touched: the bodies that a robot has touched in the last tick, each with the
            point, m, by the row of the robot. grips: which robot holds which, by the number of the body.
    """

    def __init__(self, map_: Map, setups: Sequence[BodySetup], engine: Engine | None = None) -> None:
        self.names = [setup.name for setup in setups]
        self._setups = list(setups)
        self._bodies = [body_of(setup) for setup in setups]
        self._slowing = [setup.friction * GRAVITY for setup in setups]
        self._radii = [friction_radius(setup) for setup in setups]
        self._walls = [
            *(Rigid(rectangle(b.length, b.width), Pose(b.x, b.y, b.heading), 0.0, 0.0, 0.0) for b in map_.boxes),
            *(Rigid(form_of(c.radius, ()), Pose(c.x, c.y, 0.0), 0.0, 0.0, 0.0) for c in map_.circles),
        ]
        robots = () if engine is None else zip(engine.models, engine.masses, engine.kinematic.tolist(), strict=True)
        self._robots = [robot_of(model, 0.0 if carried else 1.0 / mass) for model, mass, carried in robots]
        longest = [max(a.reach for a in m.actuators) if m.actuators else 0.0 for m in engine.models] if engine else []
        radii = [robot.form.radius for robot in self._robots]
        self._reaches: Floats = np.array([r + max(0.1, far) for r, far in zip(radii, longest, strict=True)])
        if engine is not None:  # what flies gives way to all, and so moves none
            self._reaches[[row for row, model in enumerate(engine.models) if model.flies]] = -math.inf
        self._forces = [] if engine is None else [DRIVE * m.brake * m.mass for m in engine.models]
        """The force with which each robot can push, N."""
        self._places: Floats = np.array([(wall.x, wall.y, wall.form.radius) for wall in self._walls]).reshape(-1, 3)
        self.touched: dict[int, tuple[float, float]] = {}
        self._put: set[int] = set()
        """The bodies that were put somewhere since the last step: something may stand there."""
        self.grips: dict[int, Grip] = {}
        """The bodies that robots hold, by their numbers."""
        self._rolling: set[int] = set()
        """The balls that a dribbler turns just now, so that the floor does not slow them."""

    def __iter__(self) -> Iterator[tuple[str, Rigid]]:
        """Each body by name."""
        return zip(self.names, self._bodies, strict=True)

    def standing(self) -> list[tuple[Placed, float]]:
        """Where each body is, and its height, m."""
        return [(body.at, setup.height) for body, setup in zip(self._bodies, self._setups, strict=True)]

    def place(self, name: str, pose: Pose) -> None:
        """Put a body somewhere else, at rest. What holds it lets go of it."""
        number = self.names.index(name)
        self.let_go(number)
        body = self._bodies[number]
        self._put.add(number)
        body.put(pose.x, pose.y, wrap(pose.theta))
        body.vx = body.vy = body.w = 0.0

    def track(self, name: str, pose: Pose, twist: Twist) -> None:
        """Take a tracked body to where it was seen, with its velocity in its own frame."""
        self.place(name, pose)
        body, (cos, sin) = self._bodies[self.names.index(name)], cos_sin(pose.theta)
        body.seen = twist.v * cos - twist.side * sin, twist.v * sin + twist.side * cos, twist.w
        body.vx, body.vy, body.w = body.seen

    def grip(self, row: int, pose: Pose, model: RobotModel, gripper: Gripper, closed: bool) -> None:
        """Close a robot's gripper around the nearest body, unless it holds one, or open it."""
        held = next((n for n, grip in self.grips.items() if (grip.row, grip.gripper) == (row, gripper.name)), None)
        if held is not None and not closed:
            self.let_go(held)
        elif held is None and closed:
            found = graspable(self._bodies, pose, model, gripper)
            if found is not None:
                body = self._bodies[found]
                at = Pose(*relative(body, pose), wrap(body.theta - pose.theta))
                self.hold(found, Grip(row, gripper.name, at))

    def hold(self, number: int, grip: Grip) -> None:
        """Let a robot hold a body."""
        self.grips[number], self._bodies[number].carrier = grip, self._robots[grip.row]
        self._put.add(number)

    def let_go(self, number: int) -> None:
        """Let a body go on by itself, with the velocity that it has. Nothing changes for one that is not held."""
        if self.grips.pop(number, None):
            self._bodies[number].carrier = None

    def open(self, row: int) -> None:
        """Let a robot let go of all that it holds."""
        for number in [number for number, grip in self.grips.items() if grip.row == row]:
            self.let_go(number)

    def step(
        self, dt: float, before: Floats, after: Floats, velocities: Floats, pulls: Sequence[Pull] = ()
    ) -> list[Push]:
        """Move the bodies for dt seconds, in which the robots have moved.

        Args:
            before, after: the poses of the robots, shape (robots, 3), m and rad.
            velocities: theirs, shape (robots, 3): v in m/s, w in rad/s, and the speed to the left in m/s.
            pulls: what their dribblers do.

        Returns:
            what the bodies have done to robots.
        """
        driving = (velocities.any(axis=1) | (before != after).any(axis=1)).tolist()
        near = self._near(dt, after)
        # What a standing robot touches is not pushed into it by what is found before.
        near.sort(key=lambda pair: not driving[pair[1]])
        moving = {number for number, body in enumerate(self._bodies) if body.moves}
        pulling = {pull.row for pull in pulls}
        awake = sorted(moving | self._put | {number for number, row in near if driving[row] or row in pulling})
        self._put.clear()
        rows = sorted({row for _, row in near} | {grip.row for grip in self.grips.values()})
        # Where nothing moves, a robot goes on touching what it touches.
        changed = {row for number, row in near if number in awake}
        self.touched = {r: at for r, at in self.touched.items() if not driving[r] and r not in changed}
        if not awake:
            return []
        starts, ends = before.tolist(), after.tolist()
        speeds: dict[int, tuple[float, float, float]] = {}
        for row in rows:
            cos, sin = cos_sin(ends[row][2])
            v, w, side = velocities[row].tolist()
            robot = self._robots[row]
            robot.vx, robot.vy, robot.w = speeds[row] = v * cos - side * sin, v * sin + side * cos, w
        for pull in pulls:
            self._robots[pull.row].put(*starts[pull.row])
        self._rolling = {
            number
            for pull in pulls
            for number, row in near
            if row == pull.row
            and dribble(self._bodies[number], pull, self._robots[row], Pose(*starts[row]), Pose(*ends[row]), dt)
        }
        count = self._steps(dt, awake, speeds)
        for step in range(1, count + 1):
            for row in rows:
                self._robots[row].put(*between(starts[row], ends[row], step / count))
            self._advance(dt / count, awake, near)
        pushes = []
        for row in rows:
            robot = self._robots[row]
            vx, vy, w = speeds[row]
            dx = dy = 0.0
            against = self._ahead_of(row, near)
            if robot.inverse_mass and (driving[row] or any(body.seen is not None for body, _ in against)):
                x, y, _ = starts[row]
                dx, dy = self._back(robot, (robot.x - x, robot.y - y), against)
            push = Push(row, robot.vx - vx, robot.vy - vy, robot.w - w, dx, dy)
            if any(push[1:]):
                pushes.append(push)
        for body in self._bodies:
            if body.seen is not None:  # whatever has pushed it
                body.vx, body.vy, body.w = body.seen
        for number, grip in list(self.grips.items()):
            carry(self._bodies[number], self._robots[grip.row], grip.at)
            body = self._bodies[number]
            touching = [contact for other in self._others(number, near) for contact in contacts(other.at, body.at)]
            if any(contact.depth > _SLIP for contact in touching):
                self.let_go(number)
        return pushes

    def pressed(self, touch: Sequence[int], models: Sequence[RobotModel], poses: Floats) -> Sequence[int]:
        """The bumpers in contact, also those that a body presses; see `Engine.touch`."""
        if not self.touched:
            return touch
        found = list(touch)
        for row, (px, py) in self.touched.items():
            x, y, theta = poses[row].tolist()
            found[row] |= bumper_bit(models[row], atan2(py - y, px - x) - theta)
        return found

    def _near(self, dt: float, after: Floats) -> list[tuple[int, int]]:
        """The pairs of a body and a robot that may touch in this tick, if one of them moves or is set moving."""
        if not (self._bodies and len(after)):
            return []
        x, y, radius = np.array([(b.x, b.y, b.form.radius) for b in self._bodies]).T[:, :, None]
        fastest = max(hypot(b.vx, b.vy) for b in self._bodies)
        dx, dy, far = x - after[:, 0], y - after[:, 1], np.maximum(radius + self._reaches + dt * fastest, 0.0)
        numbers, rows = (dx * dx + dy * dy < far * far).nonzero()
        return list(zip(numbers.tolist(), rows.tolist(), strict=True))

    def _steps(self, dt: float, awake: Sequence[int], speeds: dict[int, tuple[float, float, float]]) -> int:
        """The number of steps in which nothing moves farther than half of the smallest radius."""
        fastest = max((hypot(self._bodies[n].vx, self._bodies[n].vy) for n in awake), default=0.0)
        fastest += max((hypot(vx, vy) for vx, vy, _ in speeds.values()), default=0.0)
        smallest = min(self._bodies[n].form.radius for n in awake)
        return min(_MOST_STEPS, max(1, math.ceil(2.0 * fastest * dt / smallest)))

    def _advance(self, dt: float, awake: list[int], near: Sequence[tuple[int, int]]) -> None:
        """Move the bodies that are awake, and wake up those that they touch."""
        for number in awake:
            self._slide(number, dt)
        first = set(awake)
        others: list[tuple[Rigid, Rigid, int]] = []
        for number in list(awake):
            body = self._bodies[number]
            for other, second in enumerate(self._bodies):
                reach = body.form.radius + second.form.radius + _NEAR
                dx, dy = body.x - second.x, body.y - second.y
                if other == number or (other in first and other < number) or dx * dx + dy * dy > reach * reach:
                    continue
                if body.carrier is second.carrier is not None:
                    continue
                others.append((body, second, -1))
                if other not in awake:
                    awake.append(other)
        for number in awake:
            body = self._bodies[number]
            others += [(body, wall, -1) for wall in self._walls_at(body)]
        pairs = [(self._against(n, row), self._robots[row], row) for n, row in self._apart(near) if n in awake]
        self._collide([*pairs, *others])

    def _against(self, number: int, row: int) -> Rigid:
        """The body as a robot meets it: one at rest of more friction than the robot can push is as if nailed down."""
        body = self._bodies[number]
        if body.carrier or body.moves or self._slowing[number] <= self._forces[row] * body.inverse_mass:
            return body
        return Rigid(body.form, Pose(body.x, body.y, body.theta), 0.0, 0.0, body.bounce)

    def _walls_at(self, body: Rigid) -> list[Rigid]:
        if not self._walls:
            return []
        dx, dy = self._places[:, 0] - body.x, self._places[:, 1] - body.y
        reach = self._places[:, 2] + body.form.radius + _NEAR
        return [self._walls[number] for number in (dx * dx + dy * dy < reach * reach).nonzero()[0].tolist()]

    def _slide(self, number: int, dt: float) -> None:
        """Let the floor slow a body, and move it: a steady deceleration, up to where it stops."""
        body, radius, grip = self._bodies[number], self._radii[number], self.grips.get(number)
        if grip is not None:
            carry(body, self._robots[grip.row], grip.at)
            return
        sliding = hypot(body.vx, body.vy)
        speed = hypot(sliding, body.w * radius)
        if not speed or body.seen is not None:
            return
        slowing = 0.0 if number in self._rolling else self._slowing[number]
        time = dt if slowing * dt < speed else speed / slowing
        left = max(0.0, 1.0 - slowing * time / speed) if time == dt else 0.0
        mean = (1.0 + left) / 2 * time
        body.put(body.x + body.vx * mean, body.y + body.vy * mean, wrap(body.theta + body.w * mean))
        body.vx, body.vy = body.vx * left, body.vy * left
        # Of an ellipsoid the turning is slowed by the square of the radius of friction over that of inertia.
        ratio = square(radius) * body.inverse_inertia / body.inverse_mass if radius else 1.0
        body.w *= max(0.0, 1.0 - (1.0 - left) * ratio) if left else 0.0

    def _collide(self, pairs: Sequence[tuple[Rigid, Rigid, int]]) -> None:
        """Bounce what touches, and move it apart. Robots, walls and tracked bodies stay where they are."""
        touching = [contacts(a.at, b.at) for a, b, _ in pairs]
        touches = []
        for (a, b, row), found in zip(pairs, touching, strict=True):
            touches += [Touch(a, b, contact) for contact in found]
            if found and row >= 0:  # a side touches at both ends, so the middle counts
                self.touched[row] = (found[0].x + found[-1].x) / 2, (found[0].y + found[-1].y) / 2
        for _ in range(_ROUNDS if touches else 0):
            if max([touch.press() for touch in touches]) < _SETTLED:
                break
        free, moved = {id(body) for body in self._bodies if body.free}, set[int]()
        for _ in range(_ROUNDS):
            before, moved = moved, set[int]()
            for number, (a, b, _) in enumerate(pairs):
                if not {id(a), id(b)}.isdisjoint(before | moved):
                    touching[number] = contacts(a.at, b.at)
                deepest = max(touching[number], key=lambda contact: contact.depth, default=None)
                share = _share(a, b, free)
                if deepest is None or deepest.depth <= _SLACK or share is None:
                    continue
                for body, part in ((a, share), (b, share - 1.0)):
                    if part:
                        way = part * (deepest.depth + _SLACK)
                        body.put(body.x + way * deepest.nx, body.y + way * deepest.ny, body.theta)
                        moved.add(id(body))
            if not moved:
                return

    def _back(self, robot: Rigid, way: Vector, near: Sequence[tuple[Rigid, Rigid]]) -> Vector:
        """Put a robot back out of bodies that could not give way, as they lie against a wall; how far, m.

        It goes back at most as far as it has come, so that nothing presses it into what is behind it. A tracked body
        takes it along at the speed that both would have after a plastic impact: a ball cannot throw a robot.

        Args:
            way: that of the robot in this tick, m. near: each body near it, with the robot or what of it is there.
        """
        x, y = robot.x, robot.y
        for body, part in near:
            deepest = max(contacts(body.at, part.at), key=lambda contact: contact.depth, default=None)
            if deepest is None or deepest.depth <= _MOST_OVERLAP:
                continue
            vx, vy, _ = body.seen or (0.0, 0.0, 0.0)
            share = robot.inverse_mass / (robot.inverse_mass + body.inverse_mass)
            pressed = share * (vx * deepest.nx + vy * deepest.ny)
            back = min(deepest.depth + _SLACK, max(0.0, way[0] * deepest.nx + way[1] * deepest.ny))
            for moved in {robot, *(part for _, part in near)}:
                moved.put(moved.x - back * deepest.nx, moved.y - back * deepest.ny, moved.theta)
            # Both stand as far as they press on each other; what parts, parts.
            along = robot.vx * deepest.nx + robot.vy * deepest.ny - pressed
            if along > 0.0:
                robot.vx, robot.vy = robot.vx - along * deepest.nx, robot.vy - along * deepest.ny
            along = body.vx * deepest.nx + body.vy * deepest.ny - pressed
            if along < 0.0 and body.free and body not in self._robots:
                body.vx, body.vy = body.vx - along * deepest.nx, body.vy - along * deepest.ny
        return robot.x - x, robot.y - y

    def _apart(self, near: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
        """The pairs of a body and a robot, without those of which the robot holds the body."""
        return [(n, row) for n, row in near if self._bodies[n].carrier is not self._robots[row]]

    def _ahead_of(self, row: int, near: Sequence[tuple[int, int]]) -> list[tuple[Rigid, Rigid]]:
        """What may be in the way of a robot or of what it holds, each with the one or the other."""
        found = [(self._bodies[n], self._robots[row]) for n, other in self._apart(near) if other == row]
        held = [n for n, grip in self.grips.items() if grip.row == row]
        return [*found, *((other, self._bodies[n]) for n in held for other in self._others(n, near))]

    def _others(self, number: int, near: Sequence[tuple[int, int]]) -> list[Rigid]:
        """What may be in the way of a held body: walls, robots, and bodies that its robot does not hold."""
        held = self._bodies[number]
        robots = [self._robots[row] for n, row in self._apart(near) if n == number]
        bodies = [body for body in self._bodies if body is not held and body.carrier is not held.carrier]
        return [*self._walls_at(held), *robots, *bodies]


def _share(a: Rigid, b: Rigid, free: set[int]) -> float | None:
    """The share of an overlap by which the first of two gives way; None if neither does.

    Args:
        free: the bodies that give way, by their `id`.
    """
    if not a.free:
        return 0.0 if id(b) in free else None
    return a.inverse_mass / (a.inverse_mass + b.inverse_mass) if id(b) in free else 1.0
