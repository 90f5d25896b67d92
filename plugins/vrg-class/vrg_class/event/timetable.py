"""The timetable of an event: matches on one field, one after the other, and what has come out of them."""

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import Struct
from pydantic import Field, ValidationError, field_validator

from vrg.api import played_by
from vrg.config.loading import load_match, match_path
from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError, LaunchError
from vrg.files import read_bytes, read_text, toml_of, write_whole
from vrg.tables import Table, problems_of

MOST: Final = 500
"""The matches of a timetable."""
_DAY: Final = "-"
"""What a time has that names its day."""
_LONGEST_DELAY: Final = timedelta(hours=6)
"""The longest time that a match comes late. A time of the day that is longer ago is that of the next day."""


class Slot(Table):
    """A match of a timetable.

    Args:
        match: the name of a game, or a match file beside the timetable. title: who plays; that of the match if empty.
        at: the time before which it does not begin, `14:30` or `2026-12-24 14:30`; empty for as soon as it can.
        strategies: in place of those of the match, by player or team; files beside the timetable, or names.
        seed: in place of that of the match; None leaves it.
    """

    match: str
    title: str = Field("", max_length=100)
    at: str = ""
    strategies: dict[str, str] = Field(default_factory=dict)
    seed: int | None = None

    @field_validator("at")
    @classmethod
    def _is_a_time(cls, at: str) -> str:
        known = None
        with suppress(ValueError, OverflowError, OSError):
            known = _time(at) if re.fullmatch(r"(\d{4}-\d\d-\d\d )?([01]?\d|2[0-3]):[0-5]\d", at) else None
        if at and known is None:
            raise ValueError(f"expected a time, such as 14:30 or 2026-12-24 14:30, got {at!r}")
        return at


class Timetable(Table):
    """An event.

    Args:
        title: of the event. pause: the time between two matches, s. options: further ones of `vrg play`.
    """

    title: str = Field(min_length=1, max_length=100)
    pause: float = Field(120.0, ge=0.0)
    options: tuple[str, ...] = ()
    matches: tuple[Slot, ...] = Field(min_length=1, max_length=MOST)


class Outcome(Struct, frozen=True, kw_only=True):
    """What has come out of a match, by its title: in words, the score by team, and its run folder."""

    title: str
    words: str
    score: dict[str, int] = {}
    run: str = ""


