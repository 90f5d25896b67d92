"""The node that shows a match to ROS 2: it hears the match and publishes topics.

It changes nothing but what players with the strategy `ros` do: it passes on to them what comes on their topic
`cmd_vel`, as the lease that a person's window has, too. So device, permission and watchdog are the same.

Below the match's namespace, such as `/courtyard`: `map`, `markers`, `referee/state` and `referee/calls`, and for each
robot `odom`, `pose`, `robot_description`, and what its sensors measure: `scan`, `range`, `battery_state`, `fix`.
Besides `/clock`, `/tf` and `/tf_static`.
"""

import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Final

import msgspec

from vrg.bus.mailbox import Inlet, Mailbox, is_power_of_ten
from vrg.bus.messages import FieldObject, Manual, Poses, RefereeState, SensorMessage, Zone
from vrg.bus.node import Node, Tick
from vrg.bus.pacing import lease, match_speed
from vrg.bus.topics import Keys
from vrg.games import UNKNOWN_GAME, game_of
from vrg.games.game import Game
from vrg.hal.models import RobotModel
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.gps import Gps, GpsSpec
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sensors.sonar import Sonar, SonarSpec
from vrg.hal.sensors.spec import SensorSpec
from vrg.regions import Region
from vrg.types import Pose
from vrg_ros import messages as ros
from vrg_ros.wire import ros_name

if TYPE_CHECKING:
    from vrg_ros.graph import RosNode

log = logging.getLogger(__name__)

REPUBLISH_PERIOD: Final = 2.0
"""The match time in s after which what late subscribers need is published again: map, descriptions, static frames."""
PERIOD: Final = 1 / 30
"""The match time in s between two ticks, and so between two messages of a topic."""
CALL_SHOWN: Final = 4.0
"""The match time in s for which the marker of a call is shown."""
ASLEEP: Final = 0.5
"""The real time in s between two ticks from which on commands that came in between are dropped."""
SHOWN: Final[Mapping[str, tuple[str, str]]] = {
    Battery.kind: ("battery_state", "sensor_msgs/BatteryState"),
    Gps.kind: ("fix", "sensor_msgs/NavSatFix"),
    Laser.kind: ("scan", "sensor_msgs/LaserScan"),
    Sonar.kind: ("range", "sensor_msgs/Range"),
}
"""The kinds of sensors that ROS has messages for: the topic and the type of each."""


