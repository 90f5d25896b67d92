"""The traction of wheels that slip and scrub, for engines of rigid bodies.

Each wheel gets an isotropic Coulomb force. Its tyre gives way to the slip like a spring with a damper, up to the full
friction, where it slides:

    force = -friction * load * (slip / damped + stretch / GIVE), at most friction * load

The spring is what holds a robot that is pushed: a force that only grew with the slip would let locked wheels creep. A
motor presses its wheel ahead with at most DRIVE of the friction, and holds it with all of it. So a robot that stands or
brakes holds against an equal one that drives at it.

Turning in place balances the moments of lengthwise and sideways slip at

    effective track = track + wheelbase^2 / track

whatever the friction is. `skid_steer` is given the track measured with it (tests/hal/test_engines.py).
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel
from vrg.hal.models.drivetrain import Wheel
from vrg.hal.sim.compiled import kernel
from vrg.hal.sim.engines.engine import DRIVE, Floats, Start
from vrg.portable.arrays import hypot
from vrg.portable.scalars import cos_sin, square, total

MAX_PHYSICS_STEP = 0.01
"""The longest physics step, s."""
DAMPING = 1.25
"""The part of a wheel's slip that the damping of the tyres undoes in one physics step. From nearly 2 on it swings
up."""
GIVE = 0.005
"""The stretch in m at which the spring of a tyre alone is its full friction."""


class Traction:
    """The traction of all robots at once.

    Its arrays have a column for each robot, and before it a row for each wheel, and before that one for the slip along
    the way of a wheel and one for that across it. A robot with fewer wheels than another one has wheels that press
    nothing in the last rows.

    Args:
        robots: all robots of an engine.
    """

    def __init__(self, robots: Sequence[Start]) -> None:
        models = [robot.model for robot in robots]
        wheels = [_driven(model) for model in models]
        shape = max(map(len, wheels), default=0), len(robots)
        self._ways: Floats = np.zeros((3, 2, *shape))
        """The slip for each unit of a body's speed ahead, speed to the left and turn rate; so also the force ahead, the
        force to the left and the moment for each unit of a push."""
        self._stretches: Floats = np.zeros((2, *shape))
        """The stretch of the tyres, as a fraction of GIVE."""
        columns = max((len(model.drivetrain.axes) for model in models), default=0)
        self._axes: npt.NDArray[np.intp] = np.full(shape, np.arange(len(robots)) * columns, dtype=np.intp)
        """The axis of each wheel, as the number of its speed among those of all axes of all robots."""
        for row, own in enumerate(wheels):
            for n, (wheel, axis) in enumerate(own):
                (c, s), held = cos_sin(wheel.heading), float(not wheel.rollers)
                ahead, aside = (c, s, wheel.x * s - wheel.y * c), (-s, c, wheel.x * c + wheel.y * s)
                self._ways[:, 0, n, row] = ahead
                self._ways[:, 1, n, row] = [held * way for way in aside]
                self._axes[n, row] += axis
        self._radii: Floats = np.array([model.drivetrain.wheel_radius for model in models])
        self._damped: Floats = np.array([damped_slip(model) for model in models])
        """The slip of each robot in m/s at which the damping of a tyre alone is its full friction."""
        # The friction that gives the model's brake, times the load of a wheel that a motor can hold.
        self._grips: Floats = np.array(
            [
                0.0 if robot.kinematic else robot.model.brake * robot.model.mass / len(own)
                for robot, own in zip(robots, wheels, strict=True)
            ]
        )
        """The full friction of a wheel of each robot, N; those of a kinematic body press nothing."""

    def release(self, row: int) -> None:
        """Undo the stretch of a robot's tyres, as it is put somewhere at rest."""
        self._stretches[..., row] = 0.0

    def rims(self, speeds: Floats) -> Floats:
        """The speeds of the rims of all wheels, m/s, for the speeds of the axes: shape (robots, axes), rad/s."""
        return speeds.take(self._axes) * self._radii

    def press(self, dt: float, cos: Floats, sin: Floats, velocities: Floats, rims: Floats, forces: Floats) -> None:
        """Stretch the tyres for the next physics step, and compute what the wheels press with.

        Args:
            dt: the length of the physics step, s. cos, sin: those of the headings of the bodies.
            velocities: shape (robots, 3): the speeds of the bodies along x and y in m/s, and their turn rates in rad/s.
            rims: the speeds of the rims of all wheels, m/s.
            forces: shape (robots, 3): is given the forces on the bodies along x and y in N, and the moments in N m.
        """
        if kernel is not None:
            kernel.press(
                dt, GIVE, DRIVE, cos, sin, velocities, rims,
                self._ways, self._damped, self._grips, self._stretches, forces,
            )  # fmt: skip
            return
        ways, (vx, vy, w) = self._ways, velocities.T
        slips = ways[0] * (vx * cos + vy * sin) + ways[1] * (vy * cos - vx * sin) + ways[2] * w
        turning = np.sign(rims)
        rolling = slips[0] * turning > 0.0
        slips[0] -= rims
        self._stretches += slips * (dt / GIVE)
        slips /= -self._damped
        pushes = slips - self._stretches  # as fractions of a wheel's friction
        sizes = hypot(pushes[0], pushes[1])
        pushes /= np.maximum(sizes, 1.0)
        driven = rolling & (pushes[0] * turning > DRIVE)
        np.copyto(pushes[0], turning * DRIVE, where=driven)
        # The spring of a tyre that slides gives what the damper leaves of the force.
        spring_share = np.minimum(0.0, hypot(slips[0], slips[1]) - 1.0)
        np.copyto(self._stretches, pushes * spring_share, where=driven | (sizes > 1.0))
        parts = ways[:, 0] * pushes[0] + ways[:, 1] * pushes[1]
        ahead, aside, moments = parts.cumsum(axis=1)[:, -1] * self._grips  # a sum has no fixed order
        forces[:] = np.array((ahead * cos - aside * sin, ahead * sin + aside * cos, moments)).T


def _driven(model: RobotModel) -> list[tuple[Wheel, int]]:
    """The wheels that motors turn, with their axes."""
    return [(wheel, wheel.axis) for wheel in model.drivetrain.wheels if wheel.axis is not None]


def damped_slip(model: RobotModel) -> float:
    """The slip in m/s at which the damping of a tyre alone is its full friction.

    The less inertia a body has, the more a physics step of friction changes the slip, when it turns above all.
    """
    inertia = (square(model.length) + square(model.width)) / 12
    wheels = _driven(model)
    turning = total(square(wheel.x) + square(wheel.y) for wheel, _ in wheels)
    return model.brake * MAX_PHYSICS_STEP * max(1.0, turning / len(wheels) / inertia) / DAMPING
