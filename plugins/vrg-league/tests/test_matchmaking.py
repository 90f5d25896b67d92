"""The choice of the next games of a league, and the ratings that follow from all games in whatever order."""

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg_league.games import OVER, GameRecord, Pairing, Played, ScheduledGame
from vrg_league.league.matchmaking import next_pairing
from vrg_league.standings import _POINTS, SPREAD, Fit, fit, rated, ratings

NAMES = ["ann.1", "ann.2", "bob.1", "cem.1", "dora.1"]


def game(first: str, second: str, number: int, points: float) -> GameRecord:
    scheduled = ScheduledGame(
        pairing=Pairing(first, second), number=number, seed=0, first_team="red", second_team="blue"
    )
    winner = {1.0: "red", 0.0: "blue"}.get(points, "draw")
    return GameRecord(game=scheduled, played=Played(ended=OVER, winner=winner), teams={})


GAMES = st.lists(
    st.tuples(st.sampled_from(list(combinations(NAMES, 2))), st.sampled_from([0.0, 0.5, 1.0])), max_size=60
).map(lambda found: [game(*names, number, points) for number, (names, points) in enumerate(found)])


@given(rows=GAMES, data=st.data())
def test_the_order_of_the_games_changes_no_rating_and_no_choice(rows: list[GameRecord], data: st.DataObject) -> None:
    shuffled = data.draw(st.permutations(rows))
    assert ratings(NAMES, shuffled) == ratings(NAMES, rows)
    assert next_pairing(fit(NAMES, shuffled), NAMES) == next_pairing(fit(NAMES, rows), NAMES)


def total(found: Fit, among: list[str], information: np.ndarray) -> float:
    covariance = found.centred @ np.linalg.inv(information) @ found.centred
    return float(sum(covariance[found.labels.index(name), found.labels.index(name)] for name in among))


@given(rows=GAMES)
def test_no_other_pair_of_games_makes_the_ratings_more_certain(rows: list[GameRecord]) -> None:
    """Against what comes out if the information of each possible pair of games is added, and the matrix inverted."""
    found, among = fit(NAMES, rows), NAMES[1:]
    information = np.linalg.inv(found.covariance)
    left = {}
    for first, second in combinations(among, 2):
        i, j = NAMES.index(first), NAMES.index(second)
        d = np.zeros(len(NAMES))
        d[i], d[j] = 1.0, -1.0
        left[Pairing(first, second)] = total(found, among, information + 2 * found.certainty[i, j] * np.outer(d, d))
    chosen = next_pairing(found, among)
    assert chosen is not None
    assert left[chosen] == pytest.approx(min(left.values()), rel=1e-6)


def test_everybody_plays_before_anybody_plays_again() -> None:
    names = [f"player {number:02}.1" for number in range(8)]
    rows: list[GameRecord] = []
    for number in range(4):
        pairing = next_pairing(fit(names, rows), names)
        assert pairing is not None
        rows += [game(*pairing.labels, 2 * number + side, 0.5) for side in (0, 1)]
    assert sorted(name for row in rows[::2] for name in row.game.pairing.labels) == names


@given(points=st.lists(st.sampled_from([0.0, 0.5, 1.0]), min_size=30, max_size=30), count=st.integers(2, 5))
def test_nobody_plays_again_before_everybody_else_has_played_as_often(points: list[float], count: int) -> None:
    rows: list[GameRecord] = []
    turns: Counter[str] = Counter()
    for number, result in enumerate(points):
        pairing = next_pairing(fit(NAMES, rows), NAMES[:count], turns=turns)
        assert pairing is not None
        turns.update(pairing.labels)
        rows.append(game(*pairing.labels, number, result))
        played = [turns[name] for name in NAMES[:count]]
        assert max(played) - min(played) <= 1, turns


def test_a_new_version_plays_first_against_one_that_is_about_as_strong() -> None:
    known = NAMES[:4]
    rows = [
        game(first, second, number, 1.0 if number % 4 else 0.0)
        for first, second in combinations(known, 2)
        for number in range(40)
    ]
    strengths = {rating.label: rating.value for rating in ratings(NAMES, rows)}
    chosen = next_pairing(fit(NAMES, rows), NAMES)
    assert chosen is not None
    assert "dora.1" in chosen.labels
    [other] = set(chosen.labels) - {"dora.1"}
    assert abs(strengths[other] - 1500.0) == min(abs(strengths[name] - 1500.0) for name in known)


def test_games_that_are_being_played_are_reckoned_with() -> None:
    found = fit(NAMES, [])
    first = next_pairing(found, NAMES)
    assert first is not None
    second = next_pairing(found, NAMES, [first, first])
    assert second is not None
    assert not {*first.labels} & {*second.labels}


def test_a_version_that_does_not_play_any_more_is_not_chosen_but_counts() -> None:
    rows = [game("ann.1", "bob.1", number, 1.0) for number in range(10)]
    chosen = next_pairing(fit(NAMES, rows), ["bob.1", "cem.1"])
    assert chosen == Pairing("bob.1", "cem.1")
    assert rated(fit(NAMES, rows))[0].label == "ann.1"


def test_fewer_than_two_play_nothing() -> None:
    assert next_pairing(fit(["ann.1"], []), ["ann.1"]) is None
    assert next_pairing(fit([], []), []) is None


def test_the_prior_alone_is_the_covariance_without_games() -> None:
    assert fit(NAMES, []).covariance == pytest.approx(np.eye(len(NAMES)) * (SPREAD / _POINTS) ** 2)
