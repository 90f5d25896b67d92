"""The rules: one hunter, and others that are caught, leave the field, get home, or are left when the time is up."""

import math
import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

from msgspec import structs

from vrg.bus.messages import Auction, FieldObject, PlayerStatus, Stage, Zone
from vrg.coordinator.auctions import opened, reopened
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict, called
from vrg.errors import ConfigError, Problem
from vrg.games.game import Game
from vrg.geometry import interpolate
from vrg.segments import in_disc
from vrg.types import Pose
from vrg_games.pursuit import ANSWER, APOLLONIUS, CAUGHT, HOME, MARCO_POLO, OUT, RATIO
from vrg_games.pursuit.settings import ApolloniusSettings, MarcoPoloSettings, Settings

ASIDE = 1.0
"""The distance in m from the field, and from one another, at which those stand that are out of play."""
TEXTS = {"caught": "{} is caught by {}", "out": "{} left the field", "home": "{} is at home"}


End = tuple[float, int, str]
"""The fraction of the way at which something happens, its order among what happens at one instant, and the rule."""


VOICE = 0.25
"""The radius of the disc by which an answer is drawn, m."""


class Hunt(RuleBook[GameState]):
    """What both games have in common. The hunter has a point for each that is caught, and the others for the rest.

    Attributes:
        hunter: the name of the hunter. hunted: those of the others, sorted.
    """

    state_type = GameState
    lineup_limit = 3.0
    game: ClassVar[Game]
    """Its first role is that of the hunter."""
    left_count_for: ClassVar[int] = 1
    """The team, 0 for the hunter's and 1 for the other, that has a point for each that is left at the end."""

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        super().__init__(contestants)
        self.settings, self.seed, self.rounds = settings, seed, settings.rounds
        self.teams = [role.team for role in self.game.roles]
        hunters = [c.name for c in contestants if c.role == self.game.roles[0].name]
        self.hunted = sorted(self.contestants.keys() - set(hunters))
        if len(hunters) != 1 or not self.hunted:
            raise ConfigError([Problem(f"expected one {self.game.roles[0].name}, and others", ("players",))])
        self.hunter = hunters[0]
        outside = [c.name for c in contestants if not settings.field.contains(c.start.x, c.start.y)]
        if outside:
            raise ConfigError([Problem("starts outside the field", ("players", name)) for name in outside])

    def initial(self) -> GameState:
        """Nobody is caught."""
        return GameState()

    def left(self, state: GameState) -> list[str]:
        """Those that are still hunted."""
        return [n for n in self.hunted if n not in state.states and n not in state.disqualified]

    def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        """What comes first to each of the hunted between two looks; at the end of the round also those left count."""
        calls, place = list[Call](), dict[str, Pose]()
        for name in self.left(state):
            ends = self._ends(state, name, before, now) if name in now.poses else []
            if not ends:
                continue
            at, _, rule = min(ends)
            names = (name, self.hunter) if rule == "caught" else (name,)
            where = {n: interpolate(*now.way(n, before), at) for n in names}
            calls.append(called(rule, TEXTS[rule].format(*names), where))
            state = state.with_state([name], rule).scored(self.teams[rule == HOME])
            place[name] = self.aside(name)
        left, team = self.left(state), self.left_count_for
        if not left:
            return Verdict(state, calls, round_over=True, place=place)
        if self.hunter in state.disqualified:
            team = 1
            calls.append(Call(rule="forfeit", text=f"{self.hunter} cannot play on", players=(self.hunter,)))
        elif clock >= self.settings.time:
            calls.append(Call(rule="time_up", text=f"the time is up: {', '.join(left)} left", players=tuple(left)))
        else:
            return Verdict(state, calls, place=place)
        return Verdict(state.scored(self.teams[team], len(left)), calls, round_over=True, place=place)

    def _ends(self, state: GameState, name: str, before: Observation, now: Observation) -> list[End]:
        """What happens to one of the hunted between two looks."""
        found, port, (a, b) = list[End](), self.settings.port, now.way(name, before)
        start, end = (a.x, a.y), (b.x, b.y)
        if self.hunter in now.poses and self.hunter not in state.disqualified:
            p, q = now.way(self.hunter, before)
            apart = (a.x - p.x, a.y - p.y), (b.x - q.x, b.y - q.y)
            if (meets := in_disc(*apart, (0.0, 0.0), self.settings.capture_distance)) is not None:
                found.append((meets[0], 0, CAUGHT))
        if port is not None and (inside := port.inside(start, end)) is not None:
            found.append((inside[0], 1, HOME))
        if (leaves := self.settings.field.exit_fraction(start, end)) is not None:
            found.append((leaves, 2, OUT))
        return found

    def aside(self, name: str) -> Pose:
        """Where a robot stands that is out of play: beside the field, where it is in nobody's way."""
        return Pose(self.settings.x[1] + ASIDE, self.settings.y[0] + ASIDE * self.hunted.index(name), 0.0)

    def next_round(self, state: GameState, now: Observation) -> Verdict[GameState]:
        """The next round, in which all play again, or the end."""
        verdict = super().next_round(state, now)
        kept = {name: getattr(verdict.state, name) for name in ("round", "points", "disqualified")}
        return verdict if verdict.winner else replace(verdict, state=structs.replace(self.initial(), **kept))

    def may_play(self, state: GameState, name: str) -> bool:
        """True if a player is not out of play."""
        return name not in state.states

    def team_of(self, name: str) -> str:
        """The team of a player."""
        return self.teams[name != self.hunter]

    def zones(self, state: GameState) -> list[Zone]:
        """The field."""
        return [Zone(name="field", kind="field", region=self.settings.field)]

    def time_limit(self, state: GameState) -> float:
        """The time of play of a round, s."""
        return self.settings.time

    def speed_limits(self) -> dict[str, float]:
        """The hunter is as fast as the slowest robot, and the others are slower."""
        slowest = min(c.v_max for c in self.contestants.values())
        return {n: slowest if n == self.hunter else self.settings.ratio * slowest for n in self.contestants}


