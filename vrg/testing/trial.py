"""Matches by seeds in which a rule book is tried: what happens is drawn, and each look is checked for what it promises.

Players begin at their marks, all over the field, or close together. They drive to zones and to one another, vanish for
some looks, report and bid. Officials overrule, disqualify, halt and place. Then everybody stands until the match is
over. The same seed gives the same trial.
"""

import math
import random
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Final

import msgspec

from vrg.bus.messages import Official, OfficialAction, RefereeState, Sighting, Stage, Thing
from vrg.coordinator.auctions import auctioned
from vrg.coordinator.decisions import decide
from vrg.coordinator.disqualifying import readmitted
from vrg.coordinator.match import Match
from vrg.coordinator.outcome import Effects
from vrg.coordinator.rulebook import DRAW, NOBODY, Observation, Offer, RuleBook, Verdict
from vrg.testing.field import Field
from vrg.testing.leap import PERIOD
from vrg.types import Pose

LOOKS: Final = 120
"""The looks at the field of a trial before everybody stands."""
STANDING: Final = 300
"""The looks, longer and longer apart, in which everybody stands: some days of play."""
LONGEST: Final = 3600.0
"""The longest time between two of these, s."""
KEEP: Final = ": write points to `state.points`, or override `overrule`, to keep them or to refuse in words"
"""What to do where a score that an official has set is lost."""
DECISIONS: Final = (
    OfficialAction.SET_SCORE, OfficialAction.SET_ROLE, OfficialAction.SET_STATE, OfficialAction.DISQUALIFY,
    OfficialAction.REINSTATE, OfficialAction.HALT, OfficialAction.PLACE,
)  # fmt: skip
"""What officials decide in a trial."""


def trial(book: RuleBook[Any], ready: Observation, seed: int, *, endless: bool = False) -> None:
    """Try a rule book in one match.

    Args:
        ready: a field on which the first round begins. seed: of what happens.
        endless: True if only an official ends a match in which nothing happens.

    Raises:
        AssertionError: the rule book does not keep its promises. It says in words what is wrong, and by which seed it
            is seen again.
    """
    _Trial(book, ready, seed, endless=endless).run()


