"""A match as the tools of the Small Size League see one: vision, tracker and game controller, on their addresses."""

import math
import uuid
from collections.abc import Callable
from typing import Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import TIME_LIMIT, Poses, RefereeState, Stage
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.geometry import compose, inverse
from vrg.localisation.ssl.packets import (
    COLOURS,
    Colour,
    RefereeNews,
    Seen,
    SeenRobot,
    referee_packet,
    tracker_packet,
    vision_packet,
)
from vrg.regions import surrounding
from vrg.types import Pose

REPEAT_PERIOD: Final = 0.5
"""The match time in s after which the state of the referee is sent again although nothing has changed."""
GEOMETRY: Final = 50
"""The number of packets of vision of which one has the geometry of the field."""

# The league's stages and commands.
_HALVES: Final = ((0, 1), (3, 4))
"""Before and during the first and the second half; all further rounds are the second one, too."""
_HALF_TIME, _POST_GAME = 2, 13
_HALT, _STOP, _NORMAL_START = 0, 1, 2


class SslPublisher(Node):
    """The node that tells the tools of the league of a match. The first team of the match is yellow, the second blue.

    Args:
        name: of the node. mailbox: its mailbox. keys: the keys of the match.
        send: sends a packet: `vision`, `tracker` or `referee`, and its bytes. It must not wait.
        wall: the time of day, s since 1970. Nodes read no clock, so it is given from outside.
    """

    kind = "spectator"

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        send: Callable[[str, bytes], None],
        wall: Callable[[], float],
    ) -> None:
        super().__init__(name, mailbox, 0.02)
        self._send, self._wall, self._uuid = send, wall, str(uuid.uuid4())
        self._teams: tuple[str, ...] = ()
        self._robots: dict[str, tuple[Colour, int]] = {}
        self._size = 0.0, 0.0
        self._from_map = Pose(0.0, 0.0, 0.0)
        self._poses = mailbox.subscribe(keys.poses)
        self._states = mailbox.subscribe(keys.referee_state)
        self._calls = mailbox.subscribe(keys.referee_event)
        self._words = ""
        self._number = self._counter = 0
        self._command: tuple[int, float] = (-1, 0.0)
        self._told: tuple[RefereeState, str] | None = None
        self._told_at = -math.inf

    def tick(self, tick: Tick) -> None:
        """Send what is new."""
        for call in self._calls.take():
            self._words = call.body.text
        state = self._states.latest
        if state is None:
            return
        if not self._teams:
            self._survey(state.body)
        for poses in self._poses.take():
            self._vision(poses.body, tick.time - poses.stamp)
        news = state.body, self._words
        if self._told != news or not 0.0 <= tick.time - self._told_at < REPEAT_PERIOD:
            self._told, self._told_at = news, tick.time
            self._referee(state.body)

    def _survey(self, state: RefereeState) -> None:
        """Find out who plays, and where."""
        self._teams = tuple(dict.fromkeys(player.team for player in state.players))[:2]
        for colour, team in zip(COLOURS, self._teams, strict=False):
            members = [player.name for player in state.players if player.team == team]
            self._robots |= {name: (colour, number) for number, name in enumerate(members)}
        if state.zones:
            x_min, y_min, x_max, y_max = surrounding(zone.region.bounds for zone in state.zones)
            length, width = x_max - x_min, y_max - y_min
            # The league's x runs along the field.
            turn = 0.0 if length >= width else math.pi / 2
            self._size = max(length, width), min(length, width)
            self._from_map = inverse(Pose((x_min + x_max) / 2, (y_min + y_max) / 2, turn))

    def _vision(self, poses: Poses, age: float) -> None:
        now = self._wall()
        robots = []
        for body in poses.bodies:
            if body.name in self._robots:
                colour, number = self._robots[body.name]
                at = compose(self._from_map, body.pose)
                robots.append(SeenRobot(colour, number, at.x, at.y, at.theta, twist=body.twist))
        seen = Seen(now - max(0.0, age), now, robots)
        size = self._size if self._number % GEOMETRY == 0 else None
        self._send("vision", vision_packet(self._number, seen, size))
        self._send("tracker", tracker_packet(self._number, seen, self._uuid, "VRG"))
        self._number += 1

    def _referee(self, state: RefereeState) -> None:
        now = self._wall()
        stage, command = league_stage(state), league_command(state)
        if command != self._command[0]:
            self._command, self._counter = (command, now), self._counter + 1
        limit = state.numbers.get(TIME_LIMIT)
        left = None if limit is None else limit - state.clock
        teams = [(name, state.score.get(name, 0), 0) for name in self._teams]
        news = RefereeNews(now, stage, command, self._counter, self._command[1], left, teams, self._words)
        self._send("referee", referee_packet(news))


def league_stage(state: RefereeState) -> int:
    """The stage of a match in the league's numbers."""
    before, during = _HALVES[min(state.round, len(_HALVES)) - 1] if state.round else _HALVES[0]
    match state.stage:
        case Stage.PLAY_ROUND:
            return during
        case Stage.ROUND_OVER:
            return _HALF_TIME
        case Stage.GAME_OVER:
            return _POST_GAME
    return before


def league_command(state: RefereeState) -> int:
    """The command of the referee in the league's numbers: HALT, STOP while robots line up, or NORMAL_START."""
    if state.halted is not None or state.estop or state.stage is Stage.GAME_OVER:
        return _HALT
    return _NORMAL_START if state.stage is Stage.PLAY_ROUND else _STOP