class RosPublisher(Node):
    """Publishes a match.

    Args:
        name: of the node. mailbox: its mailbox. keys: the keys of the match. namespace: such as `/courtyard`.
        node: the node of the graph that publishes messages.
        robots: the models of the players' robots, by name. obstacles: the ground that walls and obstacles cover, m.
        driven: of each player that ROS drives, what returns the newest command (geometry_msgs/Twist) that has arrived
            for it since the last call; None if none has.
    """

    kind: ClassVar[str] = "spectator"

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        namespace: str,
        node: "RosNode",
        *,
        robots: Mapping[str, RobotModel],
        obstacles: Sequence[Region] = (),
        driven: Mapping[str, Callable[[], ros.Fields | None]] = {},
    ) -> None:
        super().__init__(name, mailbox, PERIOD)
        self._driven = driven
        self._manual = {robot: keys.manual(robot) for robot in driven}
        self._namespace, self._node, self._robots, self._obstacles = namespace, node, robots, tuple(obstacles)
        self._clock = mailbox.subscribe(keys.clock)
        self._poses = mailbox.subscribe(keys.poses)
        self._states = mailbox.subscribe(keys.referee_state)
        self._calls = mailbox.subscribe(keys.referee_event)
        shown = [(robot, spec) for robot, model in robots.items() for spec in model.sensors if spec.kind in SHOWN]
        self._sensors = {keys.sensor(spec.message, robot, spec.name).key: (robot, spec) for robot, spec in shown}
        """The robot and the sensor of each reading, by its key."""
        self._topics = {key: self._topic_of(robot, spec) for key, (robot, spec) in self._sensors.items()}
        """The topic and the type of each."""
        # One subscription for all robots: many of a key each cost more than what they bring.
        kinds = dict.fromkeys(spec.message for _, spec in shown)
        self._readings: list[Inlet[SensorMessage]] = [mailbox.subscribe(keys.sensor(kind), only=()) for kind in kinds]
        self._again = self._ticked = -math.inf
        self._left_out = 0
        """The number of commands that are no numbers."""
        self._game: Game = UNKNOWN_GAME
        self._lasting: list[tuple[str, str, ros.Fields]] = []
        """What lasts: topics, types and messages."""
        self._made_for: tuple[str, tuple[Zone, ...]] | None = None
        """The game and the zones that they were made for."""
        self._advertise()

    def tick(self, tick: Tick) -> None:
        """Publish what is new."""
        if (clock := self._clock.latest) is not None and self._clock.take():
            time = clock.body.time
            self._offer("/clock", "rosgraph_msgs/Clock", lambda: {"clock": ros.stamp(time)})
        state = self._states.latest
        if tick.live and state is not None and not 0.0 <= tick.time - self._again < REPUBLISH_PERIOD:
            self._again = tick.time
            self._publish_lasting(tick.time, state.body)
        for poses in self._poses.take():
            self._publish_poses(poses.stamp, poses.body)
        wanted = [key for key, topic in self._topics.items() if self._node.wanted(*topic)]
        for inlet in self._readings:
            inlet.only(wanted)
            for reading in inlet.take():
                make = partial(_measured, reading.stamp, *self._sensors[reading.key], reading.body)
                self._node.offer(*self._topics[reading.key], make)
        if state is not None and self._states.take():
            self._offer("referee/state", "std_msgs/String", lambda: _json(state.body))
            if state.body.objects:
                self._publish_markers(ros.things(state.stamp, self._placed(state.body), self._colour))
        for call in self._calls.take():
            self._node.publish(self._full("referee/calls"), "std_msgs/String", _json(call.body))
            if call.body.poses:
                note = ros.note(call.stamp, call.body.number, call.body.text, call.body.poses[0], CALL_SHOWN)
                self._publish_markers([note])
        # A command that came while this process, or the match, stood still does not count now.
        rate = 1.0 if clock is None else clock.body.rate
        awake = tick.live and 0.0 <= tick.time - self._ticked < ASLEEP * match_speed(rate)
        self._ticked = tick.time
        for robot, newest in self._driven.items():
            if (command := newest()) is not None and awake:
                self._drive(robot, command, rate)

    def _advertise(self) -> None:
        """Show every topic before its first message, so that subscribers get that, too."""
        self._node.advertise("/clock", "rosgraph_msgs/Clock")
        self._node.advertise("/tf", "tf2_msgs/TFMessage")
        for topic in ("referee/state", "referee/calls"):
            self._node.advertise(self._full(topic), "std_msgs/String")
        for robot in self._robots:
            self._node.advertise(self._full(f"{ros_name(robot)}/odom"), "nav_msgs/Odometry")
            self._node.advertise(self._full(f"{ros_name(robot)}/pose"), "geometry_msgs/PoseStamped")
        for topic, of in self._topics.values():
            self._node.advertise(topic, of)

    def _offer(self, topic: str, of: str, make: Callable[[], ros.Fields]) -> None:
        """Publish one message on a topic of the match, or on any with a leading slash, if anybody subscribes to it."""
        self._node.offer(self._full(topic), of, lambda: [make()])

    def _full(self, topic: str) -> str:
        return topic if topic.startswith("/") else f"{self._namespace}/{topic}"

    def _drive(self, robot: str, command: ros.Fields, rate: float) -> None:
        """Pass a command on, slowed down to what the robot can do on the same curve. NaN is left out."""
        model = self._robots[robot]
        shares = command["linear"]["x"] / model.v_max, command["angular"]["z"] / model.w_max
        aside = command["linear"]["y"] / model.v_max if model.drivetrain.holonomic else 0.0
        most = max(1.0, *map(abs, (*shares, aside)))
        forward, turn, side = (share / most for share in (*shares, aside))
        if math.isfinite(forward + turn + side + command["linear"]["z"]):
            climb = max(-1.0, min(1.0, command["linear"]["z"] / (model.climb_max or math.inf)))
            manual = Manual(forward=forward, turn=turn, side=side, climb=climb, lease=lease(rate))
            self.mailbox.publish(self._manual[robot], manual)
            return
        self._left_out += 1
        if is_power_of_ten(self._left_out):
            log.warning("%s: a command is dropped (number %d): %s", robot, self._left_out, command)

    def _publish_markers(self, markers: list[ros.Fields]) -> None:
        topic = self._full("markers")
        self._node.publish(topic, "visualization_msgs/MarkerArray", {"markers": markers}, lasting=True)

    def _publish_lasting(self, now: float, state: RefereeState) -> None:
        """Publish what those need who come later. It is made again only if the zones have changed."""
        if (state.game, state.zones) != self._made_for:
            self._made_for = state.game, state.zones
            self._game = UNKNOWN_GAME if not state.game else game_of(state.game)
            self._lasting = list(self._made(now, state))
        for topic, of, message in self._lasting:
            self._node.publish(self._full(topic), of, message, lasting=True)

    def _made(self, now: float, state: RefereeState) -> Iterator[tuple[str, str, ros.Fields]]:
        """The topic, the type and the message of each topic that lasts."""
        statics = []
        for robot, model in self._robots.items():
            name, mounts = ros_name(robot), _mounts(ros_name(robot), model)
            yield f"{name}/robot_description", "std_msgs/String", {"data": ros.urdf(name, model, mounts)}
            statics.append(ros.transform(0.0, ros.MAP, f"{name}/odom", Pose(0.0, 0.0, 0.0)))
            statics += [ros.transform(0.0, f"{name}/base_link", frame, *mount) for frame, mount in mounts.items()]
        yield "/tf_static", "tf2_msgs/TFMessage", {"transforms": statics}
        around = [zone.region for zone in state.zones]
        if self._obstacles or around:
            yield "map", "nav_msgs/OccupancyGrid", ros.occupancy(now, self._obstacles, around)
        markers = []
        for number, zone in enumerate(state.zones):
            markers += ros.outline(now, number, zone.name, zone.region, self._colour(zone.team))
        yield "markers", "visualization_msgs/MarkerArray", {"markers": markers}

    def _colour(self, team: str | None) -> tuple[float, float, float]:
        red, green, blue = self._game.team_style(team).colour if team else (200, 200, 200)
        return red / 255, green / 255, blue / 255

    def _placed(self, state: RefereeState) -> list[tuple[FieldObject, Pose]]:
        """The things of the game that are no robots, each where it is or where the robot is that carries it."""
        bodies = {} if self._poses.latest is None else {b.name: b.pose for b in self._poses.latest.body.bodies}
        return [(o, bodies.get(o.carrier or "", Pose(o.x, o.y, 0.0))) for o in state.objects]

    def _publish_poses(self, stamp: float, poses: Poses) -> None:
        bodies = [
            (max(0.0, stamp - body.age), ros_name(body.name), body)
            for body in poses.bodies
            if body.name in self._robots
        ]
        for at, name, body in bodies:
            odometry = partial(ros.odometry, at, name, body.pose, body.twist, body.uncertainty)
            self._offer(f"{name}/odom", "nav_msgs/Odometry", odometry)
            self._offer(f"{name}/pose", "geometry_msgs/PoseStamped", partial(ros.pose_stamped, at, body.pose))

        def frames() -> ros.Fields:
            found = [ros.transform(at, f"{name}/odom", f"{name}/base_link", body.pose) for at, name, body in bodies]
            return {"transforms": found}

        self._offer("/tf", "tf2_msgs/TFMessage", frames)

    def _topic_of(self, robot: str, spec: SensorSpec) -> tuple[str, str]:
        topic, of = SHOWN[spec.kind]
        return self._full(f"{ros_name(robot)}/{topic}"), of


