"""How a player tells others what its strategy answers: its team over the radio, the referee, and the windows."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec import to_builtins

from vrg.agents.strategy import Action
from vrg.blame import DecisionTimeoutError
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

    def tell(self, action: Action, place: Vector) -> list[str]:
        """Send what an action says, and return what cannot be sent, and why, in words.

        That is what has numbers out of range, is of another type or too long. It is left out; the rest is sent.

        Args:
            place: where the player measures itself to be, m.
        """
        problems: list[str] = []

        def attempt(what: str, send: Callable[[], None]) -> None:
            try:
                send()
            except DecisionTimeoutError:
                raise
            except Exception as error:  # it comes from a student's code, and so may its attributes
                problems.append(f"{what} left out: {error}")

        if action.say is not None:
            attempt("say", lambda: self._radio.say(action.say, place))
        if action.sightings:
            attempt("sightings", lambda: self._send(self._sightings, Sightings(seen=list(action.sightings))))
        attempt("bids", lambda: self._tell_bids(action.bids))
        if action.sketch is not None:
            attempt("sketch", lambda: self._send(self._sketch, Sketch(strokes=list(action.sketch or ()))))
        return problems

    def _tell_bids(self, bids: Mapping[str, float | None]) -> None:
        if len(bids) > BIDS_LIMIT:
            raise ValueError(f"expected at most {BIDS_LIMIT} bids at a tick, got {len(bids)}")
        # All are checked before the first is sent.
        checked_bids = [checked(Bid(lot=lot, cost=None if cost is None else float(cost))) for lot, cost in bids.items()]
        for bid in checked_bids:
            self._mailbox.publish(self._bid, bid)

    def _send(self, topic: Topic[Any], message: Message) -> None:
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
