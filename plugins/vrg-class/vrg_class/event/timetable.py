"""The timetable of an event as people write it: matches, qualifications and brackets, one after the other."""

import math
import re
from contextlib import suppress
from datetime import datetime, timedelta
from pathlib import Path
from typing import Annotated, Final, Literal, Self

from pydantic import Field, ValidationError, field_validator, model_validator

from vrg.errors import ConfigError
from vrg.files import read_text, toml_of
from vrg.tables import Table, problems_of

MOST: Final = 500
"""The matches of a timetable."""
TEAMS: Final = 64
"""The teams of a timetable."""
_DAY: Final = "-"
"""The pattern of a time that names its day."""
_LONGEST_DELAY: Final = timedelta(hours=6)
"""The longest time that a match comes late. A time of the day that is longer ago is that of the next day."""
_OWN: Final = ("--listen", "--tls", "--web", "--page", "--runs", "--dry-run")
"""Options of `vrg play` that the event itself decides on."""
Title = Annotated[str, Field(max_length=100)]


class Team(Table):
    """Who takes part in a qualification and in a bracket.

    Args:
        name: of the team. strategy: how it plays: a file beside the timetable, or a name.
    """

    name: str = Field(min_length=1, max_length=60)
    strategy: str


class Entry(Table):
    """An entry of a timetable.

    Args:
        match: the name of a game, or a match file beside the timetable.
        kind: one match; or many: a qualification, in which the teams are drawn against each other; a bracket.
        title: who plays, or what the entry is called; empty for that of the match.
        at: the time before which it does not begin, `14:30` or `2026-12-24 14:30`; empty for as soon as it can.
        strategies: of one match, in place of its own, by player or team; files beside the timetable, or names.
        seed: in place of that of the match; None leaves it.
        each: of a qualification: the matches of each team.
        elimination: of a bracket: how many lost pairings end the way of a team.
        places: of a bracket: how many of the ranking take part; None for all.
    """

    match: str
    kind: Literal["match", "qualification", "bracket"] = "match"
    title: Title = ""
    at: str = ""
    strategies: dict[str, str] = Field(default_factory=dict)
    seed: int | None = None
    each: int | None = Field(default=None, ge=1, le=20)
    elimination: Literal["single", "double"] | None = None
    places: int | None = Field(default=None, ge=2, le=TEAMS)

    @field_validator("at")
    @classmethod
    def _is_a_time(cls, at: str) -> str:
        known = None
        with suppress(ValueError, OverflowError, OSError):
            known = _time(at) if re.fullmatch(r"(\d{4}-\d\d-\d\d )?([01]?\d|2[0-3]):[0-5]\d", at) else None
        if at and known is None:
            raise ValueError(f"expected a time, such as 14:30 or 2026-12-24 14:30, got {at!r}")
        return at

    @model_validator(mode="after")
    def _belongs_together(self) -> Self:
        of = {"strategies": "match", "each": "qualification", "elimination": "bracket", "places": "bracket"}
        if wrong := [name for name, kind in of.items() if getattr(self, name) and self.kind != kind]:
            raise ValueError(f"{wrong[0]}: expected only in a {of[wrong[0]]}, this is a {self.kind}")
        if self.kind == "qualification" and self.each is None:
            raise ValueError("each: expected how many matches each team has")
        return self


class Timetable(Table):
    """An event.

    Args:
        title: of the event. pause: the time between the result of a match and the next match, s.
        review: the time after which a result is confirmed by itself, s; inf waits for an official.
        options: further ones of `vrg play`. teams: of qualifications and brackets.
    """

    title: str = Field(min_length=1, max_length=100)
    pause: float = Field(default=120.0, ge=0.0)
    review: float = Field(default=30.0, ge=0.0, allow_inf_nan=True)
    options: tuple[str, ...] = ()
    teams: tuple[Team, ...] = Field((), max_length=TEAMS)
    matches: tuple[Entry, ...] = Field(min_length=1, max_length=MOST)

    @field_validator("options")
    @classmethod
    def _are_of_play(cls, options: tuple[str, ...]) -> tuple[str, ...]:
        if own := [option for option in options if option.partition("=")[0] in _OWN]:
            raise ValueError(f"expected options of `vrg play` that the event does not decide on, got {own[0]!r}")
        return options

    @model_validator(mode="after")
    def _has_teams(self) -> Self:
        if math.isnan(self.review):
            raise ValueError("review: expected seconds, or inf")
        names = [team.name for team in self.teams]
        if len(set(names)) < len(names):
            raise ValueError(f"teams: expected different names, got {', '.join(names)}")
        if len(names) < 2 and any(entry.kind != "match" for entry in self.matches):
            raise ValueError(f"teams: expected two or more for a qualification or a bracket, got {len(names)}")
        return self


def due(at: str, earliest: float, *, lately: bool) -> float:
    """When a match begins, s of wall time.

    Args:
        at: as an entry has it. earliest: when the pause after the match before it ends, s of wall time.
        lately: a match was played lately: only then a time that is still to come today may be yesterday's.
    """
    if not at:
        return earliest
    time = _time(at)
    if _DAY in at:
        return max(earliest, time.timestamp())
    now = datetime.fromtimestamp(earliest)
    wanted = now.replace(hour=time.hour, minute=time.minute, second=0, microsecond=0)
    days = 1 if now - wanted > _LONGEST_DELAY else 0
    if lately and wanted - now > timedelta(days=1) - _LONGEST_DELAY:
        days = -1
    return max(earliest, (wanted + timedelta(days=days)).timestamp())


def is_lately(ended: float, now: float) -> bool:
    """True if a match that has ended is not longer ago than the longest delay; both are s of wall time."""
    return now - ended < _LONGEST_DELAY.total_seconds()


def _time(at: str) -> datetime:
    """A local time; that of no day is one of the first day of 1900.

    Raises:
        ValueError, OverflowError, OSError: it is not one.
    """
    found = datetime.strptime(at, "%Y-%m-%d %H:%M" if _DAY in at else "%H:%M")
    if _DAY in at:
        found.timestamp()
    return found


def read_timetable(path: Path) -> Timetable:
    """The timetable in a file of TOML.

    Raises:
        ConfigError: it cannot be used.
    """
    try:
        return Timetable.model_validate(toml_of(read_text(path)))
    except ValidationError as error:
        raise ConfigError([f"{path}: {problem}" for problem in problems_of(error)]) from None
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
