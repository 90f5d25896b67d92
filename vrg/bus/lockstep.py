"""The in-process executor: all nodes of a virtual match in lockstep, as fast as the processor allows.

It uses no threads, no network and no wall clock: the same nodes with the same seeds publish the same messages, byte for
byte. Each tick has two halves. First the world steps and publishes. Then every other node that is due is called: it
hears what the world has just published and what the others published in earlier ticks. So the order of the nodes gives
none of them an advantage.

Between the two an outer loop may ask the nodes for what they have heard, and give them what they will decide: it calls
`begin` and `finish` in place of `step`.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Final

from vrg.bus.node import Node, Tick, due_index
from vrg.bus.transport import MemoryTransport, begin_turn, end_turn, turn

DIGEST_PERIOD: Final = 1.0
"""The match time in s between two steps of which the digests are made."""


class Lockstep:
    """Runs one world and any number of other nodes.

    Args:
        world: the node that owns time. It is ticked every `world.period`.
        nodes: the other nodes. They are ticked in the order of (kind, name).
        strict: True passes every message through the codec of the bus, so that a message that could not travel over the
            bus is refused here too. This is slower.
        digested: called once a DIGEST_PERIOD with the match time in s of a step, and the digest of all that each node
            has published in it, by its kind and name. None makes none.
        clock: returns the real time, s, by which it is counted what deferred messages take; None counts nothing.
    """

    def __init__(
        self,
        world: Node,
        nodes: Sequence[Node],
        *,
        strict: bool = False,
        digested: Callable[[float, Mapping[str, str]], None] | None = None,
        clock: Callable[[], float] | None = None,
    ) -> None:
        self._world = world
        self._digested, self._digests = digested, -1
        self._transport = MemoryTransport(strict=strict, clock=clock)
        self._started = False
        self._nodes = sorted(nodes, key=lambda node: (node.kind, node.name))
        self._due = {node.period: -1 for node in self._nodes}
        self._ticks = 0
        self._begun: list[Node] | None = None
        """The nodes that are due in a tick that has begun; None between two ticks."""
        for node in [world, *self._nodes]:
            self._transport.attach(node.mailbox)

    @property
    def time(self) -> float:
        """The match time of the next tick, s."""
        return self._ticks * self._world.period

    def step(self) -> None:
        """Advance by one tick of the world. The first step is at time 0; it starts the nodes.

        Raises:
            Exception: whatever a node raises, with a note that names the node.
            TypeError, MessageError: a message could not travel over the bus; only raised if `strict` is set.
        """
        self.begin()
        self.finish()

    def begin(self) -> None:
        """The first half of `step`: the world steps and publishes, and the nodes that are due hear it and begin.

        Raises:
            Exception: as `step`.
        """
        if self._begun is not None:
            raise RuntimeError("expected a tick to be finished before the next one begins: call finish() first")
        if not self._started:
            self._started = True
            for node in [self._world, *self._nodes]:
                node.start()
        time = self.time
        if self._digested is not None and due_index(time, DIGEST_PERIOD) != self._digests:
            self._digests = due_index(time, DIGEST_PERIOD)
            self._transport.begin_digests()
        turn([self._world], Tick(time), self._transport)
        periods = self._complete(time)
        due = [node for node in self._nodes if node.period in periods] if periods else []
        begin_turn(due, Tick(time))
        self._begun = due

    def finish(self) -> None:
        """The second half of `step`: the nodes that are due decide, and what they publish is sent.

        Raises:
            Exception: as `step`.
        """
        if self._begun is None:
            raise RuntimeError("expected a tick that has begun: call begin() first")
        due, self._begun = self._begun, None
        end_turn(due, Tick(self.time), self._transport)
        if self._digested is not None and (found := self._transport.end_digests()) is not None:
            self._digested(self.time, found)
        self._ticks += 1

    def stop(self) -> None:
        """Stop every node, the world last, so that the world still hears the robots' last commands."""
        for node in self._nodes:
            node.stop()
            self._transport.send(node.mailbox.collect())
        turn([self._world], Tick(self.time), self._transport)
        self._world.stop()

    def _complete(self, time: float) -> set[float]:
        """The periods of which one more is complete, so that the nodes with this period are due."""
        complete = set()
        for period, before in self._due.items():
            index = due_index(time, period)
            if index != before:
                self._due[period] = index
                complete.add(period)
        return complete
