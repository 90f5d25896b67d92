"""The radio between the players of a team. A player's message reaches the others over a link that can be modelled.

A link decides for each message and each receiver whether it arrives, and when. It decides by the seed, the link, the
key and the sequence number alone, never by the order of arrival, so that a match in one process and a match over
processes lose the same messages. The model has range, loss, delay, jitter and bandwidth (thesis 5.2).
"""

import hashlib
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import msgspec

from vrg.bus.codec import Received, plain
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import SAY_LIMIT, LinkCount, Say
from vrg.bus.topics import Keys
from vrg.names import name_of
from vrg.radio_settings import LinkSettings, RadioSettings
from vrg.types import Vector, quantised


@dataclass(frozen=True, slots=True)
class TeamMessage:
    """A message of a player of the team.

    Args:
        speaker: the name of the player that sent it. stamp: the match time at which it was sent, s.
        words: its content: numbers, strings, lists and tables of these.
    """

    speaker: str
    stamp: float
    words: Any


@dataclass(frozen=True, slots=True)
class Transmission:
    """One message on its way from one player to another.

    Args:
        speaker, listener: the names of the two players.
        key, sequence: the key and the number of the message. No other message of the match has both the same.
        size: the size of the message in bytes. stamp: the match time at which it was sent, s.
        distance: the distance from where the speaker was then to where the listener is when it takes the message in, m;
            None where it is not known. Both are as the two measure themselves.
    """

    speaker: str
    listener: str
    key: str
    sequence: int
    size: int
    stamp: float = 0.0
    distance: float | None = None


class RadioLink(Protocol):
    """A model of the links between all players of a match. Its results depend on the arguments and its seed alone."""

    def delay(self, message: Transmission) -> float | None:
        """The match time in s until the message arrives; None if it is lost."""


class PerfectLink:
    """A link over which every message arrives at once."""

    def delay(self, message: Transmission) -> float | None:
        """Return 0.0: every message arrives at once."""
        return 0.0


_FLOAT: Final = b"\xcb"
"""The byte before a number with a fraction in MessagePack. Other values may have it, too."""


def packed(words: Any) -> bytes:
    """The words to the team as MessagePack, which numpy's numbers and arrays may be part of.

    Numbers are rounded as by `quantised`.

    Raises:
        TypeError: MessagePack cannot hold it.
        ValueError: it is longer than SAY_LIMIT bytes.
    """
    data = msgspec.msgpack.encode(words, enc_hook=plain)
    if len(data) > SAY_LIMIT:
        raise ValueError(f"expected at most {SAY_LIMIT} bytes to be sent at a tick, got {len(data)}")
    return msgspec.msgpack.encode(_rounded(msgspec.msgpack.decode(data))) if _FLOAT in data else data


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return quantised(value)
    if isinstance(value, list):
        return [_rounded(part) for part in value]
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    return value


class Radio:
    """The radio of one player.

    Args:
        keys: the keys of the match. mailbox: the mailbox of the player's node.
        name, team: the player's name and team.
        link: the model of the links. Without one, every message arrives at once.

    Attributes:
        link: as above; another one counts for what has not been heard yet.
    """

    def __init__(self, keys: Keys, mailbox: Mailbox, name: str, team: str, link: RadioLink | None = None) -> None:
        self._name = name
        self._mailbox = mailbox
        self.link = link or PerfectLink()
        self._topic = keys.say(team, name)
        self._inlet = mailbox.subscribe(keys.say(team))
        self._coming: list[tuple[float, Received[Say]]] = []
        self._counts: dict[str, _Count] = {}

    def say(self, words: bytes, place: Vector | None = None) -> None:
        """Say something to the team.

        Args:
            words: what `packed` returns. place: where this player measures itself to be, m.
        """
        self._mailbox.publish(self._topic, Say(words=words, place=place))

    def heard(self, place: Vector | None) -> Sequence[TeamMessage]:
        """Return what has arrived since the last call, in the order of arrival.

        Args:
            place: where this player measures itself to be, m. A link may depend on the distance.
        """
        now = self._mailbox.now
        for message in self._inlet.take():
            speaker = _speaker(message.key)
            if speaker == self._name:
                continue
            transmission = Transmission(
                speaker,
                self._name,
                message.key,
                message.sequence,
                len(message.body.words),
                message.stamp,
                _distance(message.body.place, place),
            )
            delay = self.link.delay(transmission)
            self._counts.setdefault(speaker, _Count()).take(delay)
            if delay is not None:
                self._coming.append((message.stamp + delay, message))
        if not self._coming:
            return []
        self._coming.sort(key=lambda item: (item[0], item[1].key, item[1].sequence))
        arrived = [message for due, message in self._coming if due <= now + 1e-9]
        self._coming = self._coming[len(arrived) :]
        for message in arrived:
            self._counts[_speaker(message.key)].under_way -= 1
        return [TeamMessage(_speaker(message.key), message.stamp, _decode(message.body.words)) for message in arrived]

    def counts(self) -> list[LinkCount]:
        """The messages from each team mate, counted, by name."""
        return [count.told(speaker) for speaker, count in sorted(self._counts.items())]


