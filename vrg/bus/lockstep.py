"""The in-process executor: all nodes of a virtual match in lockstep, as fast as the processor allows.

No threads, no network, no wall clock: the same nodes with the same seeds say the same things, byte for byte.
Each tick has two halves. First the world steps and speaks; then every other node that is due hears what the world
has just said and what the others said in earlier ticks. So no node's place in the list gives it an advantage.
"""

from collections.abc import Sequence

from vrg.bus.codec import decode, encode
from vrg.bus.mailbox import Inlet, Mailbox, Outgoing
from vrg.bus.messages import Message
from vrg.bus.node import Node, Tick, due_index
from vrg.bus.topics import key_matches


class Lockstep:
    """Runs one world and any number of other nodes.

    Args:
        world: the node that owns time; ticked every `world.period`.
        nodes: the others. They are ticked in the order of (kind, name).
        strict: pass every message through the codec of the wire, so that what is not allowed there is not allowed
            here either, at the price of speed.
    """

    def __init__(self, world: Node, nodes: Sequence[Node], *, strict: bool = False) -> None:
        self._world = world
        self._strict = strict
        self._started = False
        self._nodes = sorted(nodes, key=lambda node: (node.kind, node.name))
        self._due = {id(node): -1 for node in self._nodes}
        self._routes: dict[str, list[Inlet[Message]]] = {}
        self._ticks = 0
        self._inlets = [inlet for node in [world, *self._nodes] for inlet in node.mailbox.inlets]

    @property
    def time(self) -> float:
        """Match time of the last tick, s."""
        return self._ticks * self._world.period

    def step(self) -> None:
        """Advance by one tick of the world. The first step is at time 0; it starts the nodes.

        Raises:
            Exception: whatever a node raises, with a note of which node it was.
            TypeError, MessageError: a message could not go over the wire; only where this is strict.
        """
        if not self._started:
            self._started = True
            for node in [self._world, *self._nodes]:
                node.start()
        time = self._ticks * self._world.period
        tick = Tick(time)
        self._call(self._world, tick)
        self._deliver(self._world.mailbox)
        called = []
        for node in self._nodes:
            index = due_index(time, node.period)
            if index != self._due[id(node)]:
                self._due[id(node)] = index
                self._call(node, tick)
                called.append(node)
        for node in called:
            self._deliver(node.mailbox)
        self._ticks += 1

    def stop(self) -> None:
        """Stop every node, robots first, and let the world see it."""
        for node in self._nodes:
            node.stop()
            self._deliver(node.mailbox)
        self._call(self._world, Tick(self._ticks * self._world.period))
        self._world.stop()

    @staticmethod
    def _call(node: Node, tick: Tick) -> None:
        node.mailbox.handover(tick.time)
        try:
            node.tick(tick)
        except Exception as error:
            error.add_note(f"raised by {node.kind} {node.name} at match time {tick.time:.2f} s")
            raise

    def _deliver(self, mailbox: Mailbox) -> None:
        for sent in mailbox.collect():
            out = _over_the_wire(sent) if self._strict else sent
            key = out.message.key
            inlets = self._routes.get(key)
            if inlets is None:
                inlets = [i for i in self._inlets if key_matches(i.topic.key, key)]
                self._routes[key] = inlets
            for inlet in inlets:
                inlet.offer(out.message)


def _over_the_wire(out: Outgoing) -> Outgoing:
    """The message as its receivers would get it from the bus."""
    message = out.message
    payload = encode(message.body, message.stamp, message.sequence)
    return Outgoing(out.topic, decode(payload, out.topic.type, message.key))
