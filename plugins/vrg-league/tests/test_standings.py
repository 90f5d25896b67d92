"""The leaderboard and the schedule of a tournament, as tables of texts."""

import math
from itertools import combinations

import pytest
from test_matchmaking import game

from vrg_league.games import Pairing
from vrg_league.report import lasting, pairings, schedule
from vrg_league.series import Series
from vrg_league.standings import board, ranking, ratings, to_play

NAMES = ["Anna Maria", "bob", "cem"]


def test_strategies_are_ranked_with_what_they_won_and_have_still_to_play() -> None:
    rows = [game("Anna Maria", "bob", 0, 0.0), game("Anna Maria", "bob", 1, 0.5)]
    rows += [game("bob", "bob", number, 1.0) for number in (0, 1)]
    series = {Pairing(a, b): Series(3, 0.95, play_all=True) for a, b in (("Anna Maria", "bob"), ("bob", "cem"))}
    for row in rows[:2]:
        series[row.game.pairing].add(row.game.number, row.points)
    head, *lines = board(ratings(NAMES, rows), rows, to_play(series))
    assert head[:2] == ["rank", "strategy"]
    assert [line[1] for line in lines] == ["bob", "cem", "Anna Maria"]
    assert lines[0][4:] == ["1.5", "1", "1", "0", "2", "10"]
    assert lines[1] == ["-", "cem", "1500", "572", "0", "0", "0", "0", "0", "6"]
    assert lines[2][4:] == ["0.5", "0", "1", "1", "2", "4"]


def test_equal_results_are_equal_ratings_in_any_order_of_the_games() -> None:
    rows = [game(*names, number, 1.0 - number) for names in combinations(NAMES, 2) for number in (0, 1)]
    rated = ratings(NAMES, rows)
    assert [line[0] for line in board(rated, rows)[1:]] == ["1", "1", "1"]
    assert ranking(rated) == "1. Anna Maria, 1. bob, 1. cem"
    assert ratings(NAMES, reversed(rows)) == rated


def test_ratings_are_those_under_which_the_results_are_most_likely() -> None:
    """Ten wins of eleven are 400 points, but for the prior; many games outweigh it, and shrink the interval."""
    few, many = (
        ratings(["bob", "cem"], [game("bob", "cem", n, 0.0 if n % 11 == 0 else 1.0) for n in range(count)])
        for count in (11, 11_000)
    )
    assert many[0].value - many[1].value == pytest.approx(400.0, abs=1.0)
    assert many[0].value + many[1].value == pytest.approx(3000.0)
    assert 200.0 < few[0].value - few[1].value < 400.0
    # A game has the information p (1 - p) about the difference, whose half each rating is from the mean.
    expected = 400 / math.log(10) / 2 / math.sqrt(11_000 * 10 / 121)
    assert [rating.sigma for rating in many] == pytest.approx([expected, expected], rel=0.01)
    assert few[0].sigma > 10 * many[0].sigma


def test_the_schedule_tells_the_games_between_whom_and_how_long() -> None:
    series = {Pairing("Anna Maria", "bob"): Series(5, 0.95, play_all=True)}
    assert schedule(series, 2, None) == (
        "at most 10 games of 1 pairing, 2 at a time: the first games will show how long that takes"
    )
    assert schedule(series, 2, None, minute=12.0).endswith(": about 60 s for each minute that a game lasts")
    assert schedule(series, 2, 754.0) == "at most 10 games of 1 pairing, 2 at a time: about 13 min"
    assert pairings(series)[1] == ["Anna Maria", "bob", "0", "10"]


@pytest.mark.parametrize(
    ("seconds", "words"), [(40.2, "40 s"), (90, "2 min"), (3599, "1 h 0 min"), (7500, "2 h 5 min")]
)
def test_times_are_read_easily(seconds: float, words: str) -> None:
    assert lasting(seconds) == words
