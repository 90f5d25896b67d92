"""The virtual robots of a world: what they are told, what they may do, and what their batteries hold. Pure."""

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
from vrg.types import Pose, Twist

_EMPTY = "battery empty: motors are off"
_SILENT = "no drive command in time: braked"
_LOCKED = "stopped by the emergency stop: disarm it, then arm it"
_BRAKE = (0.0, 0.0, True)


@dataclass(slots=True)
class Member:
    """One virtual robot.

    Args:
        start: where a reset puts it. v_max: the top speed that the referee and its model allow, m/s.
        command: what its wheels were told last: left, right, in rad/s, and whether they are braked.
        empty: its battery is.
    """

    name: str
    model: RobotModel
    start: Pose
    v_max: float
    interlock: Interlock = field(default_factory=Interlock)
    command: tuple[float, float, bool] = _BRAKE
    empty: bool = False

    def state(self, now: float, estop: bool) -> RobotState:
        """How it is at match time `now`."""
        fault = None
        if self.empty:
            fault = _EMPTY
        elif self.interlock.locked:
            fault = _LOCKED
        elif self.interlock.silent(now):
            fault = _SILENT
        return RobotState(armed=self.interlock.armed, estop=estop, fault=fault)


class Fleet:
    """The virtual robots, in the order in which they came. `resize` must follow each change of the list.

    Args:
        engine: has a row for each of them, and for physical robots.
    """

    def __init__(self, engine: Engine) -> None:
        self.members: list[Member] = []
        self._engine = engine
        self._limits: dict[str, float] = {}
        self._rows: slice | npt.NDArray[np.intp] = slice(None)
        """The engine's rows of `members`."""
        self._batteries = Batteries([], np.zeros(0), np.zeros((0, 2)), np.zeros(0))
        self._used: dict[str, float] = {}

    @property
    def names(self) -> list[str]:
        """Of the robots."""
        return [member.name for member in self.members]

    def find(self, name: str) -> Member | None:
        """The robot of this name, or None."""
        return next((member for member in self.members if member.name == name), None)

    def add(self, name: str, model: RobotModel, pose: Pose) -> Member:
        """A robot has come to the world.

        Raises:
            WorldError: the name is taken.
        """
        self._engine.add(name, model, pose)
        member = Member(name, model, pose, min(self._limits.get(name, model.v_max), model.v_max))
        self.members.append(member)
        return member

    def remove(self, name: str) -> None:
        """A robot leaves the world.

        Raises:
            WorldError: there is none of that name.
        """
        member = self.find(name)
        if member is None:
            raise WorldError(f"remove {name}: expected one of the virtual robots ({', '.join(self.names) or 'none'})")
        self._engine.remove(name)
        self.members.remove(member)
        self._used.pop(name, None)

    def resize(self) -> None:
        """The list of robots has changed, or their rows in the engine."""
        engine = self._engine
        self._used |= {name: float(used) for name, used in zip(self._counted, self._batteries.used, strict=True)}
        self._rows = (~engine.kinematic).nonzero()[0] if engine.kinematic.any() else slice(None)
        used = np.array([self._used.get(name, 0.0) for name in self.names])
        models = [member.model for member in self.members]
        self._counted = self.names
        self._batteries = Batteries(models, used, engine.wheels[self._rows], engine.velocities[self._rows, 0])

    _counted: list[str] = []  # noqa: RUF012 - replaced, never changed
    """The robots whose batteries `_batteries` holds."""

    def drive(self, now: float, name: str, twist: Twist, armed: bool, estop: bool) -> None:
        """A drive command arrived. One for a robot that is not in the world is ignored: it may come yet."""
        member = self.find(name)
        if member is not None:
            member.interlock.drive(now, twist, armed, estop)

    def limit(self, name: str, v_max: float) -> None:
        """The referee caps a robot's speed, m/s; also one that comes later."""
        self._limits[name] = v_max
        member = self.find(name)
        if member is not None:
            member.v_max = min(v_max, member.model.v_max)

    def stop(self) -> None:
        """The emergency stop was engaged."""
        for member in self.members:
            member.interlock.stop()

    def command(self, now: float, gate: RefereeGate, estop: bool) -> None:
        """Tell the wheels what the robots' commands ask for, or brake them where anything holds them."""
        held = estop or gate.closed(now)
        for member in self.members:
            interlock = member.interlock
            command = _BRAKE
            if interlock.armed and not (held or member.empty or interlock.silent(now) or gate.holds(member.name)):
                left, right = member.model.wheels(member.model.limited(interlock.twist, member.v_max))
                command = (left, right, False)
            if command != member.command:
                member.command = command
                self._engine.command(member.name, *command)

    def drain(self, dt: float) -> None:
        """Account for the energy of the last dt seconds."""
        engine, rows = self._engine, self._rows
        self._batteries.draw(dt, engine.wheels[rows], engine.velocities[rows, 0])
        for member, charge in zip(self.members, self._batteries.charge.tolist(), strict=True):
            member.empty = charge <= 0.0

    def charge(self, name: str) -> float:
        """Of a robot's battery, 1 full to 0 empty."""
        return float(self._batteries.charge[self.names.index(name)])

    def used(self, name: str) -> float:
        """Energy drawn since a robot's battery was full, J."""
        return float(self._batteries.used[self.names.index(name)])

    def set_used(self, used: dict[str, float]) -> None:
        """Go on from a snapshot: energy drawn, J, by robot. `resize` must follow."""
        self._used = dict(used)
        self._counted = []
        self._batteries = Batteries([], np.zeros(0), np.zeros((0, 2)), np.zeros(0))

    def rest(self, name: str) -> None:
        """A robot was put somewhere at rest."""
        self._batteries.place(self.names.index(name))

    @property
    def poses(self) -> Floats:
        """Of the robots, shape (robots, 3)."""
        poses: Floats = self._engine.poses[self._rows]
        return poses

    @property
    def wheels(self) -> Floats:
        """Angles that the robots' wheels have turned, shape (robots, 2), rad."""
        wheels: Floats = self._engine.wheels[self._rows]
        return wheels
