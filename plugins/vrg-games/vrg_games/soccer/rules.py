"""The rule book of soccer."""

import math
from collections.abc import Mapping, Sequence

from msgspec import structs

from vrg.bus.messages import Thing, Zone
from vrg.coordinator.pushing import touched
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict, called
from vrg.errors import ConfigError, Problem
from vrg.geometry import corners
from vrg.hal.sim.config import BodySetup
from vrg.regions import Circle, Polygon, Rectangle
from vrg.types import Pose, Vector
from vrg_games.soccer import AREA, BALL, BLUES, GAME, GOAL, KEEPERS, KICK, OTHER, REDS, TEAMS
from vrg_games.soccer.settings import SIDE, Settings

TOUCH = 0.02
"""The distance in m between a robot and the ball within which it touches the ball."""
IN_PLAY = 0.05
"""The way in m by which the ball is in play again (SSL 5.1)."""
NEAR_SPOT = 0.15
"""How far from its spot people may put a real ball, m (SSL 5.2)."""
PROGRESS = 0.3
"""The way in m that is progress."""
GRACE = 2.0
"""The time of play in s after the ball was put somewhere in which nobody is called for being there, and after which it
is not waited for any more."""
REPEATED = 3
"""The fouls in a row against one kick after which nobody takes it any more: the robots are stuck beside the ball."""
NEAR = 1.0
"""The distance in m from the ball within which pushing is a foul: elsewhere it harms nobody."""


class SoccerState(GameState, frozen=True, kw_only=True):
    """The state of a match.

    Args:
        starts: the team that has the kick-off of this round. played: the time of play in the rounds before, s.
        kick: the team that has a free kick or a kick-off, of which the ball is not yet in play; empty if none has.
        fouls: those against that kick so far.
        placing: True until the ball has been seen where the world was asked to put it. Of it nothing is judged.
        spot: where the ball was put, m. since: the time of play since which it is there, or has made no progress, s.
        last: the team that has touched the ball last; empty if none has.
        rested: where the ball was when it made progress last, m.
    """

    starts: str = REDS
    played: float = 0.0
    kick: str = REDS
    fouls: int = 0
    placing: bool = False
    spot: Vector = (0.0, 0.0)
    since: float = 0.0
    last: str = ""
    rested: Vector = (0.0, 0.0)


