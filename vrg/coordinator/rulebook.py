"""The base class of the rule books of all games: objects that judge a field. They use no bus, no clock and no files.

A rule book remembers nothing itself. Its whole memory is one frozen state that is passed in and returned, so that it
can be written to the journal and another process can continue from it.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, Self, TypeVar

from msgspec import Struct, structs

from vrg.bus import messages
from vrg.bus.messages import Auction, FieldObject, OfficialAction, PlayerStatus, Sighting, Stage, Thing, Zone
from vrg.errors import ConfigError
from vrg.geometry import circumradius
from vrg.hal.sensors.downward import OverviewSpec
from vrg.hal.sensors.spec import Sweep
from vrg.hal.sim.config import BodySetup
from vrg.regions import Region
from vrg.registry import expected_one_of
from vrg.types import Pose, Uncertainty

MARK_TOLERANCE = 0.4
"""The distance in m from its mark within which a player is lined up."""
NOBODY = "nobody"
"""The winner of a match that an official has ended."""
DRAW = "draw"
"""The winner of a match without a winner."""


def wins(team: str) -> str:
    """The verb for a team that wins: sharks `win`, but a lion `wins`."""
    return "win" if team.endswith("s") else "wins"


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
        states: the state of each player, in the game's own words; a player that is missing is `active`.
        points: the points of each team.
        disqualified: the players that are out because they have failed. A rule book treats them as obstacles: they
            neither score nor are scored on, and no round waits for them. `Match` keeps them from moving.
        auctions: the auctions, by lot. A rule book opens and closes them; `Match` takes in bids and decides who wins.
        objects: the things of the game that are no robots, such as flags.
        numbers: numbers of the rules that all players receive, by name, such as a distance in m.
        driven: the players that the coordinator drives itself, and the region into which it drives each. It goes on
            until the rule book takes the player out of this table.
    """

    round: int = 1
    states: Mapping[str, str] = {}
    points: Mapping[str, int] = {}
    disqualified: Mapping[str, Disqualification] = {}
    auctions: Mapping[str, Auction] = {}
    objects: tuple[FieldObject, ...] = ()
    numbers: Mapping[str, float] = {}
    driven: Mapping[str, Region] = {}

    def with_state(self, names: Iterable[str], state: str) -> Self:
        """The same, but with these players in state `state`."""
        changed = {name: state for name in names if self.states.get(name) != state}
        return structs.replace(self, states={**self.states, **changed}) if changed else self

    def in_state(self, *states: str) -> list[str]:
        """The players in one of these states that are not disqualified."""
        return [name for name, state in self.states.items() if state in states and name not in self.disqualified]

    def with_points(self, team: str, points: int) -> Self:
        """The same, but with this many points of a team."""
        return structs.replace(self, points={**self.points, team: points}) if self.points.get(team) != points else self

    def scored(self, team: str, points: int = 1) -> Self:
        """The same, but with so many more points of a team; with fewer, if negative, but never below 0."""
        return self.with_points(team, max(0, self.points.get(team, 0) + points))


S = TypeVar("S", bound=GameState)


@dataclass(frozen=True, kw_only=True)
class Contestant:
    """A player as the rule book knows it before the match.

    Args:
        name: of the player. role: its role at the start of the match, in the game's own word.
        start: its pose in the match file.
        size: the (length, width) of its body, m.
        v_max: the top speed of its robot model, m/s. sweeps: what its range finders sweep in this match.
        overview: its camera that looks down; None if it has none.
        team: that of its role at the start, by the game's description; empty where the role is the team.
    """

    name: str
    role: str
    start: Pose
    size: tuple[float, float]
    v_max: float
    sweeps: tuple[Sweep, ...] = ()
    overview: OverviewSpec | None = None
    team: str = ""


@dataclass(frozen=True)
class Offer:
    """A player's bid: its cost for the lot, or None if it withdraws its bid or gives the lot back."""

    bidder: str
    lot: str
    cost: float | None


@dataclass(frozen=True)
class Observation:
    """The poses at one instant, and the players' reports to the referee.

    Args:
        poses: the poses by player. A player that the world has not reported is missing.
        moving: the players that are not at rest.
        physical: the players whose robots are physical ones, which only people can put somewhere.
        time: the match time of the poses, s.
        pushed: the players that an opponent pushes: their robots move although their wheels do not.
        uncertainty: how well the poses of those players are known for which that is known.
        offers: the bids since the tick before, in order.
        sightings: the sightings with the players that reported them, since the tick before, in order.
        things: the passive bodies, by name.
    """

    poses: Mapping[str, Pose]
    moving: frozenset[str] = frozenset()
    physical: frozenset[str] = frozenset()
    time: float = 0.0
    pushed: frozenset[str] = frozenset()
    offers: Sequence[Offer] = ()
    sightings: Sequence[tuple[str, Sighting]] = ()
    uncertainty: Mapping[str, Uncertainty] = field(default_factory=dict)
    things: Mapping[str, Thing] = field(default_factory=dict)

    def way(self, name: str, before: "Observation") -> tuple[Pose, Pose]:
        """Where a player was at the look before, or else is now, and where it is now."""
        end = self.poses[name]
        return before.poses.get(name, end), end


