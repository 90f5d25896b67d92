"""The virtual robots of a world: their commands, what may hold them, and the charge of their batteries.

This module uses no bus and no clock.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vrg.bus.messages import RobotState
from vrg.hal.gate import RefereeGate
from vrg.hal.models import RobotModel
from vrg.hal.sim.battery import Batteries
from vrg.hal.sim.engines.engine import Engine, Floats
from vrg.hal.sim.safety import Interlock
from vrg.hal.sim.snapshot import RobotSnapshot
from vrg.types import STILL, Twist

_EMPTY = "battery empty: motors are off"
_SILENT = "no drive command in time: braked"
_LOCKED = "stopped by the emergency stop: disarm it, then arm it"

_EPS = 1e-9


@dataclass(slots=True)
class Member:
    """One virtual robot.

    Args:
        v_max: the top speed that the referee and its model allow, m/s.
        interlock: its arming, its watchdog and its emergency stop.
        command: the motion that it was last commanded to make; None while its wheels are locked.
        empty: True if its battery is empty.
        stands: the match time since which its wheels are held or commanded to stand, s; None while they turn.
    """

    name: str
    model: RobotModel
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
    """The virtual robots, in the order of the engine's rows.

    Args:
        engine: the engine of the world, which has a row for each virtual and each physical robot.
        snapshot: the robots as they were, by name; one that is not there begins anew.
    """

    def __init__(self, engine: Engine, snapshot: Mapping[str, RobotSnapshot]) -> None:
        rows = (~engine.kinematic).nonzero()[0]
        self.members = [Member(engine.names[row], engine.models[row], engine.models[row].v_max) for row in rows]
        self._by_name = {member.name: member for member in self.members}
        self._engine = engine
        self._rows = rows if engine.kinematic.any() else slice(None)
        """The rows of `members` in the engine's arrays."""
        used = np.zeros(len(self.members))
        for row, member in enumerate(self.members):
            if (before := snapshot.get(member.name)) is not None:
                member.v_max, member.interlock.locked, used[row] = before.v_max, before.locked, before.energy_used
        models = [member.model for member in self.members]
        self._batteries = Batteries(models, used, engine.angles[self._rows], engine.velocities[self._rows])

    @property
    def names(self) -> list[str]:
        """The names of the robots."""
        return [member.name for member in self.members]

    def find(self, name: str) -> Member | None:
        """The robot of this name, or None if there is none."""
        return self._by_name.get(name)

    def drive(self, now: float, name: str, twist: Twist, armed: bool, estop: bool) -> None:
        """Take in a drive command. One for another robot is ignored.

        One that is not finite is ignored, too, as a robot is then braked that gets no other.
        """
        member = self.find(name)
        if member is not None and twist.is_finite:
            member.drive(now, twist, armed, estop)

    def limit(self, name: str, v_max: float) -> None:
        """Take in the referee's limit of a robot's speed, m/s. One for another robot is ignored."""
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
