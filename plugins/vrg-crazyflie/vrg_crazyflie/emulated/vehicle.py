"""The body of an emulated Crazyflie: how it moves, falls and uses up its battery."""

import math
from dataclasses import dataclass
from typing import Final

from vrg_crazyflie.emulated.supervisor import State, Supervisor
from vrg_crazyflie.emulated.wire import OFF, Mode, Setpoint
from vrg_crazyflie.report import Info, Power

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
    """

    began: float
    duration: float
    start: tuple[float, float, float, float]
    end: tuple[float, float, float, float]

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
        error: what the estimator adds to x, y and z, m. blocked: True while a propeller is blocked.
    """

    def __init__(self, *, response: float = RESPONSE, auto_arm: bool = True) -> None:
        self.response, self.auto_arm = response, auto_arm
        self.z = self.vz = self.tilt = 0.0
        self.charge = 1.0
        self.blocked = False
        self.low_voltage, self.critical_voltage = 3.2, 3.0
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
        self.stopped = False
        self.power = Power.BATTERY
        self._low_since: float | None = None
        self._critical_since: float | None = None

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
        planning = Info(0)
        if self.plan is None:
            planning |= Info(0) if self.stopped else Info.PLAN_DISABLED
        else:
            planning |= Info.PLAN_ACTIVE
            if self.now >= self.plan.began + self.plan.duration:
                planning |= Info.PLAN_FINISHED
        return self.supervisor.info(planning)

    def command(self, setpoint: Setpoint) -> None:
        """Take a set-point of a client, which ends a trajectory."""
        self.setpoint, self.commanded, self.low_level = setpoint, self.now, True
        self.plan, self.stopped = None, False

    def relax(self) -> None:
        """Let the high-level commander command again."""
        self.low_level = False

    def fly_to(self, end: tuple[float, float, float, float], duration: float) -> bool:
        """Plan a trajectory from here; return False if the supervisor forbids to fly."""
        if not self.supervisor.able:
            return False
        x, y, z = self.estimate
        self.plan, self.stopped = Plan(self.now, max(duration, STEP), (x, y, z, self.yaw), end), False
        return True

    def halt(self) -> None:
        """Stop the high-level commander: where nobody else commands, the motors are off."""
        self.plan, self.stopped = None, True

    @property
    def estimate(self) -> tuple[float, float, float]:
        """The position that the estimator has found, m."""
        return self.x + self.error[0], self.y + self.error[1], self.z + self.error[2]

    def step(self) -> None:
        """Let STEP pass."""
        self.now += STEP
        self._plan()
        age = self.now - self.commanded
        up = self._up()
        if round(self.now / STEP) % 4 == 0:  # 25 Hz
            self.supervisor.update(self.now, thrust=self.thrust > 0.0, up=up, age=age)
        self._use_up()
        lifting = self.thrust > 0.0 and self.tilt < UPSET
        if self.thrust and self.blocked and self.z > 0.0:
            self.tilt = min(math.pi, self.tilt + math.pi * STEP / TUMBLE_TIME)
        if lifting and not (self.blocked and self.z <= 0.0):
            self._fly()
        else:
            self.vz -= G * STEP
        self._move()

    def _plan(self) -> None:
        if self.low_level or not self.supervisor.able:
            return
        if self.stopped:
            self.setpoint, self.commanded = OFF, self.now
        elif self.plan is not None:
            x, y, z, yaw = self.plan.at(self.now)
            self.setpoint, self.commanded = Setpoint(Mode.POSITION, x, y, z, yaw), self.now

    def _up(self) -> float:
        """The acceleration that its sensor measures along its z axis, g."""
        if self.z <= 0.0:
            return math.cos(self.tilt)
        return 1.0 if self.thrust else 0.0

    def _fly(self) -> None:
        told, (x, y, z) = self.setpoint, self.estimate
        mode = told.mode
        levelling = self.supervisor.state is State.LEVELLING
        if levelling:
            turn = 0.0
        elif mode is Mode.POSITION:
            turn = POSITION_GAIN * math.remainder(told.yaw - self.yaw, math.tau)
        else:
            turn = told.yaw
        if levelling or mode is Mode.LEVEL:
            self.vx -= self.vx * STEP / DRAG
            self.vy -= self.vy * STEP / DRAG
        elif mode is Mode.POSITION:
            self._pull(*(_clamp(POSITION_GAIN * gap, SPEED_LIMIT) for gap in (told.x - x, told.y - y)))
        elif mode is Mode.HOVER:
            cos, sin = math.cos(self.yaw), math.sin(self.yaw)
            self._pull(cos * told.x - sin * told.y, sin * told.x + cos * told.y)
        else:
            self._pull(told.x, told.y)
        climb = told.z if mode is Mode.VELOCITY else _clamp(POSITION_GAIN * (told.z - z), CLIMB_LIMIT)
        self.vz += (climb - self.vz) * STEP / CLIMB_RESPONSE
        self.w += (turn - self.w) * STEP / TURN_RESPONSE

    def _pull(self, vx: float, vy: float) -> None:
        """Accelerate towards a velocity, m/s."""
        ax, ay = (vx - self.vx) / self.response, (vy - self.vy) / self.response
        size = math.hypot(ax, ay)
        share = 1.0 if size <= TILT_ACCELERATION else TILT_ACCELERATION / size
        self.vx += ax * share * STEP
        self.vy += ay * share * STEP

    def _move(self) -> None:
        self.z += self.vz * STEP
        if self.z <= 0.0:
            self.z = self.vz = self.vx = self.vy = self.w = 0.0
        self.x += self.vx * STEP
        self.y += self.vy * STEP
        self.yaw = math.remainder(self.yaw + self.w * STEP, math.tau)

    def _use_up(self) -> None:
        """Let the battery empty, and the firmware see to it."""
        self.charge = max(0.0, self.charge - (HOVER_POWER if self.thrust else IDLE_POWER) * STEP / 3600.0 / ENERGY)
        self._low_since = _since(self._low_since, self.volts < self.low_voltage, self.now)
        self._critical_since = _since(self._critical_since, self.volts < self.critical_voltage, self.now)
        self.power = Power.LOW if self.now - (self._low_since or self.now) > LOW_TIME else Power.BATTERY
        if self.now - (self._critical_since or self.now) > LOW_TIME:
            self.powered = False


def _since(before: float | None, holds: bool, now: float) -> float | None:
    """The time since when something holds; None if it does not."""
    return (now if before is None else before) if holds else None


def _clamp(value: float, limit: float) -> float:
    return min(limit, max(-limit, value))
