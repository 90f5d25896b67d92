"""The node that hears for an environment what the referee says and where all robots are."""

from vrg.agents.player import PERIOD
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Body, Call, RefereeState
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys


class Watch(Node):
    """Hears what every player hears at the same instants, and the world's poses of all bodies.

    Args:
        keys: the keys of the match.

    Attributes:
        hears: True while a tick has begun in which the players decide, and is not finished.
        state: the referee's newest state; None before the first. calls: its calls since `taken`.
        bodies: all bodies, by name.
    """

    kind = "watch"

    def __init__(self, keys: Keys) -> None:
        super().__init__("environment", Mailbox(), PERIOD)
        self.hears = False
        self.state: RefereeState | None = None
        self.calls: list[Call] = []
        self.bodies: dict[str, Body] = {}
        self._states = self.mailbox.subscribe(keys.referee_state)
        self._events = self.mailbox.subscribe(keys.referee_event)
        self._poses = self.mailbox.subscribe(keys.poses)

    def begin(self, tick: Tick) -> None:
        """Take in what has arrived."""
        self.hears = True
        if (state := self._states.latest) is not None:
            self.state = state.body
        if (poses := self._poses.latest) is not None:
            self.bodies = {body.name: body for body in poses.body.bodies}
        self.calls += [call.body for call in self._events.take()]

    def tick(self, tick: Tick) -> None:
        """The tick is over: what is heard next is new."""
        self.hears = False

    def taken(self) -> list[Call]:
        """Return the calls since this was last called."""
        calls, self.calls = self.calls, []
        return calls
