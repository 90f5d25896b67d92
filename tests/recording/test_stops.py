"""How long robots took to stop, and how far they rolled: the pure core, on tracks that are made up."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vrg.recording.stops import (
    Incident,
    IncidentKind,
    Rest,
    StopOutcome,
    Trajectory,
    rests_of,
    stop_of,
    stops_of,
    worst,
)

TICK = 0.02


def braking(
    v: float, slow: float, at: float, *, every: float = 0.1, until: float = 10.0, again: float = math.inf
) -> Trajectory:
    """A robot that drives along x at v m/s, brakes by slow m/s^2 at a time, and drives on at another one."""
    end = at + v / slow

    def x(t: float) -> float:
        braked = min(max(t - at, 0.0), v / slow)
        return v * min(t, at) + v * braked - slow * braked**2 / 2 + v * max(0.0, t - again)

    def speed(t: float) -> float:
        return v if t < at or t >= again else max(0.0, v - slow * (t - at))

    times = np.arange(0.0, until, every).tolist()
    begin = math.ceil(end / TICK - 1e-9) * TICK
    return Trajectory(
        "ann", False, times, [x(t) for t in times], [0.0] * len(times), [speed(t) for t in times],
        [Rest(begin, again, TICK)],
    )  # fmt: skip


def halt(time: float, until: float = math.inf, robots: frozenset[str] | None = None) -> Incident:
    return Incident(IncidentKind.HALT, "play is halted", time, until, robots=robots)


def test_a_robot_that_brakes_stops_after_as_long_and_as_far_as_it_brakes() -> None:
    stop = stop_of(0, halt(3.0), braking(1.0, 2.0, 3.0))
    assert (stop.outcome, stop.moved) == (StopOutcome.STOPPED, True)
    assert stop.seconds == pytest.approx(0.5)
    assert stop.distance == pytest.approx(0.25, abs=0.003)
    assert stop.speed == pytest.approx(1.0)
    assert stop.resolution == pytest.approx(TICK)
    assert (stop.gap, stop.again) == (0.0, None)


def along(x: Callable[[float], float], moves: Callable[[float], bool], *rests: Rest, until: float = 6.0) -> Trajectory:
    """A robot that is at x m along a line, and drives at 1 m/s when it moves."""
    times = np.arange(0.0, until, 0.02).tolist()
    return Trajectory(
        "bob", False, times, [x(t) for t in times], [0.0] * len(times), [float(moves(t)) for t in times], list(rests)
    )


BRAKES, DRIVES_ON = braking(1.0, 2.0, 3.0), braking(1.0, 2.0, 3.0, again=6.0)
TURNS_ROUND = along(lambda t: abs(t - 3.0), lambda t: True, Rest(2.98, 3.02), Rest(4.0))
SETS_OFF = along(lambda t: max(0.0, min(t, 3.5) - 3.0), lambda t: 3.0 <= t < 3.5, Rest(0.0, 3.0), Rest(3.5))
UNNOTICED = halt(3.0, until=6.5)
OUTCOMES: dict[str, tuple[Incident, Trajectory, StopOutcome, float, float]] = {
    "it stood already": (halt(5.0), BRAKES, StopOutcome.STOOD, 0.0, 0.0),
    "it never stood before play went on": (halt(3.0, until=3.3), BRAKES, StopOutcome.PLAYED_ON, 0.3, 0.21),
    "the recording ends before it stood": (halt(3.0), braking(1.0, 0.1, 3.0, until=5.0), StopOutcome.CUT, 1.9, 1.72),
    "it moves again before play goes on": (halt(3.0, until=9.0), DRIVES_ON, StopOutcome.MOVED_AGAIN, 6.0, 3.25),
    "it moves again as play goes on": (halt(3.0, until=6.0), DRIVES_ON, StopOutcome.STOPPED, 0.5, 0.25),
    "play may have gone on before": (replace(UNNOTICED, soonest=5.9), DRIVES_ON, StopOutcome.STOPPED, 0.5, 0.25),
    "play went on after": (replace(UNNOTICED, soonest=6.4), DRIVES_ON, StopOutcome.MOVED_AGAIN, 3.5, 0.75),
    "its speed passes zero as it turns round": (halt(2.5), TURNS_ROUND, StopOutcome.STOPPED, 1.5, 1.5),
    "it is still at rest and moves then": (halt(2.9), SETS_OFF, StopOutcome.STOPPED, 0.6, 0.5),
}
"""How an incident ended for a robot, after how long, and the way that it went until then, not how far it then was."""


@pytest.mark.parametrize(("incident", "motion", "outcome", "seconds", "distance"), OUTCOMES.values(), ids=OUTCOMES)
def test_how_a_robot_stopped(
    incident: Incident, motion: Trajectory, outcome: StopOutcome, seconds: float, distance: float
) -> None:
    stop = stop_of(0, incident, motion)
    assert (stop.outcome, stop.moved) == (outcome, outcome is not StopOutcome.STOOD)
    assert stop.seconds == pytest.approx(seconds)
    assert stop.distance == pytest.approx(distance, abs=0.03)
    assert (stop.again is None) == (outcome is not StopOutcome.MOVED_AGAIN)


@given(v=st.floats(0.1, 3.0), slow=st.floats(0.5, 8.0), at=st.floats(1.0, 3.0), delay=st.floats(0.0, 0.5))
def test_samples_ten_times_a_second_give_the_stop_to_a_tick_and_the_way_to_a_centimetre(
    v: float, slow: float, at: float, delay: float
) -> None:
    stop = stop_of(0, halt(at - delay), braking(v, slow, at))
    assert stop.outcome is StopOutcome.STOPPED
    took = delay + v / slow
    assert took - 1e-6 <= stop.seconds <= took + TICK + 1e-6
    # Between two samples the place is taken to lie on a line: with braking it does so to a * dt^2 / 8.
    assert stop.distance == pytest.approx(v * delay + v * v / slow / 2, abs=slow * 0.01 / 8 + v * 0.1)


def test_a_robot_that_stood_already_and_then_drove_on_did_not_stand() -> None:
    motion = along(
        lambda t: min(max(t - 5.4, 0.0), 2.0), lambda t: 5.4 <= t < 7.4,
        Rest(4.0, 5.4, TICK), Rest(7.4, resolution=TICK), until=12.0,
    )  # fmt: skip
    stop = stop_of(0, halt(5.0, until=9.0), motion)
    assert (stop.outcome, stop.moved) == (StopOutcome.MOVED_AGAIN, True)
    assert (stop.again, stop.seconds) == (pytest.approx(0.4), pytest.approx(2.4)), "up to the last time that it stood"
    assert stop.distance == pytest.approx(2.0)
    assert stop.resolution == pytest.approx(TICK)
    slower = stop_of(1, halt(3.0), braking(1.0, 0.2, 3.0))
    assert slower.seconds > stop.seconds
    assert worst([slower, stop]) is stop, "what had stopped it no longer held it"


def test_who_was_not_seen_to_move_before_play_went_on_has_not_moved_again() -> None:
    motion = Trajectory("bob", False, [5.0, 5.1, 5.8, 7.2, 7.3], [0.0, 0.0, 0.0, 0.1, 0.2], [0.0] * 5,
                    [0.0, 0.0, 0.0, 0.7, 0.7], [Rest(4.0, 5.8)])  # fmt: skip
    assert stop_of(0, halt(5.0, until=7.0), motion).outcome is StopOutcome.STOOD
    assert stop_of(0, halt(5.0, until=7.3), motion).outcome is StopOutcome.MOVED_AGAIN


@pytest.mark.parametrize("time", [-1.0, 12.0])
def test_what_was_not_recorded_is_not_known(time: float) -> None:
    assert stop_of(0, halt(time), braking(1.0, 2.0, 3.0)).outcome is StopOutcome.UNKNOWN
    assert stop_of(0, halt(time), Trajectory("ann")).outcome is StopOutcome.UNKNOWN


def test_a_gap_in_the_recording_is_told() -> None:
    motion = Trajectory("ann", False, [0.0, 1.0, 3.0, 4.0], [0.0, 1.0, 1.4, 1.4], [0.0] * 4, [1.0, 1.0, 0.0, 0.0],
                    [Rest(1.5, resolution=TICK)])  # fmt: skip
    stop = stop_of(0, halt(1.2), motion)
    assert stop.seconds == pytest.approx(0.3)
    assert stop.gap == pytest.approx(2.0)
    assert stop.distance == pytest.approx(0.4 * 0.3 / 0.5)


def test_only_the_robots_of_an_incident_are_looked_at_in_the_order_of_names() -> None:
    ann, bob = braking(1.0, 2.0, 3.0), Trajectory("bob")
    stops = stops_of([halt(3.0), halt(4.0, robots=frozenset(["ann"])), halt(5.0, robots=frozenset())], [bob, ann])
    assert [(stop.incident, stop.robot) for stop in stops] == [(0, "ann"), (0, "bob"), (1, "ann")]


def test_the_worst_stop_is_the_longest_one_of_those_that_moved() -> None:
    stops = stops_of([halt(5.0), halt(3.0), halt(2.8)], [braking(1.0, 2.0, 3.0)])
    found = worst(stops)
    assert found is not None
    assert found.incident == 2
    assert worst([stops[0]]) is None
    assert worst([]) is None


def test_rests_are_found_from_samples_alone_with_their_resolution() -> None:
    times = [0.0, 0.1, 0.2, 0.3, 0.5, 0.6]
    assert rests_of(times, [True, True, False, True, False, True]) == [
        Rest(0.0, 0.2, 0.0),
        Rest(0.3, 0.5, pytest.approx(0.1)),
        Rest(0.6, math.inf, pytest.approx(0.1)),
    ]
    assert rests_of([], []) == []


@st.composite
def motions(draw: st.DrawFn) -> Trajectory:
    """Any motion, with any times of rest in which the place does not change."""
    steps = draw(st.lists(st.floats(0.02, 1.0), min_size=2, max_size=30))
    times = np.cumsum([0.0, *steps]).tolist()
    resting = draw(st.lists(st.booleans(), min_size=len(times), max_size=len(times)))
    x, y = [0.0], [0.0]
    move = st.floats(-2.0, 2.0)
    for still, before in zip(resting[1:], resting, strict=False):
        stays = still and before
        x.append(x[-1] if stays else x[-1] + draw(move))
        y.append(y[-1] if stays else y[-1] + draw(move))
    return Trajectory("ann", False, times, x, y, [0.0 if r else 1.0 for r in resting], rests_of(times, resting))


@given(motion=motions(), share=st.floats(0.0, 1.0), lasts=st.floats(0.0, 20.0))
def test_the_way_is_never_shorter_than_the_distance_of_its_ends(motion: Trajectory, share: float, lasts: float) -> None:
    onset = share * motion.times[-1]
    stop = stop_of(0, halt(onset, onset + lasts), motion)
    end = onset + stop.seconds
    assert stop.distance >= math.dist(motion.place(onset), motion.place(min(end, motion.times[-1]))) - 1e-9
    assert stop.seconds <= max(lasts, 1e-6) + 1e-6
    assert (stop.distance == 0.0) or stop.moved


@given(motion=motions(), share=st.floats(0.0, 1.0))
def test_an_earlier_incident_never_has_an_earlier_end(motion: Trajectory, share: float) -> None:
    onset = share * motion.times[-1]
    assume(onset > 0.1)
    stop, before = stop_of(0, halt(onset), motion), stop_of(0, halt(onset - 0.1), motion)
    if stop.outcome is StopOutcome.STOPPED and before.outcome is StopOutcome.STOPPED:
        assert onset - 0.1 + before.seconds <= onset + stop.seconds + 1e-6


@given(motion=motions(), share=st.floats(0.0, 1.0), dx=st.floats(-50, 50), angle=st.floats(-3, 3))
def test_where_the_field_lies_does_not_matter(motion: Trajectory, share: float, dx: float, angle: float) -> None:
    c, s = math.cos(angle), math.sin(angle)
    moved = Trajectory(
        "ann", False, motion.times,
        [dx + c * x - s * y for x, y in zip(motion.x, motion.y, strict=True)],
        [s * x + c * y for x, y in zip(motion.x, motion.y, strict=True)], motion.v, motion.rests,
    )  # fmt: skip
    onset = share * motion.times[-1]
    a, b = stop_of(0, halt(onset), motion), stop_of(0, halt(onset), moved)
    assert (a.outcome, a.seconds) == (b.outcome, b.seconds)
    assert a.distance == pytest.approx(b.distance, abs=1e-6)


@given(motion=motions(), time=st.floats(0.0, 1.0))
def test_a_place_lies_between_the_places_around_it(motion: Trajectory, time: float) -> None:
    t = time * motion.times[-1]
    after = min(int(np.searchsorted(motion.times, t)), len(motion.times) - 1)
    ends = [(motion.x[i], motion.y[i]) for i in (max(0, after - 1), after)]
    place = motion.place(t)
    assert math.dist(ends[0], place) + math.dist(place, ends[1]) == pytest.approx(math.dist(*ends), abs=1e-6)
