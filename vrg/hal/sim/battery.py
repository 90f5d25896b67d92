"""A robot's battery as an energy balance. Pure."""

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel

GRAVITY = 9.81
"""m/s^2."""

Floats = npt.NDArray[np.float64]


class BatteryModel:
    """What a fleet of robots draws, one entry a robot.

    Energy drawn = idle power * time + (rolling resistance * way + gain of kinetic energy) / efficiency. Braking gives
    nothing back, and the scrub of skidding wheels in a turn is not counted.
    """

    def __init__(self, models: list[RobotModel]) -> None:
        self.capacity: Floats = np.array([m.battery_wh * 3600.0 for m in models])
        """Energy of the full batteries, J."""
        self._idle = np.array([m.idle_w for m in models])
        self._drag = np.array([m.mass * GRAVITY * m.rolling / m.drive_efficiency for m in models])
        self._inertia = np.array([m.mass / 2 / m.drive_efficiency for m in models])

    def energy(self, dt: float, way: Floats, v_before: Floats, v_after: Floats) -> Floats:
        """Energy drawn in dt seconds, J.

        Args:
            way: shape (robots,): m driven, either direction. v_before, v_after: m/s at both ends of the time.
        """
        gain = np.maximum(v_after * v_after - v_before * v_before, 0.0)
        drawn: Floats = self._idle * dt + self._drag * way + self._inertia * gain
        return drawn
