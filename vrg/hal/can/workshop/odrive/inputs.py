"""How an ODrive approaches a setpoint: its input modes, as a pure model of numbers.

Source: ODrive's documentation of the controller, firmware 0.6 (InputMode).
"""

import enum
import math


class InputMode(enum.IntEnum):
    """What is done to a setpoint before it is followed."""

    INACTIVE = 0
    PASSTHROUGH = 1
    VEL_RAMP = 2
    POS_FILTER = 3
    TRAP_TRAJ = 5
    TORQUE_RAMP = 6


class Filter:
    """A critically damped filter of the second order, which POS_FILTER sends a position through.

    Args:
        bandwidth: 1/s.
    """

    def __init__(self, bandwidth: float) -> None:
        self.bandwidth = bandwidth
        self.position = 0.0
        self.velocity = 0.0

    def follow(self, aim: float, dt: float) -> float:
        """The filtered position, turns, `dt` s later."""
        # The exact solution of x'' = w^2 (aim - x) - 2 w x', so that long steps do no harm.
        w = self.bandwidth
        offset = self.position - aim
        slope = self.velocity + w * offset
        decay = math.exp(-w * dt)
        self.position = aim + (offset + slope * dt) * decay
        self.velocity = (slope - w * (offset + slope * dt)) * decay
        return self.position


class Trajectory:
    """A move of a trapezoid of velocities, which TRAP_TRAJ makes.

    Args:
        velocity: the highest, turn/s. acceleration, deceleration: turn/s^2.
    """

    def __init__(self, velocity: float, acceleration: float, deceleration: float) -> None:
        self._most = velocity
        self._acceleration = acceleration
        self._deceleration = deceleration
        self.position = 0.0
        self.velocity = 0.0
        self.done = True

    def follow(self, aim: float, dt: float) -> float:
        """The position on the way, turns, `dt` s later."""
        left = aim - self.position
        ahead = math.copysign(1.0, left)
        speed = self.velocity * ahead
        # As fast as still lets it stop in time.
        wanted = min(self._most, math.sqrt(max(0.0, 2.0 * self._deceleration * abs(left))))
        step = (self._acceleration if wanted > speed else self._deceleration) * dt
        speed += max(-step, min(step, wanted - speed))
        way = speed * dt
        self.done = way >= abs(left)
        if self.done:
            self.position, self.velocity = aim, 0.0
        else:
            self.position += way * ahead
            self.velocity = speed * ahead
        return self.position
