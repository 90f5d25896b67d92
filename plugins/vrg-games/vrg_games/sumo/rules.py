"""The settings and the rules of robot sumo. A match is the best of some bouts, and a drawn bout counts as one."""

import math
import random
from collections.abc import Mapping, Sequence

from msgspec import Struct, structs
from pydantic import Field as Setting

from vrg.bus.messages import PlayerStatus, Stage, Zone
from vrg.coordinator.rulebook import DRAW, Call, Contestant, GameState, Observation, RuleBook, Verdict, away, called
from vrg.errors import ConfigError, Problem
from vrg.geometry import interpolate, wrap
from vrg.regions import Circle
from vrg.tables import Table
from vrg.types import Metres, Pose, Seconds
from vrg_games.sumo import EAST, GAME, WEST

WRESTLER = "wrestler"
OTHER = {EAST: WEST, WEST: EAST}
STOOD = 0.1
"""The distance in m by which a robot must get away from where it stopped, so that it does not stand still."""
AT_ONCE = 1.0
"""The time in s within which two robots have stopped at once."""
LEAD = 0.1
"""The distance in m by which one must be nearer the middle of the ring to have the better of a push in vain."""
ON_MARK = 0.1
"""The distance in m, and the angle in rad, from its mark within which a robot is lined up: the ring is small."""


class Settings(Table):
    """The [rules] table of a match file.

    Args:
        radius: of the ring, m. The default is 2.5 times that of the 3 kg class, whose ring is 1.54 m wide.
        centre: of the ring, m.
        bouts: how many there are at most; who has won more than half of them has won the match.
        time: after which a bout is drawn, s.
        standstill: the time after which a robot that stands has lost the bout, s.
    """

    radius: float = Setting(1.925, ge=0.5, le=1000)
    centre: tuple[Metres, Metres] = (0.0, 0.0)
    bouts: int = Setting(3, ge=1, le=99)
    time: float = Setting(40.0, gt=0, le=1e6)
    standstill: float = Setting(5.0, ge=0.5, le=1e6)

    @property
    def ring(self) -> Circle:
        """Where both must stay, border included."""
        return Circle(*self.centre, self.radius)


class Stop(Struct, frozen=True):
    """Where a robot has stopped or was last seen to get ahead, m, and the time of play in the bout, s."""

    x: Metres
    y: Metres
    since: Seconds


class State(GameState, frozen=True, kw_only=True):
    """The state of the match. The points are the bouts that each has won.

    Args:
        stops: where each player is that has not got ahead since.
    """

    stops: Mapping[str, Stop] = {}


