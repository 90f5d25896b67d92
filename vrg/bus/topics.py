"""The key map: every key expression of a match, the message that travels on it, how it is delivered, and who may.

`Keys` is the table: one line for each key, and no other module writes a key by hand. docs/bus.md shows it to people who
write programs in other languages, and `vrg.bus.access` makes the router's rules of it.
"""

import enum
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, overload

from vrg.bus import messages as m
from vrg.names import check_name, chunk_of, name_of
from vrg.seats.parties import (
    COMMANDER,
    DEVICE,
    EVERYBODY,
    HOST,
    HUD,
    LAUNCHER,
    LOCATING,
    MATES,
    OFFICIAL,
    PLAYER,
    PLAYING,
    RECORDER,
    REFEREE,
    TRACKER,
    TRACKING,
    WINDOW,
    WORLD,
    Party,
)

M = TypeVar("M", bound=m.Message)
S = TypeVar("S", bound=m.SensorMessage)
T_co = TypeVar("T_co", bound=m.Message, covariant=True)

_HOLE = re.compile(r"\{(\w+)\}")


class Qos(enum.Enum):
    """The quality of service: how a message is delivered.

    LATEST is for sensors and commands: only the newest message counts, so a slow reader loses old ones.
    EVENT is for calls and orders: reliable, in order, and none is lost while the router lives.
    STATE is for states: reliable, only the newest message counts, and a late subscriber gets the last one at once.
    """

    LATEST = "latest"
    EVENT = "event"
    STATE = "state"


LATEST, EVENT, STATE = Qos.LATEST, Qos.EVENT, Qos.STATE


@dataclass(frozen=True)
class Topic(Generic[T_co]):
    """A key expression with the type and the quality of service of the messages on it.

    Args:
        key: a zenoh key expression; chunks may be `*` in a topic that is only subscribed to.
        type: the class of the messages. qos: how they are delivered.
        perishable, urgent: see `TopicLine`.
    """

    key: str
    type: type[T_co]
    qos: Qos
    perishable: bool = False
    urgent: bool = False


@dataclass(frozen=True)
class TopicLine(Generic[M]):
    """One line of the table, with a key that has no names in it. As an attribute of a `Keys` object it is the topic.

    Args:
        path: the key below `vrg/<match>/`. message: the class of the messages on it. qos: how they are delivered.
        speakers: who publishes. listeners: who listens; officials may hear everything besides.
        meaning: the content of the message.
        perishable: True for events that count at once or never, such as a person's decision that lets robots move. They
            are not published again or asked for after a lost link.
        urgent: True for what goes before the other LATEST messages over a link that is too slow for all of them.
    """

    path: str
    message: type[M]
    qos: Qos
    speakers: tuple[Party, ...]
    listeners: tuple[Party, ...]
    meaning: str
    perishable: bool = False
    urgent: bool = False

    @overload
    def __get__(self, keys: None, owner: "type[Keys]") -> "TopicLine[M]": ...
    @overload
    def __get__(self, keys: "Keys", owner: "type[Keys]") -> Topic[M]: ...
    def __get__(self, keys: "Keys | None", owner: "type[Keys]") -> "TopicLine[M] | Topic[M]":
        if keys is None:
            return self
        return Topic(f"{keys.root}/{self.path}", self.message, self.qos, self.perishable, self.urgent)


class NamedLine(TopicLine[M]):
    """A line whose key has names in it, such as a robot's. In a `Keys` object it is a function from names to the topic.

    A name that is left out stands for all names.
    """

    @overload  # type: ignore[override]
    def __get__(self, keys: None, owner: "type[Keys]") -> "NamedLine[M]": ...
    @overload
    def __get__(self, keys: "Keys", owner: "type[Keys]") -> Callable[..., Topic[M]]: ...
    def __get__(self, keys: "Keys | None", owner: "type[Keys]") -> "NamedLine[M] | Callable[..., Topic[M]]":
        if keys is None:
            return self
        root = keys.root

        def topic(*names: str) -> Topic[M]:
            given = iter(names)
            path = _HOLE.sub(lambda _: chunk_of(next(given, "*")), self.path)
            return Topic(f"{root}/{path}", self.message, self.qos, self.perishable)

        return topic


READINGS = NamedLine(
    "robot/{robot}/sensor/{kind_of_sensor}/{sensor}", m.SensorMessage, LATEST,
    (WORLD,), (DEVICE, RECORDER, WINDOW, OFFICIAL, HUD),
    "a reading of this sensor",
)  # fmt: skip
"""The line of the readings of all sensors. It is not in `Keys`, because its messages are those of `vrg.hal.sensors`."""
ALIVE = "alive/{kind}/{name}/{instance}"
"""The keys of the nodes' liveliness tokens, below `vrg/<match>/`."""


