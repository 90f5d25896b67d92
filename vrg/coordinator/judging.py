"""Judges a recorded match again, by the evidence: where the journal differs, and the case of each call. Pure."""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
from msgspec import structs

from vrg.bus.messages import Call, Stage
from vrg.coordinator.evidence import TINY, Books, Exhibit, TickEvidence, book_at, replayed
from vrg.coordinator.journal import Record
from vrg.coordinator.match import Checkpoint, Match
from vrg.coordinator.outcome import Effects, numbered
from vrg.coordinator.proof import Case, Prover
from vrg.coordinator.rulebook import Observation, RuleBook
from vrg.errors import JournalError

_NOT_JUDGED = ("uncertainty", "text", "why")
"""The fields of a call that decide nothing."""


@dataclass(frozen=True)
class Disagreement:
    """A difference between the journal and the rule book.

    Args:
        time: the match time, s. what: what differs, in words.
    """

    time: float
    what: str

    def __str__(self) -> str:
        return f"{self.time:.1f} s: {self.what}"


@dataclass(frozen=True)
class Judgement:
    """The result of judging a match again.

    Args:
        disagreements: the differences from the journal, in the order of time.
        ticks: how many ticks were judged. calls: how many calls of the journal were compared.
        unjudged: how many calls of the journal the evidence does not reach.
        reworded: how many calls have other words than they would have today, which is no difference.
        gaps: the spans of match time, s, in which the evidence could not be written.
    """

    disagreements: Sequence[Disagreement]
    ticks: int
    calls: int
    unjudged: int
    reworded: int = 0
    gaps: Sequence[tuple[float, float]] = ()


def judge_again(
    book: RuleBook[Any], exhibits: Iterable[Exhibit], records: Sequence[Record], later: Books = ()
) -> Judgement:
    """Judge a match again.

    After a disagreement it continues from the journal, so that each mistake is reported once.

    Args:
        book: the rule book of the match. exhibits: the evidence. records: those of the journal.
        later: the rule books that took its place in the course of the match.
    """
    judge = _Judge(records)
    try:
        for exhibit, following, match, _, made in replayed(book, exhibits, later):
            judge.look(exhibit, following, match, made)
    except JournalError:
        raise
    except Exception as error:  # the rules of any game, on numbers that anybody may have changed
        what = f"the rules cannot continue from the journal or the evidence: {type(error).__name__}: {error}"
        judge.found.append(Disagreement(judge.since, what))
    unjudged = judge.unjudged + sum(len(record.calls) for record in judge.left)
    found = sorted(judge.found, key=lambda d: d.time)
    return Judgement(found, judge.ticks, judge.compared, unjudged, judge.reworded, judge.gaps)


class _Judge:
    """Compares what the rules do in each tick with the records of a journal.

    Attributes:
        found, ticks, gaps: as in `Judgement`. compared: the calls that were compared. unjudged: those in gaps.
        reworded: those of the compared calls that have other words.
        left: the records that were not reached yet. since: the match time of the last tick, s.
    """

    def __init__(self, records: Sequence[Record]) -> None:
        self.found: list[Disagreement] = []
        self.gaps: list[tuple[float, float]] = []
        self.left = deque(sorted({record.n: record for record in records}.values(), key=lambda record: record.n))
        self.ticks = self.compared = self.unjudged = self.reworded = 0
        self.since = 0.0
        self._last = self.left[-1].n if self.left else 0
        self._chained = True
        self._outcomes: list[Effects] = []

    def look(self, exhibit: Exhibit, following: Exhibit | None, match: Match, made: list[Effects]) -> None:
        """Take in a tick, the one that follows it, the match after it, and what followed from it by the rules."""
        tick, after = exhibit.tick, exhibit.tick.after
        self.ticks += 1
        lost = _up_to(self.left, after) if tick.anew else []
        if lost or tick.resumed is not None:
            self.gaps.append((self.since, tick.time))
            self.unjudged += sum(len(record.calls) for record in lost)
        if lost and lost[-1].n == after:
            self.found += [Disagreement(lost[-1].time, what) for what in _left_behind(tick, lost[-1].standing)]
        self.since = tick.time
        if not exhibit.genuine:
            self._find(tick.time, "the evidence of this tick, or of an earlier one, was changed after it was written")
        self._outcomes = made if tick.anew else [*self._outcomes, *made]
        if following is not None and following.tick.after == after:
            return
        decided, self._outcomes = self._outcomes, []
        if lost := _up_to(self.left, after):
            self._find(lost[0].time, f"the evidence of {_calls(lost)} is missing")
        if not self.left or self.left[0].n != after + 1:
            if texts := "; ".join(call.text for outcome in decided for call in outcome.calls):
                self._find(tick.time, f"the journal lacks: {texts}")
            elif after < self._last:
                self._find(tick.time, f"the journal lacks its record {after + 1}")
            match.calls += sum(len(outcome.calls) for outcome in decided)
            return
        record = self.left[0]
        if ends_before(exhibit, following, record):
            self.found += [Disagreement(record.time, what) for what in _begun(match, decided, record)]
            return
        self.left.popleft()
        self.compared += len(record.calls)
        if self._chained and record.evidence not in ("", exhibit.digest):
            self._chained = False  # what follows has other digests, too
            self._find(tick.time, "the evidence up to here does not belong to this journal")
        if record.time < tick.time - TINY or (
            # Where the world steps back after it, the next look tells nothing.
            following is not None and record.time - TINY > following.tick.time >= tick.time
        ):
            self._find(tick.time, f"record {record.n} of the journal has the time {record.time:.1f} s")
        wrong, reworded = _compared(match, decided, record)
        self.reworded += reworded
        if wrong:
            self.found += [Disagreement(record.time, what) for what in wrong]
            match.restore(record.standing, tick.field)
        match.calls = record.standing.calls

    def _find(self, time: float, what: str) -> None:
        self.found.append(Disagreement(time, what))


