"""The matches of an event: what its timetable becomes once teams are drawn, ranked and put into brackets."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from vrg_class.bracket import Source, champion, double, entrants, is_needed, single
from vrg_class.event.draw import draw
from vrg_class.event.outcomes import Match, Outcome
from vrg_class.event.ranking import Result, Row, ranking
from vrg_class.event.timetable import Entry, Timetable

_drawn = functools.cache(draw)  # it may have to search, and is asked for with each result


class Game(NamedTuple):
    """What the plan needs to know of a match file.

    Args:
        sides: the teams for which robots play. legs: 2 if they have different roles, so that sides are changed.
    """

    sides: tuple[str, ...]
    legs: int


class Slot(NamedTuple):
    """Where a match stands in a bracket.

    Args:
        pairing: the number of its pairing from 0. part: of the bracket. round: in that part, from 1.
        again: it is of the second final. pair_winner: the team that has won the pairing; None while that is open.
    """

    pairing: int
    part: str
    round: int
    again: bool
    pair_winner: str | None = None


@dataclass(frozen=True)
class Fixture:
    """A match of the plan.

    Args:
        of: what tells it from others. entry: the number of its entry, from 0. title: in words.
        at: as an entry has it. sides: the teams of its game, in the order of those who play for them.
        sources: who plays: `{name}` of a team, or where it comes from; empty for a single match.
        stands: its place in a bracket. needed: False if it is not played, because the bracket is decided.
    """

    of: Match
    entry: int
    title: str
    at: str
    sides: tuple[str, ...]
    sources: tuple[dict[str, Any], ...] = ()
    stands: Slot | None = None
    needed: bool = True


@dataclass(frozen=True)
class Plan:
    """All matches in the order of play, the ranking, and the winner of the last bracket.

    Args:
        seeds: the teams of each bracket that has begun or can begin, the best first, by the name of its first match.
    """

    fixtures: tuple[Fixture, ...]
    ranking: tuple[Row, ...] = ()
    champion: str | None = None
    seeds: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def fixture(self, number: int) -> Fixture | None:
        """The match of a number from 1; None for none."""
        return self.fixtures[number - 1] if 0 < number <= len(self.fixtures) else None


def plan(
    table: Timetable, games: Sequence[Game], outcomes: Mapping[str, Outcome], seeds: Mapping[str, Sequence[str]]
) -> Plan:
    """The matches as they stand.

    Args:
        games: of each entry. outcomes: by name of the match; only confirmed ones count.
        seeds: of brackets that have begun, by the name of the first match.
    """
    made = _Making(table, {name: one for name, one in outcomes.items() if one.confirmed})
    for entry, game in enumerate(games):
        match table.matches[entry].kind:
            case "qualification":
                made.qualification(entry, game)
            case "bracket":
                made.bracket(entry, game, seeds)
            case _:
                made.single_match(entry, game)
    return Plan(tuple(made.fixtures), tuple(made.ranking()), made.champion, made.seeds)


class _Making:
    def __init__(self, table: Timetable, confirmed: Mapping[str, Outcome]) -> None:
        self._table, self._confirmed = table, confirmed
        self._strategies = {team.name: team.strategy for team in table.teams}
        self._names: set[str] = set()
        self.seeds: dict[str, tuple[str, ...]] = {}
        self.fixtures: list[Fixture] = []
        self.champion: str | None = None

    def _add(self, entry: int, name: str, game: Game, *, first: bool, teams: Sequence[Any] = (), **more: Any) -> Match:
        """Add a match; `teams` are names, or where they come from; `first` is True for the first one of an entry."""
        wanted = self._table.matches[entry]
        name = self._free(name)
        self._names.add(name)
        known = tuple(team if isinstance(team, str) else "?" for team in teams)
        strategies = {side: self._strategies.get(team, "") for side, team in zip(game.sides, known, strict=bool(teams))}
        of = Match(
            name=name, number=len(self.fixtures) + 1, kind=wanted.kind, match=wanted.match, seed=wanted.seed,
            strategies=strategies if teams else wanted.strategies, teams=known,
        )  # fmt: skip
        sources = tuple({"name": team} if isinstance(team, str) else team for team in teams)
        title = " – ".join(known) if teams else _title(wanted)
        at = wanted.at if first else ""
        self.fixtures.append(Fixture(of, entry, title, at, game.sides, sources=sources, **more))
        return of

    def _free(self, name: str) -> str:
        """A name that no match has yet."""
        return next(one for n in count(1) if (one := name if n == 1 else f"{name} ({n})") not in self._names)

    def single_match(self, entry: int, game: Game) -> None:
        self._add(entry, _title(self._table.matches[entry]), game, first=True)

    def qualification(self, entry: int, game: Game) -> None:
        names = [team.name for team in self._table.teams]
        for number, pair in enumerate(_drawn(len(names), self._table.matches[entry].each or 1)):
            teams = [names[one] for one in pair]
            self._add(entry, " – ".join(teams), game, first=number == 0, teams=teams)

    def bracket(self, entry: int, game: Game, begun: Mapping[str, Sequence[str]]) -> None:
        wanted = self._table.matches[entry]
        name = self._free(f"{_title(wanted)} 1.1")
        seeds = begun.get(name)
        teams = len(self._table.teams)
        places = len(seeds) if seeds else min(wanted.places or teams, teams)
        pairings = double(places) if wanted.elimination == "double" else single(places)
        if seeds is None and all(
            one.of.name in self._confirmed for one in self.fixtures if one.of.teams and one.needed
        ):
            ranked = [row.name for row in self.ranking()] or [team.name for team in self._table.teams]
            seeds = ranked[:places]
        if seeds is not None:
            self.seeds[name] = tuple(seeds)
        winners: dict[int, int] = {}
        numbers: list[str] = []
        for number, pairing in enumerate(pairings):
            pair = entrants(pairings, number, winners)
            sources: list[Any] = [
                seeds[seed] if seeds and seed is not None else _origin(source, numbers)
                for seed, source in zip(pair, (pairing.first, pairing.second), strict=True)
            ]
            needed = is_needed(pairings, number, winners) is not False
            stands = Slot(number, pairing.side, pairing.round, pairing.again)
            legs = [
                self._add(
                    entry, f"{_title(wanted)} {number + 1}.{leg + 1}", game, first=number == leg == 0,
                    teams=sources[::-1] if leg else sources, stands=stands, needed=needed,
                )
                for leg in range(game.legs)
            ]  # fmt: skip
            numbers.append("+".join(str(leg.number) for leg in legs))
            played = [self._confirmed[leg.name] for leg in legs if leg.name in self._confirmed]
            if pair[0] is not None and pair[1] is not None and len(played) == len(legs):
                best = winners[number] = winner(pair[0], pair[1], played, game.sides)
                stands = stands._replace(pair_winner=seeds[best] if seeds else None)
                self.fixtures[-len(legs) :] = [replace(one, stands=stands) for one in self.fixtures[-len(legs) :]]
        last = champion(pairings, winners)
        self.champion = seeds[last] if seeds and last is not None else None

    def ranking(self) -> list[Row]:
        """The ranking of the teams by the qualifications so far; none if there is no qualification."""
        drawn = [one for one in self.fixtures if one.of.kind == "qualification"]
        results = [
            Result(first, second, points_of(found, one.sides), _place(found.winner, one.sides))
            for one in drawn
            for first, second in [one.of.teams]
            if (found := self._confirmed.get(one.of.name)) is not None
        ]
        return ranking([team.name for team in self._table.teams], results) if drawn else []


def _title(entry: Entry) -> str:
    return entry.title or Path(entry.match).stem


def _origin(source: Source, numbers: Sequence[str]) -> dict[str, Any]:
    return {"place": source.number + 1} if source.kind == "seed" else {source.kind: numbers[source.number]}


def points_of(outcome: Outcome, sides: Sequence[str]) -> tuple[int, int]:
    """The points of those who played for the first and for the second side."""
    first, second = (outcome.score.get(side, 0) for side in sides)
    return first, second


def _place(side: str | None, sides: Sequence[str]) -> int | None:
    return sides.index(side) if side in sides else None


def winner(first: int, second: int, legs: Sequence[Outcome], sides: Sequence[str]) -> int:
    """The seed that wins a pairing: who has more points in its matches, or has won more of them, or is the better one.

    Args:
        first, second: the seeds, from 0. In the second match they have changed sides.
    """
    if len(legs) == 1:
        won = _place(legs[0].winner, sides)
        return min(first, second) if won is None else (first, second)[won]
    (a, b), (d, c) = (points_of(leg, sides) for leg in legs)
    wins = [_place(legs[0].winner, sides), _place(legs[1].winner, sides[::-1])]
    lead = (a + c - b - d, wins.count(0) - wins.count(1))
    return min(first, second) if lead == (0, 0) else first if lead > (0, 0) else second
