"""What an event keeps in its folder, and to which matches of a timetable that was changed it belongs."""

from collections.abc import Callable, Iterable, Mapping, Sequence
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
        seeds: the teams of each bracket that has begun, the best first, by the number of its entry from 0.
        held: why the event is held, as pages tell it; None if it is not.
    """

    outcomes: tuple[Outcome, ...] = ()
    titles: dict[str, str] = {}
    seeds: dict[int, tuple[str, ...]] = {}
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

    They are found by name, else by content, else by number where the game is the same.

    Raises:
        ConfigError: one belongs to none.
    """
    outcomes = list(outcomes)
    free, found = {match.name: match for match in matches}, dict[int, Match]()
    for rule in (_named, _alike, _numbered):
        for place, outcome in enumerate(outcomes):
            if place not in found and (match := rule(outcome.of, free)) is not None:
                found[place] = free.pop(match.name)
    if lost := [outcome.of.name for place, outcome in enumerate(outcomes) if place not in found]:
        raise ConfigError(
            f"expected the results of this timetable, found those of {', '.join(map(repr, lost))}: "
            "add the matches to the timetable, or move the folder away"
        )
    return {match.name: msgspec.structs.replace(outcomes[n], of=match) for n, match in sorted(found.items())}


def _named(of: Match, free: Mapping[str, Match]) -> Match | None:
    return free.get(of.name)


def _alike(of: Match, free: Mapping[str, Match]) -> Match | None:
    return _only(of, free, lambda match: match.content == of.content)


def _numbered(of: Match, free: Mapping[str, Match]) -> Match | None:
    same = (of.number, of.kind, of.match)
    return _only(of, free, lambda match: (match.number, match.kind, match.match) == same)


def _only(of: Match, free: Mapping[str, Match], fits: Callable[[Match], bool]) -> Match | None:
    """The only match that fits, or the one of the same number among them."""
    found = [match for match in free.values() if fits(match)]
    return next((match for match in found if len(found) == 1 or match.number == of.number), None)
