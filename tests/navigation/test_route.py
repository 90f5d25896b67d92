"""The shortest way past discs and walls that stand still."""

import itertools
import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vrg.navigation import route as module
from vrg.navigation.route import WAYPOINT_CLEARANCE, Effort, grown, route
from vrg.regions import Circle, Polygon, Rectangle, Region
from vrg.types import Vector

PLACE = st.tuples(st.floats(-10, 10), st.floats(-10, 10))
DISC = st.builds(lambda p, r: Circle(p[0], p[1], r), PLACE, st.floats(0.2, 1.5))
WALL = st.builds(
    lambda p, w, h: Rectangle(p[0], p[1], p[0] + w, p[1] + h), PLACE, st.floats(0.2, 3.0), st.floats(0.2, 3.0)
)
OBSTACLES = st.lists(DISC | WALL, max_size=7)
TOLERANCE = 1e-6
RING: list[Region] = [Circle(2 * math.cos(i * math.tau / 12), 2 * math.sin(i * math.tau / 12), 0.7) for i in range(12)]
GAP = [*RING[:6], *RING[7:]]


def length(path: list[Vector]) -> float:
    return sum(math.dist(a, b) for a, b in itertools.pairwise(path))


def depth(obstacle: Region, start: Vector, end: Vector) -> float:
    """How deep a straight piece of a way enters an obstacle, m; looked at by many points."""
    deepest = 0.0
    for i in range(101):
        x, y = (a + (b - a) * i / 100 for a, b in zip(start, end, strict=True))
        if isinstance(obstacle, Circle):
            deepest = max(deepest, obstacle.radius - math.hypot(x - obstacle.x, y - obstacle.y))
        else:
            low_x, low_y, high_x, high_y = obstacle.bounds
            deepest = max(deepest, min(x - low_x, high_x - x, y - low_y, high_y - y))
    return deepest


def outside(obstacles: list[Region], *places: Vector) -> bool:
    return all(obstacle.distance(*place) > 1e-3 for obstacle in obstacles for place in places)


def test_an_obstacle_in_the_way_is_gone_round() -> None:
    for obstacle in (Circle(2.5, 0.0, 1.0), Rectangle(2, -1, 3, 1)):
        path = route((0, 0), (5, 0), [obstacle])
        assert path is not None
        assert len(path) > 1
        assert 5.0 < length([(0, 0), *path]) < 6.5


def test_the_shorter_side_is_taken() -> None:
    path = route((0, 0), (5, 0), [Circle(2.5, 0.3, 1.0)])
    assert path is not None
    assert all(y <= 0.0 for _, y in path)


def test_a_gap_between_two_obstacles_is_used() -> None:
    path = route((0, 2), (4, 2), [Rectangle(1.5, 0.2, 2.5, 9.0), Rectangle(1.5, -9.0, 2.5, -0.2)])
    assert path is not None
    assert length([(0, 2), *path]) < 6.5


WALLS: list[Region] = [
    Rectangle(-2, 1, 2, 2),
    Rectangle(-2, -2, 2, -1),
    Rectangle(1, -2, 2, 2),
    Rectangle(-2, -2, -1, 2),
]


@pytest.mark.parametrize(
    ("start", "goal", "obstacles"),
    [
        ((0, 0), (5, 0), [Circle(5.0, 0.0, 1.0)]),
        ((0, 0), (5, 0), [Rectangle(4, -1, 6, 1)]),
        ((0, 0), (5, 0), RING),
        ((5, 0), (0, 0), RING),
        ((0, 0), (5, 0), WALLS),
    ],
)
def test_there_is_no_way_into_an_obstacle_or_out_of_a_ring(
    start: Vector, goal: Vector, obstacles: list[Region]
) -> None:
    assert route(start, goal, obstacles) is None


