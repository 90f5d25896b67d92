"""What an event keeps in its folder, and to which matches of a timetable that was changed it belongs."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct

from vrg.errors import ConfigError
from vrg.files import read_bytes


class Match(Struct, frozen=True, kw_only=True):
    """What tells a match from the others of a timetable.

    Args:
        name: unlike that of all others: its title, the teams, or the place in a bracket.
        number: from 1 in the order of the timetable. kind: of its entry. match: a game or a file.
        strategies: by player or team, as in the timetable. seed: as there. teams: who plays; empty for one match.
    """

    name: str
    number: int
    kind: str
    match: str
    strategies: dict[str, str] = {}
    seed: int | None = None
    teams: tuple[str, ...] = ()

    @property
    def content(self) -> tuple[object, ...]:
        """All but its name and number. Who plays in a bracket follows from results."""
        who = () if self.kind == "bracket" else (sorted(self.strategies.items()), self.teams)
        return self.kind, self.match, self.seed, who


class Correction(Struct, frozen=True):
    """Why officials have changed a result, and what it was before."""

    reason: str
    score: dict[str, int]
    winner: str | None


class Outcome(Struct, frozen=True, kw_only=True):
    """What has come out of a match.

    Args:
        of: the match. words: its end, in words. score: the points by side. winner: a side, or `draw`; None if it was
            broken off. run: the name of its run folder. ended: when, s of the event's time.
        confirmed: it counts. corrections: what officials have changed, the first one first.
    """

    of: Match
    words: str
    score: dict[str, int]
    winner: str | None
    run: str = ""
    ended: float = 0.0
    confirmed: bool = False
    corrections: tuple[Correction, ...] = ()


class Kept(Struct, frozen=True):
    """What survives a restart.

    Args:
        outcomes: in the order of play. titles: that officials have given, by name of the match.
        seeds: the teams of each bracket that has begun, the best first, by the name of its first match.
        again: the names of matches that are to be played again.
        held: why the event is held, as pages tell it; None if it is not.
    """

    outcomes: tuple[Outcome, ...] = ()
    titles: dict[str, str] = {}
    seeds: dict[str, tuple[str, ...]] = {}
    again: tuple[str, ...] = ()
    held: dict[str, str] | None = None


def read_kept(file: Path) -> Kept:
    """What a file has kept; nothing if there is none.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        return msgspec.json.decode(read_bytes(file), type=Kept)
    except FileNotFoundError:
        return Kept()
    except (OSError, ValueError, RecursionError) as error:
        raise ConfigError(f"{file}: expected the results of an event: {error}: move it away") from None


def placed(outcomes: Iterable[Outcome], matches: Sequence[Match]) -> dict[str, Outcome]:
    """Outcomes by the name of the match to which each belongs, in their order.

    They are found by name, else by content; a single match also by its number, if its game is the same. Whether the
    teams of a bracket are still the same is left to who knows them.

    Raises:
        ConfigError: one belongs to none.
    """
    outcomes = list(outcomes)
    free, found = {match.name: match for match in matches}, dict[int, str]()
    for fits in (_named, _alike, _numbered):
        for place, outcome in enumerate(outcomes):
            same = [] if place in found else [match for match in free.values() if fits(outcome.of, match)]
            match = next((one for one in same if len(same) == 1 or one.number == outcome.of.number), None)
            if match is not None:
                found[place] = free.pop(match.name).name
    if lost := [outcome.of.name for place, outcome in enumerate(outcomes) if place not in found]:
        raise unplaced(lost)
    return {found[place]: outcome for place, outcome in enumerate(outcomes)}


def unplaced(names: Iterable[str]) -> ConfigError:
    """Says that the results of some matches belong to no match of a timetable."""
    return ConfigError(
        f"expected the results of this timetable, found those of {', '.join(map(repr, names))}: "
        "give the timetable back its teams and matches, or move the folder away"
    )


def _named(of: Match, match: Match) -> bool:
    return match.name == of.name


def _alike(of: Match, match: Match) -> bool:
    return match.content == of.content


def _numbered(of: Match, match: Match) -> bool:
    return of.kind == "match" and (match.number, match.kind, match.match) == (of.number, of.kind, of.match)