class _Trial:
    """See `trial`."""

    def __init__(self, book: RuleBook[Any], ready: Observation, seed: int, *, endless: bool) -> None:
        self._book, self._ready, self._seed, self._endless = book, ready, seed, endless
        self._rng = random.Random(seed)
        self._match = Match(book)
        self._field = Field(book, ready, self._rng)
        self._gone: dict[str, int] = {}
        """The players that the world does not report, and for how many looks more."""
        self._time = 0.0
        self._looks = 0
        self._judged: list[tuple[tuple[Any, Observation, Observation, float], Any]] = []
        """What was judged, and what came out."""
        self._teams = {status.name: status.team for status in book.statuses(self._match.game, Stage.INITIALIZE, ready)}
        self._scatters = seed % 3 != 0

    def run(self) -> None:
        with self._raising_nothing():
            if self._seed % 2:
                self._official(OfficialAction.DISQUALIFY, self._rng.choice(self._match.names), None)
            for _ in range(LOOKS):
                if self._match.over:
                    break
                if self._match.halted:
                    self._match.resume()
                elif self._rng.random() < 0.04:
                    self._decide(self._rng.choice(DECISIONS))
                self._look(PERIOD, self._seen())
            self._stand()
            for case, result in reversed(self._judged):
                again = "judged again after other looks"
                self._expect(_outcome(self._book.judge(*case)) == result, f"{again}, a look has another result")

    def _stand(self) -> None:
        """Let everybody stand until the match is over, in some matches with one that the world does not report."""
        self._match.resume()
        self._gone = {self._rng.choice(self._match.names): STANDING} if self._seed % 4 == 3 else {}
        apart = PERIOD
        for _ in range(STANDING):
            if self._match.over or self._endless:
                return
            self._look(apart, self._still())
            apart = min(1.1 * apart, LONGEST)
        self._expect(
            False,
            "everybody has stood still for days, but the match does not end: judge the time, and declare "
            "`time_limit`; or set `endless = True` in the test if only an official ends it",
        )

    def _seen(self) -> Observation:
        """The next look at the field."""
        match, rng, field = self._match, self._rng, self._field
        if match.stage is Stage.INITIALIZE or match.halted:
            return self._still()
        if match.stage is Stage.PLAY_ROUND and match.clock == 0.0 and self._scatters:
            field.scatter(match.game)
        moving = field.drive(match.game)
        self._gone = {name: looks - 1 for name, looks in self._gone.items() if looks > 1}
        if rng.random() < 0.02:
            self._gone[rng.choice(match.names)] = rng.randint(1, 20)
        poses = {name: pose for name, pose in field.poses.items() if name not in self._gone}
        return replace(
            self._ready, poses=poses, moving=moving, time=self._time + PERIOD, offers=self._offers(),
            sightings=self._sightings(poses), things=dict(field.things),
        )  # fmt: skip

    def _still(self) -> Observation:
        """A look at a field on which everybody stands; before a round, on its mark."""
        match, field, gone = self._match, self._field, set(self._gone)
        if match.stage is Stage.INITIALIZE:
            marks = {name: mark for name in match.names if (mark := match.mark(name, self._ready)) is not None}
            field.poses |= marks
            field.things = {n: Thing(n, self._book.spots(match.game).get(n, t.pose)) for n, t in field.things.items()}
            gone = set()
        now = replace(
            self._ready, poses=dict(field.poses), moving=frozenset(), time=self._time, things=dict(field.things)
        )
        return _without(now, gone)

    def _offers(self) -> Sequence[Offer]:
        rng = self._rng
        bids = [(bidder, lot) for lot, a in sorted(self._match.game.auctions.items()) for bidder in a.bidders]
        return [Offer(*bid, rng.choice((None, rng.uniform(0.0, 9.0)))) for bid in bids if rng.random() < 0.1]

    def _sightings(self, poses: dict[str, Pose]) -> Sequence[tuple[str, Sighting]]:
        rng, time = self._rng, self._time
        if rng.random() < 0.7 or len(poses) < 2:
            return ()
        who, whom = rng.sample(sorted(poses), 2)
        x, y = (poses[whom].x, poses[whom].y) if rng.random() < 0.8 else self._field.anywhere()
        return ((who, Sighting(x=x, y=y, time=max(0.0, time), xx=0.01, xy=0.0, yy=0.01)),)

    def _decide(self, action: OfficialAction) -> None:
        """Let an official decide something that is possible in most games."""
        book, rng, match = self._book, self._rng, self._match
        name, value = rng.choice(match.names), None
        if action is OfficialAction.SET_SCORE:
            name, value = rng.choice(sorted(book.score(match.game))), str(rng.randint(0, 9))
        elif action in (OfficialAction.SET_ROLE, OfficialAction.SET_STATE):
            allowed = book.roles_of(name) if action is OfficialAction.SET_ROLE else book.states_of(name)
            value = rng.choice(list(allowed) or ["nothing of this kind"])
        elif action is OfficialAction.PLACE:
            x, y = self._field.spot(match.game)
            value = f"{x} {y} {rng.uniform(-180.0, 180.0)}"
        self._official(action, name, value)

    def _official(self, action: OfficialAction, subject: str, value: str | None) -> None:
        match, now = self._match, self._still()
        score = self._book.score(match.game)
        asked = Official(action=action, by="official", reason="a trial", subject=subject, value=value)
        effects = decide(match, asked, now, ())
        self._field.put(effects.place)
        if any(call.rule == "refused" for call in effects.calls):
            return
        if action is OfficialAction.SET_SCORE and value is not None:
            wanted = {**score, subject: int(value)}
            became = self._book.score(match.game)
            self._expect(became == wanted, f"{_said(action, subject, value)}, but the score is {became}{KEEP}")
        elif action in (OfficialAction.SET_ROLE, OfficialAction.SET_STATE):
            [status] = (s for s in self._book.statuses(match.game, match.stage, now) if s.name == subject)
            told = status.role if action is OfficialAction.SET_ROLE else status.state
            self._expect(told == value, f"{_said(action, subject, value)}, but its status says {told!r}")

    def _look(self, seconds: float, now: Observation) -> None:
        """One step of the match, and all that must hold of it."""
        match, book = self._match, self._book
        self._looks += 1
        self._time = round(self._time + seconds, 6)
        now = replace(now, time=self._time)
        game, stage = match.game, match.stage
        written, limit = msgspec.json.encode(game), book.time_limit(game)
        effects = match.step(seconds, now, [])
        self._expect(msgspec.json.encode(game) == written, "the state that was handed in is changed: return a new one")
        if match.judged is not None:
            game, _ = auctioned(game, now.offers, match.clock)
            self._rejudge(game, limit)
        elif stage is Stage.ROUND_OVER and match.stage is not stage and match.standing().ended is None:
            self._went_on(readmitted(game), now)
        elif stage is Stage.INITIALIZE and match.stage is stage and not match.halted:
            why = "; ".join(match.waiting)
            self._expect(False, f"everybody stands still on its mark, and {book.round_word} does not begin: {why}")
        self._shown(now, effects)
        self._field.put(effects.place)

    def _rejudge(self, game: Any, limit: float | None) -> None:
        """Judge the last look again in several ways."""
        assert self._match.judged is not None
        book, (before, now), clock = self._book, self._match.judged, self._match.clock
        verdict = book.judge(game, before, now, clock)
        self._expect(verdict.state == self._match.game, "judged a second time, the same look has another result")
        journal = _read_again(game, book)
        for how, state, was, is_ in (
            ("a second time", game, before, now),
            ("by the state that was written to the journal", journal, before, now),
            ("with the players in another order", game, _turned(before), _turned(now)),
        ):
            again = book.judge(state, was, is_, clock)
            self._expect(_outcome(again) == _outcome(verdict), f"judged {how}, the same look has another result")
        if self._rng.random() < 0.3:
            self._judged.append(((game, before, now, clock), _outcome(verdict)))
        self._expect(verdict.winner is None, "`judge` names a winner: only `next_round` may")
        kept = verdict.state.disqualified == game.disqualified
        self._expect(kept, "the new state forgets who is disqualified: make it with `structs.replace` from the old one")
        if out := game.disqualified.keys() & now.poses.keys():
            absent = book.judge(game, _without(before, out), _without(now, out), clock)
            self._expect(
                book.score(absent.state) == book.score(verdict.state),
                f"{', '.join(sorted(out))} is disqualified, and the score depends on where it is: leave out those in "
                "`state.disqualified`, who neither score nor are scored on",
            )
        if limit is not None and clock >= limit + 1e-6:
            self._expect(
                verdict.round_over, f"`time_limit` is {limit:g} s, and play goes on: end the round, whoever is missing"
            )

    def _went_on(self, game: Any, now: Observation) -> None:
        """Judge again what followed a round."""
        book, match = self._book, self._match
        first = _outcome(book.next_round(game, now))
        self._expect(first[0] == match.game, "asked a second time, `next_round` has another result")
        turned = _outcome(book.next_round(game, _turned(now)))
        self._expect(turned == first, "with the players in another order, `next_round` has another result")
        teams = [*book.score(match.game), DRAW, NOBODY]
        if match.winner is not None:
            self._expect(match.winner in teams, f"the winner is {match.winner!r}, expected one of {', '.join(teams)}")
            return
        self._expect(match.game.round > game.round, "`next_round` returns the same round without a winner")
        self._expect(
            match.game.disqualified == game.disqualified,
            "`next_round` forgets who is disqualified: copy `state.disqualified` into the new state",
        )

    def _shown(self, now: Observation, effects: Effects) -> None:
        """What is announced and published can be read again, and says what it may."""
        match, book = self._match, self._book
        names = set(match.names)
        for call in effects.calls:
            strangers = set(call.players) - names
            self._expect(not strangers, f"{call.rule}: it names {strangers}, who do not play")
            self._expect(len(call.poses) <= max(1, len(call.players)), f"{call.rule}: it has more poses than players")
            self._expect(all(map(_finite, call.poses)), f"{call.rule}: a pose of it is not finite")
        for name, pose in effects.place.items():
            known = name in names or name in now.things
            self._expect(known and _finite(pose), f"{name} is put at {pose}: expected a player or a body, and a place")
        state = match.state(now, estop=False)
        teams = {player.name: player.team for player in state.players}
        self._expect(teams == self._teams and len(teams) == len(state.players), f"the players are {teams} now")
        self._expect(set(teams.values()) <= set(state.score), f"the score has not every team: {dict(state.score)}")
        self._expect(min(state.score.values()) >= 0, f"the score is {dict(state.score)}: points are never below 0")
        read = msgspec.msgpack.decode(msgspec.msgpack.encode(state), type=RefereeState)
        self._expect(read == state, "the published state is another one when it has been read")
        self._expect(
            _read_again(match.game, book) == match.game, "the state is another one when the journal is read: use tuples"
        )

    def _expect(self, holds: bool, words: str) -> None:
        if not holds:
            raise AssertionError(f"{self._where()}: {words}. {self._again()}")

    def _where(self) -> str:
        match = self._match
        return f"{self._book.round_word} {match.game.round}, {match.clock:.1f} s of play, look {self._looks}"

    def _again(self) -> str:
        return f"To repeat it: vrg.testing.trial.trial(book, ready, seed={self._seed})"

    @contextmanager
    def _raising_nothing(self) -> Iterator[None]:
        try:
            yield
        except AssertionError:
            raise
        except Exception as error:
            at = traceback.extract_tb(error.__traceback__)[-1]
            what = f"{type(error).__name__}: {error}, in `{at.name}`, line {at.lineno} of {at.filename}"
            raise AssertionError(f"{self._where()}: {what}. {self._again()}") from error


def _said(action: OfficialAction, subject: str, value: str | None) -> str:
    return f"{action} {subject} {value} is announced"


def _outcome(verdict: Verdict[Any]) -> tuple[Any, ...]:
    """All of a verdict but the order of its calls."""
    calls = sorted((call.rule, call.text) for call in verdict.calls)
    return verdict.state, calls, verdict.round_over, verdict.winner, dict(verdict.place)


def _read_again(state: Any, book: RuleBook[Any]) -> Any:
    return msgspec.json.decode(msgspec.json.encode(state), type=book.state_type)


def _turned(field: Observation) -> Observation:
    """The same field with the players in the other order."""
    return replace(field, poses=dict(reversed(list(field.poses.items()))))


def _without(field: Observation, names: set[str]) -> Observation:
    return replace(field, poses={name: pose for name, pose in field.poses.items() if name not in names})


def _finite(pose: Pose) -> bool:
    return all(map(math.isfinite, (pose.x, pose.y, pose.theta)))
