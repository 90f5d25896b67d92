"""The mailbox of one node. Executors fill and empty it between ticks; nodes only read from it and publish to it."""

import contextlib
import enum
import logging
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Final, Generic, TypeVar

from msgspec import Struct

from vrg.bus.codec import Header, Received, decode_body
from vrg.bus.deferred import Deferred
from vrg.bus.messages import Message
from vrg.bus.topics import Qos, Topic
from vrg.errors import MessageError

T = TypeVar("T", bound=Message)

log = logging.getLogger(__name__)

QUEUE_LIMIT = 10_000
"""The number of events that are kept for a node that does not tick. Beyond it the oldest are dropped and counted."""
LOUD_DROPS = 5
"""The number of bad messages of a subscription that are logged one by one; then only the 10th, the 100th and so on."""
KEYS_LIMIT: Final = 1_000
"""The number of keys of a subscription that messages are taken from, so that a sender cannot invent more and more."""
SENDERS_LIMIT: Final = 10_000
"""The number of senders of events whose newest numbers are remembered."""


class Origin(enum.Enum):
    """The way in which an event has arrived over the bus.

    LIVE was just published. REPEATED was published once more, because its sender's link was lost. ASKED was asked for,
    because the receiver's own link was lost.
    """

    LIVE = "live"
    REPEATED = "repeated"
    ASKED = "asked"


class Numbers:
    """The newest numbers of the messages of each sender on each key."""

    def __init__(self) -> None:
        self._newest: dict[tuple[str, str], int] = {}

    def is_new(self, head: Header, origin: Origin) -> bool:
        """Return whether a message has a higher number than all of its sender before it, and remember it.

        An answer to a request is not new if its sender was never heard: it may be older than this process.
        """
        link = (head.key, head.sender)
        if head.sequence <= self._newest.get(link, sys.maxsize if origin is Origin.ASKED else -1):
            return False
        if len(self._newest) >= SENDERS_LIMIT:
            self._newest.clear()
        self._newest[link] = head.sequence
        return True


