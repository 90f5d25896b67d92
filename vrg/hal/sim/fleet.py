"""The virtual robots of a world: their commands, what may hold them, and the charge of their batteries.

This module uses no bus and no clock.
"""

from collections import deque
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from vrg.bus.messages import RobotState
from vrg.errors import WorldError
from vrg.hal.gate import RefereeGate
from vrg.hal.models import RobotModel
from vrg.hal.sim.battery import Batteries
from vrg.hal.sim.engines.engine import Engine, Floats
from vrg.hal.sim.safety import Interlock
from vrg.types import STILL, Pose, Twist

_EMPTY = "battery empty: motors are off"
_SILENT = "no drive command in time: braked"
_LOCKED = "stopped by the emergency stop: disarm it, then arm it"

_EPS = 1e-9


@dataclass(slots=True)
class Member:
    """One virtual robot.

    Args:
        start: the pose where a reset puts it. v_max: the top speed that the referee and its model allow, m/s.
        interlock: its arming, its watchdog and its emergency stop.
        command: the motion that it was last commanded to make; None while its wheels are locked.
        empty: True if its battery is empty.
        stands: the match time since which its wheels are held or commanded to stand, s; None while they turn.
    """

    name: str
    model: RobotModel
    start: Pose
    v_max: float
    interlock: Interlock = field(default_factory=Interlock)
    command: Twist | None = None
    empty: bool = False
    stands: float | None = None
    _later: deque[tuple[float, Twist]] = field(default_factory=deque)
    """The motions that it has not acted on yet, and when it will, s."""
    _wanted: Twist = STILL
    _planned: tuple[Twist, float] = (STILL, 0.0)
    _limited: Twist = STILL

    def drive(self, now: float, twist: Twist, armed: bool, estop: bool) -> None:
        """Take in a drive command at match time `now`."""
        self.interlock.drive(now, armed, estop)
        if self.model.delay:
            self._later.append((now + self.model.delay, twist))
        else:
            self._wanted = twist

    def forget(self) -> None:
        """Drop what it has not acted on yet, as its wheels are held. Without a delay there is nothing."""
        if self.model.delay:
            self._later.clear()
            self._wanted = STILL

    def wanted(self, now: float) -> Twist:
        """The motion that it acts on at match time `now`."""
        while self._later and self._later[0][0] <= now + _EPS:
            self._wanted = self._later.popleft()[1]
        return self._wanted

    def plan(self, twist: Twist) -> Twist:
        """A motion, within its top speed."""
        if twist is not self._planned[0] or self.v_max != self._planned[1]:
            self._planned = twist, self.v_max
            self._limited = self.model.limited(twist, self.v_max)
        return self._limited

    def state(self, now: float, estop: bool) -> RobotState:
        """The robot's state at match time `now`."""
        fault = None
        if self.empty:
            fault = _EMPTY
        elif self.interlock.locked:
            fault = _LOCKED
        elif self.interlock.silent(now):
            fault = _SILENT
        return RobotState(armed=self.interlock.armed, estop=estop, fault=fault)


