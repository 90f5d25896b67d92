"""The match time of what a process has noted by its own clock, and how that clock runs."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.bus.clock_tracker import (
    CLOCK_WINDOW,
    DRIFT_SAMPLES,
    INTERVAL,
    MIN_INTERVALS,
    ClockEstimate,
    ClockOffset,
    ClockTracker,
)

TICK = 0.02


def arrivals(
    seconds: float, *, rate: float = 1.0, drift: float = 0.0, delay: float = 0.01, jitter: float = 0.0, seed: int = 1
) -> ClockTracker:
    """A tracker that has heard a clock over a link, by a clock that runs faster by `drift`."""
    tracker, chance = ClockTracker(), random.Random(seed)
    for tick in range(int(seconds * rate / TICK)):
        match_time = tick * TICK
        real = match_time / rate + delay + chance.random() * jitter
        tracker.heard(match_time, rate, 5000.0 + real * (1.0 + drift))
    return tracker


def estimated(tracker: ClockTracker) -> ClockEstimate:
    found = tracker.estimate()
    assert found is not None
    return found


def test_nothing_is_known_before_the_first_message_nor_without_a_pace() -> None:
    tracker = ClockTracker()
    assert tracker.estimate() is None
    tracker.heard(1.0, 0.0, 5000.0)
    assert tracker.estimate() is None


@given(
    drift=st.floats(-2e-4, 2e-4),
    rate=st.sampled_from([0.5, 1.0, 2.0]),
    delay=st.floats(0.0, 0.3),
    seed=st.integers(0, 9),
)
def test_the_drift_is_found_through_the_jitter_of_a_link(drift: float, rate: float, delay: float, seed: int) -> None:
    seconds = (DRIFT_SAMPLES + 2) * INTERVAL
    tracker = arrivals(seconds, rate=rate, drift=drift, delay=delay, jitter=0.004, seed=seed)
    assert estimated(tracker).drift == pytest.approx(drift, abs=4e-5)


def test_a_drift_is_not_guessed_from_too_little() -> None:
    assert estimated(arrivals((MIN_INTERVALS - 1) * INTERVAL, drift=1e-4, delay=0.0)).drift is None


def test_a_message_is_late_by_how_much_longer_it_took_than_the_fastest() -> None:
    tracker = arrivals(5.0)
    tracker.estimate()
    tracker.heard(5.0, 1.0, 5005.01 + 0.2)
    tracker.heard(5.12, 1.0, 5005.13 + 0.1)
    assert estimated(tracker).late == pytest.approx(0.15, abs=1e-6)
    assert tracker.estimate() is None, "nothing has come since"


def test_a_longer_way_is_forgotten_when_it_has_lasted() -> None:
    tracker = arrivals(5.0)
    for tick in range(int(3 * INTERVAL / TICK)):
        tracker.estimate()
        tracker.heard(5.0 + tick * TICK, 1.0, 5005.0 + tick * TICK + 0.11)
    assert estimated(tracker).late == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("match_time", "rate"), [(1.0, 1.0), (5.1, 2.0)], ids=["back in time", "another pace"])
def test_a_restarted_world_makes_nobody_late(match_time: float, rate: float) -> None:
    tracker = arrivals(5.0)
    tracker.heard(match_time, rate, 5009.0)
    estimate = estimated(tracker)
    assert (estimate.late, estimate.drift) == (0.0, None)


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
