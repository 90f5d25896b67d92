"""The potential field, evasion, and ways around bodies and borders."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vrg.agents.potential import SHARK_WEIGHT, descent, evade
from vrg.navigation.avoidance import Crowd, CrowdBody, Obstacle, steer
from vrg.regions import Rectangle
from vrg.types import Vector

FIELD = Rectangle(0, 0, 10, 20)
SAFE, START = Rectangle(0, 0, 10, 3), Rectangle(0, 17, 10, 20)
GOAL = (5.0, 1.5)
inside = st.tuples(st.floats(0.7, 9.3), st.floats(4, 19.3))


@given(inside, st.lists(inside, max_size=4))
def test_the_field_never_holds_a_minnow_back_from_the_safe_zone(
    position: tuple[float, float], sharks: list[tuple[float, float]]
) -> None:
    u = descent(position, GOAL, sharks)
    way = GOAL[0] - position[0], GOAL[1] - position[1]
    assert u[0] * way[0] + u[1] * way[1] >= (1 - SHARK_WEIGHT - 1e-9) * math.hypot(*way)


def test_the_field_bends_away_from_the_sharks_barycentre() -> None:
    assert descent((5, 10), GOAL, []) == pytest.approx((0, -1)), "straight home"
    assert descent((5, 10), GOAL, [(7, 10), (9, 10)])[0] < 0
    assert descent((5, 10), GOAL, [(7, 10), (3, 10)]) == pytest.approx((0, -1)), "sharks on both sides cancel"


@given(inside, inside)
def test_evasion_increases_the_distance_to_the_shark_away_from_borders(
    position: tuple[float, float], shark: tuple[float, float]
) -> None:
    bounds = FIELD.shrunk(0.7)
    assume(bounds.shrunk(0.6).contains(*position))
    assume(position[1] < START.y_min - 0.5)
    assume(math.dist(position, shark) > 0.1)
    u = evade(position, shark, SAFE, bounds, START)
    away = position[0] - shark[0], position[1] - shark[1]
    assert u[0] * away[0] + u[1] * away[1] == pytest.approx(math.hypot(*away))


@given(st.tuples(st.floats(0.7, 9.3), st.floats(0.7, 19.3)), inside)
def test_evasion_stays_in_bounds(position: tuple[float, float], shark: tuple[float, float]) -> None:
    bounds = FIELD.shrunk(0.7)
    assume(math.dist(position, shark) > 0.1)
    u = evade(position, shark, SAFE, bounds, START)
    assert FIELD.contains(position[0] + 0.5 * u[0], position[1] + 0.5 * u[1])
    assert math.hypot(*u) == pytest.approx(1.0)


@given(st.floats(0.7, 9.3), st.floats(0.5, 2.0))
def test_no_minnow_flees_into_the_zone_it_starts_in(x: float, between: float) -> None:
    u = evade((x, 16.9), (x, 16.9 - between), SAFE, FIELD.shrunk(0.7), START)
    assert u[1] == pytest.approx(0.0), "past the shark"


def test_in_a_corner_a_minnow_slips_past_on_the_side_with_room() -> None:
    bounds = FIELD.shrunk(0.7)
    u = evade((9.3, 19.3), (8.0, 18.0), SAFE, bounds, START)
    end = bounds.nearest(9.3 + u[0], 19.3 + u[1])
    assert math.dist(end, (9.3, 19.3)) > 0.5


ROCK = Obstacle((5.0, 10.0), (0.0, 0.0), 1.0)


AROUND = [Obstacle((5 + 1.2 * math.cos(a), 10 + 1.2 * math.sin(a)), (0.0, 0.0), 1.1) for a in range(7)]


@pytest.mark.parametrize(
    ("position", "wanted", "obstacles", "taken"),
    [
        ((5, 15), (0.0, 0.7), [ROCK], (0.0, 0.7)),
        ((5, 11.5), (0.0, -0.7), [Obstacle((5.0, 10.0), (0.0, -1.0), 1.0)], (0.0, -0.7)),
        ((5, 10), (0.7, 0.0), AROUND, (0.0, 0.0)),
        ((5, 10), (0.0, 0.0), [ROCK], (0.0, 0.0)),
    ],
    ids=["a free way", "behind a body that drives off", "every way is blocked", "who wants to stand"],
)
def test_a_free_way_is_taken_as_wanted_and_where_there_is_none_it_stands(
    position: Vector, wanted: Vector, obstacles: list[Obstacle], taken: Vector
) -> None:
    assert steer(position, wanted, obstacles, FIELD, 2.5) == taken


def test_a_body_in_the_way_is_passed_at_the_same_speed() -> None:
    u = steer((5, 11.5), (0.0, -0.7), [ROCK], FIELD, 2.5)
    assert u != (0.0, -0.7)
    assert math.hypot(*u) == pytest.approx(0.7)
    assert u[1] < 0


@given(inside, st.floats(0, 2 * math.pi), st.lists(inside, max_size=5))
def test_whatever_is_chosen_keeps_clear_of_every_body(
    position: tuple[float, float], course: float, bodies: list[tuple[float, float]]
) -> None:
    assume(all(math.dist(position, b) > 1.0 for b in bodies))
    obstacles = [Obstacle(b, (0.0, 0.0), 1.0) for b in bodies]
    u = steer(position, (0.7 * math.cos(course), 0.7 * math.sin(course)), obstacles, FIELD.shrunk(0.7), 2.5)
    for i in range(26):
        place = position[0] + u[0] * 0.1 * i, position[1] + u[1] * 0.1 * i
        assert all(math.dist(place, b) >= 1.0 - 1e-6 for b in bodies)


@given(st.tuples(st.floats(-2, 12), st.floats(-2, 22)), st.floats(0, 2 * math.pi))
def test_nobody_is_led_out_of_bounds_and_who_is_out_is_led_in(position: tuple[float, float], course: float) -> None:
    u = steer(position, (0.7 * math.cos(course), 0.7 * math.sin(course)), [], FIELD, 2.5)
    ahead = position[0] + u[0], position[1] + u[1]
    if FIELD.contains(*position):
        assert FIELD.contains(*ahead)
    else:
        assert math.dist(ahead, FIELD.nearest(*ahead)) < math.dist(position, FIELD.nearest(*position))


def test_a_body_that_comes_is_passed_in_time() -> None:
    coming = Obstacle((5.0, 8.0), (0.0, 0.7), 1.0)
    assert steer((5, 11), (0.0, -0.7), [coming], FIELD, 2.5) != (0.0, -0.7)


def test_a_body_that_is_too_near_is_left_never_approached() -> None:
    u = steer((5, 10.5), (0.0, -0.7), [ROCK], FIELD, 2.5)
    assert u[1] >= 0


bodies = st.builds(
    CrowdBody,
    st.sampled_from("abcdefgh"),
    st.tuples(st.floats(0, 10), st.floats(0, 20)),
    st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    st.floats(0.1, 1.0),
)


@given(st.lists(bodies, max_size=12), inside, st.floats(0.1, 10.0))
def test_in_a_crowd_one_finds_everybody_who_is_near_but_those_who_are_no_obstacles(
    crowd: list[CrowdBody], position: tuple[float, float], reach: float
) -> None:
    def within(limit: float) -> list[Obstacle]:
        return [
            Obstacle(b.position, b.velocity, 0.4 + b.radius)
            for b in crowd
            if b.name not in ("a", "b")
            and max(abs(b.position[0] - position[0]), abs(b.position[1] - position[1])) < limit
        ]

    found = Crowd(crowd).around(position, 0.4, reach, ("a", "b"))
    assert all(found.count(obstacle) >= 1 for obstacle in within(reach - 1e-9))
    assert all(obstacle in within(reach + 1e-9) for obstacle in found)


def test_who_is_far_away_in_a_crowd_is_not_looked_at() -> None:
    crowd = Crowd(CrowdBody(f"{n}", (float(n), 0.0), (0.5, 0.0), 0.3) for n in range(100))
    assert len(crowd.around((50.0, 0.0), 0.3, 2.5, without=("50",))) == 4
