"""A world node with everything wired in memory, for tests."""

from collections.abc import Sequence
from typing import TypeVar

from vrg.bus.lockstep import Lockstep
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease, Message
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys, Topic
from vrg.hal.backends import MatchContext, open_driver
from vrg.hal.models import robot_model
from vrg.hal.sim.config import RobotSetup, WorldConfig
from vrg.hal.sim.node import WorldNode
from vrg.testing.driver import DriverBench
from vrg.types import Pose

KEYS = Keys("test")
M = TypeVar("M", bound=Message)


class Silent(Node):
    """A node that does nothing: the test speaks through its mailbox."""

    kind = "player"

    def tick(self, tick: Tick) -> None:
        """Nothing."""


def config(
    *robots: tuple[str, float, float, float], model: str = "P2AT", physical: str = "", **options: object
) -> WorldConfig:
    """A world of the given (name, x, y, heading); planar, on open ground, unless options say otherwise.

    Robots whose name is a letter of `physical` are.
    """
    setups = tuple(
        RobotSetup(name=n, model=model, pose=Pose(x, y, heading), physical=n in physical) for n, x, y, heading in robots
    )
    wanted = {"map": "open", "engine": "planar", "robots": setups, **options}
    return WorldConfig(**wanted)  # type: ignore[arg-type]


class SimBench(DriverBench):
    """One robot of the sim backend in a world of its own; `period` is the player's."""

    def __init__(self, engine: str, period: float = 0.05, model: str = "P2AT") -> None:
        self.node = WorldNode(config(("r", 0.0, 0.0, 0.3), engine=engine, seed=7, model=model), Mailbox(), KEYS)
        mailbox = Mailbox()
        context = MatchContext(name="r", model=robot_model(model), keys=KEYS, mailbox=mailbox, now=lambda: mailbox.now)
        self.driver = open_driver("sim", context)
        self.player = Silent("r", mailbox, period)
        self._lockstep = Lockstep(self.node, [self.player])
        self._cut = False

    def advance(self, seconds: float) -> None:
        """Let the world tick."""
        steps = round(seconds / self.node.period)
        for _ in range(steps):
            if self._cut:
                self.player.mailbox.now += self.node.period
            else:
                self._lockstep.step()

    def estop(self, engaged: bool) -> None:
        """Published by the player's node, as anybody may; what is above the driver tells it, too."""
        super().estop(engaged)
        if engaged:
            self.player.mailbox.publish(KEYS.estop, Estop(by="test"))
        else:
            self.player.mailbox.publish(KEYS.estop_release, EstopRelease(by="test"))

    def cut(self) -> None:
        """The world says nothing more."""
        self._cut = True

    def close(self) -> None:
        """Let go of the engine."""
        self.node.stop()


class Wire:
    """A world node alone, with a mailbox to talk to it and what it last said by key."""

    def __init__(self, world: WorldConfig, snapshot: bytes | None = None) -> None:
        self.node = WorldNode(world, Mailbox(), KEYS, snapshot)
        self.heard: dict[str, Message] = {}
        self.log: list[tuple[str, float, Message]] = []
        self._speaker = Mailbox()
        self._ticks = self.node.start_tick

    def last(self, topic: Topic[M]) -> M:
        """What was said last of a topic."""
        body = self.heard[topic.key]
        assert isinstance(body, topic.type)
        return body

    def restarted(self) -> "Wire":
        """A world of the same set-up, restored from a snapshot of this one."""
        return Wire(self.node.world.config, self.node.snapshot())

    def say(self, topic: Topic, body: Message) -> None:  # type: ignore[type-arg]
        """Send a message to the world, heard at its next tick."""
        self._speaker.now = self._ticks * self.node.period
        self._speaker.publish(topic, body)

    def tick(self, count: int = 1, each: Sequence[tuple[Topic, Message]] = ()) -> None:  # type: ignore[type-arg]
        """Tick the world, sending the messages of `each` before every tick."""
        for _ in range(count):
            for topic, body in each:
                self.say(topic, body)
            for out in self._speaker.collect():
                for inlet in self.node.mailbox.inlets:
                    if inlet.topic.type is out.topic.type:
                        inlet.offer(out.message)
            time = self._ticks * self.node.period
            self.node.mailbox.handover(time)
            self.node.tick(Tick(time))
            for out in self.node.mailbox.collect():
                self.heard[out.message.key] = out.message.body
                self.log.append((out.message.key, out.message.stamp, out.message.body))
            self._ticks += 1