@dataclass(slots=True)
class _Count:
    """The number of messages over one link, and the sum and the longest of their delays, s."""

    lost: int = 0
    passed: int = 0
    under_way: int = 0
    delays: float = 0.0
    longest: float = 0.0

    def take(self, delay: float | None) -> None:
        if delay is None:
            self.lost += 1
            return
        self.passed += 1
        self.under_way += 1
        self.delays += delay
        self.longest = max(self.longest, delay)

    def told(self, speaker: str) -> LinkCount:
        return LinkCount(
            speaker=speaker,
            arrived=self.passed - self.under_way,
            lost=self.lost,
            under_way=self.under_way,
            delay=round(self.delays / self.passed, 6) if self.passed else 0.0,
            longest=round(self.longest, 6),
        )


def _distance(a: Vector | None, b: Vector | None) -> float | None:
    return None if a is None or b is None else math.dist(a, b)


def _decode(words: bytes) -> Any:
    """Decode a message. Bytes that are no MessagePack, which another program may send, stay bytes."""
    try:
        return msgspec.msgpack.decode(words)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return words


def _speaker(key: str) -> str:
    """The player that publishes on this key."""
    return name_of(key.rsplit("/", 1)[1])


BACKLOG = 2.0
"""The time in s for which a message may wait for its turn on a link of limited bandwidth. Beyond it, it is lost."""


class ModelledLink:
    """The links of a match by a model. It must be asked for the messages of one speaker in the order of their numbers.

    Args:
        settings: how the links are. seed: the seed of the match.
    """

    def __init__(self, settings: RadioSettings, seed: int) -> None:
        self._settings = settings
        self._seed = seed
        self._free_at: dict[tuple[str, str], float] = {}
        """The match time at which the link from one player to another has sent all earlier messages, s."""

    def delay(self, message: Transmission) -> float | None:
        """The match time in s until the message arrives; None if it is lost.

        A message that is lost on its way takes its time on the link anyway. One beyond the range takes it too,
        because the speaker does not know that it is not received. An unknown distance counts as near.
        """
        link = self._settings.between(message.speaker, message.listener)
        waits = self._turn(message, link)
        if waits is None:
            return None
        lost, late = draws(self._seed, message)
        beyond = link.range is not None and message.distance is not None and message.distance > link.range
        if beyond or lost < link.loss:
            return None
        return waits + link.delay + late * link.jitter

    def _turn(self, message: Transmission, link: LinkSettings) -> float | None:
        """The time in s for which the message waits and travels, by the bandwidth; None if it would wait for too
        long."""
        if link.bandwidth is None:
            return 0.0
        pair = (message.speaker, message.listener)
        waits = max(0.0, self._free_at.get(pair, 0.0) - message.stamp)
        if waits > BACKLOG:
            return None
        travels = message.size / link.bandwidth
        self._free_at[pair] = message.stamp + waits + travels
        return waits + travels


def draws(seed: int, message: Transmission) -> tuple[float, float]:
    """Two random numbers from 0 to 1 (exclusive) that depend on the seed, the link, the key and the number alone."""
    text = f"{seed}|{message.speaker}|{message.listener}|{message.key}|{message.sequence}"
    first, second = struct.unpack("<QQ", hashlib.blake2b(text.encode(), digest_size=16).digest())
    return first / 2**64, second / 2**64


def link_of(settings: RadioSettings, seed: int) -> ModelledLink | PerfectLink:
    """The links of a match."""
    return PerfectLink() if settings.perfect else ModelledLink(settings, seed)
