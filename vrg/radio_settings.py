"""The quality of the radio links of a match. `vrg.agents.radio` has the model that follows from it."""

from typing import Annotated

from msgspec import Meta, Struct

from vrg.types import Fraction, Length, Seconds


class LinkSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The quality of the link from one player to another.

    Args:
        range: the distance in m beyond which nothing arrives; None has no limit.
        loss: the share of messages that are lost, 0 to 1.
        delay: the match time that each message takes at least, s. jitter: the longest additional time, s; each message
            draws its own between 0 and this.
        bandwidth: the number of bytes that can travel in a second; None has no limit. Messages wait for their turn.
    """

    range: Length | None = None
    loss: Fraction = 0.0
    delay: Seconds = 0.0
    jitter: Seconds = 0.0
    bandwidth: Annotated[float, Meta(gt=0.0, le=1e12)] | None = None


PERFECT = LinkSettings()
"""A link over which every message arrives at once."""


class RadioSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The radio of a match.

    Args:
        every: the quality of each link that `links` does not hold. links: the quality of one link, by
            the names of the two joined by `>`, such as `ann>bob`.
    """

    every: LinkSettings = PERFECT
    links: dict[str, LinkSettings] = {}

    def between(self, speaker: str, listener: str) -> LinkSettings:
        """The quality of the link from one player to another."""
        return self.links.get(f"{speaker}>{listener}", self.every)

    @property
    def perfect(self) -> bool:
        """True if every message arrives at once."""
        return all(link == PERFECT for link in (self.every, *self.links.values()))
