"""The contract below all executors: how the messages of nodes travel, and what one tick of a node is.

An executor attaches the mailboxes of its nodes to a transport, decides when nodes are due, and calls `turn`. So the
same nodes run over any transport: `vrg.bus.lockstep` runs all of them in the memory of one process, and
`vrg.bus.process` runs each of them in its own process, over a session.
"""

import hashlib
from collections.abc import Callable, Sequence
from operator import methodcaller
from typing import Protocol

from vrg.blame import DecisionTimeoutError, DeferredError
from vrg.bus.codec import Received, content, decode, encode
from vrg.bus.deferred import Deferred
from vrg.bus.mailbox import Inlet, Mailbox, Outgoing
from vrg.bus.messages import Message
from vrg.bus.node import Node, Tick, sender_of
from vrg.bus.topics import key_matches

OnArrival = Callable[[Inlet[Message]], None]
"""A function that is called when something has arrived for an inlet, on any thread."""

_End = tuple[Inlet[Message], OnArrival | None]
"""The end of a message: its inlet, and the function to call on arrival."""


class Transport(Protocol):
    """Carries messages between mailboxes.

    The messages of one sender on one key arrive in the order in which they were published. All messages of an EVENT
    topic arrive unless they are a flood, and of other topics at least the newest of each key. A mailbox is given its
    own messages, too, if it subscribes to them. Alarms sound as soon as a message arrives.
    """

    def attach(self, mailbox: Mailbox, on_arrival: OnArrival | None = None) -> None:
        """Bring to a mailbox what it subscribes to, from now on. Its subscriptions must be complete."""

    def receive(self) -> None:
        """Let what has arrived wait in the inlets, for the next `handover` of their mailboxes."""

    def send(self, outgoing: Sequence[Outgoing]) -> None:
        """Carry messages, in this order. `turn` calls it once a tick for each node, which is then done."""


def turn(nodes: Sequence[Node], tick: Tick, transport: Transport) -> None:
    """Tick nodes at the same instant: each is given what has arrived before, decides, and what it publishes is sent.

    So no node is given what another one publishes in this tick, whatever their order.

    Raises:
        Exception: whatever a node raises, with a note that names the node.
    """
    begin_turn(nodes, tick)
    end_turn(nodes, tick, transport)


def begin_turn(nodes: Sequence[Node], tick: Tick) -> None:
    """The first half of `turn`: each node is given what has arrived before, and begins. Nothing is sent.

    Raises:
        Exception: whatever a node raises, with a note that names the node.
    """
    for node in nodes:
        node.mailbox.handover(tick.time)
    _each(nodes, tick, methodcaller("begin", tick))


def end_turn(nodes: Sequence[Node], tick: Tick, transport: Transport) -> None:
    """The second half of `turn`: each node decides, and what all of them have published is sent.

    Raises:
        Exception: whatever a node raises, with a note that names the node.
    """
    _each(nodes, tick, methodcaller("tick", tick))
    for node in nodes:
        transport.send(node.mailbox.collect())


def _each(nodes: Sequence[Node], tick: Tick, act: Callable[[Node], None]) -> None:
    """Let each node act. An exception gets a note that names the node, and who has deferred what it has read."""
    try:
        for node in nodes:
            act(node)
    except DeferredError as late:
        late.error.add_note(_raised_by(node, tick, late.sender))
        raise late.error from None
    except (Exception, DecisionTimeoutError) as error:
        error.add_note(_raised_by(node, tick))
        raise


def _raised_by(node: Node, tick: Tick, sender: str = "") -> str:
    """Where an exception comes from.

    Args:
        sender: who has deferred what the node has read, as in its messages; empty if it is the node's own exception.
    """
    if sender in ("", sender_of(node.kind, node.name)):
        return f"raised by {node.kind} {node.name} at match time {tick.time:.2f} s"
    other = sender.replace("/", " ")
    return f"raised by {other}, for {node.kind} {node.name}, at match time {tick.time:.2f} s"


_DIGEST = 8
"""The length of the digest of what one node publishes in one step, bytes."""


