"""An event as it goes on: what is played next and when, which results count, and what officials decide.

It knows no clock and no process: who calls it tells the time, and plays what it asks for.
"""

import enum
import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import asdict, replace

from vrg.bus.messages import Stage
from vrg.coordinator.rulebook import DRAW
from vrg.errors import ConfigError
from vrg_class.event.outcomes import Correction, Kept, Outcome, placed, unplaced
from vrg_class.event.plan import Fixture, Game, Plan, plan
from vrg_class.event.timetable import MOST, Timetable, due, is_lately
from vrg_class.site import RefusalError

PLAYED: Final = (Stage.PLAY_ROUND, Stage.ROUND_OVER, Stage.GAME_OVER)
"""The stages of a match whose play has begun."""
POINTS: Final = 1_000_000
"""The limit of the points of a side."""


class Phase(enum.StrEnum):
    """The use of the field: the next match, a match that lines up, one that is played, or the review of its score."""

    WAITING = "waiting"
    READY = "ready"
    RUNNING = "running"
    REVIEW = "review"


class Live(Struct, frozen=True):
    """What is known of a match on the field: stage, clock, score, and why it does not go on.

    Args:
        scores: sides as people write them, with their points.
    """

    stage: str | None = None
    words: str = ""
    clock: str = ""
    scores: tuple[tuple[str, int], ...] = ()
    waiting: tuple[str, ...] = ()
    halted: bool = False


class Report(Struct, frozen=True, kw_only=True):
    """How a match has ended.

    Args:
        why: the reason for which it does not count, one word of the pages' words; empty if it was played.
        words: its end, or what has failed, in words. score, winner, run: as in `Outcome`.
    """

    why: str = ""
    words: str = ""
    score: dict[str, int] = {}
    winner: str | None = None
    run: str = ""


