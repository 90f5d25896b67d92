"""The world: robots on a map, their commands, limits, sensors and batteries. Pure: no bus, no clock.

A physical robot has all of these itself. In the world it is a ghost: a body that is where the robot was measured, which
the virtual robots see and run into, and from whose place the range sensors are synthesised that the robot lacks.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from vrg.bus.messages import Body, Laser, Pose, Poses, RefereeState, RequestKind, RobotState, WorldRequest
from vrg.errors import ConfigError, WorldError
from vrg.hal.gate import RefereeGate
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.robot import limit_wheels
from vrg.hal.sim.battery import Batteries
from vrg.hal.sim.config import WorldConfig, check_setup, fingerprint, overlap, place_problems
from vrg.hal.sim.engine import Floats, make_engine
from vrg.hal.sim.ghost import Ghost
from vrg.hal.sim.lidar import Lidar
from vrg.hal.sim.map import load_map
from vrg.hal.sim.safety import Interlock
from vrg.hal.sim.sensors import Sensors
from vrg.hal.sim.snapshot import GhostSnapshot, RobotSnapshot, WorldSnapshot

_BATTERY_TICKS = 10
"""Ticks between energy balances."""
_EMPTY = "battery empty: motors are off"
_SILENT = "no drive command in time: braked"
_LOCKED = "stopped by the emergency stop: disarm it, then arm it"
_BRAKE = (0.0, 0.0, True)


@dataclass(slots=True)
class _Member:
    """One virtual robot, in the order of the engine's rows."""

    name: str
    model: RobotModel
    start: Pose
    interlock: Interlock = field(default_factory=Interlock)
    wheel_limit: float = 0.0
    command: tuple[float, float, bool] = _BRAKE
    empty: bool = False


