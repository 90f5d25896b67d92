"""Nodes that locate robots, on a bench: what a test says to them, and sources that watch what a test shows to them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Clock, Fix, Message
from vrg.bus.node import Tick
from vrg.bus.topics import Keys, Topic
from vrg.hal.models import robot_model
from vrg.hal.sim.config import BodySetup
from vrg.localisation.source import SourceContext, read_source
from vrg.types import Pose

KEYS = Keys("m")
HERE = Pose(0.0, 0.0, 0.0)


def say(mailbox: Mailbox, topic: Topic[Any], body: Message, stamp: float, number: int) -> None:
    """Let a message come."""
    for inlet in mailbox.inlets:
        if inlet.topic.type is type(body):
            inlet.offer(Received(topic.key, stamp, number, body, "x/y"))


def say_time(mailbox: Mailbox, time: float, number: int, rate: float = 1.0) -> None:
    """Let a clock message of the world come."""
    say(mailbox, KEYS.clock, Clock(time=time, tick=number, epoch=0, rate=rate, estop=False), time, number)


def context_of(
    name: str, settings: Any, *robots: str, base: Path = Path(), things: Sequence[BodySetup] = ()
) -> SourceContext:
    """The context of a source: a match in which all robots are P2ATs that begin at the origin."""
    return SourceContext(
        name=name, settings=settings, robots=dict.fromkeys(robots, robot_model("P2AT")),
        starts=dict.fromkeys(robots, HERE), seed=1, base=base, things={body.name: body for body in things},
    )  # fmt: skip


class FakeFeed:
    """Hands over what a test has put into it, in place of pictures or frames."""

    def __init__(self, *_: object) -> None:
        self.shown: list[Any] = []
        self.trouble: str | None = None
        self.running = False

    def start(self) -> None:
        """Begin to hand over."""
        self.running = True

    def close(self) -> None:
        """Stop."""
        self.running = False

    def take(self) -> list[Any]:
        """What was shown since."""
        found, self.shown = self.shown, []
        return found

    def problem(self) -> str | None:
        """What is wrong with it, in words, or None."""
        return self.trouble


class SourceBench:
    """A source that sees real robots, and a match clock that began 1000 s after the process' own.

    Args:
        kind: the class that the table names. table: of the match file. more: as for `context_of`.
    """

    def __init__(self, kind: type[Any], table: dict[str, Any], name: str, *robots: str, **more: Any) -> None:
        found, settings = read_source(table)
        self.mailbox, self.now, self._number = Mailbox(), 1000.0, 0
        self.node = kind(context_of(name, settings, *robots, **more), self.mailbox, KEYS, lambda: self.now)
        assert found is kind
        assert found.sees_physical

    def tick(self, seconds: float = 0.02, rate: float = 1.0) -> list[tuple[float, tuple[Fix, ...]]]:
        """Tick after some time, and return what is published: of each message its stamp and its fixes."""
        self.now += seconds
        self._number += 1
        time = self.now - 1000.0
        say_time(self.mailbox, time, self._number, rate)
        self.mailbox.handover(time)
        self.node.tick(Tick(time))
        return self.published()

    def published(self) -> list[tuple[float, tuple[Fix, ...]]]:
        """What has been published since."""
        return [(out.message.stamp, out.message.body.fixes) for out in self.mailbox.collect()]  # type: ignore[attr-defined]
