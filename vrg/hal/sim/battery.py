"""A model of the robots' batteries: an energy balance. It uses no bus and no clock."""

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel

GRAVITY = 9.81
"""The acceleration of gravity in m/s^2."""

Floats = npt.NDArray[np.float64]


class Batteries:
    """The batteries of a fleet of robots. Each array has one row per robot.

    Energy drawn = idle power * time + (rolling resistance * way + gain of kinetic energy) / efficiency. Braking does
    not charge the battery, and the friction of skidding wheels in a turn is not counted. The way is that of the wheels,
    by the scale at which it is the body's own straight ahead.

    Args:
        models: the models of the robots.
        used: shape (robots,): the energy drawn since each battery was full, J.
        angles: shape (robots, axes): the angles turned so far, rad.
        velocities: shape (robots, 3): v, w and the speed to the left now, m/s and rad/s.
    """

    def __init__(self, models: list[RobotModel], used: Floats, angles: Floats, velocities: Floats) -> None:
        self.used = used
        self._capacity = np.array([m.battery_wh * 3600.0 for m in models])
        self._idle = np.array([m.idle_w for m in models])
        self._drag = np.array([m.mass * GRAVITY * m.rolling / m.drive_efficiency for m in models])
        self._inertia = np.array([m.mass / 2 / m.drive_efficiency for m in models])
        self._per_rad = np.array([1 / sum(abs(ahead) for ahead, _, _ in m.drivetrain.rates) for m in models])
        self._angles, self._squared = angles.copy(), _squared_speed(velocities)

    @property
    def charge(self) -> Floats:
        """The charge of each battery: shape (robots,), from 1 (full) to 0 (empty)."""
        charge: Floats = np.maximum(1.0 - self.used / self._capacity, 0.0)
        return charge

    def draw(self, dt: float, angles: Floats, velocities: Floats) -> None:
        """Subtract the energy that the robots have drawn in the dt seconds since the last call; see the class."""
        way = np.abs(angles - self._angles).sum(axis=1) * self._per_rad
        squared = _squared_speed(velocities)
        gain = np.maximum(squared - self._squared, 0.0)
        self.used += self._idle * dt + self._drag * way + self._inertia * gain
        self._angles, self._squared = angles.copy(), squared

    def place(self, row: int) -> None:
        """Take note that a robot was put somewhere at rest, so that the change of its speed costs no energy."""
        self._squared[row] = 0.0


def _squared_speed(velocities: Floats) -> Floats:
    squared: Floats = velocities[:, 0] ** 2 + velocities[:, 2] ** 2
    return squared