class MemoryTransport:
    """Carries messages between the mailboxes of one process at once. It uses no threads and no clock.

    Messages that are deferred are not carried to those who ask for the newest only: they find it at its sender. In a
    strict transport they are carried to all.

    Args:
        strict: True passes every message through the codec of the bus. `send` then raises MessageError or TypeError for
            one that could not travel over the bus, or would not arrive as it is, such as one with a list in place of a
            tuple; and for a deferred one that would be another one if it were made later. This is slower.
        clock: returns the real time, s; see `Mailbox.clock`.

    Attributes:
        strict: as above.
    """

    def __init__(self, *, strict: bool = False, clock: Callable[[], float] | None = None) -> None:
        self._clock = clock
        self._digests: dict[str, hashlib.blake2b] | None = None
        self.strict = strict
        self._mailboxes: list[Mailbox] = []
        self._resolved = False
        self._later: dict[str, tuple[Deferred[Message], Message]] = {}
        """The deferred messages of the last tick, to be made once more, and those that were sent in their place."""
        self._twins: tuple[Deferred[Message], Deferred[Message]] | None = None
        """The deferred messages that were sent last, and the same again."""
        self._attached: dict[str, list[_End]] = {}
        self._routes: dict[str, list[_End]] = {}

    def attach(self, mailbox: Mailbox, on_arrival: OnArrival | None = None) -> None:
        """Bring to a mailbox what it subscribes to."""
        self._mailboxes.append(mailbox)
        mailbox.clock = self._clock
        for inlet in mailbox.inlets:
            self._attached.setdefault(inlet.topic.key, []).append((inlet, on_arrival))
        self._routes.clear()
        self._resolved = False

    def receive(self) -> None:
        """Do nothing: what is sent waits in the inlets at once."""

    def send(self, outgoing: Sequence[Outgoing]) -> None:
        """Put messages into the inlets that subscribe to them."""
        for out in outgoing:
            message = out.message
            if self._digests is not None:
                if message.sender not in self._digests:
                    self._digests[message.sender] = hashlib.blake2b(digest_size=_DIGEST)
                self._digests[message.sender].update(content(message))
            routes = self._routes.get(message.key)
            if routes is None:
                ends = self._route(message.key)
                routes = self._routes[message.key] = [end for end in ends if end[0].source is None]
            if self.strict:
                arrives = decode(encode(message), out.topic.type, message.key)
                if arrives.body != message.body:  # `structs.replace` checks no types
                    raise TypeError(f"{message.key}: expected a message that arrives as it is, got {message.body}")
                self._compare(message)
                message = arrives
            for inlet, on_arrival in routes:
                if not inlet.admits(message.key):
                    continue
                inlet.offer(message)
                if on_arrival is not None:
                    on_arrival(inlet)
        if not self._resolved:  # what was sent until now was carried to all
            self._resolve()

    def begin_digests(self) -> None:
        """From now on make a digest of all that each sender publishes, also of what nobody takes."""
        self._digests = {}
        for mailbox in self._mailboxes:
            mailbox.aloud = True

    def end_digests(self) -> dict[str, str] | None:
        """The digests since they were begun, by sender; None if they were not."""
        if self._digests is None:
            return None
        found = {name: digest.hexdigest() for name, digest in self._digests.items()}
        self._digests = None
        for mailbox in self._mailboxes:
            mailbox.aloud = self.strict
        return found

    def _resolve(self) -> None:
        """Find the keys on which nobody takes each message, and let those who ask for the newest find it."""
        self._resolved = True
        for mailbox in self._mailboxes:
            keys = {topic.key for topic in mailbox.deferring}
            ends = {key: self._route(key) for key in keys}
            asking = {key: [inlet for inlet, called in of if inlet.sampled and not called] for key, of in ends.items()}
            mailbox.asked = frozenset(key for key in keys if asking[key])
            mailbox.aloud = self.strict or self._digests is not None
            mailbox.untaken = frozenset(key for key in keys if len(asking[key]) == len(ends[key]))
            for inlet in (inlet for inlets in asking.values() for inlet in inlets if not self.strict):
                inlet.source = mailbox
        self._routes.clear()

    def _compare(self, message: Received[Message]) -> None:
        """Make the deferred message that was sent on this key before once more, now that time has gone on."""
        if (before := self._later.pop(message.key, None)) is not None:
            again, sent = before
            late = again.of(message.key).body
            if late != sent:
                raise TypeError(f"{message.key}: expected the same message whenever it is made, got {sent} and {late}")
        for mailbox in self._mailboxes:
            if (deferred := mailbox.newest.get(message.key)) is not None:
                if self._twins is None or self._twins[0] is not deferred:
                    self._twins = deferred, Deferred(deferred.topics, deferred.stamp, deferred.make, deferred.sender)
                self._later[message.key] = self._twins[1], message.body

    def _route(self, key: str) -> list[_End]:
        wild = (ends for of, ends in self._attached.items() if "*" in of and key_matches(of, key))
        return [end for ends in (self._attached.get(key, []), *wild) for end in ends]
