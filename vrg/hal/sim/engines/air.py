"""Aerial robots, the same among those of every engine: free bodies that reach commanded velocities with some delay.

They meet walls, most of which are as high as the sky, and what is at their own height. Whatever they meet is heavier
than they are, so they give way: nothing on the ground notices them, and two of them slide along each other. They can
stand on what is below them.

A robot that is held, or that nobody commands, hovers where it is, and lands after HOVER. Its motors are off then. Those
that are cut fall.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from vrg.geometry import wrap
from vrg.hal.models import RobotModel
from vrg.hal.models.drivetrain import Multirotor
from vrg.hal.sim.contact import Contact, Placed, contacts, form_of, placed, rectangle
from vrg.hal.sim.engines.engine import Engine, Push, Start, bumper_bit
from vrg.hal.sim.map import Map
from vrg.hal.sim.robot import GRAVITY
from vrg.portable.scalars import atan2, cos_sin, hypot
from vrg.types import STILL, Pose, Twist

HOVER = 3.0
"""The time in s for which a robot that is held stays where it is before it lands."""
LANDING = 0.3
"""The speed at which it lands, m/s."""
_NEAR = 1e-6
"""The distance in m by which things are moved apart, and heights may differ, so that rounding makes no overlap."""
_RISEN = 0.05
"""The distance in m below the height to which it takes off from which on it has taken off."""
_ROUNDS = 4
"""The number of times that a robot is moved out of what it meets at most: in a corner it takes two."""


class Flight:
    """One aerial robot.

    Args:
        row: its row in the arrays of the engine. model: its model. z: its height at the start, m.
    """

    def __init__(self, row: int, model: RobotModel, drivetrain: Multirotor, z: float) -> None:
        self.row, self.model, self.drivetrain = row, model, drivetrain
        self.form = form_of(max(model.size) / 2, ())
        self.on = False
        """True while its rotors turn."""
        self.wanted: Twist | None = None
        self.held = 0.0
        """For how long it is held, s."""
        self.z, self.aim = z, 0.0
        """Its height, and the one that it keeps, m."""
        self.rising = False
        """True while it takes off, until it is as high as it is to be."""
        self.vx = self.vy = self.climb = self.w = 0.0
        """Its velocity in the map's frame, m/s, and its turn rate, rad/s."""
        self.drift = 0.0, 0.0
        """The velocity with which it drifts, in the map's frame, m/s."""

    def fly(self, dt: float, theta: float, ground: float) -> None:
        """Change its velocity and its height in dt seconds.

        Args:
            theta: its heading, rad. ground: the height of what is below it, m.
        """
        own = self.drivetrain
        if self.wanted is None:
            self.aim = self.aim if self.held else max(self.z, ground)  # also in the middle of its take-off
            self.held += dt
        else:
            if not self.on or (self.held and self.rising):
                self.on = self.rising = True
                self.aim = min(ground + own.cruise, own.ceiling)
            self.held = 0.0
        if not self.on:
            self.climb -= GRAVITY * dt
        else:
            twist = self.wanted or STILL
            cos, sin = cos_sin(theta)
            share = dt / (own.response + dt)
            dx = (twist.v * cos - twist.side * sin + self.drift[0] - self.vx) * share
            dy = (twist.v * sin + twist.side * cos + self.drift[1] - self.vy) * share
            far = hypot(dx, dy)
            most = min(1.0, self.model.a_max * dt / far) if far else 1.0
            self.vx, self.vy = self.vx + dx * most, self.vy + dy * most
            self.w += (twist.w - self.w) * share
            if self.held > HOVER:
                climb = -LANDING
            elif twist.climb:
                self.rising = False
                climb, self.aim = twist.climb, min(max(self.z, ground), own.ceiling)
            else:
                climb = min(max((self.aim - self.z) / own.response / 2, -own.climb), own.climb)
            self.climb += (climb - self.climb) * share
        self.z += self.climb * dt
        self.rising = self.rising and (self.wanted is None or self.z < self.aim - _RISEN)
        if self.z >= own.ceiling:
            self.z, self.climb = own.ceiling, min(self.climb, 0.0)
        if self.z <= ground:
            self.z, self.climb = ground, 0.0
            self.vx = self.vy = self.w = 0.0
            self.on = self.on and self.held <= HOVER

    def meets(self, bottom: float, height: float) -> bool:
        """True if something from a height on, m, and of a height, m, is beside it and not above or below."""
        return self.z < bottom + height - _NEAR and bottom < self.z + self.model.height - _NEAR


