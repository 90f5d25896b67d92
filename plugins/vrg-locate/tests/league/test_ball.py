"""Which of several balls in a picture is the one of the match."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.bus.messages import LOST
from vrg.localisation.thing import FASTEST, SLACK
from vrg_locate.ssl.ball import likely_ball
from vrg_locate.ssl.packets import SeenBall

SPARE = SeenBall(3.0, 2.2, 0.95)
"""A ball that lies beside the field all the time."""


def test_of_two_that_are_equally_near_it_is_the_one_that_the_sender_is_surer_of() -> None:
    one, other = SeenBall(-1.0, 0.0, 0.6), SeenBall(1.0, 0.0, 0.8)
    assert likely_ball([one, other], SeenBall(0.0, 0.0), math.inf) == other
    assert likely_ball([one, SeenBall(2.0, 0.0, 0.8)], SeenBall(0.0, 0.0), math.inf) == one
    assert likely_ball([], one, math.inf) is None


def test_one_that_is_near_the_last_place_is_more_likely_than_a_surer_one_elsewhere() -> None:
    last, near = SeenBall(0.0, 0.0), SeenBall(0.1, 0.0, 0.5)
    assert likely_ball([SeenBall(2.0, 0.0, 1.0), near], last, 0.3) == near
    assert likely_ball([SeenBall(0.2, 0.0, 0.9), near], last, 0.3) == SeenBall(0.2, 0.0, 0.9), "both are near"


def test_a_ball_that_rolls_past_a_spare_one_is_followed_and_the_spare_one_not_taken_while_it_is_hidden() -> None:
    last, seen_at, others = SeenBall(0.0, 1.7), -math.inf, []
    for number in range(120):
        time = number / 60.0
        ball = SeenBall(3.0 * time, 1.7, 0.7)
        hidden = 40 <= number < 65
        shown = [SPARE] if hidden else [SPARE, ball]
        found = likely_ball(shown, last, time - seen_at, others)
        assert found == (None if hidden else ball)
        if found is not None:
            last, seen_at, others = found, time, [SPARE]


def test_one_that_was_not_seen_for_long_may_be_anywhere() -> None:
    last = SeenBall(-4.0, 0.0)
    assert likely_ball([SPARE], last, 0.1) is None
    assert likely_ball([SPARE], last, LOST + 0.01) == SPARE


@pytest.mark.parametrize("since", [-0.05, 0.0, 0.1])
def test_it_can_have_come_only_so_far(since: float) -> None:
    reach = FASTEST * max(0.0, since) + SLACK
    last = SeenBall(1.0, 1.0)
    assert likely_ball([SeenBall(1.0 + reach - 1e-6, 1.0)], last, since) is not None
    assert likely_ball([SeenBall(1.0 + reach + 1e-6, 1.0)], last, since) is None


places = st.builds(SeenBall, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(0.0, 1.0))


@given(st.lists(places, max_size=6), places, st.floats(-0.1, 1.0))
def test_it_is_always_one_of_those_that_are_seen_and_the_order_decides_nothing(
    balls: list[SeenBall], last: SeenBall, since: float
) -> None:
    found = likely_ball(balls, last, since)
    assert found is None or found in balls
    other = likely_ball(balls[::-1], last, since)
    assert (found is None) is (other is None)
    if found is not None and other is not None:
        left = [ball.confidence - math.dist((ball.x, ball.y), (last.x, last.y)) for ball in (found, other)]
        assert left[0] == pytest.approx(left[1])
