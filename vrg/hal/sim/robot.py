"""The robots of a world but for their bodies: what a virtual robot does, what holds it, and where a physical one is.

This module uses no bus and no clock.
"""

import math
from collections import deque

import numpy as np
import numpy.typing as npt

from vrg.bus.messages import MeasuredPose, RobotState, at_rest
from vrg.bus.node import CLOCK_SKEW
from vrg.errors import WorldError
from vrg.geometry import along_arc
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.hal.models import RobotModel
from vrg.hal.permission import Permission
from vrg.portable.scalars import total
from vrg.types import LEVEL, STILL, Pose, Twist, Uncertainty

EXTRAPOLATE = 0.2
"""The match time in s after a measurement for which a body goes on at the measured velocity; then it stands still."""
GRAVITY = 9.81
"""The acceleration of gravity in m/s^2."""
STANDS = 0.05
"""The measured height in m up to which a robot stands on the ground: that of one that stands is never 0 exactly."""
_FAR = 1e5
"""The largest coordinate that a message may hold, m."""
_EMPTY = "battery empty: motors are off"
_SILENT = "no drive command in time: braked"
_LOCKED = "stopped by the emergency stop: disarm it, then arm it"
_EPS = 1e-9

Floats = npt.NDArray[np.float64]
BodyMark = tuple[bool, float, float | None, float | None, Uncertainty | None]
"""The last fields of a `Body`: `physical`, `age`, `rest`, `stands` and `uncertainty`."""


class RestTimer:
    """The match time since which a body has been at rest without a break."""

    def __init__(self) -> None:
        self._since: float | None = None

    def since(self, twist: Twist, now: float, *, known: bool = True) -> float | None:
        """Take in the body's velocity at a tick, and return since when it has been at rest; None if it is not.

        Asking again at the same tick changes nothing.

        Args:
            now: the match time of the tick, s. known: False if its present motion is not known.
        """
        if not known or not at_rest(twist):
            self._since = None
        elif self._since is None:
            self._since = now
        return self._since


class VirtualRobot:
    """One virtual robot: its commands, and all that can hold it. It never moves by itself.

    After an emergency stop a robot stays disarmed until a command that disarms was heard and then, with the stop
    released, a command that arms. So a player that goes on sending the same commands does not move its robot.

    Args:
        name, model: those of the robot. row: its row in the arrays of the engine.

    Attributes:
        armed: True if the motors accept commands.
        locked: True if the emergency stop has hit the robot and no command that disarms was heard since.
        empty: True if its battery is empty.
        command: the motion that it was last decided to make; None while its wheels are locked.
        ready: the match time at which each of its actuators can be used again, s, by name.
    """

    def __init__(self, name: str, model: RobotModel, row: int = 0) -> None:
        self.name, self.model, self.row = name, model, row
        self.armed = self.locked = self.empty = False
        self.command: Twist | None = None
        self.ready: dict[str, float] = {}
        self._heard = 0.0
        self._later: deque[tuple[float, Twist]] = deque()
        """The motions that it has not acted on yet, and when it will, s."""
        self._wanted = STILL
        self._rest = RestTimer()
        self._stands: float | None = None
        """The match time since which its wheels are held or commanded to stand, s; None while they turn."""

    def drive(self, now: float, twist: Twist, *, armed: bool, estop: bool) -> None:
        """Take in a drive command at match time `now`.

        One that is not finite is ignored, as a robot is then braked that gets no other.

        Args:
            armed: False disarms the robot. estop: whether the emergency stop is engaged.
        """
        if not twist.is_finite:
            return
        if not armed:
            self.armed = self.locked = False
        elif estop:
            self.locked = True
        elif not self.locked:
            self.armed = True
        self._heard = now
        if self.model.delay:
            self._later.append((now + self.model.delay, twist))
        else:
            self._wanted = twist

    def stop(self) -> None:
        """Disarm the robot, because the emergency stop was engaged."""
        self.locked = self.locked or self.armed
        self.armed = False

    def decide(self, now: float, permission: Permission, *, estop: bool) -> Twist | None:
        """Decide at match time `now` which motion it makes, as far as it may; None locks its wheels."""
        self.command = None
        if self.armed and not (estop or self.empty or self._silent(now)):
            wanted = self._due(now)
            self.command = permission.motion(self.name, self.model, wanted, now)
            if self.command is not None and wanted == STILL:
                self.command = STILL  # its device knows why it is to stand, also during a lease
        if self.command is None and self.model.delay:  # what it has not acted on yet is dropped
            self._later.clear()
            self._wanted = STILL
        if self.command is not None and self.command != STILL:
            self._stands = None
        elif self._stands is None:
            self._stands = now
        return self.command

    @property
    def holds_until(self) -> float:
        """The match time up to which `decide` decides the same as it did last, s, if nothing new is heard."""
        if self.model.delay:
            return -math.inf
        return self._heard + COMMAND_TIMEOUT if self.armed else math.inf

    def state(self, now: float, *, estop: bool) -> RobotState:
        """The robot's state at match time `now`."""
        fault = None
        if self.empty:
            fault = _EMPTY
        elif self.locked:
            fault = _LOCKED
        elif self._silent(now):
            fault = _SILENT
        return RobotState(armed=self.armed, estop=estop, fault=fault)

    def mark(self, twist: Twist, now: float) -> BodyMark:
        """What the world publishes of the robot at match time `now` besides its pose and its twist."""
        return False, 0.0, self._rest.since(twist, now), self._stands, None

    def _silent(self, now: float) -> bool:
        """True if it is armed and its player has sent no command for longer than COMMAND_TIMEOUT."""
        return self.armed and now - self._heard > COMMAND_TIMEOUT + _EPS

    def _due(self, now: float) -> Twist:
        """The motion that it acts on at match time `now`."""
        while self._later and self._later[0][0] <= now + _EPS:
            self._wanted = self._later.popleft()[1]
        return self._wanted


