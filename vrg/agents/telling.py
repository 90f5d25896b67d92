"""How a player tells others what its strategy answers: its team over the radio, the referee, and the windows."""

from collections.abc import Sequence
from typing import Any

from msgspec import to_builtins

from vrg.agents.strategy import Action
from vrg.bus.codec import checked
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Bid, Links, Message, Sightings, Sketch
from vrg.bus.radio import Heard, Radio
from vrg.bus.topics import Keys, Topic
from vrg.types import Vector

BIDS_LIMIT = 20
"""The number of bids that a player may make at one tick. The referee looks at no more of them."""
COUNT_PERIOD = 1.0
"""The match time in s between two messages about what came over the radio."""


class Telling:
    """What a player says and hears besides what its robot does.

    Args:
        mailbox: the mailbox of the player's node. keys: the keys of the match. name: the player's name.
        radio: the radio to its team.
    """

    def __init__(self, mailbox: Mailbox, keys: Keys, name: str, radio: Radio) -> None:
        self._mailbox = mailbox
        self._radio = radio
        self._sightings, self._bid = keys.sightings(name), keys.bid(name)
        self._sketch, self._links = keys.sketch(name), keys.links(name)
        self._count_at = 0.0

    def tell(self, action: Action, place: Vector) -> None:
        """Send what an action says.

        Args:
            place: where the player measures itself to be, m.

        Raises:
            Exception: it cannot be sent, as numbers are out of range or something is of another type or too long.
        """
        if action.say is not None:
            self._radio.say(action.say, place)
        told: list[tuple[Topic[Any], Message]] = []
        if action.sightings:
            told.append((self._sightings, Sightings(seen=list(action.sightings))))
        if len(action.bids) > BIDS_LIMIT:
            raise ValueError(f"expected at most {BIDS_LIMIT} bids at a tick, got {len(action.bids)}")
        for lot, cost in action.bids.items():
            told.append((self._bid, Bid(lot=lot, cost=None if cost is None else float(cost))))
        if action.sketch is not None:
            told.append((self._sketch, Sketch(strokes=list(action.sketch))))
        for topic, message in told:
            self._mailbox.publish(topic, checked(message))

    def heard(self, place: Vector) -> Sequence[Heard]:
        """What the team has said since the last call; `place` as for `tell`."""
        return self._radio.heard(place)

    def count(self, now: float) -> None:
        """Publish what came over the radio, once per COUNT_PERIOD, if there was anything. now: match time, s."""
        counts = self._radio.counts() if now >= self._count_at else []
        if counts:
            self._count_at = now + COUNT_PERIOD
            self._mailbox.publish(self._links, Links(links=counts))

    def counted(self) -> dict[str, Any]:
        """What came over the radio, as plain data: the numbers of `LinkCount` by team mate."""
        links = {count.speaker: to_builtins(count) for count in self._radio.counts()}
        return {name: {k: v for k, v in of.items() if k != "speaker"} for name, of in links.items()}
