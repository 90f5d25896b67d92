"""Finds the instants of calls in the evidence, so that it can be shown why they were made. Pure."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from vrg.coordinator.evidence import Books, Exhibit, replayed
from vrg.coordinator.journal import Record
from vrg.coordinator.judging import ends_before
from vrg.coordinator.proof import Case
from vrg.coordinator.rulebook import Observation, RuleBook


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
        # Who was put somewhere or pushed away is judged elsewhere than on its way.
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