Call = messages.Call
"""One rule that was broken or fulfilled: `Call(rule="tag", text=..., players=..., poses=...)`."""


def called(rule: str, text: str, where: Mapping[str, Pose]) -> Call:
    """A call about some players, with the pose of each at its instant."""
    return Call(rule=rule, text=text, players=tuple(where), poses=tuple(where.values()))


@dataclass(frozen=True)
class Verdict(Generic[S]):
    """The result of judging one instant.

    Args:
        state: the new state. calls: the calls, in order.
        round_over: True if the round has ended.
        winner: the winner if the game has ended; only `next_round` may set it. why: why it has ended, in words.
        place: where virtual robots and passive bodies are put at once, by name, such as a robot that is out of play and
            stands in the way, or a ball that is out. A tracked body is put there by people, or not at all.
    """

    state: S
    calls: Sequence[Call] = field(default_factory=tuple)
    round_over: bool = False
    winner: str | None = None
    why: str = ""
    place: Mapping[str, Pose] = field(default_factory=dict)


ACTIVE = "active"
"""The state of a player for which the game has no other."""


class RuleBook(Generic[S]):
    """The rules of one game. The result of every method depends on its arguments and on the set-up alone.

    A game overrides what its rules say otherwise: at least `initial` and `judge`. Its class is constructed
    from the settings, which are the [rules] table of the match file, the contestants, and the seed of the match.

    Args:
        contestants: the players.

    Attributes:
        name: the name of the game. round_word: what a round is called. rounds: how many there are.
        state_type: the class of the game's state.
        lineup_limit: the match time in s after which virtual robots that are not on their marks are put there.
        contestants: the players, by name.
        no_room: returns the reason why no physical robot of a player can stand at a pose, or None if one can.
        walls: the ground that the map's walls and obstacles cover, m.
        bodies: the passive bodies of the match, by name.
    """

    name: str
    round_word: str = "round"
    rounds: int = 1
    state_type: type[S]
    lineup_limit: float = 60.0

    def __init__(self, contestants: Sequence[Contestant]) -> None:
        self.contestants = {contestant.name: contestant for contestant in contestants}
        self.no_room: Callable[[str, Pose], str | None] = lambda _name, _pose: None
        self.walls: Sequence[Region] = ()
        self.bodies: Mapping[str, BodySetup] = {}

    def equip(self, bodies: Sequence[BodySetup]) -> None:
        """Take in the passive bodies of the match. A game that needs some overrides this.

        Raises:
            ConfigError: they are not those that the game needs.
        """
        self.bodies = {body.name: body for body in bodies}

    def initial(self) -> S:
        """The state before the first round."""
        raise NotImplementedError

    def marks(self, state: S) -> Mapping[str, Pose]:
        """The poses at which players line up before this round: their starts. Virtual robots that are late are put
        there."""
        return {name: contestant.start for name, contestant in self.contestants.items()}

    def obstacles_to_start(self, state: S, now: Observation) -> dict[str, str]:
        """The reasons why the round cannot begin, by player, such as `is 3.2 m from its mark`; empty if it can."""
        return not_lined_up(self.marks(state), now)

    def judge(self, state: S, before: Observation, now: Observation, clock: float) -> Verdict[S]:
        """Judge what happened between two instants of play.

        Args:
            before: the field at the look before. A robot that was put somewhere since stands there in it already.
            clock: the time of play in this round at `now`, s.
        """
        raise NotImplementedError

    def next_round(self, state: S, now: Observation) -> Verdict[S]:
        """Judge what follows when a round is over: the end of the game, or the state of the next round.

        By default the game ends after its rounds, and the team with the most points has won.
        """
        if state.round < self.rounds:
            return Verdict(structs.replace(state, round=state.round + 1))
        score = self.score(state)
        best = [team for team, count in score.items() if count == max(score.values())]
        return Verdict(state, winner=best[0] if len(best) == 1 else DRAW)

    def time_limit(self, state: S) -> float | None:
        """The time of play in s at which this round ends at the latest; None if it is not limited."""
        return None

    def team_of(self, name: str) -> str:
        """The team of a player: by default that of its role at the start of the match."""
        return self.contestants[name].team or self.contestants[name].role

    def role_of(self, state: S, name: str) -> str:
        """The role of a player: by default that at the start of the match."""
        return self.contestants[name].role

    def may_play(self, state: S, name: str) -> bool:
        """True if a player may move in play, as by default everybody may."""
        return True

    def statuses(self, state: S, stage: Stage, now: Observation) -> list[PlayerStatus]:
        """The status of each player, as everybody may see it. If `may_move` is False, its robot is stopped.

        By default everybody sees all poses. Before a round players may drive to their marks, where they are held.
        """
        lining_up, playing = stage is Stage.INITIALIZE, stage is Stage.PLAY_ROUND
        marks = self.marks(state) if lining_up else {}
        held = on_marks(marks, now)
        return [
            PlayerStatus(
                name=name,
                team=self.team_of(name),
                role=self.role_of(state, name),
                state=state.states.get(name, ACTIVE),
                may_move=name in marks and name not in held if lining_up else playing and self.may_play(state, name),
                radius=circumradius(contestant.size),
                pose=now.poses.get(name),
                mark=marks.get(name),
            )
            for name, contestant in self.contestants.items()
        ]

    def zones(self, state: S) -> list[Zone]:
        """The marked parts of the field."""
        return []

    def spots(self, state: S) -> Mapping[str, Pose]:
        """The poses at which passive bodies are before this round: their starts. They are put there."""
        return {name: body.pose for name, body in self.bodies.items()}

    def objects(self, state: S, now: Observation) -> list[FieldObject]:
        """The things that everybody may see: by default those of the state, and all passive bodies."""
        return [*state.objects, *(thing_of(self.bodies[name], thing) for name, thing in now.things.items())]

    def score(self, state: S) -> dict[str, int]:
        """The points of each team."""
        teams = dict.fromkeys((self.team_of(name) for name in self.contestants), 0)
        return {**teams, **state.points}

    def speed_limits(self) -> dict[str, float]:
        """The top speed of each player's robot in play, m/s. A player that is missing has its model's own."""
        return {}

    def overrule(self, state: S, action: OfficialAction, subject: str, value: str) -> S:
        """Apply an official's decision on a score, a role or a state.

        Raises:
            ConfigError: there is no such player, team, role, state or score.
        """
        known = self.score(state) if action is OfficialAction.SET_SCORE else self.contestants
        if subject not in known:
            raise ConfigError(f"{action}: {expected_one_of(sorted(known), subject)}")
        if action is OfficialAction.SET_SCORE:
            if not (value.isascii() and value.isdigit() and len(value) <= 6):
                raise ConfigError(f"{action}: expected a whole number from 0 to 999999, got {value!r}")
            return state.with_points(subject, int(value))
        roles = action is OfficialAction.SET_ROLE
        allowed = self.roles_of(subject) if roles else self.states_of(subject)
        if not allowed:
            raise ConfigError(f"{action} {subject}: its {'role' if roles else 'state'} cannot be set in this game")
        if value not in allowed:
            raise ConfigError(f"{action}: {expected_one_of(sorted(allowed), value)}")
        return self.with_role(state, subject, value) if roles else self.put_into(state, subject, value)

    def roles_of(self, name: str) -> Sequence[str]:
        """The roles that an official may give a player; none by default."""
        return ()

    def states_of(self, name: str) -> Sequence[str]:
        """The states into which an official may put a player; none by default."""
        return ()

    def with_role(self, state: S, name: str, role: str) -> S:
        """The state after an official has given a player one of `roles_of`."""
        raise NotImplementedError

    def put_into(self, state: S, name: str, value: str) -> S:
        """The state after an official has put a player into one of `states_of`.

        Raises:
            ConfigError: it cannot be in that state now.
        """
        return state.with_state([name], value)


