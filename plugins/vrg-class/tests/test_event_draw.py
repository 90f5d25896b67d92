"""The draw of a qualification: all play equally often, in both colours, against as many as possible, with breaks."""

from collections import Counter

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from vrg_class.event.draw import draw, longest_break

TEAMS = st.integers(2, 64)
EACH = st.integers(1, 20)
FEW = settings(max_examples=25, deadline=None)
"""The largest draws take tenths of a second."""


def shortest_break(matches: list[tuple[int, int]]) -> int:
    """The smallest number of matches between two of the same team; a large one if none plays twice."""
    last: dict[int, int] = {}
    shortest = len(matches) + 1000
    for number, pair in enumerate(matches):
        for team in pair:
            if team in last:
                shortest = min(shortest, number - last[team] - 1)
            last[team] = number
    return shortest


@FEW
@given(TEAMS, EACH)
@example(3, 1)
@example(63, 19)
def test_each_team_plays_equally_often_but_for_the_first_one_where_it_must(teams: int, each: int) -> None:
    played = Counter(team for pair in draw(teams, each) for team in pair)
    assert played == dict.fromkeys(range(teams), each) | {0: each + teams * each % 2}


@FEW
@given(TEAMS, EACH)
@example(3, 20)
def test_nobody_meets_another_one_again_before_it_has_met_all(teams: int, each: int) -> None:
    met = [dict.fromkeys((b for b in range(teams) if b != a), 0) for a in range(teams)]
    for a, b in draw(teams, each):
        assert met[a][b] == min(met[a].values())
        assert met[b][a] == min(met[b].values())
        met[a][b] += 1
        met[b][a] += 1


@FEW
@given(TEAMS, EACH)
@example(2, 20)
def test_the_colours_of_a_team_differ_by_one_match_at_most_at_any_time(teams: int, each: int) -> None:
    ahead = [0] * teams
    for first, second in draw(teams, each):
        ahead[first] += 1
        ahead[second] -= 1
        assert max(map(abs, ahead)) <= 1


@FEW
@given(TEAMS, EACH)
@example(4, 3)
@example(63, 4)
@example(63, 13)
@example(19, 17)
@example(23, 20)
def test_breaks_are_as_long_as_can_be_or_nearly_so(teams: int, each: int) -> None:
    shorter = 0 if teams % 2 == 0 or each <= 4 else 1 if each <= 13 else 2
    assert shortest_break(draw(teams, each)) >= longest_break(teams) - shorter


@pytest.mark.parametrize("each", range(2, 11))
@pytest.mark.parametrize("teams", range(4, 25, 2))
def test_no_break_of_an_even_number_of_teams_is_longer_than_others_by_more_than_two(teams: int, each: int) -> None:
    last: dict[int, int] = {}
    for number, pair in enumerate(draw(teams, each)):
        for team in pair:
            assert number - last.get(team, number - teams // 2) - 1 <= longest_break(teams) + 2
            last[team] = number


def test_two_teams_change_their_colours_each_time() -> None:
    assert draw(2, 4) in ([(0, 1), (1, 0)] * 2, [(1, 0), (0, 1)] * 2)


def test_a_draw_is_always_the_same() -> None:
    assert draw(7, 3) == draw(7, 3)
    assert draw(6, 2) == draw(6, 2)


@pytest.mark.parametrize(("teams", "each"), [(1, 3), (65, 3), (8, 0), (8, 21)])
def test_numbers_out_of_range_are_refused(teams: int, each: int) -> None:
    with pytest.raises(ValueError, match="expected 2 to 64 teams"):
        draw(teams, each)
