"""The stages of a match (thesis, Algorithm 3.1), as a pure state machine around any rule book.

    INITIALIZE -> PLAY_ROUND -> ROUND_OVER -> INITIALIZE ... -> GAME_OVER

A foul has its consequences at once, and play goes on.

HALT is possible in every stage but the last: the clock is stopped and robots stand still until an official ends it.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import msgspec
from msgspec import Struct, structs

from vrg.bus.messages import TIME_LIMIT, Call, OfficialAction, PlayerStatus, RefereeState, Stage, Zone, shortened
from vrg.coordinator import disqualifying, pushing
from vrg.coordinator.auctions import auctioned
from vrg.coordinator.disqualifying import kept_out, readmitted
from vrg.coordinator.outcome import Effects
from vrg.coordinator.rulebook import DRAW, NOBODY, Disqualification, Observation, RuleBook, Verdict, away, wins
from vrg.errors import FileError, JournalError
from vrg.regions import Region
from vrg.types import Pose

log = logging.getLogger(__name__)

ROUND_PAUSE = 2.0
"""The match time in s that ROUND_OVER lasts, so that everybody sees how the round ended."""
PLACE_AGAIN = 10.0
"""The match time in s after which players that are still not on their marks are put there again."""
SPOT_TOLERANCE, SPOT_PATIENCE = 0.01, 1.0
"""How far a passive body may be from its spot before a round, m; how long it is waited for to be put there, s."""
BY_HAND = 0.1
"""How far a tracked body may be from its spot, m: people put it there, and are waited for."""
JUMP = 0.5
"""The distance in m beyond what it can drive between two looks from which a robot has not driven there."""
MAX_REASON_LENGTH = 1500
"""The length in characters to which all reasons of a halt together are cut, so that they fit into a message."""


class Checkpoint(Struct, frozen=True, kw_only=True):
    """All that has to survive a crash of the coordinator.

    Args:
        halted: why play is halted; None while it is not.
        clock: the time of play in this round, s. total: the time of play in the match, s.
        in_stage: the time in this stage without halts, s.
        calls: the number of calls so far.
        winner: the winner when the game is over. ended: who ended it before its end, and why; None if it was not ended.
        pushed: the players that were pushed away, each with where it stood and the time of play up to which it is
            judged there.
        game: the rule book's own state, as plain data.
    """

    stage: Stage
    halted: str | None
    clock: float
    total: float
    in_stage: float
    calls: int
    winner: str | None
    game: dict[str, Any]
    ended: str | None = None
    pushed: dict[str, tuple[Pose, float]] = {}


class Match:
    """One match under one rule book.

    Args:
        book: the rule book.
        standing: the standing to continue from; None for a new match. A match that goes on begins in HALT.

    Attributes:
        names: the names of the players.
        judged: the field before and now by which play was judged at the last step; None if it was not.
    """

    def __init__(self, book: RuleBook[Any], standing: Checkpoint | None = None) -> None:
        self._book = book
        self.waiting: list[str] = []
        self.stage = Stage.INITIALIZE
        self._reasons: list[str] = []
        self.clock = self.total = self.in_stage = 0.0
        self.calls = 0
        self.winner: str | None = None
        self._ended: str | None = None
        self._pushed: dict[str, tuple[Pose, float]] = {}
        self._placed: dict[str, tuple[Pose, Pose, float]] = {}
        """The bodies that the world is asked to put somewhere: where they were, where to, and when it was asked, s."""
        self.judged: tuple[Observation, Observation] | None = None
        self.game = book.initial()
        self._before: Observation | None = None
        self._place_at = book.lineup_limit
        self._asked_at: float | None = None
        """The time in the stage at which it was asked to put passive bodies on their spots, s."""
        self._ground: tuple[Any, tuple[Zone, ...]] | None = None
        """A state of the game, and the zones in it."""
        self._plain: tuple[Any, dict[str, Any]] | None = None
        """A state of the game, and it as plain data: most ticks do not change it."""
        self.names = [player.name for player in book.statuses(self.game, self.stage, Observation({}))]
        if standing is not None:
            self._take_up(standing)
            if self.stage is not Stage.GAME_OVER:
                self._reasons = [standing.halted or "the coordinator was restarted"]

    def judge_by(self, book: RuleBook[Any]) -> None:
        """Judge by another rule book of the same game from now on."""
        self._book, self._ground = book, None

    @property
    def halted(self) -> str | None:
        """All reasons why play is halted, in words; None while it is not."""
        return shortened("; ".join(self._reasons), MAX_REASON_LENGTH) or None

    @property
    def rounds(self) -> int:
        """The number of rounds of the match, with those that are played to decide a tie."""
        played: int = self.game.round
        return max(played, self._book.rounds)

    @property
    def driven(self) -> Mapping[str, Region]:
        """The players that the coordinator drives now, and the region into which it drives each."""
        if self.stage is not Stage.PLAY_ROUND or self._reasons:
            return {}
        return {name: goal for name, goal in self.game.driven.items() if name not in self.disqualified}

    @property
    def over(self) -> bool:
        """True if the game has ended."""
        return self.stage is Stage.GAME_OVER

    @property
    def before(self) -> Observation | None:
        """The field from which the next step judges; None if play has not been judged just before."""
        return self._before

    @property
    def place_at(self) -> float:
        """The time in the stage at which players that are not on their marks are put there, s."""
        return self._place_at

    def restore(self, standing: Checkpoint, before: Observation | None, place_at: float | None = None) -> None:
        """Go on from a standing as if the match had come to it by itself, in HALT only if that is halted.

        Args:
            before: the field at that instant. place_at: as the property; None keeps it.

        Raises:
            FileError: it is none of this game.
        """
        self._take_up(standing)
        self._reasons = [] if standing.halted is None else [standing.halted]
        self._before = before if self.stage is Stage.PLAY_ROUND and not self._reasons else None
        self._place_at = self._place_at if place_at is None else place_at
        self._asked_at = None

    def _take_up(self, standing: Checkpoint) -> None:
        self.stage, self.winner = standing.stage, standing.winner
        self.clock, self.total, self.in_stage = standing.clock, standing.total, standing.in_stage
        self.calls = standing.calls
        self._ended = standing.ended
        self._pushed = dict(standing.pushed)
        try:
            self.game = msgspec.convert(standing.game, self._book.state_type)
        except msgspec.ValidationError as error:
            raise FileError(f"expected a standing of {self._book.name}: {error}") from None

    @property
    def clocks(self) -> tuple[float, float, float]:
        """The time of play in this round, in the match, and in this stage without halts, as in a standing, s."""
        return round(self.clock, 6), round(self.total, 6), round(self.in_stage, 6)

    def standing(self) -> Checkpoint:
        """The standing of the match, for the journal."""
        if self._plain is None or self._plain[0] is not self.game:
            self._plain = self.game, msgspec.to_builtins(self.game)
        clock, total, in_stage = self.clocks
        return Checkpoint(
            stage=self.stage,
            halted=self.halted,
            clock=clock,
            total=total,
            in_stage=in_stage,
            calls=self.calls,
            winner=self.winner,
            game=self._plain[1],
            ended=self._ended,
            pushed=dict(self._pushed),
        )

    def state(self, now: Observation, estop: bool) -> RefereeState:
        """The state of the match, for the bus."""
        players = kept_out(self.game, self._book.statuses(self.game, self.stage, now))
        if estop or self._reasons:
            players = standing_still(players)
        limit = self._book.time_limit(self.game)
        if self._ground is None or self._ground[0] is not self.game:
            self._ground = self.game, tuple(self._book.zones(self.game))
        return RefereeState(
            game=self._book.name,
            stage=self.stage,
            halted=self.halted,
            way_out=self.way_out,
            waiting=tuple(shortened(why) for why in self.waiting),
            clock=self.clock,
            total=self.total,
            round=self.game.round,
            # A round more may be played than the game has, such as one that decides a tie.
            rounds=self.rounds,
            score=self._book.score(self.game),
            players=players,
            zones=self._ground[1],
            auctions=tuple(self.game.auctions[lot] for lot in sorted(self.game.auctions)),
            objects=tuple(self._book.objects(self.game, now)),
            numbers={**self.game.numbers, **({} if limit is None else {TIME_LIMIT: limit})},
            winner=self.winner,
            ended=self._ended,
            estop=estop,
        )

    def step(self, dt: float, now: Observation, absent: Sequence[str]) -> Effects:
        """Advance by `dt` seconds of match time to the field `now`.

        Args:
            absent: the reasons outside the rules why the match cannot go on, such as a player that does not report.
        """
        self.judged = None
        out = [name for name, why in self.disqualified.items() if not why.returns]
        if not self.over and len(out) == len(self.names):  # also in HALT, which nothing could end
            why = "everybody is disqualified"
            call = Call(rule="game_over", text=f"game over: {why}", why=why)
            return Effects([call], [self.end(DRAW, why)])
        if self._reasons or self.over:
            self._before = None
            self.waiting = list(absent)
            return Effects()
        self.in_stage += dt
        if self.stage is Stage.INITIALIZE:
            return self._initialize(now, absent)
        if self.stage is Stage.PLAY_ROUND:
            return self._play(dt, now)
        return self._round_over(now)

    def halt(self, reason: str, cause: str = "") -> Effects:
        """Stop the clock and the robots. A new reason is added to those before; a known one changes nothing.

        Args:
            cause: see `vrg.bus.messages.Call`.
        """
        if self.over or reason in self._reasons:
            return Effects()
        self._reasons.append(reason)
        return Effects([Call(rule="halt", text=f"play is halted: {reason}", why=reason, cause=cause)])

    def resume(self) -> None:
        """End the halt: forget all its reasons."""
        self._reasons.clear()

    def end(self, winner: str, why: str | None = None) -> Stage:
        """End the game now, and return the stage that is entered.

        Args:
            why: who has ended it before its end, and why, in words.
        """
        self._reasons.clear()
        self.winner = winner
        self._ended = None if why is None else shortened(why)
        return self._enter(Stage.GAME_OVER)

    def disqualify(self, name: str, why: str, now: Observation, *, by_official: bool = False) -> Effects:
        """Take a player out: its robot stops and stays where it is as an obstacle, and play goes on."""
        if self.over:
            return Effects()
        public = self.public(now)
        self.game, outcome = disqualifying.disqualify(self.game, name, why, public, by_official=by_official)
        return outcome

    def reinstate(self, name: str, now: Observation) -> Effects:
        """Let a player that is out play again: at once before a round begins, else from the next round."""
        if self.over:
            return Effects()
        later = "" if self.stage is Stage.INITIALIZE else f"the next {self._book.round_word}"
        self.game, outcome = disqualifying.reinstate(self.game, name, self.public(now), later=later)
        return outcome

    def public(self, now: Observation) -> Observation:
        """The field with only those poses that the rules publish."""
        known = {player.name for player in self._book.statuses(self.game, self.stage, now) if player.pose is not None}
        return replace(now, poses={name: pose for name, pose in now.poses.items() if name in known})

    @property
    def disqualified(self) -> Mapping[str, Disqualification]:
        """The players that are out, whatever the game."""
        disqualified: Mapping[str, Disqualification] = self.game.disqualified
        return disqualified

    def overrule(self, action: OfficialAction, subject: str, value: str) -> None:
        """Apply an official's decision on a score, a role or a state.

        Raises:
            ConfigError: there is no such player, team, role, state or score.
        """
        self.game = self._book.overrule(self.game, action, subject, value)

    def no_room(self, name: str, pose: Pose) -> str | None:
        """The reason why a player's physical robot cannot stand at a pose, or None if it can."""
        return self._book.no_room(name, pose)

    def mark(self, name: str, now: Observation) -> Pose | None:
        """The pose at which a player is asked to line up; None if it is not asked to."""
        if self.stage is Stage.INITIALIZE:
            return None if name in self.disqualified else self._book.marks(self.game).get(name)
        players = kept_out(self.game, self._book.statuses(self.game, self.stage, now))
        return next((player.mark for player in players if player.name == name), None)

    @property
    def way_out(self) -> str | None:
        """The way to continue play, in words; None while it is not halted."""
        if not self._reasons or self.over:
            return None
        how = "An official continues play"
        if not self.waiting:
            return how
        others = [why for why in self.waiting if why not in self._reasons]  # those are reported as the halt's reasons
        if not others:
            return f"{how} as soon as this is solved"
        # What to do comes first: a window may cut the end.
        solved = "this is solved" if len(others) == len(self.waiting) else "this is solved, and this"
        return shortened(f"{how} as soon as {solved}: {'; '.join(others)}", MAX_REASON_LENGTH)

    def _enter(self, stage: Stage) -> Stage:
        self.stage = stage
        self.in_stage = 0.0
        self.waiting = []
        self._before = None
        self._pushed, self._placed = {}, {}
        self._place_at = self._book.lineup_limit
        self._asked_at = None
        return stage

    def _initialize(self, now: Observation, absent: Sequence[str]) -> Effects:
        every = self._book.obstacles_to_start(self.game, now)
        obstacles = {name: why for name, why in every.items() if name not in self.disqualified}
        physical = [name for name in obstacles if name in now.physical]
        put = self._to_spots(now, BY_HAND, tracked=True).items()
        by_hand = [f"{name} does not lie at ({spot.x:g}, {spot.y:g}): put it there" for name, spot in put]
        late = [name for name in obstacles if name not in now.physical]
        self.waiting = [f"{name} {why}" for name, why in obstacles.items()]
        if obstacles:
            limit = f" of at most {self._place_at:.0f} s" if late and not absent else ""
            self.waiting[0] = f"the line-up ({self.in_stage:.0f} s{limit}): {self.waiting[0]}"
        self.waiting = [*absent, *self.waiting, *by_hand]
        spots = {} if self.waiting else self._to_spots(now, SPOT_TOLERANCE, tracked=False)
        if spots and self._asked_at is None:
            self._asked_at = self.in_stage
            return Effects(place=spots)
        if spots and self._asked_at is not None and self.in_stage - self._asked_at < SPOT_PATIENCE:
            return Effects()
        if not self.waiting:
            self.clock = 0.0
            self._enter(Stage.PLAY_ROUND)
            self._before = now
            text = f"{self._book.round_word} {self.game.round} of {self.rounds} begins"
            return Effects([Call(rule="begin", text=text)], [Stage.PLAY_ROUND])
        if absent or not obstacles or self.in_stage < self._place_at:
            return Effects()
        self._place_at = self.in_stage + PLACE_AGAIN
        virtual = {}
        texts = []
        if late:
            # All are put there, because one that is near its own mark may stand on another's.
            virtual = {name: mark for name, mark in self._book.marks(self.game).items() if name not in now.physical}
            texts.append(f"put on their marks after {self.in_stage:.0f} s: {', '.join(late)}")
        if physical:
            texts.append(
                f"not on their marks after {self.in_stage:.0f} s: {', '.join(physical)}; drive them there by hand, or "
                f"carry each there, and let an official confirm its place"
            )
        return Effects([Call(rule="placed" if virtual else "late", text="; ".join(texts))], place=virtual)

    def _to_spots(self, now: Observation, within: float, *, tracked: bool) -> dict[str, Pose]:
        """Where passive bodies are put before the round that are not there, by the world or, if tracked, by people.

        A robot may stand there, so the world is asked once, and not waited for long.
        """
        spots, things, bodies = self._book.spots(self.game), now.things, self._book.bodies
        spots = {name: spot for name, spot in spots.items() if name in things and bodies[name].tracked is tracked}
        return {
            name: spot
            for name, spot in spots.items()
            if away(things[name].pose, spot) > within or (tracked and not things[name].lies)
        }

    def _play(self, dt: float, now: Observation) -> Effects:
        self.clock += dt
        self.total += dt
        game, refused = auctioned(self.game, now.offers, self.clock)
        if refused:
            log.info("%s%s", refused[0], f" (and {len(refused) - 1} more)" if len(refused) > 1 else "")
        now = self._as_placed(now)
        verdict = self._judge(game, self._before or now, now)
        self._before = now
        self.game = verdict.state
        stages = [self._enter(Stage.ROUND_OVER)] if verdict.round_over else []
        bodies = self._book.bodies
        by_people = {n for n in verdict.place if n in now.physical or (n in bodies and bodies[n].tracked)}
        place = {name: pose for name, pose in verdict.place.items() if name not in by_people}
        asked = {name: (now.things[name].pose, pose, now.time) for name, pose in place.items() if name in now.things}
        self._placed |= asked
        return Effects(verdict.calls, stages, place=place)

    def _as_placed(self, now: Observation) -> Observation:
        """What is seen, but bodies that the world was asked to put somewhere rest there already.

        The world of another process does that after the next look, at which the same would be called again. A body is
        there as soon as it is seen nearer to its new place than to where it was.
        """
        for name, (was, pose, asked) in list(self._placed.items()):
            seen = now.things.get(name)
            if seen is None or now.time - asked > SPOT_PATIENCE or away(seen.pose, pose) < away(seen.pose, was):
                del self._placed[name]
        put = {
            name: structs.replace(now.things[name], pose=pose, vx=0.0, vy=0.0, w=0.0)
            for name, (_, pose, _) in self._placed.items()
        }
        return replace(now, things={**now.things, **put}) if put else now

    def _judge(self, game: Any, before: Observation, now: Observation) -> Verdict[Any]:
        """The verdict, with pushed players at the place where the push began.

        Robots that cannot have driven to where they are now were put there, or their measured poses have jumped: they
        are judged at their new places, not on a way.
        """
        dt = max(0.0, now.time - before.time)
        put = [
            name
            for name, pose in now.poses.items()
            if name in before.poses and away(before.poses[name], pose) > JUMP + self._book.contestants[name].v_max * dt
        ]

        def called(name: str, fields: tuple[Observation, Observation]) -> bool:
            return any(name in call.players for call in self._book.judge(game, *fields, self.clock).calls)

        self._pushed, self.judged = pushing.judged_at(self._pushed, put, before, now, self.clock, called)
        return self._book.judge(game, *self.judged, self.clock)

    def touched(self, name: str, now: Observation) -> bool:
        """True if an opponent touches a player's robot."""
        opponents = [n for n in now.poses if self._book.role_of(self.game, n) != self._book.role_of(self.game, name)]
        return pushing.touched(name, opponents, now, self._book.contestants)

    def _round_over(self, now: Observation) -> Effects:
        """Begin the next round or end the game, after a pause in which an official may still overrule the last call."""
        if self.in_stage < ROUND_PAUSE:
            return Effects()
        verdict = self._book.next_round(readmitted(self.game), now)
        self.game, self.winner = verdict.state, verdict.winner
        if self.winner is None:
            return Effects(verdict.calls, [self._enter(Stage.INITIALIZE)])
        how = {DRAW: "a draw", NOBODY: "the time is up"}.get(self.winner, won(self.winner))
        text = f"game over: {how}{f': {verdict.why}' if verdict.why else ''}"
        over = Call(rule="game_over", text=text, why=verdict.why)
        return Effects([*verdict.calls, over], [self._enter(Stage.GAME_OVER)])


def won(team: str) -> str:
    """Says that a team has won: `sharks win`, but `lion wins`."""
    return f"{team} {wins(team)}"


def state_after(book: RuleBook[Any], standing: Checkpoint | None) -> RefereeState:
    """The state of a match that has ended with a standing of its journal, which anybody may have changed.

    Raises:
        JournalError: the rules cannot continue from it.
    """
    try:
        return Match(book, standing).state(Observation({}), estop=False)
    except Exception as error:  # the rules of any game
        what = f"{type(error).__name__}: {error}"
        raise JournalError(f"the last standing in the journal is none of {book.name}: {what}") from None


def standing_still(players: Sequence[PlayerStatus]) -> tuple[PlayerStatus, ...]:
    """Return the same players, none of whom may move or is driven."""
    return tuple(structs.replace(player, may_move=False, lease=None) for player in players)
