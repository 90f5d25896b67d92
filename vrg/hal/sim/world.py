"""The world: robots on a map, their commands, limits, sensors and batteries. It uses no bus and no clock.

A physical robot has all of these itself. In the world it is a ghost: a body that is where the robot was measured.
Virtual robots see the ghost and run into it. The world also uses the ghost's pose to synthesise the range sensors that
the robot lacks. A tracked ball or box is a ghost, too.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from vrg.bus.messages import LOST, Body, MeasuredPose, Poses, RefereeState, RobotState, Stage, Thing
from vrg.errors import ConfigError, WorldError
from vrg.hal.actuators import UNUSED
from vrg.hal.models import RobotModel
from vrg.hal.permission import Permission
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.bodies import Bodies
from vrg.hal.sim.config import WorldConfig, check_setup, fingerprint
from vrg.hal.sim.engines import ENGINES
from vrg.hal.sim.engines.air import AirEngine
from vrg.hal.sim.engines.engine import Start
from vrg.hal.sim.map import load_map
from vrg.hal.sim.robot import Batteries, Ghost, VirtualRobot
from vrg.hal.sim.sensors.base import NO_HEIGHTS, Instant, Measured, Noise, Surroundings
from vrg.hal.sim.sensors.suite import Frame, SensorSuite
from vrg.hal.sim.snapshot import RobotSnapshot, WorldSnapshot
from vrg.hal.sim.uses import Uses
from vrg.types import LEVEL, Pose, Twist

_BATTERY_TICKS = 10
"""The number of ticks between two energy balances."""
DRIFT_TIME = 1.0
"""The match time in s for which a robot in the air drifts into one direction."""
STATE_PERIOD = 0.1
"""The match time in s between two states of a robot of which nothing has changed."""


class World:
    """A world of virtual and physical robots. Its time is `tick * config.tick`; it begins at tick 0.

    Args:
        config: the set-up of the world.
        snapshot: the world as it was. It goes on in a new epoch, with every robot at rest and its motors off. Physical
            robots are taken to be at their poses in the snapshot, as if measured at the snapshot's time.

    Raises:
        ConfigError: check_setup found problems; the error lists all of them.
        WorldError: the snapshot is of another set-up than this world's.

    Attributes:
        tracked: the tracked bodies, by name. Each is lost until it is seen.
    """

    def __init__(self, config: WorldConfig, snapshot: WorldSnapshot | None = None) -> None:
        if problems := check_setup(config):
            raise ConfigError(problems)
        self.config = config
        self.map = load_map(config.map)
        self._setup = fingerprint(config)
        if snapshot is not None and snapshot.setup != self._setup:
            raise WorldError(
                f"snapshot: expected one of this set-up ({self._setup}), got one of another ({snapshot.setup}): "
                "choose another run folder, or delete the snapshot to start over"
            )
        self.tick, self.epoch, self.estop, self._permission = 0, 0, False, Permission()
        before: dict[str, RobotSnapshot] = {}
        seen: dict[str, Pose] = {}
        if snapshot is not None:
            self.tick, self.epoch, self.estop = snapshot.tick, snapshot.epoch + 1, snapshot.estop
            self._permission = Permission(refereed=snapshot.refereed)
            before, seen = snapshot.robots, snapshot.physical
        starts = []
        for setup in config.robots:
            kept = before.get(setup.name)
            pose, angles = (seen.get(setup.name, setup.pose), ()) if kept is None else (kept.pose, kept.angles)
            starts.append(Start(setup.name, setup.description, pose, setup.physical, angles))
        ground, flying = ENGINES.get(config.engine), any(start.model.flies for start in starts)
        surroundings = Surroundings(self.map, config.seed, config.noise)
        self._drift = Noise(lambda: surroundings.seed, "drift", 2, [start.name for start in starts])
        self._engine = engine = (
            AirEngine(ground, self.map, starts, self._drifts) if flying else ground(self.map, starts)
        )
        self._flying = flying
        self._robots: list[VirtualRobot | Ghost] = [
            Ghost(start.name, start.pose, self.time) if start.kinematic else VirtualRobot(start.name, start.model, row)
            for row, start in enumerate(starts)
        ]
        """All robots, in the order of the engine's rows."""
        self._ghosts = {robot.name: robot for robot in self._robots if isinstance(robot, Ghost)}
        self._virtual = {robot.name: robot for robot in self._robots if isinstance(robot, VirtualRobot)}
        self._pictures = {setup.name: math.inf for setup in config.robots if setup.camera}
        """The match time until which pictures of a robot's camera are requested, s."""
        self._settled_until = -math.inf
        """The match time up to which every robot goes on as it was last decided, s, if the world hears nothing new."""
        self._decided = True
        """True if it was decided again what the robots do since their states were last asked for."""
        self._state_ticks = max(1, round(STATE_PERIOD / config.tick))
        self._said: dict[str, RobotState] = {}
        used = np.array([before[name].energy_used if name in before else 0.0 for name in engine.names])
        self._batteries = Batteries(engine.models, used, engine.angles, engine.velocities)
        self.bodies = Bodies(self.map, config.bodies, engine)
        stood = {setup.name: setup.pose for setup in config.bodies} | ({} if snapshot is None else snapshot.bodies)
        self.tracked = {s.name: Ghost(s.name, stood[s.name], -math.inf) for s in config.bodies if s.tracked}
        if snapshot is not None:
            for body, pose in snapshot.bodies.items():
                self.bodies.place(body, pose)
            for body, grip in snapshot.held.items():
                self.bodies.hold(self.bodies.names.index(body), grip)
        self._uses = Uses(self.bodies)
        self._sensors = SensorSuite(surroundings, engine.names, engine.kinematic.tolist(), self._instant())
        for name, robot in self._virtual.items():
            if (kept := before.get(name)) is not None:
                robot.locked = kept.locked
                self._permission.limit(name, kept.v_max)
                self._sensors.recall(name, kept.sensors)
        self._find_empty()

    @property
    def time(self) -> float:
        """The match time, s."""
        return self.tick * self.config.tick

    @property
    def names(self) -> list[str]:
        """The names of all robots in the world, virtual and physical, in a fixed order."""
        return list(self._engine.names)

    @property
    def virtual(self) -> list[str]:
        """The names of the virtual robots, in the same order."""
        return list(self._virtual)

    @property
    def physical(self) -> list[str]:
        """The names of the physical robots, in the same order."""
        return list(self._ghosts)

    @property
    def sensors(self) -> list[tuple[str, SensorSpec]]:
        """The sensors that are simulated: the name of the robot, and the spec of each."""
        return self._sensors.mounted

    def robot(self, name: str) -> VirtualRobot:
        """The virtual robot of this name.

        Raises:
            WorldError: there is no such robot, or it is physical.
        """
        self._engine.row(name)
        if name in self._ghosts:
            raise WorldError(f"{name} is physical: carry it, or let it drive there")
        return self._virtual[name]

    def model(self, name: str) -> RobotModel:
        """The model of a robot.

        Raises:
            WorldError: there is no such robot.
        """
        return self._engine.models[self._engine.row(name)]

    def pose(self, name: str) -> Pose:
        """The true pose of a virtual robot, or the assumed pose of a physical one.

        Raises:
            WorldError: there is no such robot.
        """
        row = self._engine.row(name)
        x, y, theta = self._engine.poses[row].tolist()
        return Pose(x, y, theta, float(self._engine.heights[row]) or LEVEL)

    def drive(self, name: str, twist: Twist, armed: bool, use: Mapping[str, float] = UNUSED) -> None:
        """Take in a drive command. One for a robot that is not in the world is ignored."""
        if name in self._virtual:
            self._virtual[name].drive(self.time, twist, armed=armed, estop=self.estop)
            if twist.is_finite:
                self._uses.hear(self._virtual[name], use)
            self._settled_until = -math.inf

    def measure(self, name: str, measured: MeasuredPose, stamp: float) -> None:
        """Take in a measured pose of a physical robot or a tracked body. One older than the newest changes nothing.

        Args:
            stamp: the match time of the measurement, s.

        Raises:
            WorldError: there is none of that name, or it was measured in the future.
        """
        ghost = self._ghosts.get(name) or self.tracked.get(name)
        if ghost is None:
            known = ", ".join([*self._ghosts, *self.tracked]) or "none"
            raise WorldError(f"pose of {name}: expected one of the physical robots and things ({known})")
        ghost.measure(measured, stamp, self.time)

    def limit(self, name: str, v_max: float) -> None:
        """Take in the referee's limit of a robot's speed, m/s. One for a robot that is not in the world is ignored."""
        if name in self._virtual:
            self._permission.limit(name, v_max)
            self._settled_until = -math.inf

    def ask_camera(self, name: str, lease: float) -> None:
        """Take pictures of a robot's camera for `lease` seconds of match time. An unknown robot is ignored.

        It never ends another lease. A viewer asks again before the lease ends.
        """
        if name in self._engine.names:
            self._pictures[name] = max(self.time + lease, self._pictures.get(name, 0.0))

    def engage(self, engaged: bool) -> None:
        """Latch or release the emergency stop. After a release no robot moves until it is armed again."""
        self.estop, self._settled_until = engaged, -math.inf
        if engaged:
            self._engine.cut()
            for robot in self._virtual.values():
                robot.stop()

    def referee(self, state: RefereeState, stamp: float) -> None:
        """Take in the referee's state of match time `stamp`, s."""
        self._permission.hear(stamp, state)
        self._settled_until = -math.inf
        if self._flying and state.stage is Stage.INITIALIZE:
            # The batteries of what flies last for minutes: people change them before a round.
            self._batteries.fill([row for row, model in enumerate(self._engine.models) if model.flies])
            self._find_empty()

    def place(self, name: str, pose: Pose) -> None:
        """Put a virtual robot or a passive body somewhere else, at rest, where there must be room for it.

        What holds or is held lets go.

        Raises:
            WorldError: there is none of that name, or it is physical.
        """
        if name in self.bodies.names:
            self.bodies.place(name, pose)
            return
        row = self.robot(name).row
        self.bodies.open(row)
        drivetrain = self._engine.models[row].flies
        height = 0.0 if drivetrain is None else min(max(pose.z, 0.0), drivetrain.ceiling)
        self._engine.place(name, Pose(pose.x, pose.y, pose.theta, height or LEVEL))
        self._sensors.placed(name)
        self._batteries.place(row)

    def step(self) -> None:
        """Advance by one tick."""
        self.tick += 1
        engine, now = self._engine, self.time
        if now > self._settled_until:
            self._decide(now)
        for name, ghost in self._ghosts.items():
            engine.move(name, *ghost.at(now))
        for name, seen in self.tracked.items():
            self.bodies.track(name, *seen.at(now))
        before = engine.poses.copy() if self.bodies.names else engine.poses
        engine.step(self.config.tick)
        if self.bodies.names:
            pulls = self._uses.act(now, self._permission, engine.poses, engine.velocities)
            for push in self.bodies.step(self.config.tick, before, engine.poses, engine.velocities, pulls):
                engine.push(push)
        if self.tick % _BATTERY_TICKS == 0:
            self._batteries.draw(_BATTERY_TICKS * self.config.tick, engine.angles, engine.velocities, engine.heights)
            self._find_empty()

    def _drifts(self) -> npt.NDArray[np.float64]:
        """How robots in the air drift at this tick; see `AirEngine`."""
        number = self.tick // round(DRIFT_TIME / self.config.tick)
        return self._drift.at(number) if self.config.noise else np.zeros((len(self._robots), 2))

    def _decide(self, now: float) -> None:
        """Decide what each virtual robot does at match time `now`, s."""
        for name, robot in self._virtual.items():
            before = robot.command
            command = robot.decide(now, self._permission, estop=self.estop)
            if command != before:
                self._engine.command(name, command)
        held = [robot.holds_until for robot in self._virtual.values()]
        self._settled_until, self._decided = min([self._permission.holds_until(now), *held]), True

    def reseed(self, seed: int) -> None:
        """Let all noise depend on another seed from now on."""
        self._sensors.reseed(seed)

    def sense(self) -> list[Measured]:
        """The readings of all sensors that are due at this tick. It must be called once per tick."""
        return [reading for frame in self.frames() for reading in frame.make()]

    def frames(self) -> list[Frame]:
        """As `sense`, but those that can be made later are not made yet. Only one of the two is called at a tick."""
        return self._sensors.frames(self._instant(), range_finders=self.config.lasers)

    def states(self) -> list[tuple[str, RobotState]]:
        """The states of the virtual robots: those that have changed, and all of them every STATE_PERIOD."""
        regular = self.tick % self._state_ticks == 0
        if not self._decided:
            return list(self._said.items()) if regular else []
        now, estop, self._decided = self.time, self.estop, False
        states = [(name, robot.state(now, estop=estop)) for name, robot in self._virtual.items()]
        news = [(name, state) for name, state in states if regular or self._said.get(name) != state]
        self._said |= dict(news)
        return news

    def poses(self) -> Poses:
        """The true poses of all virtual robots and the assumed poses of the physical ones."""
        return self.poses_later()()

    def poses_later(self) -> Callable[[], Poses]:
        """A function that returns what `poses` returns now, at any time."""
        engine, now = self._engine, self.time
        places = np.column_stack((engine.poses, engine.heights)) if self._flying else engine.poses.copy()
        moving = np.column_stack((engine.velocities, engine.climbs)) if self._flying else engine.velocities
        twists = [Twist(*velocity) for velocity in moving.tolist()]
        lost = {name for name, seen in self.tracked.items() if seen.age(now) > LOST}
        things = tuple(Thing(n, Pose(b.x, b.y, b.theta), b.vx, b.vy, b.w, n in lost) for n, b in self.bodies)
        marks = [robot.mark(twist, now) for robot, twist in zip(self._robots, twists, strict=True)]

        def make() -> Poses:
            rows = zip(self._robots, places.tolist(), twists, marks, strict=True)
            bodies = tuple(Body(r.name, _pose(*at), twist, *mark) for r, at, twist, mark in rows)
            return Poses(bodies=bodies, things=things)

        return make

    def snapshot(self) -> WorldSnapshot:
        """The snapshot from which a restarted world goes on."""
        robots = {
            name: RobotSnapshot(
                pose=self.pose(name),
                angles=self._engine.angles_of(robot.row),
                sensors=self._sensors.remember(name),
                energy_used=float(self._batteries.used[robot.row]),
                v_max=self._permission.v_max(name, robot.model),
                locked=robot.locked,
            )
            for name, robot in self._virtual.items()
        }
        return WorldSnapshot(
            setup=self._setup,
            tick=self.tick,
            epoch=self.epoch,
            estop=self.estop,
            refereed=self._permission.refereed,
            robots=robots,
            physical={name: self.pose(name) for name in self._ghosts},
            bodies={name: Pose(body.x, body.y, body.theta) for name, body in self.bodies},
            held={self.bodies.names[number]: grip for number, grip in self.bodies.grips.items()},
        )

    def close(self) -> None:
        """Close the engine and the sensors. Idempotent."""
        self._sensors.close()
        self._engine.close()

    def _instant(self) -> Instant:
        engine, now = self._engine, self.time
        return Instant(
            self.tick,
            self.config.tick,
            engine.models,
            engine.poses,
            engine.velocities,
            engine.angles,
            self.bodies.pressed(engine.touch, engine.models, engine.poses),
            self._batteries.charge,
            engine.heights if self._flying else NO_HEIGHTS,
            {name for name, until in self._pictures.items() if until > now},
            self.bodies.standing(),
        )

    def _find_empty(self) -> None:
        charges = self._batteries.charge.tolist()
        for robot in self._virtual.values():
            empty = charges[robot.row] <= 0.0
            if empty != robot.empty:  # what it says of itself changes now, and what it does at the next tick
                robot.empty, self._settled_until, self._decided = empty, -math.inf, True


def _pose(x: float, y: float, theta: float, z: float = LEVEL) -> Pose:
    return Pose(x, y, theta, z or LEVEL)