class Inlet(Generic[T]):
    """One subscription of a node.

    Messages that arrive between ticks wait outside, and `handover` brings them in, so that what a node sees does not
    change while it computes.

    Args:
        topic: what is subscribed to.
        alarm: called with each message as soon as it arrives; see `Mailbox.subscribe`.
        only: the keys that messages are taken from; None takes them from any that fits, and at most KEYS_LIMIT.
        sampled: True if only `latest` and `news` are asked for.

    Attributes:
        by_key: the newest message of each key.
        source: executor only: the mailbox whose deferred messages are found there, and count before those in `by_key`.
        dropped: the number of bad messages, and of events that came faster than they were taken.
    """

    def __init__(
        self,
        topic: Topic[T],
        alarm: Callable[[Received[T]], None] | None = None,
        only: Collection[str] | None = None,
        *,
        sampled: bool = False,
    ) -> None:
        self._keys = set(only or ())
        self._known = only is not None
        self.topic = topic
        self.alarm = alarm
        self.sampled = sampled
        self._sampled: Received[T] | None = None
        """The message that `news` returned last."""
        self.source: Mailbox | None = None
        self.dropped = 0
        self.by_key: dict[str, Received[T]] = {}
        self.waiting: list[Received[T]] = []
        """Executor only: what has arrived since the last handover."""
        self._events: list[Received[T]] = []
        self._news: dict[str, Received[T]] = {}
        self._latest: Received[T] | None = None
        """The newest message of all keys; None until somebody asks for it after a handover."""
        self._queued = topic.qos is Qos.EVENT
        self._numbers = Numbers()

    @property
    def latest(self) -> Received[T] | None:
        """The newest message of all keys of the topic, or None before the first."""
        if self.source is not None and (deferred := self.source.newest.get(self.topic.key)) is not None:
            return deferred.of(self.topic.key)  # type: ignore[return-value]
        if self._latest is None and self.by_key:
            self._latest = max(self.by_key.values(), key=_order)
        return self._latest

    def news(self) -> Received[T] | None:
        """The newest message, if it came since the last call; None if it did not."""
        latest = self.latest
        if latest is self._sampled:
            return None
        self._sampled = latest
        return latest

    @property
    def is_new(self) -> bool:
        """True if `news` would return a message."""
        return self.latest is not self._sampled

    def only(self, keys: Collection[str]) -> None:
        """From now on take messages from these keys only. Those from others are dropped unread, which costs little."""
        self._keys, self._known = set(keys), True

    def take(self) -> list[Received[T]]:
        """Return the messages handed over since the last call.

        For an EVENT topic these are all messages; for the others only the newest of each key. The messages of one
        handover are in the order of (stamp, key, sender, sequence).
        """
        if self._queued:
            events, self._events = self._events, []
            return events
        if not self._news:
            return []
        news, self._news = self._news, {}
        return list(news.values())

    def offer(self, message: Received[T]) -> None:
        """Executor only: let a message that has just arrived wait for the next handover, and call the alarm."""
        self.waiting.append(message)
        if self.alarm is not None:
            self.alarm(message)

    def sound(self, head: Header) -> None:
        """Executor only: call the alarm with what has just come over the bus, on any thread; it is offered later."""
        if self.alarm is not None:
            with contextlib.suppress(MessageError):  # `offer_header` counts and logs it
                self.alarm(decode_body(head, self.topic.type))

    def admits(self, key: str) -> bool:
        """Executor only: whether messages are taken from a key. Others are dropped unread."""
        if key in self._keys or self._known:
            return key in self._keys
        if len(self._keys) >= KEYS_LIMIT:
            self.refuse(MessageError(f"{key}: expected at most {KEYS_LIMIT} keys: a sender keeps inventing new ones"))
            return False
        self._keys.add(key)
        return True

    def offer_header(self, head: Header, origin: Origin = Origin.LIVE) -> None:
        """Executor only: decode what arrived over the bus. A bad message is counted, logged and dropped.

        After a lost link an event may come twice, and is handed over once. Messages with an alarm count again anyway,
        and perishable ones never come twice, so none of these that was just published is dropped, whatever its number.
        """
        try:
            message = decode_body(head, self.topic.type)
        except MessageError as error:
            self.refuse(error)
            return
        if self._queued and not self.topic.perishable:
            news = self._numbers.is_new(head, origin)
            if not news and not (origin is Origin.LIVE and self.alarm is not None):
                return
        self.waiting.append(message)

    def refuse(self, error: MessageError) -> None:
        """Executor only: count and log a bad message, which is dropped."""
        self.dropped += 1
        if self.dropped <= LOUD_DROPS or is_power_of_ten(self.dropped):
            log.warning("dropped a bad message (number %d here): %s", self.dropped, error)

    def forget(self) -> None:
        """Executor only: drop what was handed over, unless it is an event."""
        if not self._queued:
            self.by_key.clear()
            self._news.clear()
            self._latest = None

    def handover(self) -> None:
        """Executor only: bring in the messages that wait."""
        waiting, self.waiting = self.waiting, []
        if not waiting:
            return
        if len(waiting) > 1:
            waiting.sort(key=_order)
        by_key, news = self.by_key, self._news
        for message in waiting:
            key = message.key
            by_key[key] = message
            if not self._queued:
                # Only the newest of a key stays, at the place in the order that belongs to it.
                news.pop(key, None)
                news[key] = message
        self._latest = waiting[-1] if len(by_key) == 1 else None
        if self._queued:
            self._events += waiting
            if len(self._events) > QUEUE_LIMIT:
                self.dropped += len(self._events) - QUEUE_LIMIT
                del self._events[:-QUEUE_LIMIT]


class Outgoing(Struct, frozen=True, gc=False):
    """A message on its way out, with its topic."""

    topic: Topic[Message]
    message: Received[Message]


