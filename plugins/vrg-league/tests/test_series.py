"""Which games are played, which count, and when a series is decided."""

import random

from hypothesis import given, settings
from hypothesis import strategies as st

from vrg_league.games import Pairing
from vrg_league.report import sentence
from vrg_league.series import Series

POINTS = st.lists(st.sampled_from([0.0, 0.5, 1.0]), min_size=40, max_size=40)


def finished(points: list[float], *, jobs: int, seed: int = 0, play_all: bool = False) -> Series:
    """A series of which so many games are played at a time, any of which may finish first."""
    series = Series(len(points) // 2, 0.95, play_all=play_all)
    rng = random.Random(seed)
    running: list[int] = []
    while True:
        while len(running) < jobs and (number := series.upcoming) is not None:
            series.begin()
            running.append(number)
        if not running:
            return series
        done = running.pop(rng.randrange(len(running)))
        series.add(done, points[done])


@settings(max_examples=25)
@given(POINTS, st.integers(1, 8), st.integers(0, 99))
def test_how_many_games_are_played_at_a_time_changes_nothing(points: list[float], jobs: int, seed: int) -> None:
    assert finished(points, jobs=jobs, seed=seed).standings == finished(points, jobs=1).standings


def test_it_stops_as_soon_as_one_is_better() -> None:
    series = finished([1.0] * 40, jobs=1)
    assert series.over
    assert series.standing is not None
    assert series.standing.decided
    assert series.counted == 16
    assert series.upcoming is None


def test_all_games_count_if_that_is_wanted() -> None:
    assert finished([1.0] * 40, jobs=3, play_all=True).counted == 40


def test_equal_strategies_play_all_games_and_nothing_is_decided() -> None:
    series = finished([1.0, 0.0] * 20, jobs=2)
    assert series.counted == 40
    assert series.standing is not None
    assert not series.standing.decided
    assert series.standings[-1].share == 0.5


def test_a_pair_counts_only_once_all_pairs_before_it_are_there() -> None:
    series = Series(5, 0.95, play_all=True)
    for number in (2, 3, 0):
        series.add(number, 1.0)
    assert series.counted == 0
    series.add(1, 1.0)
    assert series.counted == 4


def test_games_that_were_played_before_are_not_played_again() -> None:
    series = Series(3, 0.95, play_all=True)
    for number in (0, 1, 3):
        series.add(number, 0.5)
    assert series.upcoming == 2
    series.begin()
    assert series.upcoming == 4


def said(points: list[float]) -> str:
    return sentence(Pairing("ann", "bob"), finished(points, jobs=1), 0.95)


def test_a_few_games_that_are_all_won_are_no_proof_but_it_is_said_how_many_more_would_be_one() -> None:
    assert said([1.0] * 8) == (
        "not proved yet: ann has 100 % of 8 games, 95 % interval 29 to 100 %; "
        "8 more games like these would prove that it is better"
    )
    assert said([0.0] * 2).startswith("not proved yet: bob has 100 % of 2 games")
    assert "; 14 more games like these" in said([0.0] * 2)
    assert said([1.0] * 16).startswith("ann beats bob: 100 % of 16 games")
    assert said([1.0, 0.0] * 20).startswith("no difference was found between ann and bob: ann has 50 % of 40 games")
    assert said([1.0, 0.0, 1.0, 1.0] * 4).startswith("not proved yet: ann has 75 % of 16 games")
    assert said([1.0, 0.0, 1.0, 0.0, 1.0, 1.0] * 2).startswith("no difference was found"), "more than as many again"
    assert said([0.5] * 60 + [0.0, 0.5]).startswith("no difference was found")