@dataclass
class Event:
    """An event as it goes on; what has come out of its matches survives a restart.

    Officials set `held`, `begun` and `again`, from another thread; all else is for the one that plays the matches.

    Args:
        table: its timetable. base: the folder of the timetable's file. folder: for what it writes.

    Attributes:
        outcomes: by the number of the match, from 0, in the order of play.
        playing: the number of the one that is played; None for none.
        begins: when the next one begins, s of wall time. held: True keeps it from beginning.
        begun: an official has it begin now. again: an official has the last one played again.
        repeated: the number of the one that is to be played again; None for none.

    Raises:
        ConfigError: what the folder has kept is that of another timetable, or cannot be read.
    """

    table: Timetable
    base: Path
    folder: Path
    outcomes: dict[int, Outcome] = field(default_factory=dict)
    playing: int | None = None
    begins: float = 0.0
    held: bool = False
    begun: bool = False
    again: bool = False
    repeated: int | None = None

    def __post_init__(self) -> None:
        try:
            kept = msgspec.json.decode(read_bytes(self._kept), type=list[Outcome])
        except FileNotFoundError:
            return
        except (OSError, ValueError) as error:
            raise ConfigError(f"{self._kept}: expected the outcomes of an event: {error}: move it away") from None
        # The timetable may have been changed: more matches, or in another order.
        free = dict(enumerate(self.titles()))
        for outcome in kept:
            number = next((number for number, title in free.items() if title == outcome.title), None)
            if number is None:
                raise ConfigError(
                    f"{self._kept}: expected the outcomes of this timetable, found that of {outcome.title!r}: "
                    "add the match to the timetable, or move the folder away"
                )
            del free[number]
            self.outcomes[number] = outcome

    @property
    def _kept(self) -> Path:
        return self.folder / "outcomes.json"

    @property
    def next(self) -> int | None:
        """The number of the match to be played again, or else of the first without an outcome; None for none."""
        if self.repeated is not None:
            return self.repeated
        return next((number for number in range(len(self.table.matches)) if number not in self.outcomes), None)

    def repeat(self) -> None:
        """Take back the outcome of the match that was played last, and play it next.

        Raises:
            LaunchError: it cannot be written.
        """
        if self.repeated is None and self.outcomes:
            self.repeated = [*self.outcomes][-1]
            self.keep(self.repeated, None)

    def played_lately(self, now: float) -> bool:
        """True if a match has ended within the longest delay before `now`, s of wall time."""
        try:
            return now - self._kept.stat().st_mtime < _LONGEST_DELAY.total_seconds()
        except OSError:
            return False

    def due(self, number: int, ended: float, *, lately: bool) -> float:
        """When a match begins, s of wall time.

        Args:
            ended: when the pause after the one before it ends, s of wall time.
            lately: a match was played lately: only then a time that is still to come today may be yesterday's.
        """
        if not (at := self.table.matches[number].at):
            return ended
        time = _time(at)
        if _DAY in at:
            return max(ended, time.timestamp())
        now = datetime.fromtimestamp(ended)
        wanted = now.replace(hour=time.hour, minute=time.minute, second=0, microsecond=0)
        days = 1 if now - wanted > _LONGEST_DELAY else 0
        if lately and wanted - now > timedelta(days=1) - _LONGEST_DELAY:
            days = -1
        return max(ended, (wanted + timedelta(days=days)).timestamp())

    def keep(self, number: int, outcome: Outcome | None) -> None:
        """Note the outcome of a match; None lets it be played again.

        Raises:
            LaunchError: it cannot be written.
        """
        others = {n: one for n, one in self.outcomes.items() if n != number}
        self.outcomes = others if outcome is None else others | {number: outcome}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self._kept, msgspec.json.encode([*self.outcomes.values()]))
        except OSError as error:
            raise LaunchError(f"{self._kept}: cannot be written: {error.strerror}") from None

    def setup(self, number: int) -> CheckedMatch:
        """The match of a number, as it is to be played.

        Raises:
            ConfigError: it cannot be played.
        """
        slot = self.table.matches[number]
        beside = self.base / slot.match
        setup = load_match(beside if beside.is_file() else match_path(slot.match), seed=slot.seed)
        return played_by(setup, {name: self._target(strategy) for name, strategy in slot.strategies.items()})

    def _target(self, strategy: str) -> str:
        """A strategy as a match file anywhere may have it."""
        name, colon, what = strategy.partition(":")
        file = self.base / name
        return f"{file.resolve()}{colon}{what}" if file.is_file() else strategy

    def titles(self) -> Sequence[str]:
        """What people read of each match."""
        return [slot.title or Path(slot.match).stem for slot in self.table.matches]

    def state(self) -> dict[str, Any]:
        """What the page shows, as plain data."""
        rows = [
            {
                "title": title, "at": slot.at, "words": outcome.words if outcome else "", "on": number == self.playing,
                "score": list(outcome.score.items()) if outcome else [],
            }
            for number, (slot, title) in enumerate(zip(self.table.matches, self.titles(), strict=True))
            for outcome in [self.outcomes.get(number)]
        ]  # fmt: skip
        return {
            "title": self.table.title, "matches": rows, "playing": self.playing, "next": self.next,
            "begins": self.begins, "held": self.held, "repeats": self.repeated is not None,
        }  # fmt: skip


def _time(at: str) -> datetime:
    """A local time; that of no day is one of the first day of 1900.

    Raises:
        ValueError, OverflowError, OSError: it is none.
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
