"""The traffic on the keys of a match: the rate of messages, the number of lost ones, the age of the newest.

The messages are counted by their headers; a body is decoded only on request.
"""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, TypeVar

from vrg.bus.codec import Received, decode, header
from vrg.bus.messages import Message
from vrg.bus.session import Collected, Session
from vrg.bus.topics import Keys, Topic, key_matches
from vrg.errors import MessageError, MisroutedError

T = TypeVar("T", bound=Message)

SPAN: Final = 2.0
"""The real time in s over which rates are counted."""
MIN_COUNT_PERIOD: Final = 0.25
"""The least real time in s between two counts."""
QUEUE_SIZE: Final = 20_000
"""The number of messages that wait for `take`. If there were more, it is not known which were lost on the way."""


@dataclass
class ArrivalCount:
    """The messages that have come over one link, counted by their numbers.

    Args:
        at: when the newest came, monotonic time, s. time: its stamp, match time, s. sequence: its number.
        arrived, lost: how many. longest: the longest time between two, real time, s.
    """

    at: float
    time: float = 0.0
    sequence: int = -1
    arrived: int = 0
    lost: int = 0
    longest: float = 0.0

    def take(self, at: float, sequence: int, stamp: float) -> None:
        """Take in a message. One with a lower number than the last is from a sender that has started again."""
        if sequence > self.sequence >= 0:
            self.lost += sequence - self.sequence - 1
            self.longest = max(self.longest, at - self.at)
        self.at, self.time, self.sequence = at, stamp, sequence
        self.arrived += 1


@dataclass(frozen=True)
class Stream:
    """The statistics of the messages on one key.

    Args:
        key: without the root of the match.
        rate: messages a second, and bandwidth: bytes a second, both of real time and over the last SPAN.
        age: the real time since the newest message came, s.
        lost: how many never came. lately: how many of them over the last SPAN. bad: how many were no messages, and
            misrouted: how many came on this key but were published on another one.
        longest: the longest real time between two messages, s.
        sender: of the newest message, such as `player/ann`.
    """

    key: str
    rate: float
    bandwidth: float
    age: float
    sender: str = ""
    lost: int = 0
    lately: int = 0
    bad: int = 0
    misrouted: int = 0
    longest: float = 0.0


@dataclass
class _Channel:
    """One key: its counts, the newest payload, and what was decoded of it."""

    heard: ArrivalCount
    size: int = 0
    bad: int = 0
    misrouted: int = 0
    payload: bytes = b""
    sender: str = ""
    decoded: tuple[bytes, Received[Any] | None] | None = None
    counts: deque[tuple[float, int, int, int]] = field(default_factory=deque)
    """Monotonic time, s, and what had come, in messages, bytes and losses."""


class Traffic:
    """Counts the messages of a match, and keeps the newest of each key.

    Args:
        keys: of the match. now: returns monotonic time, s.
    """

    def __init__(self, keys: Keys, now: Callable[[], float] = time.monotonic) -> None:
        self._root = f"{keys.root}/"
        self._now = now
        self._session: Session | None = None
        self._collected: Collected | None = None
        self._channels: dict[str, _Channel] = {}
        self._streams: list[Stream] = []
        self._looked = -MIN_COUNT_PERIOD

    def attach(self, session: Session) -> None:
        """Set the session with which `open` listens."""
        self._session = session

    def open(self) -> None:
        """Listen to everything that this seat may hear, from now on. Idempotent."""
        if self._session is not None and self._collected is None:
            self._collected = self._session.collect_raw(f"{self._root}**", QUEUE_SIZE)

    def close(self) -> None:
        """Listen no more, and forget what was heard. Idempotent."""
        if self._collected is not None:
            self._collected.close()
            self._collected = None
        self._channels.clear()
        self._streams, self._looked = [], -MIN_COUNT_PERIOD

    def take(self) -> None:
        """Take in what has arrived since this was last called. The age of a message begins here."""
        found = [] if self._collected is None else self._collected()
        if len(found) >= QUEUE_SIZE:
            for channel in self._channels.values():
                channel.heard.sequence = -1
        for key, payload in found:
            self.arrived(key, payload)

    def arrived(self, key: str, payload: bytes) -> None:
        """Take in one message."""
        now = self._now()
        channel = self._channels.get(key)
        if channel is None:
            channel = self._channels[key] = _Channel(ArrivalCount(now))
            channel.counts.append((now, 0, 0, 0))
        channel.size += len(payload)
        try:
            head = header(payload, key)
        except MisroutedError:
            channel.misrouted += 1
            return
        except MessageError:
            channel.bad += 1
            return
        channel.heard.take(now, head.sequence, head.stamp)
        channel.payload = payload
        channel.sender = "/".join(head.sender.split("/")[:2])

    def look(self) -> list[Stream]:
        """The streams heard so far, in the order of their keys."""
        now = self._now()
        if now - self._looked < MIN_COUNT_PERIOD:
            return self._streams
        self._looked = now
        self._streams = [
            self._count(key.removeprefix(self._root), channel, now) for key, channel in sorted(self._channels.items())
        ]
        return self._streams

    def newest(self, topic: Topic[T]) -> list[Received[T]]:
        """The newest message on each key of a topic, in the order of the keys. A bad one is left out, and counted."""
        if "*" in topic.key:
            found = [(key, c) for key, c in sorted(self._channels.items()) if key_matches(topic.key, key)]
        else:
            found = [(topic.key, self._channels[topic.key])] if topic.key in self._channels else []
        messages = (self._decoded(topic, key, channel) for key, channel in found)
        return [message for message in messages if message is not None]

    def _decoded(self, topic: Topic[T], key: str, channel: _Channel) -> Received[T] | None:
        payload = channel.payload
        if not payload:
            return None
        if channel.decoded is None or channel.decoded[0] is not payload:
            try:
                channel.decoded = payload, decode(payload, topic.type, key)
            except MessageError:
                channel.bad += 1
                channel.decoded = payload, None
        return channel.decoded[1]

    @staticmethod
    def _count(key: str, channel: _Channel, now: float) -> Stream:
        heard, counts = channel.heard, channel.counts
        counts.append((now, heard.arrived, channel.size, heard.lost))
        while len(counts) > 2 and now - counts[1][0] >= SPAN:
            counts.popleft()
        began, arrived, size, lost = counts[0]
        span = max(now - began, MIN_COUNT_PERIOD)
        return Stream(
            key=key,
            rate=(heard.arrived - arrived) / span,
            bandwidth=(channel.size - size) / span,
            age=max(0.0, now - heard.at),
            lost=heard.lost,
            lately=heard.lost - lost,
            bad=channel.bad,
            misrouted=channel.misrouted,
            longest=heard.longest,
            sender=channel.sender,
        )