class AirEngine(Engine):
    """An engine with aerial robots. Another engine moves all that are not, and knows of none.

    Args:
        ground: the class of the other engine. map_, robots: see `Engine`.
        drifts: returns for each robot, for the next step, the velocity along x and along y with which it drifts if it
            flies, as a multiple of its model's `drift`: shape (robots, 2).
    """

    def __init__(
        self, ground: type[Engine], map_: Map, robots: Sequence[Start], drifts: Callable[[], npt.NDArray[np.float64]]
    ) -> None:
        super().__init__(map_, robots)
        self._drifts = drifts
        self._rows_below = [row for row, robot in enumerate(robots) if robot.model.flies is None]
        self._below = ground(map_, [robots[row] for row in self._rows_below])
        self._row_below = {row: number for number, row in enumerate(self._rows_below)}
        self._flights = {
            row: Flight(row, robot.model, drivetrain, robot.pose.z)
            for row, robot in enumerate(robots)
            if (drivetrain := robot.model.flies) is not None
        }
        for row, flight in self._flights.items():
            self.heights[row] = flight.z
        walls = [
            *(placed(rectangle(b.length, b.width), b.x, b.y, b.heading) for b in map_.boxes),
            *(placed(form_of(c.radius, ()), c.x, c.y, 0.0) for c in map_.circles),
        ]
        tops = (math.inf if region.z_max is None else region.z_max for region in map_.obstacles)
        self._walls = [(place, 0.0, top) for place, top in zip(walls, tops, strict=True)]
        """Where walls and obstacles are, and from which height on and how high they are, m."""
        self._forms = [rectangle(*robot.model.size) for robot in robots]
        self._read()

    @property
    def masses(self) -> list[float]:
        """The mass of each robot against what it pushes, kg."""
        below = self._below.masses
        return [below[self._row_below[row]] if row in self._row_below else m.mass for row, m in enumerate(self.models)]

    def place(self, name: str, pose: Pose) -> None:
        """Put a robot somewhere else, at rest; see `Engine`."""
        super().place(name, pose)
        row = self.row(name)
        if row in self._row_below:
            self._below.place(name, pose)

    def move(self, name: str, pose: Pose, twist: Twist) -> None:
        """Set where a kinematic body is at the end of the next step; see `Engine`."""
        row = self.row(name)
        if row in self._row_below:
            self._below.move(name, pose, twist)
        super().move(name, pose, twist)
        if (flight := self._flights.get(row)) is not None:
            flight.z, flight.climb = max(0.0, pose.z), twist.climb

    def command(self, name: str, twist: Twist | None) -> None:
        """Set the motion that a robot aims for until the next command; see `Engine`."""
        row = self.row(name)
        if row in self._row_below:
            self._below.command(name, twist)
        else:
            super().command(name, twist)
            self._flights[row].wanted = twist

    def push(self, push: Push) -> None:
        """Take in what passive bodies have done to a robot in the last step."""
        self._below.push(push._replace(row=self._row_below[push.row]))
        self._read()

    def cut(self) -> None:
        """Switch off all rotors."""
        for flight in self._flights.values():
            flight.on, flight.wanted = False, None

    def step(self, dt: float) -> None:
        """Advance by dt seconds."""
        self._below.step(dt)
        self._read()
        standing, drifts = {row: self._placed_at(row) for row in range(len(self.names))}, self._drifts()
        for row, flight in self._flights.items():
            if not self.kinematic[row]:
                east, north = drifts[row].tolist()
                flight.drift = flight.drivetrain.drift * east, flight.drivetrain.drift * north
                self._fly(flight, dt, standing)
                standing[row] = self._placed_at(row)
            self.heights[row], self.climbs[row] = flight.z, flight.climb

    def close(self) -> None:
        """Close the other engine."""
        self._below.close()

    def _fly(self, flight: Flight, dt: float, standing: dict[int, Placed]) -> None:
        """Move one robot, and keep it out of all that it meets."""
        row = flight.row
        x, y, theta = self.poses[row].tolist()
        here = placed(flight.form, x, y, theta)
        others = ((place, self._height(n), self.models[n].height) for n, place in standing.items() if n != row)
        solid = [*self._walls, *others]
        below = [bottom + height for place, bottom, height in solid
                 if bottom + height <= flight.z + _NEAR and contacts(here, place)]  # fmt: skip
        flight.fly(dt, theta, max(below, default=0.0))
        way = flight.vx * dt, flight.vy * dt
        x, y = x + way[0], y + way[1]
        meeting = [place for place, bottom, height in solid if flight.meets(bottom, height)]
        touched: Contact | None = None
        for _ in range(_ROUNDS):
            here = placed(flight.form, x, y, theta)
            found = [contact for other in meeting for contact in contacts(here, other)]
            deepest = max(found, key=lambda contact: contact.depth, default=None)
            if deepest is None or deepest.depth <= _NEAR:
                break
            x, y, touched = x + deepest.depth * deepest.nx, y + deepest.depth * deepest.ny, deepest
            into = flight.vx * deepest.nx + flight.vy * deepest.ny
            if into < 0.0:
                flight.vx, flight.vy = flight.vx - into * deepest.nx, flight.vy - into * deepest.ny
        cos, sin = cos_sin(theta)
        v, side = flight.vx * cos + flight.vy * sin, flight.vy * cos - flight.vx * sin
        bearing = 0.0 if touched is None else atan2(touched.y - y, touched.x - x) - theta
        self.touch[row] = 0 if touched is None else bumper_bit(self.models[row], bearing)
        self.poses[row] = x, y, wrap(theta + flight.w * dt)
        self.velocities[row] = v, flight.w, side
        own = self.models[row].drivetrain
        self.angles[row, : len(own.axes)] += np.array(own.speeds(Twist(v, flight.w, side))) * dt

    def _height(self, row: int) -> float:
        flight = self._flights.get(row)
        return 0.0 if flight is None else flight.z

    def _placed_at(self, row: int) -> Placed:
        flight, (x, y, theta) = self._flights.get(row), self.poses[row].tolist()
        return placed(self._forms[row] if flight is None else flight.form, x, y, theta)

    def _read(self) -> None:
        """Take over the state of the robots of the other engine."""
        rows, below = self._rows_below, self._below
        if not rows:
            return
        columns = below.angles.shape[1]
        self.poses[rows], self.velocities[rows] = below.poses, below.velocities
        self.angles[rows, :columns], self.speeds[rows, :columns] = below.angles, below.speeds
        for row, number in self._row_below.items():
            self.touch[row] = below.touch[number]

    def _placed(self, row: int) -> None:
        if (flight := self._flights.get(row)) is not None:
            flight.on, flight.held = False, 0.0
            flight.vx = flight.vy = flight.climb = flight.w = 0.0
            flight.z = self.heights[row]

    def _moved(self, row: int, way: float, turn: float) -> None:
        """Nothing: what flies meets nobody of the other engine."""
