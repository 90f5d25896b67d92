"""What a game's rule book is: a pure object that judges a field, with no bus, no clock and no files.

A rule book's whole memory is one frozen state, handed in and handed back, so that it can be journalled and taken up
again by another process.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

from msgspec import Struct

from vrg.bus.messages import OfficialAction, PlayerStatus, Stage, Zone
from vrg.types import Pose


class GameState(Struct, frozen=True, kw_only=True):
    """What the state of every game has.

    Args:
        round: from 1.
    """

    round: int = 1


S = TypeVar("S", bound=GameState)


@dataclass(frozen=True, kw_only=True)
class Contestant:
    """A player as the rule book knows it before the match.

    Args:
        role: at the start of the match, the game's word.
        start: its place in the match file.
        size: (length, width) of its body, m.
        v_max: the top speed of its robot model, m/s.
    """

    name: str
    role: str
    start: Pose
    size: tuple[float, float]
    v_max: float


@dataclass(frozen=True)
class Field:
    """Where everybody is at one instant.

    Args:
        poses: by player; a player that the world has not reported is absent.
        moving: players that are not at rest.
        physical: players whose robots only people can put anywhere.
    """

    poses: Mapping[str, Pose]
    moving: frozenset[str] = frozenset()
    physical: frozenset[str] = frozenset()


@dataclass(frozen=True, kw_only=True)
class Call:
    """What a referee calls: one rule that was broken or fulfilled.

    Args:
        rule: its short name, such as `tag`. text: the call in words.
        foul: the stage passes through FOUL, until the rule book finds that play can go on.
        poses: of the players, in the same order, at the instant of the call.
        answers: id of the official's decision that this answers.
    """

    rule: str
    text: str
    players: tuple[str, ...] = ()
    poses: tuple[Pose, ...] = ()
    foul: bool = False
    answers: str | None = None


@dataclass(frozen=True)
class Verdict(Generic[S]):
    """What judging one instant gave: the new state, and the calls.

    Args:
        round_over: the round has ended. winner: known between rounds alone; the game has ended, too.
    """

    state: S
    calls: Sequence[Call] = field(default_factory=tuple)
    round_over: bool = False
    winner: str | None = None


class RuleBook(Protocol[S]):
    """The rules of one game. Every method is a function of its arguments and of the set-up."""

    name: str
    round_word: str
    rounds: int
    state_type: type[S]
    lineup_limit: float
    """s after which virtual robots that are not on their marks are put there."""

    def initial(self) -> S:
        """The state before the first round."""

    def obstacles_to_start(self, state: S, now: Field) -> dict[str, str]:
        """Why the round cannot begin: by player, such as `is 3.2 m from its mark`; empty when it can."""

    def judge(self, state: S, before: Field, now: Field, clock: float) -> Verdict[S]:
        """Judge what happened between two instants of play.

        Args:
            clock: s of play in this round at `now`.
        """

    def obstacles_to_resume(self, state: S, now: Field) -> list[str]:
        """Why play cannot go on after a foul, in words; empty when it can."""

    def next_round(self, state: S, now: Field) -> Verdict[S]:
        """What happens when a round is over: the end of the game, or roles, sides and places for the next round."""

    def statuses(self, state: S, stage: Stage, now: Field) -> list[PlayerStatus]:
        """Each player as everybody may see it. Where `may_move` is False its robot is stopped."""

    def zones(self, state: S) -> list[Zone]:
        """The marked parts of the field."""

    def score(self, state: S) -> dict[str, int]:
        """By team."""

    def speed_limits(self, seed: int) -> dict[str, float]:
        """Each robot's top speed in this match, m/s; empty = its model's own."""

    def overrule(self, state: S, action: OfficialAction, subject: str, value: str) -> S:
        """Apply an official's decision.

        Raises:
            ConfigError: no such player, team, role, state or score.
        """
