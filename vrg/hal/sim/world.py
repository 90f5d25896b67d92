"""The world: robots on a map, their commands, limits, sensors and batteries. Pure: no bus, no clock."""

from dataclasses import dataclass, field

import numpy as np

from vrg.bus.messages import Body, Laser, Pose, Poses, RefereeState, RequestKind, RobotState, WorldRequest
from vrg.errors import ConfigError, WorldError
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.robot import limit_wheels
from vrg.hal.sim.battery import Batteries
from vrg.hal.sim.config import WorldConfig, check_setup, fingerprint, overlap, place_problems
from vrg.hal.sim.engine import Floats, make_engine
from vrg.hal.sim.lidar import Lidar
from vrg.hal.sim.map import load_map
from vrg.hal.sim.safety import Interlock, RefereeGate
from vrg.hal.sim.sensors import Sensors
from vrg.hal.sim.snapshot import RobotSnapshot, WorldSnapshot

_BATTERY_TICKS = 10
"""Ticks between energy balances."""
_EMPTY = "battery empty: motors are off"
_SILENT = "no drive command in time: braked"
_LOCKED = "stopped by the emergency stop: disarm it, then arm it"
_BRAKE = (0.0, 0.0, True)


@dataclass(slots=True)
class _Member:
    """One robot in the world, in the order of the engine's rows."""

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
        self._limits: dict[str, float] = {}
        self._gate = RefereeGate()
        self._sensors = Sensors(config.seed, config.noise)
        self._lidar = Lidar(self.map, config.seed, config.noise)
        for robot in config.robots:
            self._add(robot.name, robot_model(robot.model), robot.pose)
        self._resize(np.zeros((len(self._members), 3)), np.zeros(len(self._members)))

    @property
    def time(self) -> float:
        """Match time, s."""
        return self.tick * self.config.tick

    @property
    def names(self) -> list[str]:
        """The robots in the world, in a fixed order."""
        return [member.name for member in self._members]

    def model(self, name: str) -> RobotModel:
        """A robot's model.

        Raises:
            WorldError: there is no such robot.
        """
        return self._members[self._engine.row(name)].model

    def pose(self, name: str) -> Pose:
        """Where a robot truly is.

        Raises:
            WorldError: there is no such robot.
        """
        return Pose(*self._engine.poses[self._engine.row(name)].tolist())

    def drive(self, name: str, left: float, right: float, armed: bool) -> None:
        """A drive command (rad/s) arrived. One for a robot that is not in the world is ignored: it may come yet."""
        for member in self._members:
            if member.name == name:
                member.interlock.drive(self.time, left, right, armed, self.estop)

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
        """Spawn, remove, reset or place.

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
                chosen = self.names if request.robot is None else [request.robot]
                self._move({name: self._members[self._engine.row(name)].start for name in chosen})

    def step(self) -> None:
        """Advance by one tick."""
        self.tick += 1
        self._apply_commands()
        self._engine.step(self.config.tick)
        if self.tick % _BATTERY_TICKS == 0:
            self._drain()

    def states(self) -> list[RobotState]:
        """What each robot knows of itself, in the order of `names`. Reads the sensors: once a tick."""
        engine = self._engine
        reading = self._sensors.read(self.tick, self.config.tick, engine.poses, engine.wheels)
        numbers = np.concatenate((reading.ins, reading.odometry, reading.velocity), axis=1).tolist()
        charges = self._batteries.charge.tolist()
        now = self.time
        states = []
        for member, row, (left, right), touch, charge in zip(
            self._members, numbers, reading.encoders.tolist(), engine.touch, charges, strict=True
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
        """Where every body truly is."""
        engine = self._engine
        bodies = [
            Body(name, Pose(x, y, theta), v, w, False)
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
        robots = [
            RobotSnapshot(
                name=member.name,
                model=member.model.name,
                start=member.start,
                pose=Pose(*self._engine.poses[row].tolist()),
                wheels=(float(self._engine.wheels[row, 0]), float(self._engine.wheels[row, 1])),
                odometry=Pose(*self._sensors.odometry[row].tolist()),
                energy_used=float(self._batteries.used[row]),
                wheel_limit=member.wheel_limit,
                locked=member.interlock.locked,
            )
            for row, member in enumerate(self._members)
        ]
        return WorldSnapshot(
            setup=self._setup,
            tick=self.tick,
            epoch=self.epoch,
            estop=self.estop,
            refereed=self._gate.refereed,
            robots=robots,
        )

    def restore(self, snapshot: WorldSnapshot) -> None:
        """Go on from a snapshot, in a new epoch, with every robot at rest and its motors off.

        Raises:
            ConfigError: it names a robot model that is not known.
            WorldError: it is of another set-up than this world's.
        """
        if snapshot.setup != self._setup:
            raise WorldError(
                f"snapshot: expected one of this set-up ({self._setup}), got one of another ({snapshot.setup}): "
                "choose another run folder, or delete the snapshot to begin anew"
            )
        models = [robot_model(robot.model) for robot in snapshot.robots]
        for name in self.names:
            self._engine.remove(name)
        self._members.clear()
        self.tick, self.epoch, self.estop = snapshot.tick, snapshot.epoch + 1, snapshot.estop
        self._gate = RefereeGate(refereed=snapshot.refereed)
        for robot, model in zip(snapshot.robots, models, strict=True):
            member = self._add(robot.name, model, robot.pose)
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
        engine = self._engine
        self._batteries.draw(_BATTERY_TICKS * self.config.tick, engine.wheels, engine.velocities[:, 0])
        for member, charge in zip(self._members, self._batteries.charge.tolist(), strict=True):
            member.empty = charge <= 0.0

    def _add(self, name: str, model: RobotModel, pose: Pose) -> _Member:
        self._engine.add(name, model, pose)
        v_max = min(self._limits.get(name, model.v_max), model.v_max)
        member = _Member(name, model, pose, wheel_limit=v_max / model.wheel_radius)
        self._members.append(member)
        return member

    def _resize(self, odometry: Floats, used: Floats) -> None:
        """The list of robots has changed."""
        engine = self._engine
        self._sensors.resize(engine.names, engine.models, engine.wheels, odometry)
        self._batteries = Batteries(engine.models, used, engine.wheels, engine.velocities[:, 0])

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
        row = self._engine.row(name)
        self._engine.remove(name)
        del self._members[row]
        self._resize(np.delete(self._sensors.odometry, row, axis=0), np.delete(self._batteries.used, row))

    def _move(self, places: dict[str, Pose]) -> None:
        for name, pose in places.items():
            self._require_room(name, self.model(name), pose, set(places))
            for other, other_pose in places.items():
                if other < name and overlap(self.model(name), pose, self.model(other), other_pose):
                    raise WorldError(f"place {name}: expected room, but it would overlap {other}")
        for name, pose in places.items():
            self._engine.place(name, pose)
            row = self._engine.row(name)
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
