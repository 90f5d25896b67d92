"""Passive bodies: balls that roll, boxes that slide, and what robots do to them. The same for every engine.

An engine moves the robots; then this moves the bodies among them. What a body does to a robot goes back to the engine
as a change of the robot's velocity, which its motors then work against: so a robot pushes a box as long as its motors
overcome the friction, and a robot with a heavy box speeds up more slowly. A tracked body is where it was
seen: it pushes others with its mass, and stops them, but nothing moves it.

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
from vrg.hal.actuators import Kicker
from vrg.hal.models import RobotModel
from vrg.hal.sim.config import BodySetup
from vrg.hal.sim.contact import Contact, Form, Placed, contacts, form_of, moments, placed, rectangle
from vrg.hal.sim.engines.engine import DRIVE, Engine, Push, bumper_bit
from vrg.hal.sim.map import Map
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
_BOUNCE = 0.2
"""The approach speed in m/s up to which nothing bounces: more than a robot gains in a tick against what it pushes."""
_MOST_STEPS = 20
"""The number of steps at most into which a tick is divided, so that nothing small and fast passes through a robot."""


class Rigid:
    """One body, robot or wall, in the map's frame.

    Attributes:
        x, y, theta: its pose, m and rad. vx, vy, w: its velocity, m/s and rad/s.
        inverse_mass, inverse_inertia: of its mass and moment of inertia, 1/kg and 1/(kg m^2); 0 if nothing moves it.
    """

    __slots__ = ("_at", "bounce", "form", "inverse_inertia", "inverse_mass", "theta", "vx", "vy", "w", "x", "y")

    def __init__(self, form: Form, pose: Pose, inverse_mass: float, inverse_inertia: float, bounce: float) -> None:
        self.form, self.inverse_mass, self.inverse_inertia, self.bounce = form, inverse_mass, inverse_inertia, bounce
        self.put(pose.x, pose.y, pose.theta)
        self.vx = self.vy = self.w = 0.0

    def put(self, x: float, y: float, theta: float) -> None:
        """Put it at a pose."""
        self.x, self.y, self.theta = x, y, theta
        self._at: Placed | None = None

    @property
    def at(self) -> Placed:
        """Its form where it is."""
        if self._at is None:
            self._at = placed(self.form, self.x, self.y, self.theta)
        return self._at

    @property
    def moves(self) -> bool:
        """True if it is not at rest."""
        return bool(self.vx or self.vy or self.w)


class _Touch:
    """A contact of two bodies while its impulse is found."""

    __slots__ = ("a", "b", "impulse", "mass", "nx", "ny", "ra", "rb", "wanted")

    def __init__(self, a: Rigid, b: Rigid, contact: Contact) -> None:
        self.a, self.b, self.nx, self.ny, self.impulse = a, b, contact.nx, contact.ny, 0.0
        self.ra = (contact.x - a.x) * self.ny - (contact.y - a.y) * self.nx
        self.rb = (contact.x - b.x) * self.ny - (contact.y - b.y) * self.nx
        turning = self.ra * self.ra * a.inverse_inertia + self.rb * self.rb * b.inverse_inertia
        inverse = a.inverse_mass + b.inverse_mass + turning
        self.mass = 1.0 / inverse if inverse else 0.0
        speed = self.speed
        self.wanted = -max(a.bounce, b.bounce) * speed if speed < -_BOUNCE else 0.0

    @property
    def speed(self) -> float:
        """The speed at which the two part at the contact, m/s; negative if they approach."""
        a, b = self.a, self.b
        return (a.vx - b.vx) * self.nx + (a.vy - b.vy) * self.ny + a.w * self.ra - b.w * self.rb

    def press(self) -> float:
        """Change the velocities so that the two part at the wanted speed, and return the change of the impulse, N s.

        The impulse of all changes together only ever presses, and never pulls.
        """
        a, b, before = self.a, self.b, self.impulse
        self.impulse = max(0.0, before + (self.wanted - self.speed) * self.mass)
        change = self.impulse - before
        a.vx += change * a.inverse_mass * self.nx
        a.vy += change * a.inverse_mass * self.ny
        a.w += change * a.inverse_inertia * self.ra
        b.vx -= change * b.inverse_mass * self.nx
        b.vy -= change * b.inverse_mass * self.ny
        b.w -= change * b.inverse_inertia * self.rb
        return abs(change)


class Bodies:
    """The passive bodies of a world.

    Args:
        map_: the walls. setups: the bodies. engine: moves the robots.

    Attributes:
        names: the names of the bodies. touched: the bodies that a robot has touched in the last tick, each with the
            point, m, by the row of the robot.
    """

    def __init__(self, map_: Map, setups: Sequence[BodySetup], engine: Engine | None = None) -> None:
        self.names = [setup.name for setup in setups]
        self._setups = list(setups)
        self._bodies = [_body(setup) for setup in setups]
        self._slowing = [setup.friction * GRAVITY for setup in setups]
        self._radii = [_friction_radius(setup) for setup in setups]
        self._walls = [
            *(Rigid(rectangle(b.length, b.width), Pose(b.x, b.y, b.heading), 0.0, 0.0, 0.0) for b in map_.boxes),
            *(Rigid(form_of(c.radius, ()), Pose(c.x, c.y, 0.0), 0.0, 0.0, 0.0) for c in map_.circles),
        ]
        robots = () if engine is None else zip(engine.models, engine.masses, engine.kinematic.tolist(), strict=True)
        self._robots = [_robot(model, 0.0 if carried else 1.0 / mass) for model, mass, carried in robots]
        self._reaches: Floats = np.array([robot.form.radius + 0.1 for robot in self._robots])
        self._forces = [] if engine is None else [DRIVE * m.brake * m.mass for m in engine.models]
        """The force with which each robot can push, N."""
        self._places: Floats = np.array([(wall.x, wall.y, wall.form.radius) for wall in self._walls]).reshape(-1, 3)
        self._carried = {number: (0.0, 0.0, 0.0) for number, setup in enumerate(setups) if setup.tracked}
        """The velocities of the tracked bodies, as `Rigid` has them."""
        self.touched: dict[int, tuple[float, float]] = {}
        self._put: set[int] = set()
        """The bodies that were put somewhere since the last step: something may stand there."""

    def __iter__(self) -> Iterator[tuple[str, Rigid]]:
        """Each body by name."""
        return zip(self.names, self._bodies, strict=True)

    def standing(self) -> list[tuple[Placed, float]]:
        """Where each body is, and its height, m."""
        return [(body.at, setup.height) for body, setup in zip(self._bodies, self._setups, strict=True)]

    def place(self, name: str, pose: Pose) -> None:
        """Put a body somewhere else, at rest."""
        number = self.names.index(name)
        body = self._bodies[number]
        self._put.add(number)
        body.put(pose.x, pose.y, wrap(pose.theta))
        body.vx = body.vy = body.w = 0.0

    def carry(self, name: str, pose: Pose, twist: Twist) -> None:
        """Take a tracked body to where it was seen, with its velocity in its own frame."""
        number, (cos, sin) = self.names.index(name), cos_sin(pose.theta)
        self.place(name, pose)
        velocity = twist.v * cos - twist.side * sin, twist.v * sin + twist.side * cos, twist.w
        body = self._bodies[number]
        self._carried[number] = body.vx, body.vy, body.w = velocity

    def kick(self, pose: Pose, twist: Twist, model: RobotModel, kicker: Kicker, speed: float) -> bool:
        """Kick the discs in front of a robot straight ahead, and return whether there was one.

        Args:
            pose, twist: those of the robot. speed: that of the kick relative to the robot, m/s.
        """
        cos, sin = cos_sin(pose.theta)
        kicked = False
        discs = [b for n, b in enumerate(self._bodies) if not b.form.corners and n not in self._carried]
        for body in discs:
            dx, dy, radius = body.x - pose.x, body.y - pose.y, body.form.radius
            ahead, aside = dx * cos + dy * sin - model.length / 2 - radius, dy * cos - dx * sin
            v, side = body.vx * cos + body.vy * sin, body.vy * cos - body.vx * sin
            if -radius < ahead <= kicker.reach and abs(aside) <= kicker.width / 2 and v < twist.v + speed:
                v = twist.v + speed
                body.vx, body.vy = v * cos - side * sin, v * sin + side * cos
                kicked = True
        return kicked

    def step(self, dt: float, before: Floats, after: Floats, velocities: Floats) -> list[Push]:
        """Move the bodies for dt seconds, in which the robots have moved.

        Args:
            before, after: the poses of the robots, shape (robots, 3), m and rad.
            velocities: theirs, shape (robots, 3): v in m/s, w in rad/s, and the speed to the left in m/s.

        Returns:
            what the bodies have done to robots.
        """
        driving = (velocities.any(axis=1) | (before != after).any(axis=1)).tolist()
        near = self._near(dt, after)
        # What a standing robot touches is not pushed into it by what is found before.
        near.sort(key=lambda pair: not driving[pair[1]])
        moving = {number for number, body in enumerate(self._bodies) if body.moves}
        awake = sorted(moving | self._put | {number for number, row in near if driving[row]})
        self._put.clear()
        rows = sorted({row for _, row in near})
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
        count = self._steps(dt, awake, speeds)
        for step in range(1, count + 1):
            for row in rows:
                self._robots[row].put(*_between(starts[row], ends[row], step / count))
            self._advance(dt / count, awake, near)
        pushes = []
        for row in rows:
            robot = self._robots[row]
            vx, vy, w = speeds[row]
            dx = dy = 0.0
            against = [n for n, other in near if other == row]
            if robot.inverse_mass and (driving[row] or not self._carried.keys().isdisjoint(against)):
                x, y, _ = starts[row]
                dx, dy = self._back(robot, (robot.x - x, robot.y - y), against)
            push = Push(row, robot.vx - vx, robot.vy - vy, robot.w - w, dx, dy)
            if any(push[1:]):
                pushes.append(push)
        for number, velocity in self._carried.items():  # whatever has pushed it
            body = self._bodies[number]
            body.vx, body.vy, body.w = velocity
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
        dx, dy, far = x - after[:, 0], y - after[:, 1], radius + self._reaches + dt * fastest
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
                others.append((body, second, -1))
                if other not in awake:
                    awake.append(other)
        for number in awake:
            body = self._bodies[number]
            others += [(body, wall, -1) for wall in self._walls_at(body)]
        pairs = [(self._against(n, row), self._robots[row], row) for n, row in near if n in awake]
        self._collide([*pairs, *others])

    def _against(self, number: int, row: int) -> Rigid:
        """The body as a robot meets it: one at rest of more friction than the robot can push is as if nailed down."""
        body = self._bodies[number]
        if body.moves or self._slowing[number] <= self._forces[row] * body.inverse_mass:
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
        body, radius = self._bodies[number], self._radii[number]
        sliding = hypot(body.vx, body.vy)
        speed = hypot(sliding, body.w * radius)
        if not speed or number in self._carried:
            return
        slowing = self._slowing[number]
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
            touches += [_Touch(a, b, contact) for contact in found]
            if found and row >= 0:  # a side touches at both ends, so the middle counts
                self.touched[row] = (found[0].x + found[-1].x) / 2, (found[0].y + found[-1].y) / 2
        for _ in range(_ROUNDS if touches else 0):
            if max([touch.press() for touch in touches]) < _SETTLED:
                break
        fixed = {id(self._bodies[number]) for number in self._carried}
        free, moved = {id(body) for body in self._bodies} - fixed, set[int]()
        for _ in range(_ROUNDS):
            before, moved = moved, set[int]()
            for number, (a, b, _) in enumerate(pairs):
                if not {id(a), id(b)}.isdisjoint(before | moved):
                    touching[number] = contacts(a.at, b.at)
                deepest = max(touching[number], key=lambda contact: contact.depth, default=None)
                if deepest is None or deepest.depth <= _SLACK or (id(a) in fixed and id(b) not in free):
                    continue
                share = a.inverse_mass / (a.inverse_mass + b.inverse_mass) if id(b) in free else 1.0
                share = 0.0 if id(a) in fixed else share
                for body, part in ((a, share), (b, share - 1.0)):
                    if part:
                        way = part * (deepest.depth + _SLACK)
                        body.put(body.x + way * deepest.nx, body.y + way * deepest.ny, body.theta)
                        moved.add(id(body))
            if not moved:
                return

    def _back(self, robot: Rigid, way: Vector, near: Sequence[int]) -> Vector:
        """Put a robot back out of bodies that could not give way, as they lie against a wall; how far, m.

        It goes back at most as far as it has come, so that nothing presses it into what is behind it. A tracked body
        takes it along at the speed that both would have after a plastic impact: a ball cannot throw a robot.

        Args:
            way: that of the robot in this tick, m. near: the bodies near it.
        """
        x, y = robot.x, robot.y
        for number in near:
            body = self._bodies[number]
            deepest = max(contacts(body.at, robot.at), key=lambda contact: contact.depth, default=None)
            if deepest is None or deepest.depth <= _MOST_OVERLAP:
                continue
            vx, vy, _ = self._carried.get(number, (0.0, 0.0, 0.0))
            share = robot.inverse_mass / (robot.inverse_mass + body.inverse_mass)
            pressed = share * (vx * deepest.nx + vy * deepest.ny)
            back = min(deepest.depth + _SLACK, max(0.0, way[0] * deepest.nx + way[1] * deepest.ny))
            robot.put(robot.x - back * deepest.nx, robot.y - back * deepest.ny, robot.theta)
            for rigid in (robot, body):  # both stand, as far as they press on each other
                along = rigid.vx * deepest.nx + rigid.vy * deepest.ny - pressed
                rigid.vx, rigid.vy = rigid.vx - along * deepest.nx, rigid.vy - along * deepest.ny
        return robot.x - x, robot.y - y


def _body(setup: BodySetup) -> Rigid:
    _, _, gyration = moments(setup.corners) if setup.corners else (0.0, (0.0, 0.0), square(setup.radius) / 2)
    form = form_of(setup.radius, setup.corners)
    return Rigid(form, setup.pose, 1.0 / setup.mass, 1.0 / (setup.mass * gyration), setup.restitution)


def _friction_radius(setup: BodySetup) -> float:
    """The radius at which all friction would brake a turn as that of the whole ground does, m; 0 for a disc that rolls.

    That of an outline is taken to be that of a disc of the same area: 2 / 3 of its radius.
    """
    return 2 / 3 * math.sqrt(moments(setup.corners)[0] / math.pi) if setup.corners else 0.0


def _robot(model: RobotModel, inverse_mass: float) -> Rigid:
    gyration = (square(model.length) + square(model.width)) / 12
    return Rigid(rectangle(model.length, model.width), Pose(0.0, 0.0, 0.0), inverse_mass, inverse_mass / gyration, 0.0)


def _between(start: Sequence[float], end: Sequence[float], fraction: float) -> tuple[float, float, float]:
    """The pose between two; it is the second one itself at the end of the way."""
    if fraction == 1.0:
        return end[0], end[1], end[2]
    x, y, theta = start
    return x + (end[0] - x) * fraction, y + (end[1] - y) * fraction, theta + wrap(end[2] - theta) * fraction