class Soccer(RuleBook[SoccerState]):
    """The rule book. A round lasts from a kick-off to a goal, or to the end of the match."""

    name = GAME.name
    round_word = GAME.round_word
    state_type = SoccerState
    lineup_limit = 15.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        super().__init__(contestants)
        self.settings = settings
        problems = []
        for team in (REDS, BLUES):
            own = [c for c in contestants if TEAMS[c.role] == team]
            if not 2 <= len(own) <= 6 or [c.role for c in own].count(KEEPERS[team]) != 1:
                problems.append(Problem(f"expected 2 to 6 {team}, of whom one is the {KEEPERS[team]}", ("players",)))
            problems += [
                Problem("starts outside its own half, or in the centre circle", ("players", c.name))
                for c in own
                if c.start.x * SIDE[team] <= 0.0 or settings.middle.contains(c.start.x, c.start.y)
            ]
        if problems:
            raise ConfigError(problems)

    def equip(self, bodies: Sequence[BodySetup]) -> None:
        """Take in the ball.

        Raises:
            ConfigError: there is no ball, or more than one.
        """
        super().equip(bodies)
        balls = [body for body in bodies if body.kind == BALL and body.radius]
        if len(balls) != 1:
            raise ConfigError([Problem(f'expected one round body of the kind "{BALL}", got {len(balls)}', ("bodies",))])
        self._ball = balls[0]

    def initial(self) -> SoccerState:
        """Reds have the first kick-off."""
        return SoccerState(numbers={KICK.format(team=REDS): 1.0})

    def team_of(self, name: str) -> str:
        """The team of a player's role."""
        return TEAMS[self.contestants[name].role]

    def spots(self, state: SoccerState) -> Mapping[str, Pose]:
        """The ball is in the middle."""
        return {**super().spots(state), self._ball.name: Pose(0.0, 0.0, 0.0)}

    def marks(self, state: SoccerState) -> Mapping[str, Pose]:
        """The starts; one player of the team that kicks off is behind the ball."""
        marks = dict(super().marks(state))
        own = [n for n in marks if self.team_of(n) == state.starts and self.contestants[n].role not in KEEPERS.values()]
        taker = min(own, key=lambda n: (n in state.disqualified, math.hypot(marks[n].x, marks[n].y), n))
        side = SIDE[state.starts]
        marks[taker] = Pose(side * 0.3, 0.0, math.pi if side > 0.0 else 0.0)
        return marks

    def time_limit(self, state: SoccerState) -> float:
        """What is left of the time of the match, s."""
        return max(0.0, self.settings.time - state.played)

    def next_round(self, state: SoccerState, now: Observation) -> Verdict[SoccerState]:
        """The next kick-off, or the end of the match."""
        if state.played >= self.settings.time:
            return super().next_round(structs.replace(state, round=max(state.round, self.rounds)), now)
        return Verdict(self._kick_for(structs.replace(state, round=state.round + 1), state.starts, (0.0, 0.0), 0.0))

    def zones(self, state: SoccerState) -> list[Zone]:
        """The field, the centre circle, the defence areas, the goals, and the spot on which people put a ball."""
        rules = self.settings
        found = [
            Zone(name="field", kind="field", region=rules.field),
            Zone(name="centre", kind="circle", region=rules.middle),
        ]
        for team in (REDS, BLUES):
            found.append(Zone(name=f"{team} area", kind=AREA, region=rules.area_of(team), team=team))
            found.append(Zone(name=f"{team} goal", kind=GOAL, region=rules.goal_of(team), team=team))
        if state.placing and self._ball.tracked:  # people see where they are to put it
            found.append(Zone(name="spot", kind="circle", region=Circle(*state.spot, NEAR_SPOT)))
        return found

    def judge(self, state: SoccerState, before: Observation, now: Observation, clock: float) -> Verdict[SoccerState]:
        """A goal, a ball that is out, a foul, no progress, or the end of the time."""
        was, ball = before.things.get(self._ball.name), now.things.get(self._ball.name)
        if was is None or ball is None:
            return Verdict(state)
        toucher = self._toucher(state, now, ball)
        verdict = self._unseen(state, was, ball, clock) or self._awaited(state, ball, clock)
        if verdict is None:
            verdict = self._left(state, was, ball, clock)
        if verdict is None:
            verdict = self._foul(state, now, ball, toucher, clock)
        if verdict is None:
            verdict = self._went_on(state, ball, toucher, clock)
        if clock >= self.time_limit(state) and not verdict.round_over:
            call = Call(rule="time_up", text="the time is up")
            ended = structs.replace(verdict.state, played=self.settings.time)
            return Verdict(ended, [*verdict.calls, call], round_over=True)
        return verdict

    @staticmethod
    def _unseen(state: SoccerState, was: Thing, ball: Thing, clock: float) -> Verdict[SoccerState] | None:
        """Of a ball that is lost nothing is judged, nor of its way from there to where it is found; None if it is seen.

        It makes no progress meanwhile, and nobody is to blame for that.
        """
        return Verdict(structs.replace(state, since=clock)) if was.lost or ball.lost else None

    def _awaited(self, state: SoccerState, ball: Thing, clock: float) -> Verdict[SoccerState] | None:
        """Nothing is judged before the ball is where it was put; None once it is, or is not put there for long.

        A real ball is put there by people, who are waited for; the kick is then taken from where it lies.
        """
        if not state.placing:
            return None
        if self._ball.tracked:
            at = (ball.pose.x, ball.pose.y)
            if math.dist(at, state.spot) >= NEAR_SPOT or not ball.lies:
                return Verdict(structs.replace(state, since=clock))
            return Verdict(structs.replace(state, placing=False, spot=at, since=clock, rested=at))
        there = math.dist((ball.pose.x, ball.pose.y), state.spot) < IN_PLAY
        return Verdict(structs.replace(state, placing=not there and clock - state.since < GRACE))

    def _toucher(self, state: SoccerState, now: Observation, ball: Thing) -> str:
        """The player that touches the ball, the nearest if there are several; empty if none does."""
        reach, found = self._ball.radius + TOUCH, []
        for name, pose in now.poses.items():
            contestant = self.contestants[name]
            if name not in state.disqualified and math.dist((pose.x, pose.y), (ball.pose.x, ball.pose.y)) < 1.0 + reach:
                outline = Polygon(tuple(corners(pose, *contestant.size)))
                found.append((math.dist(outline.nearest(ball.pose.x, ball.pose.y), (ball.pose.x, ball.pose.y)), name))
        return min(((far, name) for far, name in found if far <= reach), default=(0.0, ""))[1]

    def _left(self, state: SoccerState, was: Thing, ball: Thing, clock: float) -> Verdict[SoccerState] | None:
        """A goal, or a kick for a ball that is out; None while it is on the field."""
        rules, radius = self.settings, self._ball.radius
        x, y = rules.length / 2 + radius, rules.width / 2 + radius
        start, end = (was.pose.x, was.pose.y), (ball.pose.x, ball.pose.y)
        whole = Rectangle(-x, -y, x, y)
        rolled = not whole.contains(*start)  # out of the field while play was halted
        at = 0.0 if rolled else whole.exit_fraction(start, end)
        if at is None:
            return None
        px, py = whole.nearest(*start) if rolled else start
        px, py = px + (end[0] - start[0]) * at, py + (end[1] - start[1]) * at
        where = Pose(px, py, 0.0)
        over_goal_line = abs(px) >= x - 1e-6
        defender = REDS if px < 0.0 else BLUES
        if over_goal_line and abs(py) < rules.goal / 2 and not rolled:
            scorer = OTHER[defender]
            made = state.scored(scorer)
            made = structs.replace(made, starts=defender, played=state.played + clock)
            call = Call(rule="goal", text=f"goal for the {scorer}", poses=(where,))
            return Verdict(made, [call], round_over=True)
        team = OTHER[state.last] if state.last else defender
        what = "a free kick"
        spot = rules.legal(px, py)
        if over_goal_line:
            far = rules.inside if team != defender else 2 * rules.inside
            what = "a corner kick" if team != defender else "a goal kick"
            corner = rules.width / 2 - rules.inside
            spot = (rules.length / 2 - far) * SIDE[defender], corner if py > 0.0 else -corner
        call = Call(rule="free_kick", text=f"the ball is out: {what} for the {team}", poses=(where,))
        return self._put(state, team, spot, clock, call)

    def _foul(
        self, state: SoccerState, now: Observation, ball: Thing, toucher: str, clock: float
    ) -> Verdict[SoccerState] | None:
        rules, x, y = self.settings, ball.pose.x, ball.pose.y
        team = self.team_of(toucher) if toucher else ""
        taken = bool(toucher) and team != state.kick and math.dist((x, y), state.spot) >= IN_PLAY
        if state.kick and clock - state.since < GRACE and not taken:
            return None
        where, why, by = {toucher: now.poses[toucher]} if toucher else {}, "", toucher
        if toucher and state.kick and team != state.kick:
            why = f"{toucher} touches the ball of a kick for the {state.kick}"
        elif toucher and rules.area_of(team).contains(x, y) and self.contestants[toucher].role != KEEPERS[team]:
            why = f"{toucher} defends in its own defence area and is not the keeper"
        elif toucher and rules.area_of(OTHER[team]).contains(x, y):
            why = f"{toucher} attacks in the defence area"
        for name in sorted(now.pushed):
            pose = now.poses[name]
            rivals = [n for n in sorted(now.poses) if self.team_of(n) != self.team_of(name)]
            pushers = [n for n in rivals if n not in state.disqualified and touched(name, [n], now, self.contestants)]
            if why or math.dist((pose.x, pose.y), (x, y)) > NEAR or not pushers:
                continue  # far from the ball, or it is a team mate that pushes
            by = pushers[0]
            why, where = f"{by} pushes {name}", {name: pose, by: now.poses[by]}
        if not why:
            return None
        other = OTHER[self.team_of(by)]
        call = called("foul", f"{why}: a free kick for the {other}", where)
        if state.kick != other:
            return self._put(state, other, rules.legal(x, y), clock, call)
        if state.fouls >= REPEATED:
            return self._neutral(state, ball, clock)
        return self._put(state, other, state.spot, clock, call, fouls=state.fouls + 1)

    def _went_on(self, state: SoccerState, ball: Thing, toucher: str, clock: float) -> Verdict[SoccerState]:
        """Take note of who touched the ball, and of its progress."""
        at = (ball.pose.x, ball.pose.y)
        if toucher:
            state = structs.replace(state, last=self.team_of(toucher))
        if state.kick:
            if math.dist(at, state.spot) < IN_PLAY and clock - state.since < self.settings.kick_time:
                return Verdict(state)
            state = structs.replace(state, kick="", numbers={}, since=clock, rested=at)
        if math.dist(at, state.rested) >= PROGRESS:
            return Verdict(structs.replace(state, since=clock, rested=at))
        if clock - state.since < self.settings.stuck:
            return Verdict(state)
        return self._neutral(state, ball, clock)

    def _neutral(self, state: SoccerState, ball: Thing, clock: float) -> Verdict[SoccerState]:
        """Put the ball on the nearest of the spots on which it is not, for everybody."""
        at = (ball.pose.x, ball.pose.y)
        x = self.settings.length / 4
        spots = [each for each in ((0.0, 0.0), (-x, 0.0), (x, 0.0)) if math.dist(each, at) > PROGRESS]
        spot = min(spots, key=lambda each: math.dist(each, at))
        call = Call(
            rule="no_progress", text=f"no progress: the ball is put on ({spot[0]:g}, {spot[1]:g})", poses=(ball.pose,)
        )
        put = self._kick_for(state, "", spot, clock)
        return Verdict(put, [call], place={self._ball.name: Pose(*spot, 0.0)})

    def _put(
        self, state: SoccerState, team: str, spot: Vector, clock: float, call: Call, *, fouls: int = 0
    ) -> Verdict[SoccerState]:
        kick = structs.replace(self._kick_for(state, team, spot, clock), fouls=fouls)
        return Verdict(kick, [call], place={self._ball.name: Pose(*spot, 0.0)})

    @staticmethod
    def _kick_for(state: SoccerState, team: str, spot: Vector, clock: float) -> SoccerState:
        """The ball is put on a spot, for a kick of a team, or, if that is empty, for everybody."""
        numbers = {KICK.format(team=team): 1.0} if team else {}
        return structs.replace(
            state, kick=team, fouls=0, placing=True, spot=spot, since=clock, rested=spot, last="", numbers=numbers
        )