class Fleet:
    """The virtual robots, in the order in which they were added. Call `resize` after each change of the list.

    Args:
        engine: the engine of the world, which has a row for each virtual and each physical robot.
    """

    def __init__(self, engine: Engine) -> None:
        self.members: list[Member] = []
        self._by_name: dict[str, Member] = {}
        self._engine = engine
        self._limits: dict[str, float] = {}
        self._rows: slice | npt.NDArray[np.intp] = slice(None)
        """The rows of `members` in the engine's arrays."""
        self._batteries = Batteries([], np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3)))
        self._counted: list[str] = []
        """The names of the robots whose batteries are in `_batteries`."""
        self._used: dict[str, float] = {}

    @property
    def names(self) -> list[str]:
        """The names of the robots."""
        return [member.name for member in self.members]

    def find(self, name: str) -> Member | None:
        """The robot of this name, or None if there is none."""
        return self._by_name.get(name)

    def add(self, name: str, model: RobotModel, pose: Pose) -> Member:
        """Put a robot into the world.

        Raises:
            WorldError: the name is taken.
        """
        self._engine.add(name, model, pose)
        member = Member(name, model, pose, min(self._limits.get(name, model.v_max), model.v_max))
        self.members.append(member)
        self._by_name[name] = member
        return member

    def remove(self, name: str) -> None:
        """Take a robot out of the world.

        Raises:
            WorldError: there is none of that name.
        """
        member = self.find(name)
        if member is None:
            raise WorldError(f"remove {name}: expected one of the virtual robots ({', '.join(self.names) or 'none'})")
        self._engine.remove(name)
        self.members.remove(member)
        del self._by_name[name]

    def resize(self) -> None:
        """Adapt to a change of the list of robots, or of their rows in the engine."""
        engine = self._engine
        self._used |= {name: float(used) for name, used in zip(self._counted, self._batteries.used, strict=True)}
        # A robot that was removed takes its battery with it.
        names = self.names
        self._used = {name: used for name, used in self._used.items() if name in names}
        self._rows = (~engine.kinematic).nonzero()[0] if engine.kinematic.any() else slice(None)
        used = np.array([self._used.get(name, 0.0) for name in names])
        models = [member.model for member in self.members]
        self._counted = names
        self._batteries = Batteries(models, used, engine.angles[self._rows], engine.velocities[self._rows])

    def drive(self, now: float, name: str, twist: Twist, armed: bool, estop: bool) -> None:
        """Take in a drive command. One for a robot that is not in the world is ignored: the robot may still come.

        One that is not finite is ignored, too, as a robot is then braked that gets no other.
        """
        member = self.find(name)
        if member is not None and twist.is_finite:
            member.drive(now, twist, armed, estop)

    def limit(self, name: str, v_max: float) -> None:
        """Take in the referee's limit of a robot's speed, m/s. It also holds for a robot that comes later."""
        self._limits[name] = v_max
        member = self.find(name)
        if member is not None:
            member.v_max = min(v_max, member.model.v_max)

    def stop(self) -> None:
        """Disarm every robot, because the emergency stop was engaged."""
        for member in self.members:
            member.interlock.stop()

    def command(self, now: float, gate: RefereeGate, estop: bool) -> None:
        """Pass the robots' commands on to the engine, and lock the wheels of each robot that anything holds."""
        held = estop or gate.closed(now)
        for member in self.members:
            interlock = member.interlock
            command = None
            if interlock.armed and not (held or member.empty or interlock.silent(now) or gate.holds(member.name)):
                command = member.plan(gate.led(member.name, member.wanted(now)))
            else:
                member.forget()
            if command != member.command:
                member.command = command
                self._engine.command(member.name, command)
            if command is not None and command != STILL:
                member.stands = None
            elif member.stands is None:
                member.stands = now

    def drain(self, dt: float) -> None:
        """Subtract the energy that the robots have drawn in the last dt seconds from their batteries."""
        engine, rows = self._engine, self._rows
        self._batteries.draw(dt, engine.angles[rows], engine.velocities[rows])
        for member, charge in zip(self.members, self._batteries.charge.tolist(), strict=True):
            member.empty = charge <= 0.0

    def charge(self, name: str) -> float:
        """The charge of a robot's battery, from 1 (full) to 0 (empty)."""
        return float(self._batteries.charge[self.names.index(name)])

    def used(self, name: str) -> float:
        """The energy drawn since a robot's battery was full, J."""
        return float(self._batteries.used[self.names.index(name)])

    def set_used(self, used: dict[str, float]) -> None:
        """Set the energy drawn by each robot, J, from a snapshot. Call `resize` afterwards."""
        self._used = dict(used)
        self._counted = []
        self._batteries = Batteries([], np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3)))

    def rest(self, name: str) -> None:
        """Take note that a robot was put somewhere at rest."""
        self._batteries.place(self.names.index(name))

    @property
    def poses(self) -> Floats:
        """The robots' poses: shape (robots, 3), x and y in m, heading in rad."""
        poses: Floats = self._engine.poses[self._rows]
        return poses

    def angles(self, name: str) -> tuple[float, ...]:
        """The angles that the axes of a robot have turned, rad."""
        return self._engine.angles_of(self._engine.row(name))