def thing_of(body: BodySetup, thing: Thing) -> FieldObject:
    """A passive body as the referee publishes it."""
    pose = thing.pose
    return FieldObject(
        name=body.name, kind=body.kind, x=pose.x, y=pose.y, heading=pose.theta, vx=thing.vx, vy=thing.vy,
        radius=body.radius, corners=body.corners, lost=thing.lost,
    )  # fmt: skip


def away(pose: Pose, mark: Pose) -> float:
    """The distance of a player from its mark, m."""
    return math.hypot(pose.x - mark.x, pose.y - mark.y)


def on_marks(marks: Mapping[str, Pose], now: Observation) -> set[str]:
    """The players that are within MARK_TOLERANCE of their marks."""
    return {name for name, mark in marks.items() if name in now.poses and away(now.poses[name], mark) <= MARK_TOLERANCE}


def not_lined_up(marks: Mapping[str, Pose], now: Observation) -> dict[str, str]:
    """The reasons why players do not yet stand still on their marks, by player."""
    reasons = {}
    for name, mark in marks.items():
        pose = now.poses.get(name)
        if pose is None:
            reasons[name] = "is not in the world"
        elif away(pose, mark) > MARK_TOLERANCE:
            reasons[name] = f"is {away(pose, mark):.1f} m from its mark"
        elif name in now.moving:
            reasons[name] = "is moving"
    return reasons
