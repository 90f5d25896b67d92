"""The body of an emulated Crazyflie: how it moves, falls and uses up its battery."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from vrg_crazyflie.emulated.supervisor import State, Supervisor
from vrg_crazyflie.emulated.wire import OFF, Mode, Setpoint
from vrg_crazyflie.report import LOW_POWER, Info

STEP: Final = 0.01
"""The time in s from one state to the next."""
G: Final = 9.81
"""m/s^2."""
TILT_ACCELERATION: Final = G * math.tan(math.radians(20.0))
"""The most that it accelerates level, m/s^2: at the tilt of PID_VEL_ROLL_MAX (platform_defaults_cf2.h)."""
RESPONSE: Final = 1.0 / (G * math.radians(25.0))
"""The time constant in s of its velocity: PID_VEL_X_KP tilts it by 25 degrees for each m/s that is missing, 0.23 s. How
soon it tilts, and what the controller integrates, are left out."""
CLIMB_RESPONSE, TURN_RESPONSE, DRAG = 0.15, 0.1, 1.5
"""The time constants in s of its vertical velocity, of its turn rate, and of its drift while nothing holds it:
estimates."""
POSITION_GAIN, CLIMB_LIMIT, SPEED_LIMIT = 2.0, 1.0, 1.0
"""The speed in m/s that the controller wants for each metre that is missing, and the most that it wants upwards and
level (PID_POS_X_KP, PID_POS_Z_KP, PID_POS_VEL_X_MAX, PID_POS_VEL_Z_MAX)."""
HOVER_POWER, IDLE_POWER, ENERGY = 7.5, 0.5, 0.925
"""The power in W with and without thrust, and the battery's energy in Wh: it hovers for 7 minutes."""
LOW_TIME: Final = 5.0
"""The time in s for which the battery is low before the firmware says so, or switches everything off
(DEFAULT_BAT_LOW_DURATION_TO_TRIGGER_SEC)."""
CRITICAL_VOLTAGE: Final = 3.0
"""The voltage in V below which everything is switched off (DEFAULT_BAT_CRITICAL_LOW_VOLTAGE)."""
HOVER_THRUST: Final = 36000.0
"""What the controller asks of the motors while it hovers, of 65535 (PID_VEL_THRUST_BASE)."""
TUMBLE_TIME: Final = 0.3
"""The time in s in which it turns over if a propeller is blocked in the air: an estimate."""
UPSET: Final = math.radians(60.0)
"""The tilt in rad from which its thrust no longer carries it."""


@dataclass(frozen=True)
class Plan:
    """A trajectory of the high-level commander from rest to rest. The firmware plans with polynomials of the seventh
    degree; these have the fifth.

    Args:
        began: its beginning, s. duration: s. start, end: x, y and z in m, and the heading in rad.
        lands: True if the motors are off at its end.
    """

    began: float
    duration: float
    start: Sequence[float]
    end: Sequence[float]
    lands: bool

    def at(self, now: float) -> tuple[float, ...]:
        """The position and the heading at a time."""
        s = min(1.0, max(0.0, (now - self.began) / self.duration))
        share = s**3 * (10.0 + s * (6.0 * s - 15.0))
        return tuple(a + (b - a) * share for a, b in zip(self.start, self.end, strict=True))


