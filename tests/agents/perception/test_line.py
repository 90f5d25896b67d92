"""The straight course of a robot, fitted to sightings."""

import itertools
import math
import random
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.agents.perception.scenes import covariance_of
from vrg.agents.perception.line import COMMON, SAME_ERROR, TrackedLine, fitted
from vrg.agents.perception.scan import Floats
from vrg.bus.messages import Sighting
from vrg.types import Vector


def sighting(x: float, y: float, time: float, xx: float = 0.01, xy: float = 0.0, yy: float = 0.01) -> Sighting:
    return Sighting(x=x, y=y, time=time, xx=xx, xy=xy, yy=yy)


def spread(line: TrackedLine, time: float) -> Floats:
    """The covariance of the position on a course, shape (2, 2), m^2."""
    xx, xy, yy = line.covariance_at(time)
    return np.array([[xx, xy], [xy, yy]])


def drawn(rng: np.random.Generator, count: int) -> list[Sighting]:
    """Sightings of one straight course in 6 s, each wrong by as much as its own covariance says."""
    made = []
    for time in np.sort(rng.uniform(0.0, 6.0, count)):
        bearing, along, aside = rng.uniform(-math.pi, math.pi), rng.uniform(0.05, 0.3), rng.uniform(0.02, 0.1)
        c, s = math.cos(bearing), math.sin(bearing)
        turn = np.array([[c, -s], [s, c]])
        covariance = turn @ np.diag([along**2, aside**2]) @ turn.T
        x, y = rng.multivariate_normal([1.0 + 0.6 * time, 2.0 - 0.8 * time], covariance)
        made.append(sighting(x, y, float(time), covariance[0, 0], covariance[0, 1], covariance[1, 1]))
    return made