def _measured(stamp: float, robot: str, spec: SensorSpec, reading: SensorMessage) -> list[ros.Fields]:
    """The messages of a reading; a sonar has one for each transducer."""
    frame = _frame(ros_name(robot), spec)
    if isinstance(reading, Laser):
        ranges = memoryview(reading.data).cast("f")
        return [ros.scan(stamp, frame, reading.angle_min, reading.angle_step, reading.range_max, ranges, 1 / spec.rate)]
    if isinstance(reading, Battery):
        return [ros.battery(stamp, reading.charge)]
    if isinstance(reading, Gps) and isinstance(spec, GpsSpec):
        return [ros.satellite_fix(stamp, frame, reading.latitude, reading.longitude, spec.position_noise)]
    if isinstance(reading, Sonar) and isinstance(spec, SonarSpec):
        return [
            ros.reach(stamp, f"{frame}_{number}", distance, spec.cone, spec.range_min, spec.range_max)
            for number, distance in enumerate(reading.ranges)
        ]
    return []


def _json(body: msgspec.Struct) -> ros.Fields:
    return {"data": msgspec.json.encode(body, enc_hook=str).decode()}


def _frame(robot: str, spec: SensorSpec) -> str:
    return f"{robot}/{spec.kind}_{ros_name(spec.name)}"


def _mounts(robot: str, model: RobotModel) -> dict[str, tuple[Pose, float]]:
    """The mounts of the sensors of a robot, and how high above the ground, m, by the names of their frames."""
    found = {}
    for spec in model.sensors:
        if isinstance(spec, LaserSpec):
            found[_frame(robot, spec)] = (Pose(spec.x, 0.0, 0.0), spec.height)
        elif isinstance(spec, SonarSpec):
            found |= {f"{_frame(robot, spec)}_{n}": (place, model.height / 2) for n, place in enumerate(spec.places)}
        elif isinstance(spec, GpsSpec):
            found[_frame(robot, spec)] = (Pose(0.0, 0.0, 0.0), spec.height)
    return found