class Mailbox:
    """All inlets of a node, and the messages that it has published since the executor last collected them.

    Args:
        sender: the kind and the name of who publishes, such as `official/ann`. A node writes its own here.

    Attributes:
        inlets: the subscriptions.
        flooded: the keys on which their senders, known by their seats, publish far more than a match needs. Events that
            come on them are dropped unread.
        now: the match time of this tick, s. brought: whether the handover before it has brought any message.
        deferring: the topics of which messages may be deferred. A node writes its own here before its first tick.
        asked: executor only: the keys of these on which some ask for the newest message only, and find it here.
        untaken: executor only: the keys of these on which nobody takes each message.
        newest: the newest deferred message of each key that is asked for, up to the end of the last tick. It is
            replaced, and never changed.
        aloud: executor only: True publishes also what nobody takes.
        clock: executor only: returns the real time, s, by which `making` is counted; None counts nothing.
        making: the real time that it has taken to make what was deferred, s.
    """

    def __init__(self, sender: str = "") -> None:
        self.sender = sender
        self.inlets: list[Inlet[Message]] = []
        self.flooded: frozenset[str] = frozenset()
        self.now, self.brought = 0.0, False
        self.deferring: Sequence[Topic[Message]] = ()
        self.asked: frozenset[str] = frozenset()
        self.untaken: frozenset[str] = frozenset()
        self.newest: Mapping[str, Deferred[Message]] = {}
        self._deferred: dict[str, Deferred[Message]] = {}
        self.aloud = False
        self.clock: Callable[[], float] | None = None
        self.making = 0.0
        self._out: list[Outgoing] = []
        self._sequences: dict[str, int] = {}

    def subscribe(
        self,
        topic: Topic[T],
        alarm: Callable[[Received[T]], None] | None = None,
        only: Collection[str] | None = None,
        *,
        sampled: bool = False,
    ) -> Inlet[T]:
        """Subscribe the node to a topic. It must be called before the node's first tick.

        Args:
            topic: the topic to hear.
            alarm: called with each message as soon as it arrives, on any thread, also while the node decides. It is for
                an emergency stop, which cannot wait for the end of a tick. It may make a robot safe; it must not
                publish. Answers to a request after a lost link are only handed over.
            only: the keys of the topic that matter, where they are known.
            sampled: True if only the newest message is ever asked for, of a topic with one key. It may then be made
                when it is asked for: see `defer`.
        """
        inlet = Inlet(topic, alarm, only, sampled=sampled)
        self.inlets.append(inlet)  # type: ignore[arg-type]
        return inlet

    def publish(self, topic: Topic[T], body: T, stamp: float | None = None) -> None:
        """Publish a message. It is sent when the tick is over.

        Args:
            stamp: the match time of the measurement, s; the default is the time of this tick.
        """
        key = topic.key
        sequence = self._sequences.get(key, 0)
        self._sequences[key] = sequence + 1
        received = Received(key, self.now if stamp is None else stamp, sequence, body, self.sender)
        self._out.append(Outgoing(topic, received))

    def defer(self, topics: Sequence[Topic[T]], make: Callable[[], Sequence[T]]) -> None:
        """Publish a message on each of some topics, of which none need be made before somebody reads one.

        Args:
            topics: among `deferring`; otherwise the messages are published at once.
            make: see `Deferred`. It is called at once where somebody takes each message.
        """
        timed = make if self.clock is None else partial(self._timed, self.clock, make)
        deferred = Deferred(topics, self.now, timed, self.sender)
        for topic in topics:
            if topic.key in self.asked:
                self._deferred[topic.key] = deferred  # type: ignore[assignment]
            if self.aloud or topic.key not in self.untaken:
                self.publish(topic, deferred.of(topic.key).body)

    def _timed(self, clock: Callable[[], float], make: Callable[[], Sequence[T]]) -> Sequence[T]:
        began = clock()
        try:
            return make()
        finally:
            self.making += clock() - began

    def forget(self) -> None:
        """Executor only: drop everything but events, because the world has stepped back in time."""
        for inlet in self.inlets:
            inlet.forget()

    def handover(self, now: float) -> None:
        """Executor only: begin a tick at match time `now`."""
        self.now, self.brought = now, False
        for inlet in self.inlets:
            if inlet.waiting:
                inlet.handover()
                self.brought = True

    def collect(self) -> list[Outgoing]:
        """Executor only: return what was published since the last call."""
        if self._deferred:
            self.newest, self._deferred = {**self.newest, **self._deferred}, {}
        out, self._out = self._out, []
        return out


def _order(message: Received[Message]) -> tuple[float, str, str, int]:
    # A name must come before a longer one that begins with it, with and without an instance behind it.
    return (message.stamp, message.key, message.sender.replace("/", "\0"), message.sequence)


def is_power_of_ten(n: int) -> bool:
    """True if a count is 1, 10, 100 and so on. Repetitions are logged at these counts."""
    return str(n).strip("0") == "1"
