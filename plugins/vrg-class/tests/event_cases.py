"""Events as pure objects, for tests: timetables, and matches that are played at once."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

import msgspec

from vrg_class.event.course import Event, Live, Phase, Report
from vrg_class.event.outcomes import Kept
from vrg_class.event.plan import Game
from vrg_class.event.timetable import Timetable

ROLES = Game(("sharks", "minnows"), 2)
"""A game whose teams have different roles."""
EVEN = Game(("red", "blue"), 1)
"""A game whose teams have the same."""
NOW = datetime(2026, 11, 28, 12, 0).timestamp()
THREE = tuple({"match": "tiny.toml", "title": title} for title in ("Ann against Bob", "Cid against Dee", "Eve"))
TEAMS = tuple({"name": name, "strategy": f"{name}.py"} for name in ("Ann", "Bob", "Cid", "Dee"))


def table(*matches: Mapping[str, Any], **more: Any) -> Timetable:
    return Timetable.model_validate({"title": "Open day", "pause": 60.0, "matches": matches or THREE, **more})


def event(of: Timetable | None = None, kept: Kept | None = None, game: Game = ROLES, now: float = NOW) -> Event:
    of = of or table()
    return Event(of, [game] * len(of.matches), kept or Kept(), now)


def restarted(before: Event, of: Timetable | None = None, now: float = NOW) -> Event:
    """The event as another process finds it, maybe with another timetable."""
    kept = msgspec.json.decode(msgspec.json.encode(before.kept), type=Kept)
    return event(of or before.table, kept, before._games[0], now)


def played(found: Event, now: float, first: int = 2, second: int = 1, *, confirm: bool = True) -> int:
    """Play the next match at once, with these points of its sides; returns its number."""
    if found.phase is Phase.WAITING:
        found.begin(now)
    fixture = found.step(now)
    assert fixture is not None
    found.hear(Live(stage="play_round"))
    sides = fixture.sides
    winner = "draw" if first == second else sides[first < second]
    found.ended(Report(words="the end", score=dict(zip(sides, (first, second), strict=True)), winner=winner), now)
    if confirm:
        found.confirm(now)
    return fixture.of.number


def words(found: Event) -> list[str | None]:
    return [outcome and outcome.words for outcome in map(found.outcome, found.plan.fixtures)]
