"""Interception, eq. 4.4."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vrg.agents.interception import intercept
from vrg.types import Vector

places = st.tuples(st.floats(-10, 10), st.floats(-10, 10))
velocities = st.tuples(st.floats(-2, 2), st.floats(-2, 2))


@given(places, st.floats(0.1, 3), places, velocities, st.floats(0.2, 1))
def test_at_the_meeting_both_have_driven_for_as_long_as_the_equation_says(
    pursuer: Vector, speed: float, target: Vector, velocity: Vector, k: float
) -> None:
    assume(math.dist(pursuer, target) > 1e-3)
    met = intercept(pursuer, speed, target, velocity, k=k)
    if met is None:
        return
    assert met.time >= 0
    d_p = math.dist(pursuer, met.point)
    assert d_p / speed == pytest.approx(k * met.time, rel=1e-5, abs=1e-6)


@given(places, st.floats(0.1, 3), places, st.floats(0, 2 * math.pi), st.floats(0, 0.99))
def test_a_faster_pursuer_always_meets_its_target(
    pursuer: Vector, speed: float, target: Vector, course: float, fraction: float
) -> None:
    velocity = speed * fraction * math.cos(course), speed * fraction * math.sin(course)
    assert intercept(pursuer, speed, target, velocity) is not None


def test_of_two_meetings_the_first_is_taken() -> None:
    """A fast target that comes by can be met before it passes."""
    met = intercept((0.0, 1.0), 1.0, (-10.0, 0.0), (3.0, 0.0))
    assert met is not None
    assert met.point[0] < 0


def test_who_runs_away_as_fast_or_faster_is_never_met() -> None:
    assert intercept((0.0, 0.0), 1.0, (1.0, 0.0), (1.0, 0.0)) is None
    assert intercept((0.0, 0.0), 1.0, (1.0, 0.0), (1.5, 0.0)) is None


@pytest.mark.parametrize(
    ("speed", "target", "velocity", "time", "point"),
    [(1.0, (4.0, 0.0), (-1.0, 0.0), 2.0, (2.0, 0.0)), (2.0, (3.0, 4.0), (0.0, 0.0), 2.5, (3.0, 4.0))],
    ids=["head on in the middle", "where it stands"],
)
def test_they_meet(speed: float, target: Vector, velocity: Vector, time: float, point: Vector) -> None:
    met = intercept((0.0, 0.0), speed, target, velocity)
    assert met is not None
    assert (met.time, met.point) == (pytest.approx(time), pytest.approx(point))


def test_being_near_is_enough_where_a_reach_is_given() -> None:
    met = intercept((0.0, 0.0), 1.0, (3.0, 0.0), (0.0, 0.0), reach=1.0)
    assert met is not None
    assert met.time == pytest.approx(2.0)
    assert intercept((0.0, 0.0), 1.0, (0.5, 0.0), (9.0, 0.0), reach=1.0).time == 0.0  # type: ignore[union-attr]