class Event:
    """An event as it goes on. Times are s of the event's clock.

    Args:
        table: its timetable. games: of each entry. kept: what an earlier run has kept. now: the time.

    Attributes:
        on: the name of the match on the field, or whose score is under review; None for none.
        held: why nothing begins and nothing is confirmed by itself; None if it is not held.
        live: what is known of the match on the field; None if its page does not answer.
        stopping: the match on the field is to be broken off. version: grows with each change of matches or results.

    Raises:
        ConfigError: what was kept is that of another timetable, or there are too many matches.
    """

    def __init__(self, table: Timetable, games: Sequence[Game], kept: Kept, now: float) -> None:
        self.table, self._games = table, games
        self._titles, self._seeds, self._again = dict(kept.titles), dict(kept.seeds), set(kept.again)
        names = {team.name for team in table.teams}
        if lost := {name for seeds in kept.seeds.values() for name in seeds} - names:
            raise ConfigError(f"expected {', '.join(sorted(lost))} among the teams: a bracket with them has begun")
        self._outcomes: dict[str, Outcome] = {}
        self.version = int(now * 1000)
        self._found: tuple[int, Plan] = -1, Plan(())
        fixtures = self.plan.fixtures
        if len(fixtures) > MOST:
            raise ConfigError(f"expected at most {MOST} matches, got {len(fixtures)}")
        before = placed(kept.outcomes, [fixture.of for fixture in fixtures])
        now_as = {one.of.name: one.of for one in self._planned(before).fixtures}
        if other := [name for name, outcome in before.items() if now_as[name].teams != outcome.of.teams]:
            raise unplaced(other)
        self._outcomes = {name: replace(outcome, of=now_as[name]) for name, outcome in before.items()}
        self.phase: Phase = Phase.WAITING
        self.on: str | None = None
        self.held = kept.held
        self.live: Live | None = None
        self.stopping = False
        self._held_at = self._reviewed = now
        paused = max((one.ended for one in self._outcomes.values()), default=-math.inf) + table.pause
        self._earliest = min(max(now, paused), now + table.pause)
        self._begun = False
        self._change()
        if (name := next((name for name, one in self._outcomes.items() if not one.confirmed), None)) is not None:
            self._review(name, now)

    @property
    def plan(self) -> Plan:
        """All matches as they stand."""
        if self._found[0] != self.version:
            self._found = self.version, self._planned(self._outcomes)
        return self._found[1]

    def _planned(self, outcomes: Mapping[str, Outcome]) -> Plan:
        return plan(self.table, self._games, outcomes, self._seeds)

    @property
    def kept(self) -> Kept:
        """The state that must survive a restart."""
        return Kept(tuple(self._outcomes.values()), self._titles, self._seeds, tuple(self._again), self.held)

    @property
    def next(self) -> Fixture | None:
        """The match that is to be played again, or else the first without a result; None for none."""
        open_ = [one for one in self.plan.fixtures if one.needed and one.of.name not in self._outcomes]
        return next((one for one in open_ if one.of.name in self._again), open_[0] if open_ else None)

    @property
    def _current(self) -> Fixture | None:
        return self.next if self.on is None else next(one for one in self.plan.fixtures if one.of.name == self.on)

    def outcome(self, fixture: Fixture) -> Outcome | None:
        """The outcome of a match; None before its end."""
        return self._outcomes.get(fixture.of.name)

    def title(self, fixture: Fixture) -> str:
        """What people read of a match."""
        return self._titles.get(fixture.of.name) or fixture.title

    def begins(self, fixture: Fixture) -> float:
        """When the next match begins."""
        if fixture.of.name in self._again:
            return self._earliest
        lately = any(is_lately(one.ended, self._earliest) for one in self._outcomes.values())
        return due(fixture.at, self._earliest, lately=lately)

    def step(self, now: float) -> Fixture | None:
        """Let time pass; returns a match that is to be played now, and of which `ended` is to be told."""
        if self.phase is Phase.REVIEW and self.held is None and now >= self._confirms:
            self._confirm(now)
        fixture = self.next
        waits = self.held is not None or not (self._begun or (fixture and now >= self.begins(fixture)))
        if self.phase is not Phase.WAITING or fixture is None or waits:
            return None
        self.phase, self.on, self._begun, self.stopping, self.live = Phase.READY, fixture.of.name, False, False, None
        first = next(one for one in self.plan.fixtures if one.entry == fixture.entry)
        if first.stands is not None:  # from now on the bracket keeps its teams
            self._seeds.setdefault(first.of.name, self.plan.seeds[first.of.name])
        self._change()
        return fixture

    def hear(self, live: Live | None) -> None:
        """Take in what is known of the match on the field; None if its page does not answer."""
        self.live = live
        if live is not None and live.stage in PLAYED and self.phase is Phase.READY:
            self.phase = Phase.RUNNING
            self._change()

    def ended(self, report: Report, now: float) -> None:
        """Take in how the match on the field has ended. One that does not count is held, and played again."""
        fixture, self.live = self._current, None
        if fixture is None or self.on is None:
            return
        if report.why:
            self.phase, self.on = Phase.WAITING, None
            self.hold(now, report.why, words=report.words)
        else:
            self._outcomes[self.on] = Outcome(
                of=fixture.of, words=report.words, score=report.score, winner=report.winner, run=report.run, ended=now
            )
            self._review(self.on, now)
        self._change()

    def fail(self, now: float, words: str) -> None:
        """Hold the event, because something has failed that must not; nobody plays the match on the field any more."""
        if self.phase in (Phase.READY, Phase.RUNNING):
            self.ended(Report(why="failed", words=words), now)
        else:
            self.hold(now, "failed", words=words)

    def _review(self, name: str, now: float) -> None:
        """Let officials look at a score. A match that was broken off must be confirmed if there is a review."""
        self.phase, self.on, self._reviewed, self._held_at = Phase.REVIEW, name, now, now
        self._again.discard(name)

    @property
    def _confirms(self) -> float:
        """When the score under review is confirmed by itself."""
        whole = self.table.review == 0.0 or (self.on is not None and self._outcomes[self.on].winner is not None)
        return self._reviewed + self.table.review if whole else math.inf

    def _confirm(self, now: float) -> None:
        assert self.on is not None
        self._outcomes[self.on] = replace(self._outcomes[self.on], confirmed=True)
        self.phase, self.on, self._earliest = Phase.WAITING, None, now + self.table.pause
        self._change()

    def hold(self, now: float, why: str, **found: str) -> None:
        """Let nothing begin, and confirm nothing, until officials let it go on; `why` is one word of pages' words."""
        if self.held is None:
            self._held_at = now
        if self.held != (held := {"why": why, **found}):
            self.held = held
            self._change()

    def go_on(self, now: float) -> None:
        """Go on; a review goes on with the time that was left."""
        if self.held is not None:
            self._reviewed += now - self._held_at
            self.held = None
            self._change()

    def begin(self, now: float) -> None:
        """Begin the next match now.

        Raises:
            RefusalError: there is none, or another one is on the field.
        """
        self._need(self.phase is Phase.WAITING and self.next is not None)
        self.go_on(now)
        self._begun = True

    def confirm(self, now: float) -> None:
        """Confirm the score that is under review.

        Raises:
            RefusalError: none is, or it decides between teams and has no winner.
        """
        self._need(self.phase is Phase.REVIEW and self.on is not None)
        outcome = self._outcomes[self.on or ""]
        if outcome.winner is None and outcome.of.teams:
            raise RefusalError("winner")
        self._confirm(now)

    def stop(self) -> None:
        """Have the match on the field broken off.

        Raises:
            RefusalError: there is none.
        """
        self._need(self.phase in (Phase.READY, Phase.RUNNING))
        self.stopping = True

    def again(self, number: int, now: float) -> None:
        """Take back the result of a match, and play it next.

        Raises:
            RefusalError: it has none, another one is on the field, or one that follows from it was played.
        """
        fixture = self._played(number)
        name = fixture.of.name
        reviewed = self.phase is Phase.REVIEW
        self._need(self.phase is Phase.WAITING or (reviewed and self.on == name))
        self._set({other: one for other, one in self._outcomes.items() if other != name})
        if reviewed:
            self.phase, self.on = Phase.WAITING, None
        self._earliest = max(self._earliest, now + self.table.pause)
        self._again.add(name)
        self._change()

    def correct(self, number: int, score: Mapping[str, int], winner: str, reason: str) -> None:
        """Correct a result. Its former value is kept.

        Args:
            winner: a side, or `draw`.

        Raises:
            RefusalError: there is none, it cannot be so, or a match that follows from it was played.
        """
        fixture = self._played(number)
        before = self._outcomes[fixture.of.name]
        sides = set(before.score) or set(fixture.sides)
        if (
            set(score) != sides
            or winner not in (*sides, DRAW)
            or any(abs(points) > POINTS for points in score.values())
        ):
            raise RefusalError("score")
        if not (reason := reason.strip()[:200]):
            raise RefusalError("reason")
        corrections = (*before.corrections, Correction(reason, before.score, before.winner))
        score = {side: score[side] for side in before.score or fixture.sides}
        after = replace(before, score=score, winner=winner, corrections=corrections)
        self._set(self._outcomes | {fixture.of.name: after})

    def rename(self, number: int, title: str) -> None:
        """Correct what people read of a match; nothing gives it back what the timetable says.

        Raises:
            RefusalError: there is no such match.
        """
        if (fixture := self.plan.fixture(number)) is None:
            raise RefusalError("unknown_match", 404)
        self._titles.pop(fixture.of.name, None)
        if title := title.strip()[:100]:
            self._titles[fixture.of.name] = title
        self._change()

    def _played(self, number: int) -> Fixture:
        fixture = self.plan.fixture(number)
        if fixture is None or fixture.of.name not in self._outcomes:
            raise RefusalError("unknown_match", 404)
        return fixture

    def _need(self, possible: bool) -> None:
        if not possible:
            raise RefusalError("not_now", 409)

    def _set(self, outcomes: dict[str, Outcome]) -> None:
        """Have other results, unless matches that were played, or are on the field, would have had other teams."""
        for old, new in zip(self.plan.fixtures, self._planned(outcomes).fixtures, strict=True):
            if (old.of.name in outcomes or old.of.name == self.on) and (old.of.teams, old.needed) != (
                new.of.teams, new.needed,
            ):  # fmt: skip
                raise RefusalError("followed", 409, n=old.of.number)
        self._outcomes = outcomes
        self._change()

    def _change(self) -> None:
        self.version += 1

    def state(self, now: float) -> dict[str, Any]:
        """What pages show and what changes at any time, as plain data.

        Returns:
            `left` (s until the next match begins, or the score is confirmed by itself; None for never), `n` (the number
            of the match that is on, or next), `phase`, `held`, `live`, `stopping` and `version`.
        """
        current = self._current
        left = self._confirms - now if self.phase is Phase.REVIEW else None
        if self.phase is Phase.WAITING and current is not None:
            left = 0.0 if self._begun else self.begins(current) - now
        return {
            "phase": self.phase if current else "over", "n": current and current.of.number, "held": self.held,
            "left": None if left is None or math.isinf(left) else round(max(0.0, left), 2),
            "live": self.live and asdict(self.live), "version": self.version,
            "stopping": self.stopping and self.phase in (Phase.READY, Phase.RUNNING),
        }  # fmt: skip

    def listing(self) -> dict[str, Any]:
        """What pages show and what changes with `version` alone: the title, all matches, the ranking, the champion."""
        return {
            "title": self.table.title,
            "matches": [self.row(fixture) for fixture in self.plan.fixtures],
            "ranking": [row._asdict() for row in self.plan.ranking],
            "champion": self.plan.champion,
        }

    def row(self, fixture: Fixture) -> dict[str, Any]:
        """A match with its result, as plain data."""
        of, found, stands = fixture.of, self.outcome(fixture), fixture.stands
        known = {"title": self.title(fixture)} if of.name in self._titles or not of.teams else {}
        done = "confirmed" if found else "waiting" if fixture.needed else "unneeded"
        result = {} if found is None else {
            "score": [*found.score.items()], "winner": found.winner, "words": found.words,
            "corrections": [asdict(one) for one in found.corrections],
        }  # fmt: skip
        return {
            "n": of.number, "kind": of.kind, "at": fixture.at, "who": fixture.sources, "sides": fixture.sides,
            "state": self.phase if of.name == self.on else done,
            **known, **(stands._asdict() if stands else {}), **result,
        }  # fmt: skip