class MarcoPolo(Hunt):
    """Marco Polo. Marco calls by a bid, as players can tell the referee nothing else, and the referee answers.

    The answers are the objects of the state: where each that is left is heard. No pose of one that is left is
    published.
    """

    name = MARCO_POLO.name
    game = MARCO_POLO
    settings: MarcoPoloSettings

    def __init__(self, settings: MarcoPoloSettings, contestants: Sequence[Contestant], seed: int) -> None:
        super().__init__(settings, contestants, seed)
        if self.contestants[self.hunter].sweeps:
            raise ConfigError([Problem("has a range finder: write lasers = false", ("players", self.hunter))])

    def initial(self) -> GameState:
        """Marco may call after a pause."""
        auction = Auction(lot=ANSWER, bidders=(self.hunter,), opened=0.0, lasts=self.settings.pause)
        return opened(GameState(), auction)

    def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        """Also answer Marco."""
        verdict = super().judge(state, before, now, clock)
        state, auction = verdict.state, verdict.state.auctions[ANSWER]
        left = self.left(state)
        if auction.winner is None or verdict.round_over:
            heard = tuple(each for each in state.objects if each.name in left)
            return replace(verdict, state=structs.replace(state, objects=heard) if heard != state.objects else state)
        heard = tuple(self.voice(name, now.poses[name]) for name in left if name in now.poses)
        state = structs.replace(opened(state, reopened(auction, clock)), objects=heard)
        call = Call(rule="call", text=f"{self.hunter} calls, and {len(heard)} answer", players=(self.hunter,))
        return replace(verdict, state=state, calls=[*verdict.calls, call])

    def voice(self, name: str, pose: Pose) -> FieldObject:
        """Where a player is heard: the middle of a square of the grid."""
        grid = self.settings.grid
        x, y = ((math.floor(each / grid) + 0.5) * grid for each in (pose.x, pose.y))
        return FieldObject(name=name, kind="voice", x=x, y=y, team=self.teams[1], radius=VOICE)

    def statuses(self, state: GameState, stage: Stage, now: Observation) -> list[PlayerStatus]:
        """The status of each player, without the poses of those that are hunted."""
        found, hidden = super().statuses(state, stage, now), self.left(state)
        return [structs.replace(each, pose=None, mark=None) if each.name in hidden else each for each in found]


class Apollonius(Hunt):
    """Apollonius' pursuit. In each round the evaders begin at other y, which are drawn."""

    name = APOLLONIUS.name
    game = APOLLONIUS
    left_count_for = 0
    settings: ApolloniusSettings

    def initial(self) -> GameState:
        """All may play."""
        return GameState(numbers={RATIO: self.settings.ratio})

    def marks(self, state: GameState) -> Mapping[str, Pose]:
        """The starts, but the y of each evader is drawn in a lane of its own."""
        (low, high), marks = self.settings.y, dict(super().marks(state))
        for lane, name in enumerate(self.hunted):
            share = lane + random.Random(f"{self.seed} {state.round} {name}").uniform(0.2, 0.8)
            marks[name] = structs.replace(marks[name], y=low + (high - low) * share / len(self.hunted))
        return marks

    def zones(self, state: GameState) -> list[Zone]:
        """The field and the harbour."""
        return [*super().zones(state), Zone(name="harbour", kind="safe", region=self.settings.port)]