def ends_before(exhibit: Exhibit, following: Exhibit | None, record: Record) -> bool:
    """Whether the evidence ends, or has a gap, behind a tick and before the one in which a record was decided."""
    if record.evidence == exhibit.digest:
        return False
    if following is not None:
        return following.tick.anew
    return not record.evidence or exhibit.tick.time < record.time


def _up_to(left: deque[Record], number: int) -> list[Record]:
    """Take the records up to a number."""
    taken = []
    while left and left[0].n <= number:
        taken.append(left.popleft())
    return taken


def cases_of(
    book: RuleBook[Any], exhibits: Iterable[Exhibit], records: Sequence[Record], later: Books = ()
) -> Iterator[Case]:
    """The case of each call of a match, in their order; calls that the evidence does not reach have none.

    Args:
        book: the rule book of the match. exhibits: the evidence. records: those of the journal.
        later: the rule books that took its place in the course of the match.
    """
    numbered = {record.n: record for record in records}
    before = Observation({})
    for exhibit, following, match, state, _ in replayed(book, exhibits, later):
        tick = exhibit.tick
        # A robot that was put somewhere or pushed away is not judged on its way.
        seen = match.judged or (before if before.poses else tick.field, tick.field)
        decided = following is None or following.tick.after > tick.after
        record = numbered.get(tick.after + 1)
        if decided and record is not None and not ends_before(exhibit, following, record):
            for call in record.calls:
                yield Case(call, state, *seen)
        before = tick.field


def seconds_before(exhibits: Iterable[Exhibit], case: Case, seconds: float) -> list[Observation]:
    """The field at each look of the referee during the seconds before a case, and at the case itself, by time."""
    end = case.now.time
    fields = [e.tick.field for e in exhibits if end - seconds - 1e-9 <= e.tick.field.time <= end]
    return sorted(fields, key=lambda field: field.time)


def refuted(prover: Prover | None, book: RuleBook[Any], cases: Iterable[Case], later: Books = ()) -> list[Disagreement]:
    """Calls whose deciding numbers, computed in another way than the judgement, are not as the rules want them.

    Args:
        prover: the game's; None for a game that has none. book: the rule book of the match. cases: of its calls.
        later: as for `judge_again`.
    """
    if prover is None:
        return []
    found = []
    for case in cases:
        for measure in prover(book_at(case.now.time, book, later), case):
            if not measure.holds:
                what = f"call {case.call.number}, {case.call.rule}: {case.call.text}: but {measure}"
                found.append(Disagreement(case.now.time, what))
    return found


def _compared(match: Match, outcomes: Sequence[Effects], record: Record) -> tuple[list[str], int]:
    """The differences between the rules' effects and a record, in words; and how many calls have other words."""
    standing = match.standing()
    calls = numbered(outcomes, match.calls, standing.clock, {})
    stages = [stage for outcome in outcomes for stage in outcome.stages]
    wrong = [_differing(number, calls, record.calls) for number in range(max(len(calls), len(record.calls)))]
    wrong = [what for what in wrong if what]
    if stages != record.stages:
        wrong.append(f"by the rules {_stages(stages)}, the journal has {_stages(record.stages)}")
    if not wrong:
        wrong = _standings(structs.replace(standing, calls=match.calls + len(calls)), record.standing)
    return wrong, sum(ours.text != theirs.text for ours, theirs in zip(calls, record.calls, strict=False))


