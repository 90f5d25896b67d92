"""A drive base: the motors of a robot as the axes of its drivetrain, and odometry by their encoders."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from msgspec import Struct

from vrg.geometry import along_arc, wrap
from vrg.hal.can.plausibility import SLUGGISH, MotorLimits, was_restarted
from vrg.hal.models import RobotModel
from vrg.portable.scalars import total
from vrg.types import Pose, Twist

TURN = math.tau
"""One turn in rad."""
_OVERSPEED = 1.5
"""The number of times its top speed above which the speed of a motor is disbelieved."""
_JUMP_SLACK = 0.25
"""s that a frame may be late. Its content is then older than it looks, and the next one seems to come from far."""


@dataclass(frozen=True, slots=True)
class WheelAxis:
    """The way in which one motor turns one axis of the drivetrain.

    Args:
        node: the id of its drive. axis: the number of the axis, which others may turn with it.
        direction: 1 where a positive motor speed is one of the axis, which drives a left or right wheel ahead; else -1.
        ratio: turns of the motor for one turn of the wheel.
        serial: the serial number of the drive with which this was measured; empty where that is not known.
    """

    node: int
    axis: int
    direction: int = 1
    ratio: float = 1.0
    serial: str = ""


class EncoderEstimate(Struct, frozen=True):
    """A position and a velocity of the motor from its encoder, in turns and turn/s, at monotonic time `at`, s."""

    position: float
    velocity: float
    at: float


class DriveBase:
    """The motors of one robot as the axes of its drivetrain, and its odometry. It has no bus and no clock.

    Args:
        axes: how the motors are wired; an axis without any stands, as where one motor is tried alone.
        model: its drivetrain and top speed are used.

    Attributes:
        bounds: what the motor of each node can do.
        pose: the pose by odometry, which is (0, 0, 0) where the robot was when `restart` was called.
        angles: the angles that the axes of the drivetrain have turned since then, rad.
    """

    def __init__(self, axes: Sequence[WheelAxis], model: RobotModel) -> None:
        self.axes = tuple(axes)
        self._model = model
        self._axis_of = {axis.node: axis for axis in axes}
        self.bounds = {axis.node: _bounds(axis, model) for axis in axes}
        self._last: dict[int, EncoderEstimate] = {}
        self._moved: dict[int, float] = {}
        self.pose = Pose(0.0, 0.0, 0.0)
        self._by_axis = [[a for a in axes if a.axis == number] for number in range(len(model.drivetrain.axes))]
        self.angles = (0.0,) * len(self._by_axis)

    def restart(self) -> None:
        """Start again at (0, 0, 0)."""
        self.pose, self.angles = Pose(0.0, 0.0, 0.0), (0.0,) * len(self._by_axis)
        self.rebase()

    def rebase(self) -> None:
        """Take whatever the encoders say next as where the wheels are now: none has moved."""
        self._last.clear()
        self._moved.clear()

    def setpoints(self, twist: Twist) -> list[tuple[int, float]]:
        """The motor speed of each node in turn/s, for a motion of the body."""
        speeds = self._model.drivetrain.speeds(twist)
        return [(axis.node, speeds[axis.axis] / TURN * axis.direction * axis.ratio) for axis in self.axes]

    def speeds(self, velocities: Mapping[int, float]) -> tuple[float, ...]:
        """The speeds of the drivetrain's axes in rad/s, for motor speeds by node in turn/s.

        The speed of an axis is the mean of its motors.
        """
        return self._means({a.node: velocities[a.node] * TURN * a.direction / a.ratio for a in self.axes})

    def update(self, node: int, estimate: EncoderEstimate, turns: float = 0.0) -> float | None:
        """Take in one encoder's estimate; the pose moves on once all have one more.

        A position is only ever compared with the one before: how coarse a float32 has become far from zero adds up to
        nothing, as what one difference is short of is in the next.

        Args:
            node: the node of the encoder. estimate: its value.
            turns: the number of turns after which the position starts again; 0 = never.

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
        if was_restarted(estimate.at - last.at, estimate.position, way, last.velocity, bounds.slip):
            return None
        fastest = min(max(abs(last.velocity), abs(estimate.velocity)), _OVERSPEED * bounds.speed)
        if abs(way) > bounds.slip + fastest * (max(0.0, estimate.at - last.at) + _JUMP_SLACK):
            return None
        self._moved[node] = self._moved.get(node, 0.0) + way * TURN * axis.direction / axis.ratio
        if len(self._moved) == len(self.axes):
            self._advance()
        return way

    def _advance(self) -> None:
        turned = self._means(self._moved)
        self._moved.clear()
        self.angles = tuple(before + angle for before, angle in zip(self.angles, turned, strict=True))
        # Angles in place of speeds give a way and a turn in place of velocities.
        pose = along_arc(self.pose, self._model.drivetrain.twist(turned), 1.0)
        self.pose = Pose(pose.x, pose.y, wrap(pose.theta))

    def _means(self, of_nodes: Mapping[int, float]) -> tuple[float, ...]:
        """The mean of each axis's motors; 0 for one without any."""
        return tuple(total(of_nodes[a.node] for a in own) / len(own) if own else 0.0 for own in self._by_axis)


def _bounds(axis: WheelAxis, model: RobotModel) -> MotorLimits:
    """The limits of the motor of an axis."""
    per_metre = abs(axis.ratio) / model.drivetrain.wheel_radius / TURN
    change = SLUGGISH * min(model.a_max, model.slowing or model.a_max)
    return MotorLimits(model.v_max * per_metre, change * per_metre)