def dense(seen: Sequence[Sighting], time: float, speed: float | None) -> tuple[Floats, Floats]:
    """Weighted least squares of (x, vx, y, vy) with one big block covariance, and the covariance of the result."""
    rows, values = [], []
    for s in seen:
        dt = s.time - time
        rows += [[1.0, dt, 0.0, 0.0], [0.0, 0.0, 1.0, dt]]
        values += [s.x, s.y]
    size = 2 * len(seen) + (0 if speed is None else 2)
    block = np.zeros((size, size))
    for i, s in enumerate(seen):
        block[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = covariance_of(s)
    if speed is not None:
        rows += [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
        values += [0.0, 0.0]
        block[-2:, -2:] = speed**2 * np.eye(2)
    A, W = np.array(rows), np.linalg.inv(block)
    covariance = np.linalg.inv(A.T @ W @ A)
    return covariance @ A.T @ W @ np.array(values), covariance


coordinates = st.floats(-50, 50)
times = st.lists(st.floats(0, 60), min_size=2, max_size=10, unique_by=lambda t: round(t, 1))


@given(times, st.data())
def test_equal_errors_give_the_straight_lines_of_ordinary_least_squares(when: list[float], data: st.DataObject) -> None:
    seen = [sighting(data.draw(coordinates), data.draw(coordinates), t) for t in when]
    line = fitted(seen, time=when[0])
    for axis, values in enumerate(([s.x for s in seen], [s.y for s in seen])):
        slope, intercept = np.polyfit(when, values, 1)
        assert line.velocity[axis] == pytest.approx(slope, rel=1e-6, abs=1e-6)
        assert line.at(0.0)[axis] == pytest.approx(intercept, rel=1e-6, abs=1e-4)
        assert line.at(100.0)[axis] == pytest.approx(intercept + 100.0 * slope, rel=1e-6, abs=1e-4)


@pytest.mark.parametrize("velocity", [(0.0, 1.0), (0.0, -0.7), (1.0, 0.0), (0.0, 0.0), (0.5, 0.5)])
def test_a_course_may_lead_anywhere_also_straight_up_the_map(velocity: Vector) -> None:
    seen = [sighting(3.0 + velocity[0] * t, -1.0 + velocity[1] * t, t) for t in (2.0, 2.5, 4.0)]
    line = fitted(seen, time=2.0)
    assert line.velocity == pytest.approx(velocity, abs=1e-9)
    assert line.at(10.0) == pytest.approx((3.0 + velocity[0] * 10.0, -1.0 + velocity[1] * 10.0))


@given(st.integers(0, 10_000), st.integers(2, 12), st.none() | st.floats(0.1, 3.0), st.floats(-5, 10))
def test_each_sighting_counts_as_far_as_it_is_known(seed: int, count: int, speed: float | None, time: float) -> None:
    seen = drawn(np.random.default_rng(seed), count)
    if seen[-1].time - seen[0].time < 0.2:
        return
    line = fitted(seen, time=time, speed=speed)
    (x, vx, y, vy), covariance = dense(seen, time, speed)
    assert line.at(time) == pytest.approx((x, y), rel=1e-5, abs=1e-5)
    assert line.velocity == pytest.approx((vx, vy), rel=1e-5, abs=1e-5)
    assert spread(line, time) == pytest.approx(covariance[np.ix_((0, 2), (0, 2))], rel=1e-4, abs=1e-8)
    assert line.velocity_covariance == pytest.approx(covariance[np.ix_((1, 3), (1, 3))], rel=1e-4, abs=1e-8)


def test_more_noisy_sightings_make_speed_and_heading_better() -> None:
    """Over many seeds: two, four, eight, ... sightings in the same six seconds."""
    worst = math.inf, math.inf
    for count in (2, 4, 8, 16, 32):
        speeds, headings = [], []
        for seed in range(150):
            rng = np.random.default_rng([count, seed])
            seen = [
                sighting(0.6 * t + 0.1 * rng.standard_normal(), -0.8 * t + 0.1 * rng.standard_normal(), t)
                for t in np.linspace(0.0, 6.0, count).tolist()
            ]
            vx, vy = fitted(seen, time=0.0).velocity
            speeds.append((math.hypot(vx, vy) - 1.0) ** 2)
            headings.append(math.remainder(math.atan2(vy, vx) - math.atan2(-0.8, 0.6), math.tau) ** 2)
        now = math.sqrt(np.mean(speeds)), math.sqrt(np.mean(headings))
        assert now[0] < worst[0]
        assert now[1] < worst[1]
        worst = now
    assert worst[0] < 0.012


@pytest.mark.parametrize("count", [2, 5, 20])
def test_the_covariances_of_place_and_velocity_are_honest(count: int) -> None:
    """By Monte Carlo: squared normalised errors in two dimensions have a mean of 2."""
    place, velocity = [], []
    for seed in range(500):
        seen = drawn(np.random.default_rng([count, seed]), count)
        if seen[-1].time - seen[0].time < 0.05:
            continue
        line = fitted(seen, time=0.0)
        dv = np.array(line.velocity) - (0.6, -0.8)
        velocity.append(dv @ np.linalg.solve(line.velocity_covariance, dv))
        dp = np.array(line.at(8.0)) - (1.0 + 0.6 * 8.0, 2.0 - 0.8 * 8.0)
        place.append(dp @ np.linalg.solve(spread(line, 8.0), dp))
    assert np.mean(velocity) == pytest.approx(2.0, abs=0.35)
    assert np.mean(place) == pytest.approx(2.0, abs=0.35)


def test_a_sighting_of_the_course_surprises_as_little_as_it_should() -> None:
    surprises = []
    for seed in range(500):
        *seen, last = drawn(np.random.default_rng(seed), 7)
        surprises.append(fitted(seen, time=0.0).surprise(last))
    assert np.mean(surprises) == pytest.approx(2.0, abs=0.35)
    assert np.mean(np.array(surprises) > 9.21) < 0.03, "one in a hundred by chi square"


def test_one_sighting_with_a_usual_speed_is_a_robot_that_may_go_anywhere() -> None:
    line = fitted([sighting(3.0, 4.0, 2.0, 0.04, 0.01, 0.09)], time=2.0, speed=0.5)
    assert line.at(2.0) == pytest.approx((3.0, 4.0))
    assert line.velocity == pytest.approx((0.0, 0.0), abs=1e-12)
    assert line.velocity_covariance == pytest.approx(0.25 * np.eye(2))
    later = spread(line, 4.0)
    assert later == pytest.approx(np.array([[0.04 + 1.0, 0.01], [0.01, 0.09 + 1.0]]))


@pytest.mark.parametrize(
    ("seen", "speed"),
    [
        ([sighting(3.0, 4.0, 2.0)], None),
        ([sighting(3.0, 4.0, 2.0), sighting(3.1, 4.0, 2.0), sighting(3.0, 4.1, 2.0)], None),
        ([], None),
        ([], 0.5),
    ],
    ids=["one", "several at one time", "none", "none with a usual speed"],
)
def test_without_two_times_or_a_usual_speed_there_is_no_course(seen: list[Sighting], speed: float | None) -> None:
    line = fitted(seen, time=0.0, speed=speed)
    for ask in (lambda: line.velocity, lambda: line.at(3.0), lambda: line.covariance_at(3.0)):
        with pytest.raises(ValueError, match="at two times, or a usual speed"):
            ask()


def test_two_sightings_at_one_time_are_one_better_one() -> None:
    seen = [sighting(3.0, 4.0, 0.0, 0.01, 0.0, 0.04), sighting(3.3, 4.5, 0.0, 0.02, 0.0, 0.01)]
    line = fitted(seen, time=0.0, speed=0.5)
    assert line.at(0.0) == pytest.approx((3.1, 4.4))
    assert spread(line, 0.0) == pytest.approx(np.diag([1 / 150, 1 / 125]))


@pytest.mark.parametrize(
    ("xx", "xy", "yy"),
    [
        (1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 2.0, 1.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0),
        (-1.0, 0.0, 1.0), (-1.0, 0.0, -1.0), (math.nan, 0.0, 1.0), (1.0, math.nan, 1.0),
    ],
)  # fmt: skip
def test_a_covariance_that_is_none_is_refused(xx: float, xy: float, yy: float) -> None:
    with pytest.raises(ValueError, match="positive definite"):
        TrackedLine.start(0.0, 0.5).seen(sighting(1.0, 2.0, 3.0, xx, xy, yy))


@pytest.mark.parametrize("speed", [None, 0.5])
@pytest.mark.parametrize("cut", [1, 3, 5])
def test_two_courses_joined_are_the_course_through_all_sightings(speed: float | None, cut: int) -> None:
    seen = drawn(np.random.default_rng(3), 6)
    everything = fitted(seen, time=0.0, speed=speed)
    joined = fitted(seen[:cut], time=0.0, speed=speed).joined(fitted(seen[cut:], time=0.0, speed=speed))
    assert (joined.count, joined.first, joined.last) == (6, seen[0].time, seen[-1].time)
    assert joined.velocity == pytest.approx(everything.velocity, rel=1e-9)
    assert joined.at(8.0) == pytest.approx(everything.at(8.0), rel=1e-9)


def test_a_course_of_many_parts_is_as_fast_as_the_robot() -> None:
    """A usual speed is known once, however often what is known of one robot is put together."""
    parts = [fitted([sighting(0.8 * t, 0.0, t)], time=0.0, speed=0.5) for t in np.arange(0.0, 2.0, 0.1).tolist()]
    line = parts[0]
    for part in parts[1:]:
        line = line.joined(part)
    assert line.velocity[0] == pytest.approx(0.8, abs=0.05)


def test_one_sighting_is_a_course_however_sure_it_is_and_however_late() -> None:
    """Any variance that a message may hold, long after the time from which all courses are counted."""
    wrong = []
    for error, since in itertools.product((1e-9, 1e-6, 1e-2, 1e4), (0.0, 100.0, 10_000.0)):
        place = fitted([sighting(3.0, 4.0, since, error, 0.0, error)], time=0.0, speed=0.5).at(since)
        if place != pytest.approx((3.0, 4.0), abs=1e-3):
            wrong.append(f"{error:g} m2, {since:g} s: {place}")
    assert not wrong, "\n".join(wrong)


WHO: list[str | None] = ["ann", "bob", None]


def told(seed: int, count: int) -> list[tuple[Sighting, str | None]]:
    """Sightings of one course with those who have made them."""
    rng = np.random.default_rng(seed)
    return [(each, WHO[rng.integers(3)]) for each in drawn(rng, count)]


def course(seen: Sequence[tuple[Sighting, str | None]], *, time: float = 0.0, speed: float | None = 0.5) -> TrackedLine:
    line = TrackedLine.start(time, speed)
    for each, who in seen:
        line = line.seen(each, who)
    return line


def test_an_offset_of_each_source_is_fitted_with_the_course() -> None:
    """Beside least squares with one big covariance, in which the sightings of a source have COMMON of it together."""
    rng = np.random.default_rng(0)
    covariance = np.array([[0.09, 0.02], [0.02, 0.04]])
    times = np.arange(0.0, 12.0, 1.1 * SAME_ERROR)
    who = rng.integers(2, size=len(times))
    places = rng.standard_normal((len(times), 2))
    seen = [sighting(x, y, t, 0.09, 0.02, 0.04) for (x, y), t in zip(places.tolist(), times.tolist(), strict=True)]
    line = course([(s, ("ann", "bob")[w]) for s, w in zip(seen, who, strict=True)], speed=None)
    block = np.kron((who[:, None] == who) * COMMON + np.eye(len(who)) * (1.0 - COMMON), covariance)
    A = np.vstack([[[1.0, t, 0.0, 0.0], [0.0, 0.0, 1.0, t]] for t in times])
    W = np.linalg.inv(block)
    expected = np.linalg.inv(A.T @ W @ A)
    x, vx, y, vy = expected @ A.T @ W @ places.ravel()
    assert line.at(0.0) == pytest.approx((x, y))
    assert line.velocity == pytest.approx((vx, vy))
    assert spread(line, 0.0) == pytest.approx(expected[np.ix_((0, 2), (0, 2))])
    assert line.velocity_covariance == pytest.approx(expected[np.ix_((1, 3), (1, 3))])


@given(st.integers(0, 10_000), st.integers(2, 12), st.randoms(use_true_random=False), st.floats(-20, 20))
def test_neither_order_nor_time_nor_parts_matter_for_several(
    seed: int, count: int, rng: random.Random, time: float
) -> None:
    seen = told(seed, count)
    mixed = rng.sample(seen, len(seen))
    cut = rng.randrange(len(seen))
    one = course(seen)
    for other in (course(mixed, time=time), course(mixed[:cut]).joined(course(mixed[cut:], time=time))):
        assert other.velocity == pytest.approx(one.velocity, rel=1e-6, abs=1e-7)
        assert other.at(9.0) == pytest.approx(one.at(9.0), rel=1e-6, abs=1e-6)
        assert spread(other, 9.0) == pytest.approx(spread(one, 9.0), rel=1e-6, abs=1e-9)
        assert (other.count, other.first, other.last) == (one.count, one.first, one.last)


@given(st.integers(0, 10_000), st.integers(1, 12), st.floats(-math.pi, math.pi), st.floats(-30, 30))
def test_who_turns_and_moves_the_map_turns_and_moves_the_course(seed: int, count: int, turn: float, by: float) -> None:
    c, s = math.cos(turn), math.sin(turn)
    R = np.array([[c, -s], [s, c]])

    def turned(each: Sighting) -> Sighting:
        (xx, xy), (_, yy) = R @ covariance_of(each) @ R.T
        x, y = R @ (each.x, each.y)
        return sighting(x + by, y - by, each.time, xx, xy, yy)

    seen = told(seed, count)
    plain, other = course(seen), course([(turned(each), who) for each, who in seen])
    assert other.at(7.0) == pytest.approx(R @ plain.at(7.0) + (by, -by), rel=1e-6, abs=1e-6)
    assert spread(other, 7.0) == pytest.approx(R @ spread(plain, 7.0) @ R.T, rel=1e-6, abs=1e-9)


def test_one_sighting_tells_the_same_whoever_has_made_it() -> None:
    one = sighting(3.0, 4.0, 2.0, 0.04, 0.01, 0.09)
    for who in WHO:
        line = course([(one, who)])
        assert line.at(2.0) == pytest.approx((3.0, 4.0))
        assert spread(line, 2.0) == pytest.approx(covariance_of(one))


def test_two_who_look_know_more_than_one_who_looks_twice_as_often() -> None:
    def known(who: Sequence[str], step: float) -> float:
        line = course([(sighting(0.0, 0.0, t), name) for name in who for t in np.arange(0.0, 4.0, step).tolist()])
        return float(np.linalg.det(spread(line, 2.0)))

    assert known(["ann", "bob"], 0.2) < 0.5 * known(["ann"], 0.1)
    assert known(["ann"], 0.01) == pytest.approx(known(["ann"], 0.1), rel=0.1), "looking more often does not help"
    line = course([(sighting(0.0, 0.0, t), "ann") for t in np.arange(0.0, 60.0, 0.1).tolist()])
    assert spread(line, 30.0)[0, 0] > COMMON * 0.01


@pytest.mark.parametrize("sources", [1, 2, 3])
def test_errors_that_stay_the_same_for_a_while_do_not_make_a_course_too_sure(sources: int) -> None:
    """Each source has an offset, and others that fade within three looks."""
    place, neglected = [], []
    for seed in range(120):
        rng = np.random.default_rng([sources, seed])
        line = alone = TrackedLine.start(0.0, None)
        for who in range(sources):
            offset = math.sqrt(COMMON) * 0.1 * rng.standard_normal(2)
            drift = rng.standard_normal(2)
            for t in np.arange(0.0, 4.0, 0.1).tolist():
                x, y = offset + math.sqrt(1 - COMMON) * 0.1 * drift + (0.6 * t, -0.8 * t)
                line, alone = line.seen(sighting(x, y, t), f"p{who}"), alone.seen(sighting(x, y, t))
                drift = 0.6 * drift + 0.8 * rng.standard_normal(2)
        for each, found in ((line, place), (alone, neglected)):
            d = np.array(each.at(4.0)) - (0.6 * 4.0, -0.8 * 4.0)
            found.append(float(d @ np.linalg.solve(spread(each, 4.0), d)))
    assert np.mean(place) == pytest.approx(2.0, abs=0.7)
    assert np.mean(neglected) > 6.0
