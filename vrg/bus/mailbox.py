"""What one node hears and says. Executors fill and empty it between ticks; nodes only read and publish."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from vrg.bus.codec import Received, decode
from vrg.bus.messages import Message
from vrg.bus.topics import Qos, Topic
from vrg.errors import MessageError

T = TypeVar("T", bound=Message)

log = logging.getLogger(__name__)

QUEUE_LIMIT = 10_000
"""Events held for a node that does not tick; beyond it the oldest are dropped and counted."""
LOUD_DROPS = 5
"""Bad messages of one subscription that are logged one by one; then only each tenfold."""


class Inlet(Generic[T]):
    """One subscription of a node.

    Between ticks arrivals wait outside, and `handover` brings them in, so that what a node sees does not change
    while it computes.

    Args:
        alarm: called with each arrival before the tick that hands it over; see `Mailbox.subscribe`.
    """

    def __init__(self, topic: Topic[T], alarm: Callable[[Received[T]], None] | None = None) -> None:
        self.topic = topic
        self.alarm = alarm
        self._alarmed = 0
        self.dropped = 0
        self.by_key: dict[str, Received[T]] = {}
        self._waiting: list[Received[T]] = []
        self._fresh: list[Received[T]] = []
        self._queued = topic.qos is Qos.EVENT

    @property
    def latest(self) -> Received[T] | None:
        """The newest message over all keys of the topic, or None before the first."""
        if len(self.by_key) == 1:
            return next(iter(self.by_key.values()))
        return max(self.by_key.values(), key=_order, default=None)

    def take(self) -> list[Received[T]]:
        """The messages handed over since the last call; those of one handover by (stamp, key, sequence).

        Every one for an EVENT topic; for the others at most the newest of each key and handover.
        """
        fresh, self._fresh = self._fresh, []
        return fresh

    def offer(self, message: Received[T]) -> None:
        """Executor only: let a message wait for the next handover."""
        self._waiting.append(message)

    def offer_bytes(self, key: str, payload: bytes) -> None:
        """Executor only: decode what came over the wire; a bad message is counted, logged and dropped."""
        try:
            self.offer(decode(payload, self.topic.type, key))
        except MessageError as error:
            self.dropped += 1
            if self.dropped <= LOUD_DROPS or _is_power_of_ten(self.dropped):
                log.warning("dropped a bad message (number %d here): %s", self.dropped, error)

    def forget(self) -> None:
        """Executor only: drop what was handed over and is no event."""
        if not self._queued:
            self.by_key.clear()
            self._fresh.clear()

    def sound(self) -> None:
        """Executor only: raise the alarm for what has arrived since the last call."""
        if self.alarm is not None:
            fresh, self._alarmed = self._waiting[self._alarmed :], len(self._waiting)
            for message in fresh:
                self.alarm(message)

    def handover(self) -> None:
        """Executor only: bring in what waits."""
        if not self._waiting:
            return
        self.sound()
        self._alarmed = 0
        waiting, self._waiting = self._waiting, []
        if len(waiting) > 1:
            waiting.sort(key=_order)
        if self._queued:
            self._fresh.extend(waiting)
            if len(self._fresh) > QUEUE_LIMIT:
                self.dropped += len(self._fresh) - QUEUE_LIMIT
                del self._fresh[:-QUEUE_LIMIT]
        else:
            newest = {message.key: message for message in waiting}
            self._fresh = [old for old in self._fresh if old.key not in newest] if self._fresh else []
            self._fresh.extend(newest.values())
        for message in waiting:
            self.by_key[message.key] = message


@dataclass(frozen=True, slots=True)
class Outgoing:
    """A message on its way out, with what the wire needs to know of it."""

    topic: Topic[Message]
    message: Received[Message]


class Mailbox:
    """All inlets of a node and the messages that it has published since the executor last looked."""

    def __init__(self) -> None:
        self.inlets: list[Inlet[Message]] = []
        self.now = 0.0
        self._out: list[Outgoing] = []
        self._sequences: dict[str, int] = {}

    def subscribe(self, topic: Topic[T], alarm: Callable[[Received[T]], None] | None = None) -> Inlet[T]:
        """Declare that the node hears this topic. Only before its first tick.

        Args:
            alarm: called at once with what arrives, on the node's own thread, between its ticks: for an emergency
                stop, which cannot wait for the next one. It may make a robot safe; it publishes nothing.
        """
        inlet = Inlet(topic, alarm)
        self.inlets.append(inlet)  # type: ignore[arg-type]
        return inlet

    def publish(self, topic: Topic[T], body: T, stamp: float | None = None) -> None:
        """Send a message when the tick is over.

        Args:
            stamp: match time of the measurement, s; the time of this tick if it is missing.
        """
        key = topic.key
        sequence = self._sequences.get(key, 0)
        self._sequences[key] = sequence + 1
        self._out.append(Outgoing(topic, Received(key, self.now if stamp is None else stamp, sequence, body)))

    def sound(self) -> None:
        """Executor only: raise the alarms of what has arrived since the last call."""
        for inlet in self.inlets:
            inlet.sound()

    def forget(self) -> None:
        """Executor only: the world has stepped back in time; sensors, commands and states count no more."""
        for inlet in self.inlets:
            inlet.forget()

    def handover(self, now: float) -> None:
        """Executor only: begin a tick at match time `now`."""
        self.now = now
        for inlet in self.inlets:
            inlet.handover()

    def collect(self) -> list[Outgoing]:
        """Executor only: what was published since the last call."""
        out, self._out = self._out, []
        return out


def _order(message: Received[Message]) -> tuple[float, str, int]:
    return (message.stamp, message.key, message.sequence)


def _is_power_of_ten(n: int) -> bool:
    return str(n).strip("0") == "1"
