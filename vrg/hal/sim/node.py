"""The world as a node: it owns match time, listens to robots and the referee, and publishes where all robots are."""

import logging
from collections.abc import Mapping
from functools import partial

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Clock, Estop, MeasuredPose, SensorMessage, WorldAnswer, WorldRequest, shortened
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys, Topic, name_in
from vrg.errors import WorldError
from vrg.hal.estop import EstopOrders
from vrg.hal.models import RobotModel
from vrg.hal.sim.config import WorldConfig, overlap, place_problems
from vrg.hal.sim.engines import BULLET, installed
from vrg.hal.sim.sensors.suite import Frame
from vrg.hal.sim.snapshot import decode_snapshot, encode_snapshot
from vrg.hal.sim.world import World
from vrg.types import Pose

log = logging.getLogger(__name__)

LOUD_NAMES = 100
"""The number of names whose refused poses are logged. It is bounded because any program may send any name."""


class WorldNode(Node):
    """The node of the world's process. Its period is the world's tick.

    Its first tick, at `start_tick`, only publishes; every later one steps the world first. The executor chooses the
    time of a tick; it must be (start_tick + number of ticks so far) * period.

    Args:
        config: the set-up of the world.
        mailbox: the node's own mailbox. keys: the keys of the match.
        snapshot: the bytes of a snapshot. The world continues from it: one epoch later, with every robot at rest.

    Raises:
        ConfigError: the set-up has problems; the error lists all of them.
        WorldError: the snapshot is damaged, of another release, or of another set-up.
    """

    kind = "world"

    def __init__(self, config: WorldConfig, mailbox: Mailbox, keys: Keys, snapshot: bytes | None = None) -> None:
        super().__init__("world", mailbox, config.tick)
        self.world = World(config, None if snapshot is None else decode_snapshot(snapshot))
        self._keys = keys
        self._started = False
        self._measured = mailbox.subscribe(keys.robot_pose())
        self._seen = mailbox.subscribe(keys.thing_pose())
        self._refused: set[str] = set()
        self._drives = mailbox.subscribe(keys.drive())
        self._limits = mailbox.subscribe(keys.speed_limit())
        self._camera_requests = mailbox.subscribe(keys.camera_request())
        self._blind = False
        """True if pictures were asked for that nothing can draw; what a program asks for must not end the world."""
        self._requests = mailbox.subscribe(keys.world_request)
        self._answers = keys.world_answer
        self._referee = mailbox.subscribe(keys.referee_state, sampled=True)
        self._estops = EstopOrders(mailbox, keys)
        self._poses = keys.poses
        self._clock = keys.clock
        self._states = {name: keys.robot_state(name) for name in self.world.virtual}
        self._sensors: dict[tuple[str, str, type[SensorMessage]], Topic[SensorMessage]] = {}
        for robot, spec in self.world.sensors:
            self._sensor_of(robot, spec.name, spec.message)
        mailbox.deferring = [self._poses, self._clock, *self._states.values(), *self._sensors.values()]

    @property
    def start_tick(self) -> int:
        """The number of the first tick: 0, or the snapshot's. Read it before the first tick only."""
        return self.world.tick

    def snapshot(self) -> bytes:
        """The bytes of a snapshot, from which a new world can go on."""
        return encode_snapshot(self.world.snapshot())

    def tick(self, tick: Tick) -> None:
        """Listen, step the world, and publish. The clock is published last, so that its receivers have all else."""
        self._listen()
        if self._started:
            self.world.step()
        self._started = True
        defer, world = self.mailbox.defer, self.world
        if states := dict(world.states()):
            defer([self._states[name] for name in states], lambda: list(states.values()))
        for frame in world.frames():
            defer([self._sensor_of(*sensor) for sensor in frame.sensors], partial(_in_order, frame))
        poses = world.poses_later()
        defer([self._poses], lambda: [poses()])
        if world.physical:
            for body in poses().bodies:
                if body.physical:
                    seen = MeasuredPose(pose=body.pose, twist=body.twist)
                    self.mailbox.publish(self._keys.robot_seen(body.name), seen)
        clock = partial(
            Clock, time=tick.time, tick=world.tick, epoch=world.epoch, rate=world.config.rate, estop=world.estop
        )
        defer([self._clock], lambda: [clock()])

    def stop(self) -> None:
        """Close the engine."""
        self.world.close()

    def _listen(self) -> None:
        world = self.world
        if not (self.mailbox.brought or self._referee.is_new):
            return
        order = self._estops.take()
        if order is not None:
            world.engage(isinstance(order, Estop))
        if (state := self._referee.news()) is not None:
            world.referee(state.body, state.stamp)
        for request in self._requests.take():
            self._request(request.body)
        for asked in self._camera_requests.take():
            if installed(BULLET):
                world.ask_camera(name_in(asked.key), asked.body.lease)
            elif not self._blind:
                self._blind = True
                log.warning("%s: no pictures: PyBullet, which draws them, is not installed", name_in(asked.key))
        for limit in self._limits.take():
            world.limit(name_in(limit.key), limit.body.v_max)
        for measured in (*self._measured.take(), *self._seen.take()):
            self._measure(measured)
        for drive in self._drives.take():
            world.drive(name_in(drive.key), drive.body.twist, drive.body.armed, drive.body.use)

    def _measure(self, measured: Received[MeasuredPose]) -> None:
        name, body = name_in(measured.key), measured.body
        if body.uncertainty is not None and name in self.world.virtual:
            return  # the fusion centre has located it for its player; the world knows better
        try:
            self.world.measure(name, body, measured.stamp)
        except WorldError as error:
            # Such poses come many times a second: only the first is logged, and the first after a good one.
            if name not in self._refused and len(self._refused) < LOUD_NAMES:
                self._refused.add(name)
                log.warning("ignored a measured pose: %s", error)
        else:
            self._refused.discard(name)

    def _request(self, request: WorldRequest) -> None:
        refused = None
        try:
            place(self.world, request.places)
        except WorldError as error:
            log.warning("refused a request to the world: %s", error)
            refused = shortened(str(error))
        if refused is not None or request.id is not None:
            self.mailbox.publish(self._answers, WorldAnswer(id=request.id, refused=refused))

    def _sensor_of(self, robot: str, sensor: str, message: type[SensorMessage]) -> Topic[SensorMessage]:
        topic = self._sensors.get((robot, sensor, message))
        if topic is None:
            topic = self._sensors[robot, sensor, message] = self._keys.sensor(message, robot, sensor)
        return topic