class Vehicle:
    """The body, its controller, and the firmware's supervisor. Its frame is that in which its estimator began.

    Args:
        response: the time constant of its velocity, s. auto_arm: see `Supervisor`.

    Attributes:
        plan: the trajectory of the high-level commander; None while that is stopped: then it switches the motors off.
        low_level: True while set-points of a client outrank it.
        error: what the estimator adds to x, y and z, m. blocked: True while a propeller is blocked.
        sag: by how much it flies too low, as its thrust does not suffice, m.
    """

    def __init__(self, *, response: float = RESPONSE, auto_arm: bool = True) -> None:
        self.response, self.auto_arm = response, auto_arm
        self.z = self.vz = self.tilt = self.sag = 0.0
        self.charge = 1.0
        self.blocked = False
        self.low_voltage = 3.2
        self.powered = True
        self.boot()

    def boot(self) -> None:
        """Begin anew, as after it is switched on: the estimator's frame is where it stands."""
        self.x = self.y = self.yaw = self.vx = self.vy = self.w = 0.0
        self.error = [0.0, 0.0, 0.0]
        self.now = 0.0
        self.supervisor = Supervisor(auto_arm=self.auto_arm)
        self.setpoint, self.commanded, self.low_level = OFF, 0.0, False
        self.plan: Plan | None = None
        self.power = 0
        self._low_since = self._critical_since = 0.0

    @property
    def thrust(self) -> float:
        """What the controller asks of the motors, of 65535."""
        return HOVER_THRUST if self.supervisor.able and self.setpoint.mode is not Mode.OFF and self.powered else 0.0

    @property
    def volts(self) -> float:
        """The battery's voltage: an estimate for a cell of lithium polymer under this load."""
        return 3.0 + 1.15 * math.pow(max(0.0, self.charge), 0.3) - (0.25 if self.thrust else 0.0)

    @property
    def info(self) -> Info:
        """The bits that the supervisor reports."""
        is_finished = self.plan is None or self.now >= self.plan.began + self.plan.duration
        planning = Info(0) if self.plan is None else Info.PLAN_ACTIVE
        return self.supervisor.info(planning | (Info.PLAN_FINISHED if is_finished else Info(0)))

    def command(self, setpoint: Setpoint) -> None:
        """Take a set-point of a client, which stops the high-level commander."""
        self.setpoint, self.commanded, self.low_level, self.plan = setpoint, self.now, True, None

    def fly_to(self, end: Sequence[float], duration: float, *, lands: bool = False) -> bool:
        """Plan a trajectory from here; return False if the supervisor forbids to fly, or it already lands."""
        if not self.supervisor.able or (lands and self.plan is not None and self.plan.lands):
            return False
        self.plan = Plan(self.now, max(duration, STEP), (*self.estimate, self.yaw), end, lands)
        return True

    @property
    def estimate(self) -> tuple[float, float, float]:
        """The position that the estimator has found, m."""
        return self.x + self.error[0], self.y + self.error[1], self.z + self.error[2]

    def step(self) -> None:
        """Let STEP pass."""
        self.now += STEP
        self._plan()
        up = math.cos(self.tilt) if self.z <= 0.0 else 1.0 if self.thrust else 0.0
        if round(self.now / STEP) % 4 == 0:  # 25 Hz
            age = self.now - self.commanded
            self.supervisor.update(self.now, thrust=self.thrust > 0.0, up=up, age=age)
        self._use_up()
        if self.thrust and self.blocked and self.z > 0.0:
            self.tilt = min(math.pi, self.tilt + math.pi * STEP / TUMBLE_TIME)
        if self.thrust and self.tilt < UPSET and not (self.blocked and self.z <= 0.0):
            self._fly()
        else:
            self.vz -= G * STEP
        self._move()

    def _plan(self) -> None:
        """Take the set-point of the high-level commander, unless a client's outranks it."""
        if not self.supervisor.able:
            self.plan = None
        elif not self.low_level:
            self.commanded = self.now
            self.setpoint = OFF if self.plan is None else Setpoint(Mode.POSITION, *self.plan.at(self.now))
            if self.plan is not None and self.plan.lands and Info.PLAN_FINISHED in self.info:
                self.plan = None

    def _fly(self) -> None:
        told, (x, y, z) = self.setpoint, self.estimate
        mode = told.mode
        levelling = self.supervisor.state is State.LEVELLING
        turn = 0.0 if levelling else told.yaw
        if mode is Mode.POSITION:
            turn = POSITION_GAIN * math.remainder(told.yaw - self.yaw, math.tau)
        if levelling or mode is Mode.LEVEL:
            self.vx, self.vy = (v - v * STEP / DRAG for v in (self.vx, self.vy))
        elif mode is Mode.POSITION:
            self._pull(*(_clamp(POSITION_GAIN * gap, SPEED_LIMIT) for gap in (told.x - x, told.y - y)))
        elif mode is Mode.HOVER:
            cos, sin = math.cos(self.yaw), math.sin(self.yaw)
            self._pull(cos * told.x - sin * told.y, sin * told.x + cos * told.y)
        else:
            self._pull(told.x, told.y)
        climb = told.z if mode is Mode.VELOCITY else _clamp(POSITION_GAIN * (told.z - self.sag - z), CLIMB_LIMIT)
        self.vz += (climb - self.vz) * STEP / CLIMB_RESPONSE
        self.w += (turn - self.w) * STEP / TURN_RESPONSE

    def _pull(self, vx: float, vy: float) -> None:
        """Accelerate towards a velocity, m/s."""
        ax, ay = (vx - self.vx) / self.response, (vy - self.vy) / self.response
        share = min(1.0, TILT_ACCELERATION / max(math.hypot(ax, ay), 1e-9))
        self.vx, self.vy = self.vx + ax * share * STEP, self.vy + ay * share * STEP

    def _move(self) -> None:
        self.z += self.vz * STEP
        if self.z <= 0.0:
            self.z = self.vz = self.vx = self.vy = self.w = 0.0
        self.x, self.y = self.x + self.vx * STEP, self.y + self.vy * STEP
        self.yaw = math.remainder(self.yaw + self.w * STEP, math.tau)

    def _use_up(self) -> None:
        """Let the battery empty, and the firmware see to it."""
        self.charge = max(0.0, self.charge - (HOVER_POWER if self.thrust else IDLE_POWER) * STEP / 3600.0 / ENERGY)
        # The times at which it was last not low.
        self._low_since = self._low_since if self.volts < self.low_voltage else self.now
        self._critical_since = self._critical_since if self.volts < CRITICAL_VOLTAGE else self.now
        self.power = LOW_POWER[0] if self.now - self._low_since > LOW_TIME else 0
        self.powered = self.powered and self.now - self._critical_since <= LOW_TIME


def _clamp(value: float, limit: float) -> float:
    return min(limit, max(-limit, value))