class Ghost:
    """A physical robot or a tracked body, as the world shows it: where it was measured, and then along its arc.

    Measurements come at about 10 Hz, and the world ticks at 50 Hz. The body goes on along its arc, but not for long.

    Args:
        pose: where the robot is taken to stand until it is measured.
        stamp: the match time from which the age of that pose is counted, s.

    Attributes:
        uncertainty: how well its pose is known; None if that is not known.
    """

    def __init__(self, name: str, pose: Pose, stamp: float) -> None:
        self.name = name
        self._pose = pose
        self._stamp = self._seen = stamp
        self._twist = STILL
        self._rest = RestTimer()
        self.uncertainty: Uncertainty | None = None

    def measure(self, measured: MeasuredPose, stamp: float, now: float) -> None:
        """Take in a measurement; one that is older than the newest changes nothing.

        Args:
            stamp: the match time of the measurement, s. now: the match time, s.

        Raises:
            WorldError: the stamp is in the future by more than CLOCK_SKEW.
        """
        if stamp > now + CLOCK_SKEW:
            raise WorldError(
                f"pose of {self.name}: expected a pose of now ({now:.2f} s) or earlier, got one of {stamp:.2f} s"
            )
        if stamp >= self._stamp:
            self._pose, self._twist, self._stamp = measured.pose, measured.twist, stamp
            self._seen = max(0.0, stamp - measured.unseen) if measured.lost else stamp
            self.uncertainty = measured.uncertainty

    def age(self, now: float) -> float:
        """The match time since the robot was measured, or since it was last seen if it is lost, s."""
        return max(0.0, now - self._seen)

    def at(self, now: float) -> tuple[Pose, Twist]:
        """Its pose at match time `now` and the velocity of its body, which is 0 once it stands still."""
        age = max(0.0, now - self._stamp)
        pose = along_arc(self._pose, self._twist, min(age, EXTRAPOLATE))
        x, y, z = (max(-_FAR, min(each, _FAR)) for each in (pose.x, pose.y, pose.z))
        pose = Pose(x, y, pose.theta, z if z > STANDS else LEVEL)
        return pose, self._twist if age <= EXTRAPOLATE else STILL

    def mark(self, twist: Twist, now: float) -> BodyMark:
        """What the world publishes of the robot at match time `now` besides its pose and its twist."""
        age = self.age(now)
        return True, age, self._rest.since(twist, now, known=age <= EXTRAPOLATE), None, self.uncertainty


class Batteries:
    """The batteries of all robots, as an energy balance. Each array has one row per robot.

    Energy drawn = idle power * time + (rolling resistance * way + gain of kinetic energy) / efficiency. Braking does
    not charge the battery, and the friction of skidding wheels in a turn is not counted. The way is that of the wheels,
    by the scale at which it is the body's own straight ahead.

    Args:
        models: the models of the robots.
        used: shape (robots,): the energy drawn since each battery was full, J.
        angles: shape (robots, axes): the angles turned so far, rad.
        velocities: shape (robots, 3): v, w and the speed to the left now, m/s and rad/s.

    What flies needs the power to hover besides, as long as it is in the air.

    Attributes:
        charge: the charge of each battery: shape (robots,), from 1 (full) to 0 (empty).
    """

    def __init__(self, models: list[RobotModel], used: Floats, angles: Floats, velocities: Floats) -> None:
        self.used = used
        self._capacity = np.array([m.battery_wh * 3600.0 for m in models])
        self._idle = np.array([m.idle_w for m in models])
        self._drag = np.array([m.mass * GRAVITY * m.rolling / m.drive_efficiency for m in models])
        self._inertia = np.array([m.mass / 2 / m.drive_efficiency for m in models])
        hover = [0.0 if m.flies is None else m.flies.hover for m in models]
        self._hover = np.array(hover) if any(hover) else None
        self._per_rad = np.array([1 / total(abs(ahead) for ahead, _, _ in m.drivetrain.rates) for m in models])
        self._angles, self._squared = angles.copy(), _squared_speed(velocities)
        self.draw(0.0, angles, velocities)

    def fill(self, rows: list[int]) -> None:
        """Charge the batteries of some robots, by their rows."""
        self.used[rows], self.charge[rows] = 0.0, 1.0

    def draw(self, dt: float, angles: Floats, velocities: Floats, heights: Floats | None = None) -> None:
        """Subtract the energy that the robots have drawn in the dt seconds since the last call; see the class.

        Args:
            heights: shape (robots,): of the robots above the ground, m; None if all are on it.
        """
        way = np.abs(angles - self._angles).sum(axis=1) * self._per_rad
        squared = _squared_speed(velocities)
        gain = np.maximum(squared - self._squared, 0.0)
        self.used += self._idle * dt + self._drag * way + self._inertia * gain
        if self._hover is not None and heights is not None:
            self.used += np.where(heights > 0.0, self._hover, 0.0) * dt
        self._angles, self._squared = angles.copy(), squared
        self.charge: Floats = np.maximum(1.0 - self.used / self._capacity, 0.0)

    def place(self, row: int) -> None:
        """Take note that a robot was put somewhere at rest, so that the change of its speed costs no energy."""
        self._squared[row] = 0.0


def _squared_speed(velocities: Floats) -> Floats:
    squared: Floats = velocities[:, 0] * velocities[:, 0] + velocities[:, 2] * velocities[:, 2]
    return squared