def _in_order(frame: Frame) -> list[SensorMessage]:
    """The readings in the order of their sensors.

    Raises:
        WorldError: the simulation gives none for one that is due.
    """
    made = {(robot, name): reading for robot, name, reading in frame.make()}
    if lacks := [
        f"{message.kind} {name} of {robot}" for robot, name, message in frame.sensors if (robot, name) not in made
    ]:
        raise WorldError(f"sense: expected a reading of each sensor that is due, got none of {', '.join(lacks)}")
    return [made[robot, name] for robot, name, _ in frame.sensors]


def place(world: World, places: Mapping[str, Pose]) -> None:
    """Put robots and passive bodies somewhere, as many as there is room for; the others stay where they are.

    A physical robot, or a tracked body, cannot be placed, because only people can move it.

    Raises:
        WorldError: there are no places, or some robots stay; the error names them, each with the reason.
    """
    if not places:
        raise WorldError("place: expected places, got none")
    robots = {name: pose for name, pose in places.items() if name not in world.bodies.names}
    refused: dict[str, str] = {}
    # A robot that stays is in the way of others, so that one refusal may lead to more.
    while wrong := _without_room(world, {name: pose for name, pose in robots.items() if name not in refused}):
        refused |= wrong
    for name, pose in places.items():
        # A body makes room by itself: what overlaps with it pushes it away, unless it is where it was seen.
        if name in world.tracked:
            refused[name] = f"place {name}: it is a real one, which only people can put there"
        elif name not in robots and not world.map.bounds.contains(pose.x, pose.y):
            refused[name] = f"place {name}: expected a place inside map {world.map.name}"
    for name, pose in places.items():
        if name not in refused:
            world.place(name, pose)
    if refused:
        raise WorldError("; ".join(refused.values()))


def _without_room(world: World, places: Mapping[str, Pose]) -> dict[str, str]:
    """The robots that cannot be put where they should be, each with the reason."""
    found = {}
    for name, pose in places.items():
        try:
            _require_room(world, name, world.robot(name).model, pose, set(places))
        except WorldError as error:
            found[name] = str(error)
            continue
        for other, other_pose in places.items():
            if other < name and overlap(world.model(name), pose, world.model(other), other_pose):
                found[name] = f"place {name}: expected room, but it would overlap {other}"
    return found


def _require_room(world: World, name: str, model: RobotModel, pose: Pose, leaving: set[str]) -> None:
    """Raise WorldError unless the pose is free of walls and of robots other than `name` and those leaving."""
    problem = place_problems(world.map, name, model, pose)
    if problem is not None:
        raise WorldError(f"robot {name}: {problem}")
    for other in world.names:
        there = world.pose(other)
        if there.z > model.height:
            continue  # it flies above
        if other != name and other not in leaving and overlap(model, pose, world.model(other), there):
            kind = ", a physical robot" if other not in world.virtual else ""
            raise WorldError(f"place {name}: expected room, but it would overlap {other}{kind}")
