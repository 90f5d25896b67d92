"""A player of the team `t` whose robot, referee, commander and mates are played by the test."""

from typing import Any, Generic, TypeVar

from tests.hal.fake_driver import POSE, FakeDriver
from vrg.agents.player import Player
from vrg.agents.radio import Radio
from vrg.agents.strategy import Strategy
from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.topics import Keys, key_matches
from vrg.hal.device import Device
from vrg.types import Pose, Twist

KEYS = Keys("m")
S = TypeVar("S", bound=Strategy)


def referee_state(
    *,
    name: str = "a",
    may_move: bool = True,
    halted: str | None = None,
    estop: bool = False,
    lease: Twist | None = None,
    pose: Pose | None = POSE,
) -> m.RefereeState:
    players = [
        m.PlayerStatus(
            name=each, team=team, role="r", state="active", may_move=may_move, radius=0.35, pose=pose,
            lease=lease if each == name else None,
        )
        for each, team in ((name, "t"), ("b", "t"), ("c", "u"))
    ]  # fmt: skip
    return m.RefereeState(
        game="g", stage=m.Stage.PLAY_ROUND, halted=halted, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=players, zones=(), estop=estop,
    )  # fmt: skip


class Bench(Generic[S]):
    def __init__(self, strategy: S) -> None:
        self.robot, self.mailbox, self.strategy = FakeDriver(), Mailbox(), strategy
        device, radio = Device(self.robot, KEYS, self.mailbox), Radio(KEYS, self.mailbox, "a", "t")
        self.player = Player(self.mailbox, KEYS, device, strategy, team="t", radio=radio)
        self.time = 0.0
        self._sequence = 0
        self.robot.told.clear()

    def hear(self, body: m.Message, key: str | None = None) -> None:
        """A message for this player, if no other key is given."""
        self._sequence += 1
        for inlet in self.mailbox.inlets:
            if inlet.topic.type is type(body) and (key is None or key_matches(inlet.topic.key, key)):
                inlet.offer(Received(key or inlet.topic.key, self.time, self._sequence, body))

    def tick(self, *, referee: bool = True, live: bool = True, advance: float = 0.1, **state: Any) -> list[str]:
        """One tick; what the robot was told in it."""
        self.time = round(self.time + advance, 6)
        if referee:
            self.hear(referee_state(**state))
        self.robot.told.clear()
        self.mailbox.handover(self.time)
        self.player.tick(Tick(self.time, live))
        return list(self.robot.told)

    def sent(self) -> list[m.Message]:
        """What the player has published."""
        return [out.message.body for out in self.mailbox.collect()]

    def report(self) -> m.Report:
        return [body for body in self.sent() if isinstance(body, m.Report)][-1]
