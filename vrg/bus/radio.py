"""The radio between the players of a team: what one says reaches the others by a link that can be modelled.

A link decides for each message and each receiver whether it arrives, and when. It decides by (seed, link, key, sequence)
alone, never by the order of arrival, so that a match in one process and a match over processes lose the same messages.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import msgspec

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import SAY_LIMIT, Say
from vrg.bus.topics import Keys
from vrg.types import Vector


@dataclass(frozen=True, slots=True)
class Heard:
    """What a player was told.

    Args:
        speaker: the name of the player who said it. stamp: match time at which it was said, s.
        words: whatever was said: numbers, texts, lists and tables of these.
    """

    speaker: str
    stamp: float
    words: Any


@dataclass(frozen=True, slots=True)
class Transmission:
    """One message on its way from one player to another.

    Args:
        key, sequence: which message it is; they tell it from every other one of the match.
        size: bytes. distance: m between the two when it arrives, None where that is not known.
    """

    speaker: str
    listener: str
    key: str
    sequence: int
    size: int
    distance: float | None = None


class Link(Protocol):
    """A model of the links between all players of a match. A function of its arguments and its seed."""

    def delay(self, message: Transmission) -> float | None:
        """s of match time until the message arrives; None where it is lost."""


class PerfectLink:
    """Everything arrives at once."""

    def delay(self, message: Transmission) -> float | None:
        """No time at all."""
        return 0.0


class Radio:
    """One player's.

    Args:
        name, team: of the player.
        link: the model; everything arrives at once without one.
    """

    def __init__(self, keys: Keys, mailbox: Mailbox, name: str, team: str, link: Link | None = None) -> None:
        self._name = name
        self._mailbox = mailbox
        self._link = link or PerfectLink()
        self._topic = keys.say(team, name)
        self._inlet = mailbox.subscribe(keys.say(team))
        self._coming: list[tuple[float, Received[Say]]] = []

    def say(self, words: Any) -> None:
        """Say something to the team: anything that MessagePack can hold, numpy's numbers and arrays included.

        Raises:
            TypeError: it holds something else. ValueError: it is too long.
        """
        data = msgspec.msgpack.encode(words, enc_hook=plain)
        if len(data) > SAY_LIMIT:
            raise ValueError(f"expected at most {SAY_LIMIT} bytes to be said at a tick, got {len(data)}")
        self._mailbox.publish(self._topic, Say(words=data))

    def heard(self, places: dict[str, Vector]) -> Sequence[Heard]:
        """What has arrived since the last call, in the order of arrival.

        Args:
            places: of the players, m, as far as they are known: a link may depend on the distance.
        """
        now = self._mailbox.now
        for message in self._inlet.take():
            speaker = message.key.rsplit("/", 1)[1]
            if speaker == self._name:
                continue
            delay = self._link.delay(
                Transmission(
                    speaker,
                    self._name,
                    message.key,
                    message.sequence,
                    len(message.body.words),
                    _distance(places.get(speaker), places.get(self._name)),
                )
            )
            if delay is not None:
                self._coming.append((message.stamp + delay, message))
        self._coming.sort(key=lambda item: (item[0], item[1].key, item[1].sequence))
        arrived = [message for due, message in self._coming if due <= now + 1e-9]
        self._coming = self._coming[len(arrived) :]
        return [Heard(message.key.rsplit("/", 1)[1], message.stamp, _decode(message.body.words)) for message in arrived]


def plain(value: object) -> object:
    """Numpy's numbers and arrays as Python's own, for msgspec.

    Raises:
        TypeError: it is none of these.
    """
    tolist = getattr(value, "tolist", None)
    if callable(tolist):
        return tolist()
    raise TypeError(f"expected numbers, texts, lists and tables, got {type(value).__name__}")


def _distance(a: Vector | None, b: Vector | None) -> float | None:
    return None if a is None or b is None else ((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) ** 0.5


def _decode(words: bytes) -> Any:
    """Whatever was said; bytes that are no MessagePack, which another program may send, stay bytes."""
    try:
        return msgspec.msgpack.decode(words)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return words