def _begun(match: Match, outcomes: Sequence[Effects], record: Record) -> list[str]:
    """The differences between a record and the rules' effects up to where its evidence ends, in words.

    The coordinator that decided these effects also wrote the record: see `EvidenceFile`. So it begins with them.
    """
    standing = match.standing()
    calls = numbered(outcomes, match.calls, standing.clock, {})
    # The clock of a call is that of the tick in which its record was written.
    made = [structs.replace(call, clock=standing.clock) for call in record.calls[: len(calls)]]
    stages = [stage for outcome in outcomes for stage in outcome.stages]
    wrong = [what for number in range(len(calls)) if (what := _differing(number, calls, made))]
    if stages != record.stages[: len(stages)]:
        wrong.append(f"by the rules {_stages(stages)}, the journal has {_stages(record.stages)}")
    if not wrong and (len(calls), len(stages)) == (len(record.calls), len(record.stages)):
        ours = structs.replace(standing, calls=match.calls + len(calls))
        wrong = _standings(_called(ours, record.standing), record.standing)
    return wrong


def _left_behind(tick: TickEvidence, theirs: Checkpoint) -> list[str]:
    """The difference between the standing of the last record before a gap and that of the tick behind it, in words."""
    if tick.resumed is not None:
        return _standings(_called(tick.resumed.standing, theirs), theirs)
    if tick.began is None or tick.began.standing is None:
        return ["the evidence continues without a standing"]
    # The next coordinator continues from the record, with the clock of the newest tick.
    clocks = {name: getattr(theirs, name) for name in ("clock", "total", "in_stage")}
    return _standings(structs.replace(tick.began.standing, **clocks), theirs)


def _called(ours: Checkpoint, theirs: Checkpoint) -> Checkpoint:
    """The other standing, with what changes only with a call or a stage as it is in ours."""
    names = ("stage", "calls", "winner", "ended")
    game = {**theirs.game, **{name: ours.game[name] for name in ("round", "points")}}
    return structs.replace(theirs, game=game, **{name: getattr(ours, name) for name in names})


def _differing(at: int, ours: Sequence[Call], theirs: Sequence[Call]) -> str:
    """The difference between two lists of calls at one place, in words; empty if there is none."""
    if at >= len(theirs):
        return f"by the rules there is a call that was not made: {ours[at].rule}: {ours[at].text}"
    made = f"call {theirs[at].number}, {theirs[at].rule}: {theirs[at].text}"
    if at >= len(ours):
        return f"{made}: by the rules there is no such call"
    if ours[at].rule != theirs[at].rule:
        return f"{made}: by the rules it is {ours[at].rule}: {ours[at].text}"
    # How well poses were known decides nothing, and another release may tell the same in other words.
    judged = [name for name in Call.__struct_fields__ if name not in _NOT_JUDGED]
    names = [name for name in judged if getattr(ours[at], name) != getattr(theirs[at], name)]
    if names:
        name = names[0]
        return f"{made}: its {name} are {getattr(theirs[at], name)!r}, by the rules {getattr(ours[at], name)!r}"
    return ""


def _standings(ours: Checkpoint, theirs: Checkpoint) -> list[str]:
    """The first thing in which two standings differ, in words."""
    # As a file has them: there a pair is a list.
    mine, its = (msgspec.json.decode(msgspec.json.encode(standing)) for standing in (ours, theirs))
    for before, after in ((mine, its), (mine["game"], its["game"])):
        for name in before:
            if name == "halted" and None not in (before[name], after.get(name)):
                continue  # why it is halted is given in words
            if name != "game" and before[name] != after.get(name):
                return [f"{name} is {after.get(name)!r} in the journal, by the rules {before[name]!r}"]
    return []


def _stages(stages: Sequence[Stage]) -> str:
    return f"the match enters {', '.join(stages)}" if stages else "the stage stays"


def _calls(records: Sequence[Record]) -> str:
    numbers = [str(call.number) for record in records for call in record.calls]
    if not numbers:
        return f"record {records[0].n} of the journal"
    return f"call{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}"
