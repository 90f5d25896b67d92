"""A motor with its load, under a drive's current control, as a pure model of numbers."""

import math
from collections import deque
from dataclasses import dataclass

from vrg.portable.scalars import exp

_STEP = 0.002
"""The longest step of integration, s."""
_LONGEST = 1.0
"""The most simulated time that one call makes up for, s."""


@dataclass(frozen=True, kw_only=True)
class MotorModel:
    """A motor and its load. The defaults drive one side of a 20 kg robot through a 50:1 gear.

    Args:
        inertia: moment of inertia of rotor and load at the shaft, kg m^2.
        torque_constant: torque for each ampere, Nm/A. current_limit: highest current, A.
        friction: Coulomb friction at the shaft, Nm.
        response: time constant of the velocity loop, s.
        braking: time constant with the drive off, s: of shorted phases by default, and much longer where it coasts.
        velocity_limit: highest velocity, turn/s. delay: from a setpoint to when the drive acts on it, s.
    """

    inertia: float = 9e-4
    torque_constant: float = 0.04
    current_limit: float = 12.0
    friction: float = 0.02
    response: float = 0.02
    braking: float = 0.03
    velocity_limit: float = 120.0
    delay: float = 0.0


class Motor:
    """A motor with its load, under a drive's current control.

    Attributes:
        position, velocity: of the shaft, in turns and turn/s. current: A.
        current_limit, velocity_limit: as in the model, until a master changes them.
        blocked: something holds the wheel. stuck: it turns on when it is switched off.
        excess: how many times as fast as it is asked the motor turns.
    """

    def __init__(self, model: MotorModel) -> None:
        self.model = model
        self.current_limit = model.current_limit
        self.velocity_limit = model.velocity_limit
        self.position = 0.0
        self.velocity = 0.0
        self.current = 0.0
        self.blocked = self.stuck = False
        self.excess = 1
        self._now = 0.0
        self._asked: deque[tuple[float, float]] = deque()
        """The velocities that it is still to aim for, and when, on a clock of its own; the first one is due."""

    @property
    def torque(self) -> float:
        """The torque of the motor, Nm."""
        return self.current * self.model.torque_constant

    def coast(self, dt: float) -> None:
        """Let `dt` seconds pass with the drive off: the motor comes to a halt by and by."""
        self.current = 0.0
        self._asked.clear()
        if self.blocked:
            self.velocity = 0.0
        if self.stuck:
            self.position += self.velocity * dt
            return
        decay = exp(-dt / self.model.braking)
        self.position += self.velocity * self.model.braking * (1 - decay)
        self.velocity *= decay

    def turn(self, dt: float, velocity: float) -> None:
        """Let `dt` seconds pass while the drive aims for a velocity in turn/s."""
        if not self.model.delay:
            self._turn(dt, velocity)
            return
        if not self._asked:
            self._asked.append((self._now, 0.0))
        if self._asked[-1][1] != velocity:
            self._asked.append((self._now + self.model.delay, velocity))
        end = self._now + max(0.0, min(dt, _LONGEST))
        while self._now < end:
            while len(self._asked) > 1 and self._asked[1][0] <= self._now:
                self._asked.popleft()
            until = min(end, self._asked[1][0]) if len(self._asked) > 1 else end
            self._turn(until - self._now, self._asked[0][1])
            self._now = until

    def _turn(self, dt: float, velocity: float) -> None:
        target = max(-self.velocity_limit, min(self.velocity_limit, velocity * self.excess))
        gain = self.model.inertia * math.tau / (self.model.response * self.model.torque_constant)
        for step in _steps(dt):
            drag = math.copysign(self.model.friction, target) / self.model.torque_constant if target else 0.0
            self._push(gain * (target - self.velocity) + drag, step)

    def pull(self, dt: float, torque: float) -> None:
        """Let `dt` seconds pass while the drive holds a torque in Nm."""
        for step in _steps(dt):
            self._push(torque / self.model.torque_constant, step)

    def _push(self, current: float, dt: float) -> None:
        self.current = max(-self.current_limit, min(self.current_limit, current))
        torque = self.current * self.model.torque_constant
        if self.blocked:
            self.velocity = 0.0
            return
        friction = self.model.friction
        if self.velocity == 0.0 and abs(torque) <= friction:
            return
        torque -= math.copysign(friction, self.velocity or torque)
        before = self.velocity
        self.velocity += torque / self.model.inertia / math.tau * dt
        if before * self.velocity < 0.0 and abs(self.torque) <= friction:
            self.velocity = 0.0  # friction stops, it does not push back
        self.position += (before + self.velocity) / 2 * dt


def _steps(dt: float) -> list[float]:
    dt = max(0.0, min(dt, _LONGEST))
    count = max(1, math.ceil(dt / _STEP))
    return [dt / count] * count
