"""Rigid bodies, robots and walls among them, and the impulse of a contact of two."""

import math
from collections.abc import Sequence

from vrg.geometry import wrap
from vrg.hal.models import RobotModel
from vrg.hal.sim.config import BodySetup
from vrg.hal.sim.contact import Contact, Form, Placed, form_of, moments, placed, rectangle
from vrg.portable.scalars import square
from vrg.types import Pose

_BOUNCE = 0.2
"""The approach speed in m/s up to which nothing bounces: more than a robot gains in a tick against what it pushes."""


class Rigid:
    """One body, robot or wall, in the map's frame.

    Attributes:
        x, y, theta: its pose, m and rad. vx, vy, w: its velocity, m/s and rad/s.
        inverse_mass, inverse_inertia: of its mass and moment of inertia, 1/kg and 1/(kg m^2); 0 if nothing moves it.
        carrier: the robot that holds it, whose mass and motion are then its own; None if none does.
        seen: of a tracked body the velocity with which it was seen, which nothing changes; otherwise None.
    """

    __slots__ = (
        "_at", "bounce", "carrier", "form", "inverse_inertia", "inverse_mass", "seen", "theta", "vx", "vy", "w", "x",
        "y",
    )  # fmt: skip

    def __init__(self, form: Form, pose: Pose, inverse_mass: float, inverse_inertia: float, bounce: float) -> None:
        self.form, self.inverse_mass, self.inverse_inertia, self.bounce = form, inverse_mass, inverse_inertia, bounce
        self.put(pose.x, pose.y, pose.theta)
        self.vx = self.vy = self.w = 0.0
        self.carrier: Rigid | None = None
        self.seen: tuple[float, float, float] | None = None

    def put(self, x: float, y: float, theta: float) -> None:
        """Put it at a pose."""
        self.x, self.y, self.theta = x, y, theta
        self._at: Placed | None = None

    def push(self, jx: float, jy: float, x: float, y: float) -> None:
        """Change its velocity by an impulse at a point, N s and m."""
        self.vx += jx * self.inverse_mass
        self.vy += jy * self.inverse_mass
        self.w += ((x - self.x) * jy - (y - self.y) * jx) * self.inverse_inertia

    @property
    def at(self) -> Placed:
        """Its form where it is."""
        if self._at is None:
            self._at = placed(self.form, self.x, self.y, self.theta)
        return self._at

    @property
    def free(self) -> bool:
        """True for a body that gives way: no robot holds it, and it is not where it was seen."""
        return self.carrier is None and self.seen is None

    @property
    def moves(self) -> bool:
        """True if it is not at rest."""
        return bool(self.vx or self.vy or self.w)


class Touch:
    """A contact of two bodies while its impulse is found."""

    __slots__ = ("a", "b", "impulse", "mass", "nx", "ny", "ra", "rb", "wanted")

    def __init__(self, a: Rigid, b: Rigid, contact: Contact) -> None:
        a, b = a.carrier or a, b.carrier or b
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


def body_of(setup: BodySetup) -> Rigid:
    _, _, gyration = moments(setup.corners) if setup.corners else (0.0, (0.0, 0.0), square(setup.radius) / 2)
    form = form_of(setup.radius, setup.corners)
    body = Rigid(form, setup.pose, 1.0 / setup.mass, 1.0 / (setup.mass * gyration), setup.restitution)
    body.seen = (0.0, 0.0, 0.0) if setup.tracked else None
    return body


def friction_radius(setup: BodySetup) -> float:
    """The radius at which all friction would brake a turn as that of the whole ground does, m; 0 for a disc that rolls.

    That of an outline is taken to be that of a disc of the same area: 2 / 3 of its radius.
    """
    return 2 / 3 * math.sqrt(moments(setup.corners)[0] / math.pi) if setup.corners else 0.0


def robot_of(model: RobotModel, inverse_mass: float) -> Rigid:
    gyration = (square(model.length) + square(model.width)) / 12
    return Rigid(rectangle(model.length, model.width), Pose(0.0, 0.0, 0.0), inverse_mass, inverse_mass / gyration, 0.0)


def between(start: Sequence[float], end: Sequence[float], fraction: float) -> tuple[float, float, float]:
    """The pose between two; it is the second one itself at the end of the way."""
    if fraction == 1.0:
        return end[0], end[1], end[2]
    x, y, theta = start
    return x + (end[0] - x) * fraction, y + (end[1] - y) * fraction, theta + wrap(end[2] - theta) * fraction
