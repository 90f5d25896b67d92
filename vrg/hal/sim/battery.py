"""A robot's battery as an energy balance. Pure."""

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel

GRAVITY = 9.81
"""m/s^2."""

Floats = npt.NDArray[np.float64]


class Batteries:
    """The batteries of a fleet, one row a robot.

    Energy drawn = idle power * time + (rolling resistance * way + gain of kinetic energy) / efficiency. Braking gives
    nothing back, and the scrub of skidding wheels in a turn is not counted.

    Args:
        used: shape (robots,): energy drawn since each was full, J.
        wheels: shape (robots, 2): angles turned so far, rad. v: shape (robots,): speeds now, m/s.
    """

    def __init__(self, models: list[RobotModel], used: Floats, wheels: Floats, v: Floats) -> None:
        self.used = used
        self._capacity = np.array([m.battery_wh * 3600.0 for m in models])
        self._idle = np.array([m.idle_w for m in models])
        self._drag = np.array([m.mass * GRAVITY * m.rolling / m.drive_efficiency for m in models])
        self._inertia = np.array([m.mass / 2 / m.drive_efficiency for m in models])
        self._radius = np.array([m.wheel_radius for m in models])
        self._wheels, self._v = wheels.copy(), v.copy()

    @property
    def charge(self) -> Floats:
        """Shape (robots,): 1 full to 0 empty."""
        charge: Floats = np.maximum(1.0 - self.used / self._capacity, 0.0)
        return charge

    def draw(self, dt: float, wheels: Floats, v: Floats) -> None:
        """Account for the dt seconds since the last call.

        Args:
            wheels: shape (robots, 2): angles turned, rad. v: shape (robots,): speeds now, m/s.
        """
        way = np.abs(wheels - self._wheels).sum(axis=1) / 2 * self._radius
        gain = np.maximum(v * v - self._v * self._v, 0.0)
        self.used += self._idle * dt + self._drag * way + self._inertia * gain
        self._wheels, self._v = wheels.copy(), v.copy()

    def place(self, row: int) -> None:
        """A robot was put somewhere at rest: its standstill cost nothing."""
        self._v[row] = 0.0