def test_a_search_ends_where_its_effort_does(monkeypatch: pytest.MonkeyPatch) -> None:
    tested = []

    def counted(*args: Any) -> bool:
        tested.append(args)
        return meets(*args)

    meets = module._meets
    monkeypatch.setattr(module, "_meets", counted)
    assert route((0, 0), (5, 0), GAP) is not None
    whole, tested[:] = len(tested), []
    assert route((0, 0), (5, 0), GAP, effort=Effort(whole // 10)) is None
    assert len(tested) < whole / 4
    effort = Effort(10 * whole)
    assert route((0, 0), (5, 0), GAP, effort=effort) is not None
    while route((0, 0), (5, 0), GAP, effort=effort) is not None:
        assert len(tested) < 20 * whole, "several searches share it"


def test_a_ring_with_one_gap_is_left_by_it() -> None:
    path = route((0, 0), (5, 0), GAP)
    assert path is not None
    assert path[0][0] < -1.0, "the gap is on the other side"


def test_no_way_turns_outside_the_field() -> None:
    field = Rectangle(0, -1.2, 5, 3)
    path = route((0.1, 0), (4.9, 0), [Circle(2.5, -0.3, 1.0)], field.contains)
    assert path is not None
    assert all(field.contains(*place) for place in path)
    assert route((0.1, 0), (4.9, 0), [Rectangle(2, -2, 3, 4)], field.contains) is None


def test_whoever_is_inside_a_disc_gets_out_of_it_and_not_deeper_into_it() -> None:
    disc = Circle(1.0, 0.0, 1.0)
    start = (0.5, 0.0)
    path = route(start, (5, 0), [disc])
    assert path is not None
    way = [start, *path]
    nearest = math.dist(start, (disc.x, disc.y))
    for a, b in itertools.pairwise(way):
        assert depth(Circle(disc.x, disc.y, nearest - WAYPOINT_CLEARANCE), a, b) < TOLERANCE
    assert route((0, 0), (5, 0), [Circle(0.0, 0.0, 1.0)]) == [(5, 0)], "also from its very middle"


@given(PLACE, PLACE, OBSTACLES)
def test_a_way_meets_no_obstacle_and_is_not_longer_than_around_everything(
    start: Vector, goal: Vector, obstacles: list[Region]
) -> None:
    assume(outside(obstacles, start, goal))
    path = route(start, goal, obstacles)
    assume(path is not None)
    assert path is not None
    way = [start, *path]
    assert path[-1] == goal
    around = 0.0
    for obstacle in obstacles:
        low_x, low_y, high_x, high_y = obstacle.bounds
        around += 2 * (high_x - low_x + high_y - low_y + 8 * WAYPOINT_CLEARANCE)
        for a, b in itertools.pairwise(way):
            assert depth(obstacle, a, b) < TOLERANCE
    assert length(way) <= math.dist(start, goal) + around + TOLERANCE


@given(PLACE, PLACE, DISC | WALL)
def test_around_one_obstacle_there_is_always_a_way(start: Vector, goal: Vector, obstacle: Region) -> None:
    assume(outside([obstacle], start, goal))
    assert route(start, goal, [obstacle]) is not None


@given(PLACE, PLACE, OBSTACLES)
def test_obstacles_that_are_not_in_the_way_change_nothing(start: Vector, goal: Vector, obstacles: list[Region]) -> None:
    assume(all(obstacle.inside(start, goal) is None for obstacle in obstacles))
    assert route(start, goal, obstacles) == [goal]


@given(PLACE, PLACE, st.lists(DISC | WALL, min_size=1, max_size=5))
def test_the_order_of_obstacles_does_not_change_the_length(
    start: Vector, goal: Vector, obstacles: list[Region]
) -> None:
    assume(outside(obstacles, start, goal))
    ways = [route(start, goal, order) for order in (obstacles, obstacles[::-1])]
    assert (ways[0] is None) == (ways[1] is None)
    if ways[0] is not None and ways[1] is not None:
        assert length([start, *ways[0]]) == pytest.approx(length([start, *ways[1]]), abs=0.05)


@given(DISC | WALL, st.floats(0.0, 1.0), PLACE)
def test_what_is_grown_holds_everything_that_is_nearer_than_the_margin(
    region: Region, margin: float, place: Vector
) -> None:
    larger = grown(region, margin)
    if region.distance(*place) < margin - TOLERANCE:
        assert larger.contains(*place)
    if isinstance(region, Rectangle):
        assert larger.bounds == pytest.approx(region.bounds, abs=margin + TOLERANCE)


def test_a_polygon_is_grown_on_every_side() -> None:
    larger = grown(Polygon(((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 3.0))), 0.3)
    assert all(larger.contains(*place) for place in ((2.0, -0.29), (4.29, 1.0), (4.2, -0.2), (-0.29, 1.5), (2.0, 2.79)))
    assert not any(larger.contains(*place) for place in ((2.0, -0.31), (4.31, 1.0), (-0.31, 1.5), (2.0, 2.82)))


@pytest.mark.parametrize("degrees", [50, 40, 20, 5])
def test_a_polygon_with_a_sharp_corner_is_grown_on_the_sides_of_the_corner_too(degrees: float) -> None:
    half = math.radians(degrees) / 2
    end = (4.0 * math.cos(half), 4.0 * math.sin(half))
    larger = grown(Polygon(((0.0, 0.0), (end[0], -end[1]), end)), 0.3)
    beside = (math.cos(half) - 0.29 * math.sin(half), math.sin(half) + 0.29 * math.cos(half))
    assert larger.contains(*beside), "0.29 m from a side, 1 m from the corner"


@pytest.mark.parametrize("nowhere", [math.inf, -math.inf, math.nan])
def test_no_way_leads_to_what_is_no_place(nowhere: float) -> None:
    obstacle = Circle(2.5, 0.0, 1.0)
    assert route((0.0, 0.0), (nowhere, 0.0), [obstacle]) is None
    assert route((0.0, nowhere), (5.0, 0.0), [obstacle]) is None
