"""The results of an event as files for spreadsheets and for programs."""

import csv
import io
from typing import Any, Final

import msgspec

from vrg_class.event.course import Event

HEADS: Final = (
    "number", "kind", "title", "state", "first", "second", "points of first", "points of second", "winner", "score",
    "words", "corrected because", "score before", "run",
)  # fmt: skip


def rows(event: Event) -> list[dict[str, Any]]:
    """Each match, in the order of the timetable, by `HEADS`. What is not known yet is None."""
    found = []
    for fixture in event.plan.fixtures:
        row, outcome = event.row(fixture), event.outcome(fixture)
        who = fixture.of.teams or fixture.sides
        names = dict(zip(fixture.sides, who, strict=True))
        score = outcome.score if outcome else {}
        points = [score.get(side) for side in fixture.sides] + [None, None]
        corrections = outcome.corrections if outcome else ()
        values = (
            fixture.of.number, fixture.of.kind, event.title(fixture), str(row["state"]), *[*who, None, None][:2],
            *points[:2], names.get(outcome.winner or "", outcome.winner) if outcome else None, _score(score) or None,
            outcome.words if outcome else None, "; ".join(one.reason for one in corrections) or None,
            "; ".join(_score(one.score) for one in corrections) or None, (outcome.run or None) if outcome else None,
        )  # fmt: skip
        found.append(dict(zip(HEADS, values, strict=True)))
    return found


def _score(score: dict[str, int]) -> str:
    return ", ".join(f"{side} {points}" for side, points in score.items())


def as_csv(event: Event) -> bytes:
    """The matches as a file that spreadsheets open. No cell of it is a formula."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(HEADS)
    for row in rows(event):
        writer.writerow([harmless(cell) if isinstance(cell, str) else cell for cell in row.values()])
    return text.getvalue().encode("utf-8-sig")


def harmless(cell: str) -> str:
    """A text that no spreadsheet takes for a formula."""
    return f"'{cell}" if cell[:1] in ("=", "+", "-", "@", "\t", "\r") else cell


def as_json(event: Event) -> bytes:
    """The matches, and the ranking, for programs."""
    ranking = [row._asdict() for row in event.plan.ranking]
    about = {"title": event.table.title, "matches": rows(event), "ranking": ranking, "champion": event.plan.champion}
    return msgspec.json.format(msgspec.json.encode(about))
