"""A player's messages.

Its strategy's answers go to its team over the radio, to the referee, and to windows. From its team come the orders of
the person who commands it, and the players that it sees.
"""

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from msgspec import Struct, structs, to_builtins

from vrg.agents.radio import Radio, TeamMessage, packed
from vrg.agents.strategy import Action
from vrg.bus.codec import checked
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Bid, Links, RefereeState, Sight, Sighting, Sightings, Sketch, Stroke
from vrg.bus.node import is_fresh
from vrg.bus.topics import Keys
from vrg.hal.actuators import UNUSED
from vrg.hal.models import RobotModel
from vrg.shared import shared
from vrg.types import Vector, quantised

T = TypeVar("T")
log = logging.getLogger(__name__)

BIDS_LIMIT = 20
"""The number of bids that a player may make at one tick. The referee looks at no more of them."""
_VARIANCE_STEPS = 1e12
"""The steps of a variance in 1 m^2; that of a standard deviation of one micrometre is one."""
WARNINGS_LIMIT = 50
"""The number of different warnings about a strategy's messages that are logged."""
COUNT_PERIOD = 1.0
"""The match time in s between two messages about what arrived over the radio."""
SIGHT_TIMEOUT = 0.25
"""The match time in s by which the poses that a team sees may be older than the state of the referee."""


class Once:
    """Lets each text pass once, and this many texts at most."""

    def __init__(self) -> None:
        self._told: set[str] = set()

    def __call__(self, text: str) -> bool:
        """Return True if a text may pass."""
        if text in self._told or len(self._told) >= WARNINGS_LIMIT:
            return False
        self._told.add(text)
        return True


class Payload(Struct, frozen=True):
    """The messages of an action, as they can be sent.

    Args:
        say: the MessagePack of its message to its team. sightings, bids, sketch: the messages.
        use: what it does with actuators.
    """

    say: bytes | None = None
    sightings: Sightings | None = None
    bids: Sequence[Bid] = ()
    sketch: Sketch | None = None
    use: Mapping[str, float] = {}


def usable(use: Mapping[str, float], robot: RobotModel | None = None) -> dict[str, float]:
    """What a player does with actuators, with Python's own numbers, within what the robot can do.

    Args:
        robot: whose actuators they are; None where only its player knows it.

    Raises:
        ValueError: it has no such actuator, or a value is no finite number. TypeError: it is no table.
    """
    if not isinstance(use, Mapping):
        raise TypeError(f'expected a table such as {{"kicker": 4.0}}, got {use!r}')
    found = {}
    for name, value in use.items():
        actuator = None if robot is None else robot.actuator(name)
        if robot is not None and actuator is None:
            known = ", ".join(actuator.name for actuator in robot.actuators) or "none"
            raise ValueError(f"expected an actuator of {robot.name} ({known}), got {name!r}")
        try:
            wanted = float(value)
        except (TypeError, ValueError, OverflowError):
            wanted = math.nan
        if not math.isfinite(wanted):
            raise ValueError(f"expected a finite number for {name}, got {value!r}")
        found[str(name)] = quantised(wanted if actuator is None else min(max(wanted, 0.0), actuator.most))
    return found


def sendable(action: Action) -> tuple[Payload, list[str]]:
    """The messages of an action, with numpy's numbers as Python's own; and the parts that cannot be sent, and why, in
    words."""
    problems: list[str] = []

    def attempt(what: str, make: Callable[[], T], otherwise: T) -> T:
        try:
            return make()
        except Exception as error:  # it comes from a student's code, and so may its attributes
            problems.append(f"{what} left out: {error}")
            return otherwise

    payload = Payload(
        None if action.say is None else attempt("say", lambda: packed(action.say), None),
        attempt("sightings", lambda: checked(Sightings(seen=tuple(map(_quantised, action.sightings)))), None)
        if action.sightings
        else None,
        attempt("bids", lambda: _bids(action.bids), []) if action.bids else [],
        None
        if action.sketch is None
        else attempt("sketch", lambda: checked(Sketch(strokes=tuple(map(_drawn, action.sketch or ())))), None),
        attempt("use", lambda: usable(action.use), {}) if action.use is not UNUSED else {},
    )
    return payload, problems


