"""The interface of a game's rule book: an object that judges a field. It uses no bus, no clock and no files.

A rule book remembers nothing itself. Its whole memory is one frozen state that is passed in and returned, so that it
can be written to the journal and another process can go on from it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

from msgspec import Struct

from vrg.bus.messages import Auction, FieldObject, OfficialAction, PlayerStatus, Sighting, Stage, Zone
from vrg.errors import ConfigError
from vrg.regions import Region
from vrg.types import Pose


class Disqualification(Struct, frozen=True, kw_only=True):
    """Why a player is out, whatever the game.

    Args:
        why: the reason, in words.
        by_official: a person has decided it, so only a person ends it. Otherwise the player comes back once it reports.
        returns: it plays again from the next round.
    """

    why: str
    by_official: bool = False
    returns: bool = False


class GameState(Struct, frozen=True, kw_only=True):
    """The base class of the states of all games.

    Args:
        round: the number of the round, from 1.
        disqualified: the players that are out because they have failed. A rule book treats them as obstacles: they
            neither score nor are scored on, and no round waits for them. `Match` keeps them from moving.
        auctions: the auctions, by lot. A rule book opens and closes them; `Match` takes in bids and decides who wins.
        objects: the things of the game that are no robots, such as flags.
        numbers: numbers of the rules that everybody is told, by name, such as a distance in m.
        driven: the players that the coordinator drives itself, and the region into which it drives each. It goes on
            until the rule book takes the player out of this table.
    """

    round: int = 1
    disqualified: dict[str, Disqualification] = {}
    auctions: dict[str, Auction] = {}
    objects: list[FieldObject] = []
    numbers: dict[str, float] = {}
    driven: dict[str, Region] = {}


S = TypeVar("S", bound=GameState)


@dataclass(frozen=True, kw_only=True)
class Contestant:
    """A player as the rule book knows it before the match.

    Args:
        role: its role at the start of the match, in the game's own word.
        start: its pose in the match file.
        size: the (length, width) of its body, m.
        v_max: the top speed of its robot model, m/s.
    """

    name: str
    role: str
    start: Pose
    size: tuple[float, float]
    v_max: float


@dataclass(frozen=True)
class Offer:
    """A player's bid: its cost for the lot, or None if it withdraws its bid or gives the lot back."""

    bidder: str
    lot: str
    cost: float | None


@dataclass(frozen=True)
class Field:
    """Where everybody is at one instant, and what players have told the referee.

    Args:
        poses: the poses by player. A player that the world has not reported is missing.
        moving: the players that are not at rest.
        physical: the players whose robots are physical ones, which only people can put somewhere.
        time: the match time of the poses, s.
        offers: the bids since the tick before, in order.
        sightings: what players have seen, and who has told it, since the tick before, in order.
    """

    poses: Mapping[str, Pose]
    moving: frozenset[str] = frozenset()
    physical: frozenset[str] = frozenset()
    time: float = 0.0
    offers: Sequence[Offer] = ()
    sightings: Sequence[tuple[str, Sighting]] = ()


@dataclass(frozen=True, kw_only=True)
class Call:
    """A call as a rule book makes it: one rule that was broken or fulfilled.

    Args:
        rule: the rule's short name, such as `tag`. text: the call in words.
        players: the players that it concerns. poses: the poses of the first of them at the instant of the call, in the
            same order; those that not everybody may know are left out.
        foul: True if the match enters the stage FOUL, until the rule book finds that play can go on.
        answers: the id of the official's decision that this call answers; None if it answers none.
    """

    rule: str
    text: str
    players: tuple[str, ...] = ()
    poses: tuple[Pose, ...] = ()
    foul: bool = False
    answers: str | None = None


@dataclass(frozen=True)
class Verdict(Generic[S]):
    """The result of judging one instant.

    Args:
        state: the new state. calls: the calls, in order.
        round_over: True if the round has ended.
        winner: the winner if the game has ended; only `next_round` may set it.
        place: where virtual robots are put at once, by player, such as one that is out of play and stands in the way.
    """

    state: S
    calls: Sequence[Call] = field(default_factory=tuple)
    round_over: bool = False
    winner: str | None = None
    place: Mapping[str, Pose] = field(default_factory=dict)


def points(action: OfficialAction, value: str) -> int:
    """The number of points that an official sets.

    Raises:
        ConfigError: it is no whole number from 0 to 999999.
    """
    if not (value.isascii() and value.isdigit() and len(value) <= 6):
        raise ConfigError([f"{action}: expected a whole number from 0 to 999999, got {value!r}"])
    return int(value)


class RuleBook(Protocol[S]):
    """The rules of one game. The result of every method depends on its arguments and on the set-up alone.

    A rule book is made from the game's settings, the list of contestants, and the seed of the match.

    Attributes:
        name: the name of the game. round_word: what a round is called. rounds: how many there are.
        state_type: the class of the game's state.
    """

    name: str
    round_word: str
    rounds: int
    state_type: type[S]
    lineup_limit: float
    """The match time in s after which virtual robots that are not on their marks are put there."""

    def initial(self) -> S:
        """The state before the first round."""

    def obstacles_to_start(self, state: S, now: Field) -> dict[str, str]:
        """The reasons why the round cannot begin, by player, such as `is 3.2 m from its mark`; empty if it can."""

    def marks(self, state: S) -> dict[str, Pose]:
        """Where players line up before this round. Virtual robots that are late are put there."""

    def judge(self, state: S, before: Field, now: Field, clock: float) -> Verdict[S]:
        """Judge what happened between two instants of play.

        Args:
            clock: the time of play in this round at `now`, s.
        """

    def obstacles_to_resume(self, state: S, now: Field) -> list[str]:
        """The reasons, in words, why play cannot go on after a foul; empty if it can."""

    def next_round(self, state: S, now: Field) -> Verdict[S]:
        """Judge what follows when a round is over: the end of the game, or the state of the next round."""

    def statuses(self, state: S, stage: Stage, now: Field) -> list[PlayerStatus]:
        """The status of each player, as everybody may see it. If `may_move` is False, its robot is stopped."""

    def zones(self, state: S) -> list[Zone]:
        """The marked parts of the field."""

    def score(self, state: S) -> dict[str, int]:
        """The points of each team."""

    def speed_limits(self) -> dict[str, float]:
        """The top speed of each player's robot in this match, m/s. A player that is missing has its model's own."""

    def overrule(self, state: S, action: OfficialAction, subject: str, value: str) -> S:
        """Apply an official's decision.

        Raises:
            ConfigError: there is no such player, team, role, state or score.
        """
