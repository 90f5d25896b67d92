"""A model of the radio links between players: range, loss, delay, jitter and bandwidth (thesis 5.2).

Whether a message is lost, and by how much its delay varies, is drawn by the seed, the link, the key and the number of
the message alone. So a match in one process and one over processes lose the same messages, if the same are sent.
"""

import hashlib
import struct

from vrg.bus.radio import PerfectLink, Transmission
from vrg.bus.radio_settings import LinkSettings, RadioSettings

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

        A message that is lost on its way takes its time on the link all the same. One beyond the range takes it too,
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
