"""The ranking of a qualification."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg_class.event.ranking import Result, Row, ranking

NAMES = ("Ann", "Bob", "Cid", "Dee")


def won(first: str, second: str, points: tuple[int, int] = (1, 0)) -> Result:
    return Result(first, second, points, 0)


def drawn(first: str, second: str, points: int = 0) -> Result:
    return Result(first, second, (points, points), None)


def order(*results: Result, names: tuple[str, ...] = NAMES) -> list[tuple[int, str]]:
    return [(row.place, row.name) for row in ranking(names, results)]


def test_a_row_counts_what_there_was() -> None:
    results = [Result("Ann", "Bob", (3, 1), 0), Result("Bob", "Ann", (2, 2), None), Result("Bob", "Ann", (0, 4), 0)]
    assert ranking(("Ann", "Bob"), results) == [
        Row(1, "Ann", played=3, wins=1, draws=1, losses=1, points=3, difference=6, score=9),
        Row(2, "Bob", played=3, wins=1, draws=1, losses=1, points=3, difference=-6, score=3),
    ]


def test_one_match_more_is_no_advantage() -> None:
    assert order(won("Ann", "Dee"), won("Bob", "Cid"), drawn("Ann", "Cid"))[:2] == [(1, "Bob"), (2, "Ann")]


def test_the_difference_per_match_goes_before_the_score_per_match() -> None:
    assert order(won("Ann", "Cid", (9, 8)), won("Bob", "Dee", (3, 1)))[0] == (1, "Bob")
    assert order(won("Ann", "Cid", (2, 1)), won("Bob", "Dee", (4, 3)))[0] == (1, "Bob")
    # Twice by 2 is less than once by 3.
    assert order(won("Ann", "Cid", (2, 0)), won("Ann", "Dee", (2, 0)), won("Bob", "Dee", (3, 0)))[0] == (1, "Bob")


def test_who_has_won_against_an_equal_one_is_before_it() -> None:
    equal = (won("Bob", "Ann"), won("Ann", "Cid"), won("Cid", "Bob", (1, 0)))
    # All three beat one another in a circle, so nothing decides.
    assert order(*equal, names=("Ann", "Bob", "Cid")) == [(1, "Ann"), (1, "Bob"), (1, "Cid")]
    two = (won("Bob", "Ann"), won("Ann", "Cid"), won("Dee", "Bob"))
    assert order(*two) == [(1, "Dee"), (2, "Bob"), (3, "Ann"), (4, "Cid")]


def test_without_a_match_between_equal_ones_they_share_a_place_in_the_order_of_the_names() -> None:
    results = (won("Bob", "Cid"), won("Ann", "Dee"))
    assert order(*results) == [(1, "Ann"), (1, "Bob"), (3, "Cid"), (3, "Dee")]
    assert order(*results, names=NAMES[::-1]) == [(1, "Bob"), (1, "Ann"), (3, "Dee"), (3, "Cid")]


def test_equal_ones_of_whom_some_have_not_met_are_not_compared() -> None:
    results = (won("Ann", "Bob"), won("Bob", "Dee"), won("Eve", "Ann"), won("Cid", "Fay"), won("Guy", "Cid"))
    found = order(*results, names=("Ann", "Bob", "Cid", "Dee", "Eve", "Fay", "Guy"))
    assert [place for place, name in found if name in ("Ann", "Bob", "Cid")] == [3, 3, 3]


def test_who_has_not_played_is_behind_all_who_have() -> None:
    assert order(won("Bob", "Dee", (1, 0))) == [(1, "Bob"), (2, "Dee"), (3, "Ann"), (3, "Cid")]
    assert order() == [(1, name) for name in NAMES]


def test_the_name_of_nobody_is_refused() -> None:
    with pytest.raises(ValueError, match="Zoe"):
        ranking(NAMES, [won("Ann", "Zoe")])


RESULTS = st.lists(
    st.builds(
        lambda two, points, winner: Result(*two, points, winner),
        st.permutations(NAMES).map(lambda names: names[:2]),
        st.tuples(st.integers(-3, 9), st.integers(-3, 9)),
        st.sampled_from((0, 1, None)),
    )
)


@given(RESULTS)
def test_sums_agree_and_the_order_of_results_does_not_matter(results: list[Result]) -> None:
    rows = ranking(NAMES, results)
    assert rows == ranking(NAMES, results[::-1])
    assert sorted(row.name for row in rows) == sorted(NAMES)
    assert sum(row.played for row in rows) == sum(row.points for row in rows) == 2 * len(results)
    assert sum(row.difference for row in rows) == 0
    assert all(row.played == row.wins + row.draws + row.losses for row in rows)
    assert [row.place for row in rows] == sorted(row.place for row in rows)
    assert rows[0].place == 1