def _bids(bids: Mapping[str, float | None]) -> list[Bid]:
    if len(bids) > BIDS_LIMIT:
        raise ValueError(f"expected at most {BIDS_LIMIT} bids at a tick, got {len(bids)}")
    costs = {lot: None if cost is None else quantised(float(cost)) for lot, cost in bids.items()}
    return [checked(Bid(lot=lot, cost=cost)) for lot, cost in costs.items()]


def _quantised(seen: Sighting) -> Sighting:
    """A sighting with rounded numbers: see `vrg.types.quantised`. The covariance stays positive definite."""
    x, y, time = (quantised(float(value)) for value in (seen.x, seen.y, seen.time))
    xx, xy, yy = (quantised(float(value), _VARIANCE_STEPS) for value in (seen.xx, seen.xy, seen.yy))
    if xx <= 0.0 or yy <= 0.0:
        xx, xy, yy = seen.xx, seen.xy, seen.yy
    return Sighting(x=x, y=y, time=time, xx=xx, xy=xy, yy=yy)


def _drawn(stroke: Stroke) -> Stroke:
    points = tuple((quantised(float(x)), quantised(float(y))) for x, y in stroke.points)
    return Stroke(points=points, label=stroke.label)


class Telling:
    """The messages of a player, besides the commands to its robot.

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
        """Send the messages of an action, and return what cannot be sent, and why, in words.

        Such a message has numbers out of range, or is of another type or too long. It is left out; the rest is sent.

        Args:
            place: where the player measures itself to be, m.
        """
        if action.say is None and action.sketch is None and not (action.sightings or action.bids):
            return []
        payload, problems = sendable(action)
        if payload.say is not None:
            self._radio.say(payload.say, place)
        if payload.sightings is not None:
            self._mailbox.publish(self._sightings, payload.sightings)
        for bid in payload.bids:
            self._mailbox.publish(self._bid, bid)
        if payload.sketch is not None:
            self._mailbox.publish(self._sketch, payload.sketch)
        return problems

    def heard(self, place: Vector) -> Sequence[TeamMessage]:
        """The messages from the team since the last call; `place` as for `tell`."""
        return self._radio.heard(place)

    def count(self, now: float) -> None:
        """Publish what arrived over the radio, once per COUNT_PERIOD, if there was anything. now: match time, s."""
        counts = self._radio.counts() if now >= self._count_at else []
        if counts:
            self._count_at = now + COUNT_PERIOD
            self._mailbox.publish(self._links, Links(links=tuple(counts)))

    def counted(self) -> dict[str, Any]:
        """The messages that came over the radio, as plain data: the numbers of `LinkCount` by team mate."""
        links = {count.speaker: to_builtins(count) for count in self._radio.counts()}
        return {name: {k: v for k, v in of.items() if k != "speaker"} for name, of in links.items()}


class TeamChannel:
    """The subscriptions of one player to its team's messages.

    Args:
        keys: the keys of the match. mailbox: the mailbox of the player's node.
        name: the player's name. team: its team.
    """

    def __init__(self, keys: Keys, mailbox: Mailbox, name: str, team: str) -> None:
        self._name = name
        self._orders = mailbox.subscribe(keys.order(team))
        self._sight = mailbox.subscribe(keys.sight(team))
        self._unknown: str | None = None

    def seen(self, state: RefereeState, stamp: float) -> RefereeState:
        """The referee's state of match time `stamp`, with the poses that only this team receives.

        In a match without a limited view there are none. Poses that are older than the state do not count.
        """
        sight = self._sight.latest
        fresh = sight is not None and is_fresh(sight.stamp, stamp, SIGHT_TIMEOUT)
        return _with_poses(state, sight.body) if sight is not None and fresh else state

    def priority(self, now: float, known: Sequence[str]) -> str | None:
        """The order of the person who commands the team at match time `now`, if it is one of the known priorities."""
        order = self._orders.latest
        if order is None or order.body.priority is None or not is_fresh(order.stamp, now, order.body.lease):
            return None
        wanted = order.body.priority
        if wanted in known:
            return wanted
        if wanted != self._unknown:
            self._unknown = wanted
            expected = ", ".join(known) or "none"
            log.warning("%s: expected one of the strategy's priorities (%s), got %r", self._name, expected, wanted)
        return None


@shared
def _with_poses(state: RefereeState, sight: Sight) -> RefereeState:
    poses = sight.poses
    return structs.replace(state, players=tuple(structs.replace(p, pose=poses.get(p.name)) for p in state.players))