class Keys:
    """The topics of one match. The lines below are the whole key map, except for the sensors' keys.

    Args:
        match: the name of the match, which is the second chunk of every key.

    Raises:
        ConfigError: the name cannot be part of a key.
    """

    clock = TopicLine("clock", m.Clock, LATEST, (WORLD,), PLAYING, "match time", urgent=True)
    poses = TopicLine(
        "poses", m.Poses, LATEST, (WORLD,), (REFEREE, RECORDER, WINDOW, OFFICIAL, TRACKER), "where every body really is"
    )
    world_request = TopicLine(
        "world/request", m.WorldRequest, EVENT, (REFEREE,), (WORLD,), "where to put virtual robots"
    )
    world_answer = TopicLine(
        "world/answer", m.WorldAnswer, EVENT, (WORLD,), (REFEREE,), "whether a request was granted"
    )
    drive = NamedLine("robot/{robot}/drive", m.Drive, LATEST, (DEVICE,), (WORLD,), "the motion to make")
    robot_state = NamedLine(
        "robot/{robot}/state", m.RobotState, LATEST, (WORLD,), (DEVICE, WINDOW),
        "whether it is armed, stopped, faulty",
    )  # fmt: skip
    robot_pose = NamedLine(
        "robot/{robot}/pose", m.MeasuredPose, LATEST, (LOCATING, TRACKING),
        (WORLD, REFEREE, DEVICE, RECORDER, LAUNCHER, WINDOW, HUD),
        "where a robot was measured to be",
    )  # fmt: skip
    motion = NamedLine(
        "robot/{robot}/motion", m.Motion, LATEST, (DEVICE,), (TRACKER, RECORDER),
        "the odometry of a robot that is located by fusion",
    )  # fmt: skip
    fixes = NamedLine(
        "fix/{source}", m.Fixes, EVENT, (TRACKER,), (TRACKER, RECORDER, WINDOW),
        "where a source has seen robots and things", perishable=True,
    )  # fmt: skip
    thing_pose = NamedLine(
        "thing/{thing}/pose", m.MeasuredPose, LATEST, (TRACKER,), (WORLD,),
        "where a real ball or box was measured to be",
    )  # fmt: skip
    robot_seen = NamedLine(
        "robot/{robot}/seen", m.MeasuredPose, LATEST, (WORLD,), (DEVICE,),
        "where the world has a physical robot: a restarted device continues from there",
    )  # fmt: skip
    speed_limit = NamedLine(
        "robot/{robot}/limit", m.SpeedLimit, STATE, (REFEREE,), (DEVICE, WORLD), "its top speed now"
    )
    recover = NamedLine("robot/{robot}/recover", m.Recover, EVENT, (REFEREE,), (DEVICE,), "clear the latched fault")
    placed = NamedLine(
        "robot/{robot}/placed", m.Placed, EVENT, (REFEREE,), (DEVICE, TRACKER), "where a person has put it"
    )
    camera_request = NamedLine(
        "robot/{robot}/camera/request", m.CameraRequest, LATEST, (OFFICIAL, WINDOW, HUD), (WORLD,),
        "it wants pictures of the robot's camera for a while",
    )  # fmt: skip
    report = NamedLine(
        "player/{player}/report", m.Report, LATEST, (PLAYER,),
        (REFEREE, RECORDER, LAUNCHER, WINDOW, OFFICIAL, COMMANDER, HUD), "what it is doing, and what it lacks",
    )  # fmt: skip
    manual = NamedLine(
        "player/{player}/manual", m.Manual, LATEST, (OFFICIAL, COMMANDER, HUD), (DEVICE,),
        "a person drives it for a while",
    )  # fmt: skip
    order = NamedLine("team/{team}/order", m.TeamOrder, LATEST, (COMMANDER,), (MATES,), "what the team is to do")
    sight = NamedLine(
        "team/{team}/sight", m.Sight, LATEST, (REFEREE,), (MATES, COMMANDER, HUD),
        "whom the team sees, if not everybody",
    )  # fmt: skip
    say = NamedLine("team/{team}/say/{player}", m.Say, EVENT, (PLAYER,), (MATES,), "what it tells its team")
    links = NamedLine(
        "player/{player}/links", m.Links, STATE, (PLAYER,), (RECORDER, OFFICIAL), "what the radio delivered and lost"
    )
    sightings = NamedLine(
        "player/{player}/sightings", m.Sightings, EVENT, (PLAYER,), (REFEREE, RECORDER, WINDOW, OFFICIAL),
        "unknown robots it sees",
    )  # fmt: skip
    bid = NamedLine("player/{player}/bid", m.Bid, EVENT, (PLAYER,), (REFEREE,), "what a lot would cost it")
    sketch = NamedLine(
        "player/{player}/sketch", m.Sketch, LATEST, (PLAYER,), (RECORDER, WINDOW, OFFICIAL, COMMANDER, HUD),
        "dots and lines to show",
    )  # fmt: skip
    referee_state = TopicLine(
        "referee/state", m.RefereeState, STATE, (REFEREE,), PLAYING, "stage, score, clock, players, zones"
    )
    referee_event = TopicLine("referee/event", m.Call, EVENT, (REFEREE,), PLAYING, "each call, in words and numbers")
    official = TopicLine(
        "official", m.Official, EVENT, (OFFICIAL, LAUNCHER), (REFEREE,), "what an official decides", perishable=True
    )
    estop = TopicLine("estop", m.Estop, EVENT, EVERYBODY, PLAYING, "the emergency stop is engaged")
    estop_release = TopicLine(
        "estop/release", m.EstopRelease, EVENT, (OFFICIAL,), PLAYING, "the emergency stop is released", perishable=True
    )
    seat_request = TopicLine(
        "seat/request", m.SeatRequest, EVENT, (OFFICIAL,), (LAUNCHER,), "put another player into a seat",
        perishable=True,
    )  # fmt: skip
    seat_answer = TopicLine("seat/answer", m.SeatAnswer, EVENT, (LAUNCHER,), (OFFICIAL,), "whether that was done")
    processes = TopicLine(
        "processes", m.Processes, LATEST, (LAUNCHER,), (WINDOW, OFFICIAL), "the state of the processes of the match"
    )
    pulse = NamedLine("pulse/{kind}/{name}", m.Pulse, LATEST, EVERYBODY, (LAUNCHER, HOST), "it is alive")

    def __init__(self, match: str) -> None:
        self.match = check_name(match, "match name")
        self.root = f"vrg/{chunk_of(match)}"

    def sensor(self, message: type[S], robot: str = "*", name: str = "*") -> Topic[S]:
        """The topic of the readings of one sensor of a robot, which the world publishes for the player's device.

        Args:
            message: the message class of this kind of sensor. name: the sensor's name on its robot.
        """
        names = {"robot": chunk_of(robot), "kind_of_sensor": message.kind, "sensor": chunk_of(name)}
        return Topic(f"{self.root}/{_HOLE.sub(lambda hole: names[hole[1]], READINGS.path)}", message, READINGS.qos)

    def alive(self, kind: str = "*", name: str = "*", instance: str = "*") -> str:
        """The key expression of a node's liveliness token.

        Args:
            instance: an id that distinguishes two processes of one name, so that the second can be refused.
        """
        return f"{self.root}/{ALIVE.format(kind=kind, name=chunk_of(name), instance=instance)}"

    def topic_of(
        self, key: str, sensors: Callable[[str], type[m.SensorMessage] | None] = lambda _: None
    ) -> Topic[m.Message] | None:
        """The topic that a concrete key belongs to, or None where the key map has no such key.

        Args:
            sensors: returns the message class of a kind of sensor, such as `vrg.hal.sensors.message_class`.
        """
        for line in self.lines():
            topic = Topic(f"{self.root}/{_HOLE.sub('*', line.path)}", line.message, line.qos)
            if key_matches(topic.key, key):
                return topic
        if key_matches(f"{self.root}/{_HOLE.sub('*', READINGS.path)}", key):
            _, _, _, robot, _, kind, name = key.split("/")
            message = sensors(kind)
            return None if message is None else self.sensor(message, name_of(robot), name_of(name))
        return None

    @staticmethod
    def expression(path: str, names: Mapping[str, str] = {}) -> str:
        """The path of a line with names in place of its holes, and `*` for those that are missing.

        Args:
            path: such as `robot/{robot}/drive`. names: by hole.
        """
        return _HOLE.sub(lambda hole: chunk_of(names.get(hole[1], "*")), path)

    @classmethod
    def lines(cls) -> list[TopicLine[Any]]:
        """The lines of the table, in its order."""
        return [line for line in vars(cls).values() if isinstance(line, TopicLine)]


ROUTERS_ALIVE = "vrg-router/*"
"""The key expression of the liveliness tokens of routers' processes, which belong to no match."""


def router_alive(pid: int) -> str:
    """The key of the liveliness token of a router's process."""
    return ROUTERS_ALIVE.replace("*", str(pid))


def key_matches(expression: str, key: str) -> bool:
    """True if a key matches a key expression, whose chunks may be `*` and whose last chunk may be `**`."""
    wanted, given = expression.split("/"), key.split("/")
    if wanted[-1] == "**":
        wanted = wanted[:-1]
        given = given[: len(wanted)]
    return len(wanted) == len(given) and all(w in ("*", g) for w, g in zip(wanted, given, strict=True))


def name_in(key: str) -> str:
    """The robot's or player's name in a key such as `vrg/<match>/robot/<name>/drive`."""
    return name_of(key.split("/")[3])
