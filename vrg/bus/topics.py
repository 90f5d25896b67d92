"""The key map: every key expression of a match, the message that travels on it, and how it is delivered.

Nobody else writes a key by hand.
"""

import enum
import re
from dataclasses import dataclass
from typing import Generic, TypeVar

from vrg.bus import messages as m
from vrg.errors import ConfigError

T_co = TypeVar("T_co", bound=m.Message, covariant=True)

NAME_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")


class Qos(enum.Enum):
    """How a message is delivered.

    LATEST: sensors and commands; the newest wins, there is never a backlog, a slow reader loses old ones.
    EVENT: calls and orders; reliable, in order, none lost while the router lives.
    STATE: reliable, the newest wins, and a late joiner is given the last one at once.
    """

    LATEST = "latest"
    EVENT = "event"
    STATE = "state"


@dataclass(frozen=True)
class Topic(Generic[T_co]):
    """A key expression with the type and the quality of service of what travels on it.

    Args:
        key: a zenoh key expression; one chunk may be `*` in a topic that is only subscribed to.
    """

    key: str
    type: type[T_co]
    qos: Qos


def check_name(name: str, what: str = "name") -> str:
    """Return `name` if it can be one chunk of a key expression.

    Raises:
        ConfigError: it is empty, longer than 64 characters, or has characters other than A-Z a-z 0-9 _ -.
    """
    if not NAME_PATTERN.fullmatch(name):
        raise ConfigError(
            [f"{what}: expected 1 to 64 of A-Z a-z 0-9 _ - beginning with a letter or digit, got {name!r}"]
        )
    return name


class Keys:
    """The topics of one match.

    Args:
        match: name of the match, the second chunk of every key.

    Raises:
        ConfigError: the name cannot be part of a key.
    """

    def __init__(self, match: str) -> None:
        self.match = check_name(match, "match name")
        self.root = f"vrg/{match}"

    @property
    def clock(self) -> Topic[m.Clock]:
        """World -> all: match time."""
        return Topic(f"{self.root}/clock", m.Clock, Qos.LATEST)

    @property
    def poses(self) -> Topic[m.Poses]:
        """World -> referee, ui: where every body is, virtual and physical."""
        return Topic(f"{self.root}/poses", m.Poses, Qos.LATEST)

    @property
    def world_request(self) -> Topic[m.WorldRequest]:
        """Referee, ui -> world: spawn, remove, reset, place."""
        return Topic(f"{self.root}/world/request", m.WorldRequest, Qos.EVENT)

    def drive(self, robot: str = "*") -> Topic[m.Drive]:
        """Player's HAL -> world: wheel speeds."""
        return Topic(f"{self.root}/robot/{robot}/drive", m.Drive, Qos.LATEST)

    def robot_state(self, robot: str = "*") -> Topic[m.RobotState]:
        """World -> player's HAL: vehicle state, INS, odometry, encoders, touch."""
        return Topic(f"{self.root}/robot/{robot}/state", m.RobotState, Qos.LATEST)

    def laser(self, robot: str = "*") -> Topic[m.Laser]:
        """World -> player's HAL: one scan."""
        return Topic(f"{self.root}/robot/{robot}/laser", m.Laser, Qos.LATEST)

    def robot_pose(self, robot: str = "*") -> Topic[m.MeasuredPose]:
        """A physical robot's HAL, or a motion-capture system -> world: where it was measured to be."""
        return Topic(f"{self.root}/robot/{robot}/pose", m.MeasuredPose, Qos.LATEST)

    def recover(self, robot: str = "*") -> Topic[m.Recover]:
        """Referee -> the robot device: clear the latched fault."""
        return Topic(f"{self.root}/robot/{robot}/recover", m.Recover, Qos.EVENT)

    def speed_limit(self, robot: str = "*") -> Topic[m.SpeedLimit]:
        """Referee -> the robot device: the top speed this match allows it, which no player is told."""
        return Topic(f"{self.root}/robot/{robot}/limit", m.SpeedLimit, Qos.STATE)

    def report(self, player: str = "*") -> Topic[m.Report]:
        """Player -> all: what it does and whether it is ready."""
        return Topic(f"{self.root}/player/{player}/report", m.Report, Qos.LATEST)

    def manual(self, player: str = "*") -> Topic[m.Manual]:
        """Ui -> player: a human's drive command, good for the length of its lease."""
        return Topic(f"{self.root}/player/{player}/manual", m.Manual, Qos.LATEST)

    @property
    def referee_state(self) -> Topic[m.RefereeState]:
        """Referee -> all: stage, score, clock, and each player's role."""
        return Topic(f"{self.root}/referee/state", m.RefereeState, Qos.STATE)

    @property
    def referee_event(self) -> Topic[m.Call]:
        """Referee -> all: each call, in words and numbers."""
        return Topic(f"{self.root}/referee/event", m.Call, Qos.EVENT)

    @property
    def official(self) -> Topic[m.Official]:
        """A human official -> referee: halt, resume, overrule, recover, end."""
        return Topic(f"{self.root}/official", m.Official, Qos.EVENT)

    @property
    def estop(self) -> Topic[m.Estop]:
        """Anyone -> all: the emergency stop."""
        return Topic(f"{self.root}/estop", m.Estop, Qos.EVENT)

    def pulse(self, kind: str = "*", name: str = "*") -> Topic[m.Pulse]:
        """Every node -> its supervisor: it still works."""
        return Topic(f"{self.root}/pulse/{kind}/{name}", m.Pulse, Qos.LATEST)

    def alive(self, kind: str = "*", name: str = "*", instance: str = "*") -> str:
        """Key expression of a node's liveliness token.

        Args:
            instance: tells two processes of one name apart, so that the second can be refused.
        """
        return f"{self.root}/alive/{kind}/{name}/{instance}"

    def topic_of(self, key: str) -> Topic[m.Message] | None:
        """The topic that a concrete key belongs to, or None where the key map has no such key."""
        for topic in self._all():
            if key_matches(topic.key, key):
                return topic
        return None

    def _all(self) -> list[Topic[m.Message]]:
        return [
            self.clock, self.poses, self.world_request, self.drive(), self.robot_state(), self.laser(),
            self.robot_pose(), self.recover(), self.speed_limit(), self.report(), self.manual(), self.referee_state,
            self.referee_event, self.official, self.estop, self.pulse(),
        ]  # fmt: skip


def router_alive(pid: int) -> str:
    """Key of the liveliness token of a router's process: a router belongs to no match."""
    return f"vrg-router/{pid}"


def key_matches(expression: str, key: str) -> bool:
    """Whether a concrete key is in the set of a key expression whose chunks may be `*` or a last `**`."""
    wanted, given = expression.split("/"), key.split("/")
    if wanted[-1] == "**":
        wanted = wanted[:-1]
        given = given[: len(wanted)]
    return len(wanted) == len(given) and all(w in ("*", g) for w, g in zip(wanted, given, strict=True))


def name_in(key: str) -> str:
    """The robot's or player's name in a key such as `vrg/<match>/robot/<name>/drive`."""
    return key.split("/")[3]