class World:
    """See the module. Time is `tick * config.tick`; the world begins at tick 0.

    Args:
        config: what is in it.

    Raises:
        ConfigError: check_setup found problems; all of them.
    """

    def __init__(self, config: WorldConfig) -> None:
        if problems := check_setup(config):
            raise ConfigError(problems)
        self.config = config
        self._setup = fingerprint(config)
        self.map = load_map(config.map)
        self.tick = 0
        self.epoch = 0
        self.estop = False
        self._engine = make_engine(config.engine, self.map)
        self._members: list[_Member] = []
        self._ghosts: dict[str, Ghost] = {}
        self._rows: slice | npt.NDArray[np.intp] = slice(None)
        """The engine's rows of `_members`."""
        self._limits: dict[str, float] = {}
        self._gate = RefereeGate()
        self._sensors = Sensors(config.seed, config.noise)
        self._lidar = Lidar(self.map, config.seed, config.noise)
        for robot in config.robots:
            if robot.physical:
                self._add_ghost(robot.name, robot_model(robot.model), robot.pose)
            else:
                self._add(robot.name, robot_model(robot.model), robot.pose)
        self._resize(np.zeros((len(self._members), 3)), np.zeros(len(self._members)))

    @property
    def time(self) -> float:
        """Match time, s."""
        return self.tick * self.config.tick

    @property
    def names(self) -> list[str]:
        """The robots in the world, virtual and physical, in a fixed order."""
        return list(self._engine.names)

    @property
    def virtual(self) -> list[str]:
        """The virtual robots, in the same order."""
        return [member.name for member in self._members]

    def model(self, name: str) -> RobotModel:
        """A robot's model.

        Raises:
            WorldError: there is no such robot.
        """
        return self._engine.models[self._engine.row(name)]

    def pose(self, name: str) -> Pose:
        """Where a robot truly is; a physical one, where it is taken to be.

        Raises:
            WorldError: there is no such robot.
        """
        return Pose(*self._engine.poses[self._engine.row(name)].tolist())

    def drive(self, name: str, left: float, right: float, armed: bool) -> None:
        """A drive command (rad/s) arrived. One for a robot that is not in the world is ignored: it may come yet."""
        for member in self._members:
            if member.name == name:
                member.interlock.drive(self.time, left, right, armed, self.estop)

    def measure(self, name: str, pose: Pose, v: float, w: float, stamp: float) -> None:
        """A physical robot was measured to be somewhere. What is older than the newest changes nothing.

        Args:
            v, w: its body velocity then, m/s and rad/s. stamp: when, match time in s.

        Raises:
            WorldError: there is no physical robot of that name, or it was measured in the future.
        """
        ghost = self._ghosts.get(name)
        if ghost is None:
            known = ", ".join(self._ghosts) or "none"
            raise WorldError(f"pose of {name}: expected one of the physical robots ({known})")
        try:
            ghost.measure(pose, v, w, stamp, self.time)
        except WorldError as error:
            raise WorldError(f"pose of {name}: {error}") from None

    def limit(self, name: str, v_max: float) -> None:
        """The referee caps a robot's speed, m/s; also one that comes later."""
        self._limits[name] = v_max
        for member in self._members:
            if member.name == name:
                member.wheel_limit = min(v_max, member.model.v_max) / member.model.wheel_radius

    def engage(self, engaged: bool) -> None:
        """Latch or release the emergency stop. Nothing moves after a release until armed again."""
        self.estop = engaged
        if engaged:
            for member in self._members:
                member.interlock.stop()

    def referee(self, state: RefereeState) -> None:
        """The referee spoke."""
        self._gate.hear(self.time, state)

    def request(self, request: WorldRequest) -> None:
        """Spawn, remove, reset or place. Only people can put a physical robot anywhere.

        Raises:
            WorldError: it cannot be done; nothing has changed.
        """
        match request.kind:
            case RequestKind.SPAWN:
                self._spawn(request)
            case RequestKind.REMOVE:
                self._remove(_named(request))
            case RequestKind.PLACE:
                if not request.places:
                    raise WorldError("place: expected places, got none")
                self._move(request.places)
            case RequestKind.RESET:
                chosen = self._members if request.robot is None else [self._member(request.robot)]
                self._move({member.name: member.start for member in chosen})

    def step(self) -> None:
        """Advance by one tick."""
        self.tick += 1
        self._apply_commands()
        for name, ghost in self._ghosts.items():
            self._engine.move(name, *ghost.at(self.time))
        self._engine.step(self.config.tick)
        if self.tick % _BATTERY_TICKS == 0:
            self._drain()

    def states(self) -> list[RobotState]:
        """What each virtual robot knows of itself, in the order of `virtual`. Reads the sensors: once a tick."""
        engine, rows = self._engine, self._rows
        reading = self._sensors.read(self.tick, self.config.tick, engine.poses[rows], engine.wheels[rows])
        numbers = np.concatenate((reading.ins, reading.odometry, reading.velocity), axis=1).tolist()
        charges = self._batteries.charge.tolist()
        now = self.time
        states = []
        touches = [touch for touch, ghost in zip(engine.touch, engine.kinematic.tolist(), strict=True) if not ghost]
        for member, row, (left, right), touch, charge in zip(
            self._members, numbers, reading.encoders.tolist(), touches, charges, strict=True
        ):
            interlock = member.interlock
            fault = None
            if member.empty:
                fault = _EMPTY
            elif interlock.locked:
                fault = _LOCKED
            elif interlock.silent(now):
                fault = _SILENT
            states.append(
                RobotState(
                    ins=Pose(row[0], row[1], row[2]),
                    odometry=Pose(row[3], row[4], row[5]),
                    v=row[6],
                    w=row[7],
                    encoders=(left, right),
                    touch=_pressed(touch, member.model.bumpers),
                    battery=charge,
                    armed=interlock.armed,
                    estop=self.estop,
                    fault=fault,
                )
            )
        return states

    def poses(self) -> Poses:
        """Where every body truly is; a physical one, where it is taken to be."""
        engine, ghosts, now = self._engine, self._ghosts, self.time
        bodies = [
            Body(name, Pose(x, y, theta), v, w, name in ghosts, ghosts[name].age(now) if name in ghosts else 0.0)
            for name, (x, y, theta), (v, w) in zip(
                engine.names, engine.poses.tolist(), engine.velocities.tolist(), strict=True
            )
        ]
        return Poses(bodies=bodies)

    def scans(self) -> list[tuple[str, Laser]]:
        """A scan of each robot whose range finder is due at this tick."""
        engine = self._engine
        return self._lidar.scans(self.tick, self.config.tick, engine.names, engine.models, engine.poses)

    def snapshot(self) -> WorldSnapshot:
        """All that a restarted world needs to go on."""
        engine = self._engine
        robots = [
            RobotSnapshot(
                name=member.name,
                model=member.model.name,
                start=member.start,
                pose=Pose(*pose),
                wheels=(left, right),
                odometry=Pose(*self._sensors.odometry[row].tolist()),
                energy_used=float(self._batteries.used[row]),
                wheel_limit=member.wheel_limit,
                locked=member.interlock.locked,
            )
            for row, (member, pose, (left, right)) in enumerate(
                zip(self._members, engine.poses[self._rows].tolist(), engine.wheels[self._rows].tolist(), strict=True)
            )
        ]
        physical = [GhostSnapshot(name=n, model=self.model(n).name, pose=self.pose(n)) for n in self._ghosts]
        return WorldSnapshot(
            setup=self._setup,
            tick=self.tick,
            epoch=self.epoch,
            estop=self.estop,
            refereed=self._gate.refereed,
            robots=robots,
            physical=physical,
        )

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Go on from a snapshot, in a new epoch, with every robot at rest and its motors off.

        Physical robots count as measured there and then.

        Raises:
            ConfigError: it names a robot model that is not known.
            WorldError: it is of another set-up than this world's.
        """
        if snapshot.setup != self._setup:
            raise WorldError(
                f"snapshot: expected one of this set-up ({self._setup}), got one of another ({snapshot.setup}): "
                "choose another run folder, or delete the snapshot to begin anew"
            )
        models = {robot.name: robot_model(robot.model) for robot in snapshot.robots}
        models |= {ghost.name: robot_model(ghost.model) for ghost in snapshot.physical}
        for name in self.names:
            self._engine.remove(name)
        self._members.clear()
        self._ghosts.clear()
        self.tick, self.epoch, self.estop = snapshot.tick, snapshot.epoch + 1, snapshot.estop
        self._gate = RefereeGate(refereed=snapshot.refereed)
        for ghost in snapshot.physical:
            self._add_ghost(ghost.name, models[ghost.name], ghost.pose)
        for robot in snapshot.robots:
            member = self._add(robot.name, models[robot.name], robot.pose)
            member.start, member.wheel_limit = robot.start, robot.wheel_limit
            member.interlock.locked = robot.locked
            self._engine.restore(robot.name, robot.pose, robot.wheels)
        odometry = [(r.odometry.x, r.odometry.y, r.odometry.theta) for r in snapshot.robots]
        self._resize(np.array(odometry).reshape(-1, 3), np.array([r.energy_used for r in snapshot.robots]))

    def close(self) -> None:
        """Let go of the engine. Idempotent."""
        self._engine.close()

    def _apply_commands(self) -> None:
        now = self.time
        closed = self._gate.closed(now)
        for member in self._members:
            interlock = member.interlock
            command = _BRAKE
            if not (
                closed
                or self.estop
                or not interlock.armed
                or member.empty
                or interlock.silent(now)
                or self._gate.holds(member.name)
            ):
                wheels = limit_wheels(interlock.left, interlock.right, member.wheel_limit)
                command = (wheels.left, wheels.right, False)
            if command != member.command:
                member.command = command
                self._engine.command(member.name, *command)

    def _drain(self) -> None:
        engine, rows = self._engine, self._rows
        self._batteries.draw(_BATTERY_TICKS * self.config.tick, engine.wheels[rows], engine.velocities[rows, 0])
        for member, charge in zip(self._members, self._batteries.charge.tolist(), strict=True):
            member.empty = charge <= 0.0

    def _add(self, name: str, model: RobotModel, pose: Pose) -> _Member:
        self._engine.add(name, model, pose)
        v_max = min(self._limits.get(name, model.v_max), model.v_max)
        member = _Member(name, model, pose, wheel_limit=v_max / model.wheel_radius)
        self._members.append(member)
        return member

    def _add_ghost(self, name: str, model: RobotModel, pose: Pose) -> None:
        self._engine.add(name, model, pose, kinematic=True)
        self._ghosts[name] = Ghost(pose, self.time)

    def _member(self, name: str) -> _Member:
        """A virtual robot.

        Raises:
            WorldError: there is no such robot, or it is physical.
        """
        self._engine.row(name)
        if name in self._ghosts:
            raise WorldError(f"{name} is physical: carry it, or let it drive there")
        return self._members[self.virtual.index(name)]

    def _resize(self, odometry: Floats, used: Floats) -> None:
        """The list of virtual robots has changed, or their rows: `odometry` and `used` are theirs."""
        engine = self._engine
        self._rows = (~engine.kinematic).nonzero()[0] if self._ghosts else slice(None)
        models = [member.model for member in self._members]
        self._sensors.resize(self.virtual, models, engine.wheels[self._rows], odometry)
        self._batteries = Batteries(models, used, engine.wheels[self._rows], engine.velocities[self._rows, 0])

    def _spawn(self, request: WorldRequest) -> None:
        name = _named(request)
        if request.model is None or request.pose is None:
            raise WorldError(f"spawn {name}: expected a model and a pose")
        if name in self.names:
            raise WorldError(f"spawn {name}: expected a name that is not in the world")
        try:
            model = robot_model(request.model)
        except ConfigError as error:
            raise WorldError(f"spawn {name}: {error}") from None
        self._require_room(name, model, request.pose, set())
        self._add(name, model, request.pose)
        self._resize(np.vstack((self._sensors.odometry, np.zeros(3))), np.append(self._batteries.used, 0.0))

    def _remove(self, name: str) -> None:
        self._engine.remove(name)
        if self._ghosts.pop(name, None) is not None:
            self._resize(self._sensors.odometry, self._batteries.used)
            return
        row = self.virtual.index(name)
        del self._members[row]
        self._resize(np.delete(self._sensors.odometry, row, axis=0), np.delete(self._batteries.used, row))

    def _move(self, places: dict[str, Pose]) -> None:
        for name, pose in places.items():
            self._require_room(name, self._member(name).model, pose, set(places))
            for other, other_pose in places.items():
                if other < name and overlap(self.model(name), pose, self.model(other), other_pose):
                    raise WorldError(f"place {name}: expected room, but it would overlap {other}")
        for name, pose in places.items():
            self._engine.place(name, pose)
            row = self.virtual.index(name)
            self._sensors.odometry[row] = 0.0
            self._batteries.place(row)

    def _require_room(self, name: str, model: RobotModel, pose: Pose, leaving: set[str]) -> None:
        """Raise WorldError unless the pose is free of walls and of robots other than `name` and those leaving."""
        if problems := place_problems(self.map, name, model, pose):
            raise WorldError(problems[0])
        for other in self.names:
            if other != name and other not in leaving and overlap(model, pose, self.model(other), self.pose(other)):
                raise WorldError(f"place {name}: expected room, but it would overlap {other}")


def _named(request: WorldRequest) -> str:
    if request.robot is None:
        raise WorldError(f"{request.kind}: expected a robot, got none")
    return request.robot


def _pressed(touch: int, bumpers: int) -> list[bool]:
    return [bool(touch >> n & 1) for n in range(bumpers)] if touch else [False] * bumpers
