"""Timetables of events: what is refused, at what times matches begin, and by which clock."""

import math
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from vrg.errors import ConfigError
from vrg.testing.tiny import TINY
from vrg_class.event.field import Field
from vrg_class.event.plan import Game
from vrg_class.event.running import EventClock
from vrg_class.event.timetable import Timetable, due, is_lately, read_timetable

NOW = datetime(2026, 11, 28, 12, 0).timestamp()


def table(*matches: Mapping[str, Any], **more: Any) -> Timetable:
    return Timetable.model_validate({"title": "Open day", "matches": matches, **more})


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "title"),
        ('title = "x"', "matches"),
        ('title = "x"\nmatches = []', "matches"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\nat = "25:00"', "at"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\nat = "2026-02-30 12:00"', "expected a time"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\nat = "0001-01-01 00:00"', "expected a time"),
        ('title = "x"\npause = -1\n[[matches]]\nmatch = "tiny.toml"', "pause"),
        ('title = "x"\nreview = nan\n[[matches]]\nmatch = "tiny.toml"', "review"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\ntittle = "y"', "tittle"),
        ('title = "x"\noptions = ["--tls"]\n[[matches]]\nmatch = "tiny.toml"', "--tls"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\nkind = "bracket"', "two or more"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\neach = 3', "only in a qualification"),
        ('title = "x"\n[[matches]]\nmatch = "tiny.toml"\nkind = "qualification"', "each"),
        (
            'title = "x"\n[[teams]]\nname = "a"\nstrategy = "s"\n[[teams]]\nname = "a"\nstrategy = "s"',
            "different names",
        ),
        ("[", "cannot be read"),
    ],
)
def test_a_timetable_is_checked(text: str, told: str, tmp_path: Path) -> None:
    text += '\n[[matches]]\nmatch = "x"' if "teams" in text else ""
    (tmp_path / "day.toml").write_text(text)
    with pytest.raises(ConfigError, match=told):
        read_timetable(tmp_path / "day.toml")


def test_a_review_may_last_until_an_official_ends_it(tmp_path: Path) -> None:
    (tmp_path / "day.toml").write_text('title = "x"\nreview = inf\n[[matches]]\nmatch = "tiny.toml"')
    assert math.isinf(read_timetable(tmp_path / "day.toml").review)


@pytest.mark.parametrize(
    ("at", "ended", "begins"),
    [
        ("", datetime(2026, 11, 28, 23, 40), datetime(2026, 11, 28, 23, 40)),
        ("00:30", datetime(2026, 11, 28, 23, 40), datetime(2026, 11, 29, 0, 30)),
        ("23:50", datetime(2026, 11, 29, 0, 10), datetime(2026, 11, 29, 0, 10)),
        ("22:00", datetime(2026, 11, 28, 5, 0), datetime(2026, 11, 28, 22, 0)),
        ("09:00", datetime(2026, 11, 28, 14, 59), datetime(2026, 11, 28, 14, 59)),
        ("09:00", datetime(2026, 11, 28, 15, 1), datetime(2026, 11, 29, 9, 0)),
        ("2026-11-30 09:00", datetime(2026, 11, 28, 12, 0), datetime(2026, 11, 30, 9, 0)),
        ("2026-11-27 09:00", datetime(2026, 11, 28, 12, 0), datetime(2026, 11, 28, 12, 0)),
    ],
)
def test_a_time_of_the_day_is_one_at_most_six_hours_ago_or_the_next(at: str, ended: datetime, begins: datetime) -> None:
    assert datetime.fromtimestamp(due(at, ended.timestamp(), lately=True)) == begins


def test_an_evening_match_waits_for_its_evening_if_nothing_was_played_yet() -> None:
    night = datetime(2026, 11, 28, 0, 30)
    found = datetime.fromtimestamp(due("23:59", night.timestamp(), lately=False))
    assert found == night.replace(hour=23, minute=59)
    assert is_lately(NOW - 20_000.0, NOW)
    assert not is_lately(NOW - 30_000.0, NOW)


def test_the_clock_of_an_event_goes_on_evenly_whatever_the_system_clock_is_set_to() -> None:
    wall, since = [1000.0], [5.0]
    clock = EventClock(lambda: wall[0], lambda: since[0])
    wall[0], since[0] = 4600.0, 8.0
    assert clock.now() == 1003.0


def test_a_match_has_the_strategies_and_the_seed_of_its_entry_and_mistakes_are_found_before_the_guests_come(
    tmp_path: Path,
) -> None:
    mine = "from vrg.agents import *\n\n\nclass Mine(Strategy):\n    def act(self, view):\n        return STILL\n"
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "mine.py").write_text(mine)
    field = Field(tmp_path, tmp_path / "day", "token", [], paged=True)
    setup = field.setup("tiny.toml", {"minnows": "mine.py:Mine"}, 7)
    assert setup.seed == 7
    of_minnows = {player.strategy for player in setup.players if player.team == "minnows"}
    assert of_minnows == {f"{tmp_path / 'mine.py'}:Mine"}
    assert field.games(table({"match": "tiny.toml"}, {"match": "roboflag"})) == [
        Game(("sharks", "minnows"), 2),
        Game(("red", "blue"), 2),
    ]
    teams = [{"name": name, "strategy": "nothing.py"} for name in ("Ann", "Bob")]
    with pytest.raises(ConfigError, match=r"entry 1 of the timetable, tiny\.toml"):
        field.games(table({"match": "tiny.toml", "kind": "qualification", "each": 1}, teams=teams))
