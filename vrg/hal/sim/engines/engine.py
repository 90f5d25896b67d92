"""The interface of a physics engine. Engines know bodies and their drivetrains, but no players, sensors or bus."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from vrg.errors import WorldError
from vrg.geometry import wrap
from vrg.hal.models import RobotModel
from vrg.hal.sensors.touch import TouchSpec
from vrg.hal.sim.compiled import kernel
from vrg.hal.sim.map import Map
from vrg.portable.scalars import cos_sin
from vrg.types import Pose, Twist

Floats = npt.NDArray[np.float64]

CONTACT = 0.005
"""The distance in m below which a bumper is pressed."""
DRIVE = 0.75
"""The force with which motors can press a wheel ahead, as a fraction of the wheel's full friction: an estimate. To turn
in place a P2AT needs 0.56, an ATRV-Jr 0.62. Held wheels have the full friction, as gears hold more than they drive."""


class Push(NamedTuple):
    """What passive bodies have done to a robot in a tick.

    Args:
        row: that of the robot in the engine. vx, vy, w: the change of its velocity in the map's frame, m/s and rad/s.
        dx, dy: how far it is put back, m, as a body behind which there is no room does not give way.
    """

    row: int
    vx: float
    vy: float
    w: float
    dx: float
    dy: float


@dataclass(frozen=True, slots=True)
class Start:
    """A robot as an engine begins with it, at rest and with its wheels braked.

    Args:
        name: one that no other robot has. pose: in the map's frame.
        kinematic: True for a body that only `move` moves, and that may be anywhere, also in a wall.
        angles: those that the axes of its drivetrain have turned, rad; all 0 if none are given.
    """

    name: str
    model: RobotModel
    pose: Pose
    kinematic: bool = False
    angles: tuple[float, ...] = ()


class Engine(ABC):
    """Moves robots over a map. Its state is in arrays with one row per robot, in the order of `names`.

    A kinematic body is where `move` puts it: nothing pushes it, and neither a wall nor another kinematic body stops it.
    The other bodies run into it, and it pushes them. A body that is caught between it and a wall overlaps with it
    rather than with the wall.

    Args:
        map_: the walls and obstacles. robots: all robots; no other ones come, and none leaves.

    Attributes:
        names, models: the robots' names and models.
        kinematic: shape (robots,): True for a body that only `move` moves.
        poses: shape (robots, 3): x, y in m, heading in rad within -pi..pi.
        velocities: shape (robots, 3): v in m/s, w in rad/s, and the speed to the left in m/s.
        heights: shape (robots,): the height of each above the ground, m. climbs: its speed upwards, m/s. Only those of
            aerial robots are ever not 0.
        angles: shape (robots, axes): the angles that the axes of their drivetrains have turned, rad. A robot that has
            fewer axes than another one has zeros in the last columns.
        speeds: shape (robots, axes): the speeds of the axes that the motors have reached, rad/s.
        touch: one number per robot; bit n is set if bumper n is in contact. For a kinematic body, only contact with
            bodies that are not kinematic counts.
    """

    def __init__(self, map_: Map, robots: Sequence[Start]) -> None:
        self.map = map_
        self.names = [robot.name for robot in robots]
        self._rows = {name: row for row, name in enumerate(self.names)}
        self.models = models = [robot.model for robot in robots]
        count, axes = len(robots), max((len(model.drivetrain.axes) for model in models), default=0)
        self.kinematic: npt.NDArray[np.bool_] = np.array([robot.kinematic for robot in robots], dtype=bool)
        poses = [(robot.pose.x, robot.pose.y, wrap(robot.pose.theta)) for robot in robots]
        self.poses: Floats = np.array(poses, dtype=np.float64).reshape(-1, 3)
        self.velocities: Floats = np.zeros((count, 3))
        self.heights: Floats = np.zeros(count)
        self.climbs: Floats = np.zeros(count)
        self.angles: Floats = np.zeros((count, axes))
        for row, robot in enumerate(robots):
            self.angles[row, : len(robot.angles)] = robot.angles
        self.speeds: Floats = np.zeros((count, axes))
        self.touch = [0] * count
        self._targets: Floats = np.zeros((count, axes))
        self._braking: npt.NDArray[np.bool_] = np.ones(count, dtype=bool)
        brakes = [model.brake / model.drivetrain.wheel_radius for model in models]
        self._slew: Floats = np.array(brakes, dtype=np.float64).reshape(-1, 1)
        self._slowing: Floats = self._slew.copy()
        """How fast the speeds of the axes rise, and how fast they fall, rad/s^2."""
        self._sideways: npt.NDArray[np.bool_] = np.array([model.drivetrain.holonomic for model in models], dtype=bool)
        """True for the robots that can drive sideways."""
        self._any_sideways = bool(self._sideways.any())

    def place(self, name: str, pose: Pose) -> None:
        """Put a robot somewhere else, at rest. The caller must check that it fits there.

        Raises:
            WorldError: there is none of that name.
        """
        row = self.row(name)
        self.poses[row] = pose.x, pose.y, wrap(pose.theta)
        self.heights[row], self.climbs[row] = pose.z, 0.0
        self.velocities[row] = self.speeds[row] = 0.0
        self.touch[row] = 0
        self._placed(row)

    def move(self, name: str, pose: Pose, twist: Twist) -> None:
        """Set where a kinematic body is at the end of the next step.

        Args:
            twist: the velocity of its body there. It pushes other bodies at that speed.

        Raises:
            WorldError: there is none of that name, or it is not kinematic.
        """
        row = self.row(name)
        if not self.kinematic[row]:
            raise WorldError(f"move {name}: expected a kinematic body, got one that drives itself")
        x, y, theta = self.poses[row].tolist()
        self.poses[row] = pose.x, pose.y, wrap(pose.theta)
        self.velocities[row] = twist.v, twist.w, twist.side
        self._moved(row, math.hypot(pose.x - x, pose.y - y), abs(wrap(pose.theta - theta)))

    def command(self, name: str, twist: Twist | None) -> None:
        """Set the motion that a robot aims for until the next command.

        Args:
            twist: within the limits of the model, whose acceleration limits how fast it is reached; None locks the
                wheels instead.

        Raises:
            WorldError: there is none of that name, or it is kinematic.
        """
        row = self.row(name)
        if self.kinematic[row]:
            raise WorldError(f"command {name}: expected a body that drives itself, got a kinematic one")
        model = self.models[row]
        if twist is None:
            self._targets[row] = 0.0
        else:
            self._targets[row, : len(model.drivetrain.axes)] = model.drivetrain.speeds(twist)
        if self._braking[row] == (twist is None):
            return
        self._braking[row] = twist is None
        self._slew[row] = (model.brake if twist is None else model.a_max) / model.drivetrain.wheel_radius
        slowing = model.brake if twist is None else model.slowing or model.a_max
        self._slowing[row] = slowing / model.drivetrain.wheel_radius

    def push(self, push: Push) -> None:
        """Take in what passive bodies have done to a robot in the last step."""
        row = push.row
        cos, sin = cos_sin(float(self.poses[row, 2]))
        self.velocities[row] += push.vx * cos + push.vy * sin, push.w, push.vy * cos - push.vx * sin
        self.poses[row, :2] += push.dx, push.dy
        self._pushed(push)

    def cut(self) -> None:  # noqa: B027 - on the ground, wheels that are locked are all that there is
        """Switch off the rotors of all that fly, at once."""

    @property
    def masses(self) -> list[float]:
        """The mass of each robot against what it pushes, kg."""
        return [model.mass for model in self.models]

    @abstractmethod
    def step(self, dt: float) -> None:
        """Advance by dt seconds."""

    @abstractmethod
    def close(self) -> None:
        """Release what the engine holds, such as a physics client. Idempotent."""

    def row(self, name: str) -> int:
        """The row of a robot in the arrays.

        Raises:
            WorldError: there is none of that name.
        """
        try:
            return self._rows[name]
        except KeyError:
            known = ", ".join(self.names) or "none"
            raise WorldError(f"robot: expected one of those in the world ({known}), got {name!r}") from None

    def angles_of(self, row: int) -> tuple[float, ...]:
        """The angles that the axes of one robot have turned, rad."""
        return tuple(self.angles[row, : len(self.models[row].drivetrain.axes)].tolist())

    @abstractmethod
    def _placed(self, row: int) -> None:
        """Called after a robot has been put at `poses[row]`, at rest."""

    def _pushed(self, push: Push) -> None:  # noqa: B027 - most engines begin each step with these arrays
        """Called after `poses` and `velocities` of a robot were changed by a push."""

    @abstractmethod
    def _moved(self, row: int, way: float, turn: float) -> None:
        """Called after a kinematic body has been moved to `poses[row]`, by `way` in m and `turn` in rad."""

    def _accelerate(self, dt: float) -> None:
        """Move the speeds of the axes towards their targets, as far as the motors do that in dt seconds."""
        speeds = self.speeds
        if kernel is not None:
            kernel.accelerate(dt, self._targets, speeds, self._slew, self._slowing, self._sideways)
            return
        change = self._targets - speeds
        limit = np.where(change * speeds < 0.0, self._slowing, self._slew) * dt
        if self._any_sideways:
            own = change[self._sideways]
            shares = limit[self._sideways] / np.maximum(np.abs(own), 1e-12)
            change[self._sideways] = own * np.minimum(1.0, shares.min(axis=1, keepdims=True))
        np.minimum(change, limit, out=change)
        np.maximum(change, -limit, out=change)
        speeds += change


def bumper_bit(model: RobotModel, bearing: float) -> int:
    """The bit of the bumper that covers a bearing in the robot's frame (rad); 0 for a model without bumpers."""
    count = bumpers(model)
    return 1 << round(bearing / (2 * math.pi) * count) % count if count else 0


def bumpers(model: RobotModel) -> int:
    """The number of bumpers of a model's first ring, 0 where it has none."""
    touch = model.sensor(TouchSpec)
    return 0 if touch is None else touch.count