class Sumo(RuleBook[State]):
    """The rule book of robot sumo. The team of a player is its side of the ring, east or west."""

    name = GAME.name
    round_word = GAME.round_word
    state_type = State
    lineup_limit = 5.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        super().__init__(contestants)
        self.settings, self.seed = settings, seed
        self.rounds = settings.bouts
        if sorted(c.role for c in contestants) != [EAST, WEST]:
            raise ConfigError([Problem(f"expected one player in the {EAST} and one in the {WEST}", ("players",))])
        outside = [c.name for c in contestants if not settings.ring.contains(c.start.x, c.start.y)]
        if outside:
            raise ConfigError([Problem("starts outside the ring", ("players", name)) for name in outside])

    def initial(self) -> State:
        """Nobody has won a bout."""
        return State()

    def marks(self, state: State) -> dict[str, Pose]:
        """The places of the match file. Each bout both are turned by one angle that is drawn, up to 90 degrees.

        So robots that the match file has back to back begin anywhere between that and side by side.
        """
        turn = random.Random(f"{self.seed} {state.round}").uniform(-math.pi / 2, math.pi / 2)
        starts = {name: c.start for name, c in self.contestants.items()}
        return {name: Pose(start.x, start.y, wrap(start.theta + turn)) for name, start in starts.items()}

    def obstacles_to_start(self, state: State, now: Observation) -> dict[str, str]:
        """The reasons why a player does not stand on its mark, with the heading of it, by player."""
        reasons = super().obstacles_to_start(state, now)
        for name, mark in self.marks(state).items():
            if name not in reasons and away(now.poses[name], mark) > ON_MARK:
                reasons[name] = f"is {away(now.poses[name], mark):.2f} m from its mark"
            elif name not in reasons and abs(off := wrap(now.poses[name].theta - mark.theta)) > ON_MARK:
                reasons[name] = f"is turned {math.degrees(off):.0f} degrees away from its mark"
        return reasons

    def judge(self, state: State, before: Observation, now: Observation, clock: float) -> Verdict[State]:
        """Somebody is disqualified, leaves the ring or stands still for too long, or the time is up."""
        if gone := sorted(self.contestants.keys() & state.disqualified.keys()):
            text = f"{' and '.join(gone)} cannot play on"
            return self._lost(state, gone, Call(rule="forfeit", text=text, players=tuple(gone)))
        ring, left = self.settings.ring, dict[str, tuple[float, Pose]]()
        for name in sorted(self.contestants.keys() & now.poses.keys()):
            start, end = now.way(name, before)
            at = ring.exit_fraction((start.x, start.y), (end.x, end.y))
            if at is not None:
                left[name] = at, interpolate(start, end, at)
        if left:
            first = min(at for at, _ in left.values())
            out = {name: pose for name, (at, pose) in left.items() if at == first}
            return self._lost(state, list(out), called("out", f"{' and '.join(out)} left the ring", out))
        state = self._followed(state, now, clock)
        stood = {name: clock - stop.since for name, stop in state.stops.items() if name in now.poses}
        if (longest := max(stood.values(), default=0.0)) >= self.settings.standstill - 1e-9:
            still = {name: now.poses[name] for name, time in sorted(stood.items()) if time > longest - AT_ONCE}
            return self._stood(state, still, longest)
        if clock >= self.settings.time:
            return self._lost(state, [], Call(rule="time_up", text="the time is up, and the bout is drawn"))
        return Verdict(state)

    def _followed(self, state: State, now: Observation, clock: float) -> State:
        """The state with where each player has been since it last got ahead."""
        moved = {
            name: Stop(pose.x, pose.y, clock)
            for name, pose in now.poses.items()
            if name in self.contestants
            and ((stop := state.stops.get(name)) is None or math.dist((stop.x, stop.y), (pose.x, pose.y)) > STOOD)
        }
        return structs.replace(state, stops={**state.stops, **moved}) if moved else state

    def _stood(self, state: State, still: Mapping[str, Pose], time: float) -> Verdict[State]:
        """The end of a bout after one has stood still, or both have for the same time."""
        text = f"{' and '.join(still)} stood still for {time:.1f} s{' or almost' if len(still) > 1 else ''}"
        if len(still) == 1:
            return self._lost(state, list(still), called("standstill", text, still))
        ways = {name: math.dist((pose.x, pose.y), self.settings.centre) for name, pose in still.items()}
        inner, outer = sorted(ways, key=lambda name: ways[name])
        if ways[outer] - ways[inner] < LEAD:
            return self._lost(state, [], called("locked", text, still))
        where = {outer: still[outer], inner: still[inner]}
        return self._lost(state, [outer], called("yusei", f"{text}, and {inner} is nearer the middle", where))

    def _lost(self, state: State, losers: Sequence[str], call: Call) -> Verdict[State]:
        """The end of a bout: the other one has won it, but nobody has if both have lost it, or neither."""
        if len(losers) == 1:
            winner = OTHER[self.team_of(losers[0])]
            state = state.scored(winner)
        return Verdict(structs.replace(state, stops={}), [call], round_over=True)

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        """The end of the match as soon as one has won more than half of the bouts, else the next bout."""
        score = self.score(state)
        if 2 * max(score.values()) <= self.rounds:
            return super().next_round(state, now)
        best = [team for team, won in score.items() if won == max(score.values())]
        return Verdict(state, winner=best[0] if len(best) == 1 else DRAW)

    def role_of(self, state: State, name: str) -> str:
        """The same for both: `vrg.coordinator.pushing` forgives where a player is that another role has pushed."""
        return WRESTLER

    def statuses(self, state: State, stage: Stage, now: Observation) -> list[PlayerStatus]:
        """The status of each player, whose role is its side, so that they are told apart."""
        return [structs.replace(each, role=each.team) for each in super().statuses(state, stage, now)]

    def zones(self, state: State) -> list[Zone]:
        """The ring."""
        return [Zone(name="ring", kind="field", region=self.settings.ring)]

    def time_limit(self, state: State) -> float:
        """The time of play of a bout, s."""
        return self.settings.time

    def speed_limits(self) -> dict[str, float]:
        """Both are as fast as the slower one."""
        slower = min(c.v_max for c in self.contestants.values())
        return dict.fromkeys(self.contestants, slower)
