"""The match time of what a process has noted by its own clock."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.localisation.clock import CLOCK_WINDOW, ClockOffset


def test_without_a_clock_message_there_is_no_match_time() -> None:
    assert ClockOffset().match_time(5.0) is None


@given(seed=st.integers(0, 10_000), start=st.floats(0.0, 1e6))
def test_late_messages_do_not_count_beside_those_that_are_not(seed: int, start: float) -> None:
    rng, offset = random.Random(seed), ClockOffset()
    arrived = start
    for tick in range(200):
        late = 0.001 if tick % 20 == 0 else rng.uniform(0.001, 0.08)
        arrived = max(arrived, start + 0.02 * tick + late)  # they do not overtake each other
        offset.heard(0.02 * tick, arrived)
    assert offset.match_time(start + 3.0) == pytest.approx(3.0 - 0.001, abs=1e-6)


def test_what_was_heard_long_ago_is_forgotten() -> None:
    """The process' clock runs by a thousandth too fast."""
    offset = ClockOffset()
    for tick in range(5000):
        offset.heard(0.02 * tick, 7.0 + 0.02 * tick * 1.001)
    now = 7.0 + 100.0 * 1.001
    assert offset.match_time(now) == pytest.approx(100.0, abs=1.5 * CLOCK_WINDOW * 0.001)


def followed(begin: float) -> ClockOffset:
    """A match clock that was heard for two seconds, from 50 s of the process' clock on."""
    offset = ClockOffset()
    for tick in range(100):
        offset.heard(begin + 0.02 * tick, 50.0 + 0.02 * tick)
    return offset


def test_a_match_clock_that_stands_still_for_a_while_is_followed_at_once() -> None:
    offset = followed(0.0)
    offset.heard(2.0, 57.0)
    assert offset.match_time(57.0) == pytest.approx(2.0)


def test_one_that_is_held_up_on_its_way_is_followed_by_those_that_are_not() -> None:
    offset = followed(0.0)
    offset.heard(2.0, 53.5)
    offset.heard(3.5, 53.51)
    assert offset.match_time(53.5) == pytest.approx(3.49)


def test_a_clock_that_steps_back_begins_anew() -> None:
    offset = followed(10.0)
    offset.heard(4.0, 52.0)
    assert offset.match_time(52.5) == pytest.approx(4.5)
