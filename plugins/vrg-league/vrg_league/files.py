"""Tables of games and of pairings as CSV and as Parquet."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import csv, parquet

from vrg.errors import LaunchError
from vrg_league.games import GameRecord, Pairing, ScheduledGame
from vrg_league.report import called_rules
from vrg_league.series import Series
from vrg_league.standings import Rating

Columns = dict[str, tuple[Any, list[Any]]]
"""The type and the values of each column."""


def games(rows: Sequence[GameRecord], again: Callable[[ScheduledGame], str]) -> Columns:
    """A row for each game.

    Args:
        again: returns the command that plays a game again.
    """
    columns: Columns = {
        "first": (pa.string(), [row.game.pairing.first for row in rows]),
        "second": (pa.string(), [row.game.pairing.second for row in rows]),
        "game": (pa.int64(), [row.game.number for row in rows]),
        "pair": (pa.int64(), [row.game.pair for row in rows]),
        "seed": (pa.int64(), [row.game.seed for row in rows]),
        "first_team": (pa.string(), [row.game.first_team for row in rows]),
        "second_team": (pa.string(), [row.game.second_team for row in rows]),
        "ended": (pa.string(), [row.played.ended for row in rows]),
        "problem": (pa.string(), [row.played.problem for row in rows]),
        "winning_team": (pa.string(), [row.played.winner for row in rows]),
        "winner": (pa.string(), [row.winner for row in rows]),
        "first_points": (pa.float64(), [row.points for row in rows]),
        "first_score": (pa.int64(), [row.played.score.get(row.game.first_team) for row in rows]),
        "second_score": (pa.int64(), [row.played.score.get(row.game.second_team) for row in rows]),
        "match_time_s": (pa.float64(), [row.played.match_time for row in rows]),
        "play_time_s": (pa.float64(), [row.played.play_time for row in rows]),
        "wall_time_s": (pa.float64(), [row.played.wall_time for row in rows]),
        "disqualified": (pa.string(), [" ".join(row.played.disqualified) for row in rows]),
        "failures": (pa.int64(), [len(row.played.failures) for row in rows]),
    }
    for rule in called_rules(rows):
        columns[f"calls_{rule}"] = (pa.int64(), [row.total(rule) for row in rows])
        for which in ("first", "second"):
            on = [row.calls_on(rule, getattr(row.game.pairing, which)) for row in rows]
            columns[f"calls_{rule}_on_{which}"] = (pa.int64(), on)
    columns["play_again"] = (pa.string(), [again(row.game) for row in rows])
    return columns


def pairings(found: Mapping[Pairing, Series]) -> Columns:
    """A row for each pairing."""
    standings = [series.standing for series in found.values()]
    return {
        "first": (pa.string(), [pairing.first for pairing in found]),
        "second": (pa.string(), [pairing.second for pairing in found]),
        "games": (pa.int64(), [0 if s is None else s.games for s in standings]),
        "share_of_first": (pa.float64(), [None if s is None else s.share for s in standings]),
        "low": (pa.float64(), [None if s is None else s.low for s in standings]),
        "high": (pa.float64(), [None if s is None else s.high for s in standings]),
        "difference_found": (pa.bool_(), [s is not None and s.decided for s in standings]),
    }


def rated(found: Sequence[Rating]) -> Columns:
    """A row for each strategy."""
    return {
        "strategy": (pa.string(), [rating.label for rating in found]),
        "rating": (pa.float64(), [rating.value for rating in found]),
        "sigma": (pa.float64(), [rating.sigma for rating in found]),
    }


def table(columns: Columns) -> pa.Table:
    """The columns as a table of Arrow."""
    return pa.table({column: pa.array(values, kind) for column, (kind, values) in columns.items()})


def write(folder: Path, name: str, columns: Columns) -> None:
    """Write a table as `name.csv` and `name.parquet`.

    Raises:
        LaunchError: it cannot be written.
    """
    found = table(columns)
    try:
        csv.write_csv(found, folder / f"{name}.csv", csv.WriteOptions(quoting_style="needed"))
        parquet.write_table(found, folder / f"{name}.parquet")
    except OSError as error:
        raise LaunchError(f"{folder}: the table {name} cannot be written: {error}") from None
