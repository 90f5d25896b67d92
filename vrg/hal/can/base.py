"""A drive base: two or four motor axes as a robot's left and right wheels, and odometry by their encoders."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from msgspec import Struct

from vrg.geometry import wrap
from vrg.hal.can.plausibility import SLUGGISH, Bounds
from vrg.hal.models import RobotModel
from vrg.types import Pose

TURN = math.tau
"""One turn in rad."""
_OVERSPEED = 1.5
"""How many times faster than its top speed a motor may be before its speed is disbelieved."""
_JUMP_SLACK = 0.25
"""s that a frame may be late. What it says is then older than it looks, and the next one seems to come from far."""


@dataclass(frozen=True, slots=True)
class WheelAxis:
    """How one motor drives one side.

    Args:
        node: the id of its drive. left: it is on the left side.
        direction: 1 where a positive motor speed drives ahead, -1 where it drives back.
        ratio: turns of the motor for one turn of the wheel.
    """

    node: int
    left: bool
    direction: int = 1
    ratio: float = 1.0


class Estimate(Struct, frozen=True):
    """What an encoder said: position and velocity of the motor, in turns and turn/s, at monotonic time `at`, s."""

    position: float
    velocity: float
    at: float


class DriveBase:
    """See the module. It has no bus and no clock.

    Args:
        axes: one or two on each side; a side without any stands, as where one motor is tried alone.
        model: its wheel radius, effective track and top speed are used.

    Attributes:
        bounds: what the motor of each node can do.
        pose: the pose by odometry, which is (0, 0, 0) where the robot was when `restart` was called.
        angles: the angles that the left and the right wheels have turned since then, rad.
    """

    def __init__(self, axes: Sequence[WheelAxis], model: RobotModel) -> None:
        self.axes = tuple(axes)
        self._model = model
        self._axis_of = {axis.node: axis for axis in axes}
        self.bounds = {axis.node: _bounds(axis, model) for axis in axes}
        self._last: dict[int, Estimate] = {}
        self._moved: dict[int, float] = {}
        self.pose = Pose(0.0, 0.0, 0.0)
        self.angles = (0.0, 0.0)

    def restart(self) -> None:
        """Begin anew at (0, 0, 0)."""
        self.pose, self.angles = Pose(0.0, 0.0, 0.0), (0.0, 0.0)
        self.rebase()

    def rebase(self) -> None:
        """Take whatever the encoders say next as where the wheels are now: none has moved."""
        self._last.clear()
        self._moved.clear()

    def setpoints(self, left: float, right: float) -> list[tuple[int, float]]:
        """The motor speed of each node in turn/s, for wheel speeds in rad/s."""
        return [(axis.node, (left if axis.left else right) / TURN * axis.direction * axis.ratio) for axis in self.axes]

    def wheels(self, velocities: Mapping[int, float]) -> tuple[float, float]:
        """The speeds of the left and the right wheels in rad/s, for motor speeds by node in turn/s.

        The speed of a side is the mean of its motors.
        """
        sides: tuple[list[float], list[float]] = ([], [])
        for axis in self.axes:
            sides[0 if axis.left else 1].append(velocities[axis.node] * TURN * axis.direction / axis.ratio)
        return _mean(sides[0]), _mean(sides[1])

    def update(self, node: int, estimate: Estimate, turns: float = 0.0) -> float | None:
        """Take in one encoder's estimate; the pose moves on once all have one more.

        A position is only ever compared with the one before: how coarse a float32 has become far from zero adds up to
        nothing, as what one difference is short of is in the next.

        Args:
            node: whose encoder. estimate: what it said.
            turns: the number of turns after which the position begins anew; 0 = never.

        Returns:
            how far the motor has turned since the estimate before, turns; None where it could not have turned that far
            at the speeds that were measured, as after a start of the drive. The position is then taken for the old one.
        """
        axis = self._axis_of[node]
        last, self._last[node] = self._last.get(node), estimate
        if last is None:
            return 0.0
        way = estimate.position - last.position
        if turns:
            way = math.remainder(way, turns)
        bounds = self.bounds[node]
        fastest = min(max(abs(last.velocity), abs(estimate.velocity)), _OVERSPEED * bounds.speed)
        if abs(way) > bounds.slip + fastest * (max(0.0, estimate.at - last.at) + _JUMP_SLACK):
            return None
        self._moved[node] = self._moved.get(node, 0.0) + way * TURN * axis.direction / axis.ratio
        if len(self._moved) == len(self.axes):
            self._advance()
        return way

    def _advance(self) -> None:
        left = _mean([self._moved[a.node] for a in self.axes if a.left])
        right = _mean([self._moved[a.node] for a in self.axes if not a.left])
        self._moved.clear()
        self.angles = (self.angles[0] + left, self.angles[1] + right)
        # Wheel angles in place of speeds give a way and a turn in place of velocities.
        moved = self._model.drivetrain.twist((left, right))
        way, turn = moved.v, moved.w
        middle = self.pose.theta + turn / 2
        self.pose = Pose(
            self.pose.x + way * math.cos(middle),
            self.pose.y + way * math.sin(middle),
            wrap(self.pose.theta + turn),
        )


def _bounds(axis: WheelAxis, model: RobotModel) -> Bounds:
    """What the motor of an axis can do."""
    per_metre = abs(axis.ratio) / model.drivetrain.wheel_radius / TURN
    change = SLUGGISH * min(model.a_max, model.brake)
    return Bounds(model.v_max * per_metre, change * per_metre)


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else 0.0
