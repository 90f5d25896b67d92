"""Regions: the same object judges a field and is drawn."""

import math
from random import Random

import msgspec
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec import structs

from vrg.regions import Circle, Polygon, Rectangle, Region, Sector, surrounding, touch
from vrg.segments import CHORD
from vrg.types import Pose

FIELD = Rectangle(0.0, 0.0, 10.0, 6.0)
DISC = Circle(5.0, 3.0, 2.0)
CORNER = Sector(0.0, 0.0, 3.0, 0.0, math.pi / 2)
AREA = Polygon(((1.0, 0.5), (8.0, 1.0), (9.0, 4.0), (4.0, 5.5)))
REGIONS = [FIELD, DISC, CORNER, AREA]

near = st.tuples(st.floats(-4.0, 14.0), st.floats(-4.0, 10.0))
any_region = st.sampled_from(REGIONS)
fractions = st.floats(0.0, 1.0)


def between(a: tuple[float, float], b: tuple[float, float], share: float) -> tuple[float, float]:
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])


def is_near_the_border(region: Region, point: tuple[float, float]) -> bool:
    around = [(point[0] + dx, point[1] + dy) for dx in (-1e-6, 0, 1e-6) for dy in (-1e-6, 0, 1e-6)]
    return len({region.contains(*p) for p in around}) > 1


@given(any_region, near, near, fractions)
def test_a_way_is_inside_for_exactly_the_stretch_that_is_told(
    region: Region, start: tuple[float, float], end: tuple[float, float], share: float
) -> None:
    point = between(start, end, share)
    if is_near_the_border(region, point):
        return
    stretch = region.inside(start, end)
    told = stretch is not None and stretch[0] <= share <= stretch[1]
    assert told == region.contains(*point)


@given(any_region, near, near)
def test_a_way_leaves_where_the_border_is(region: Region, start: tuple[float, float], end: tuple[float, float]) -> None:
    left = region.exit_fraction(start, end)
    assert (left is None) == (region.contains(*start) and region.contains(*end))
    if not region.contains(*start):
        assert left == 0.0
    elif left is not None:
        border = between(start, end, left)
        assert region.distance(*border) < 1e-6
        assert abs(region.signed_distance(*border)) <= CHORD


@given(any_region, near, near)
def test_no_point_of_a_region_is_nearer_than_the_nearest(
    region: Region, point: tuple[float, float], other: tuple[float, float]
) -> None:
    nearest = region.nearest(*point)
    assert region.distance(*nearest) < 1e-6
    inside = region.nearest(*other)
    assert math.dist(point, nearest) <= math.dist(point, inside) + 1e-6
    if region.contains(*point):
        assert nearest == point


@given(any_region, near, st.floats(0.05, 0.6))
def test_what_is_in_the_shrunk_region_is_well_inside(region: Region, point: tuple[float, float], margin: float) -> None:
    small = region.shrunk(margin)
    if not small.contains(*point):
        return
    for step in range(16):
        angle = step * math.tau / 16
        edge = point[0] + (margin - 1e-6) * math.cos(angle), point[1] + (margin - 1e-6) * math.sin(angle)
        assert region.distance(*edge) < CHORD + 1e-6


@given(any_region, near)
def test_the_outline_that_is_drawn_is_the_border_that_is_judged(region: Region, point: tuple[float, float]) -> None:
    outline = region.outline()
    assert all(region.distance(x, y) < 1e-9 for x, y in outline)
    drawn = Polygon(tuple(outline))
    if abs(drawn.distance(*point) - region.distance(*point)) > CHORD:
        pytest.fail(f"drawn {drawn.distance(*point)} m away, judged {region.distance(*point)}")
    x_min, y_min, x_max, y_max = region.bounds
    xs, ys = [x for x, _ in outline], [y for _, y in outline]
    assert (min(xs), min(ys), max(xs), max(ys)) == pytest.approx((x_min, y_min, x_max, y_max), abs=CHORD)


@pytest.mark.parametrize("region", REGIONS, ids=lambda region: type(region).__name__)
def test_its_middle_is_inside_and_too_large_a_margin_leaves_it(region: Region) -> None:
    assert region.contains(*region.middle)
    tiny = region.shrunk(50.0)
    assert region.contains(*tiny.nearest(*region.middle))


@pytest.mark.parametrize("region", REGIONS, ids=lambda region: type(region).__name__)
def test_a_region_travels_as_one_type(region: Region) -> None:
    wire = msgspec.msgpack.encode(region)
    assert msgspec.msgpack.decode(wire, type=Region) == region
    assert msgspec.msgpack.decode(wire)["shape"] == type(region).__name__.lower()


@pytest.mark.parametrize(
    "wrong",
    [
        {"shape": "rectangle", "x_min": 5.0, "y_min": 0.0, "x_max": 1.0, "y_max": 1.0},
        {"shape": "circle", "x": 0.0, "y": 0.0, "radius": 0.0},
        {"shape": "sector", "x": 0.0, "y": 0.0, "radius": 1.0, "start": 0.0, "sweep": 4.0},
        {"shape": "polygon", "points": [[0.0, 0.0], [1.0, 0.0]]},
        {"shape": "polygon", "points": [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]},
        {"shape": "polygon", "points": [[0, 0], [4, 0], [1, 1], [0, 4]]},
        {"shape": "star"},
    ],
)
def test_what_is_no_convex_region_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(wrong, Region, strict=False)


@pytest.mark.parametrize("region", [FIELD, DISC, CORNER, AREA])
def test_a_region_holds_what_is_inside_at_its_height(region: Region) -> None:
    x, y = region.middle
    assert region.holds(Pose(x, y, 0.0))
    assert region.holds(Pose(x, y, 0.0, 50.0)), "it has no upper end"
    low = structs.replace(region, z_min=0.5, z_max=2.0)
    assert [low.holds(Pose(x, y, 0.0, z)) for z in (0.4, 0.5, 2.0, 2.1)] == [False, True, True, False]
    assert not low.holds(Pose(x + 100.0, y, 0.0, 1.0))
    assert low.contains(x, y), "it is of the plane"
    assert (low.shrunk(0.1).z_min, low.shrunk(0.1).z_max) == (0.5, 2.0)
    assert b"z_" not in msgspec.msgpack.encode(region)
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(low), type=Region) == low
    with pytest.raises(ValueError, match="expected z_min <= z_max, got 3 and 2"):
        structs.replace(low, z_min=3.0)


def test_the_border_belongs_to_a_region() -> None:
    assert FIELD.contains(0.0, 6.0)
    assert DISC.contains(7.0, 3.0)
    assert CORNER.contains(3.0, 0.0)
    assert AREA.contains(1.0, 0.5)
    assert not CORNER.contains(-0.1, 0.1)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (FIELD, DISC, True),
        (DISC, Circle(5.0, 6.0, 0.9), False),
        (DISC, Circle(5.0, 6.0, 1.1), True),
        (CORNER, Rectangle(2.5, 2.5, 4.0, 4.0), False),
        (CORNER, Rectangle(2.0, 2.0, 4.0, 4.0), True),
        (AREA, Polygon(((9.5, 0.0), (12.0, 0.0), (12.0, 9.0))), False),
        (AREA, FIELD, True),
    ],
)
def test_regions_touch_or_do_not(first: Region, second: Region, expected: bool) -> None:
    assert touch(first, second) is expected
    assert touch(second, first) is expected


bearings = st.lists(st.integers(0, 35), min_size=3, max_size=9, unique=True)


def on_ellipse(steps: list[int], x: float, y: float, size: float) -> tuple[tuple[float, float], ...]:
    """Points of an ellipse about (x, y), each so many times 10 degrees from its long axis."""
    angles = [math.radians(10 * step) for step in steps]
    return tuple((x + size * math.cos(angle), y + 0.6 * size * math.sin(angle)) for angle in angles)


place = st.floats(-3.0, 3.0)
size = st.floats(0.1, 3.0)
some_region: st.SearchStrategy[Region] = st.one_of(
    st.builds(lambda x, y, a, b: Rectangle(x, y, x + a, y + b), place, place, size, size),
    st.builds(Circle, place, place, size),
    st.builds(Sector, place, place, size, st.floats(-4.0, 4.0), st.floats(0.1, math.pi)),
    st.builds(lambda steps, x, y, a: Polygon(on_ellipse(sorted(steps), x, y, a)), bearings, place, place, size),
)


def gap(first: Region, second: Region) -> float:
    """The distance of two regions: going to and fro between their nearest points ends at the nearest of them all."""
    here = there = first.middle
    for _ in range(300):
        there = second.nearest(*here)
        here = first.nearest(*there)
    return math.dist(here, there)


@given(some_region, some_region)
def test_regions_touch_if_going_to_and_fro_between_them_ends_at_one_point(first: Region, second: Region) -> None:
    overlap, apart = gap(first.shrunk(1e-3), second) < 1e-9, gap(first, second) > 2 * CHORD
    assume(overlap or apart)
    assert touch(first, second) is touch(second, first) is overlap


@given(bearings, st.randoms(use_true_random=False))
def test_corners_make_a_polygon_only_in_their_order_around_it(steps: list[int], rng: Random) -> None:
    order = sorted(steps)
    mixed = rng.sample(order, len(order))
    first = mixed.index(order[0])
    if mixed[first:] + mixed[:first] == order:
        assert Polygon(on_ellipse(mixed, 1.0, 2.0, 3.0)).contains(*Polygon(on_ellipse(order, 1.0, 2.0, 3.0)).middle)
    else:
        with pytest.raises(ValueError, match="convex"):
            Polygon(on_ellipse(mixed, 1.0, 2.0, 3.0))


def test_a_star_is_no_polygon_although_it_turns_to_the_left_only() -> None:
    with pytest.raises(ValueError, match="convex"):
        Polygon(on_ellipse([0, 14, 28, 7, 21], 0.0, 0.0, 1.0))


@pytest.mark.parametrize(("length", "width"), [(6.0, 1.0), (1.0, 6.0), (4.0, 2.0)])
def test_a_polygon_that_is_shrunk_to_nothing_leaves_its_middle(length: float, width: float) -> None:
    flat = Polygon(((0.0, 0.0), (length, 0.0), (length, width), (0.0, width)))
    left = flat.shrunk(min(length, width) / 2)
    assert left.middle == pytest.approx((length / 2, width / 2), abs=1e-3)
    assert Rectangle(0.0, 0.0, length, width).shrunk(9.0).bounds == (length / 2, width / 2) * 2


@given(any_region, near, near)
def test_the_signed_distance_tells_the_side_and_how_far_the_border_is(
    region: Region, point: tuple[float, float], other: tuple[float, float]
) -> None:
    away = region.signed_distance(*point)
    if not is_near_the_border(region, point):
        assert (away <= 0.0) == region.contains(*point)
    if math.dist(point, other) < abs(away) - CHORD:
        assert region.contains(*other) == region.contains(*point), "nothing nearer is on the other side"
    assert abs(region.signed_distance(*other) - away) <= math.dist(point, other) + CHORD


def test_what_surrounds_boxes_reaches_to_the_outermost_sides() -> None:
    assert surrounding([(0.0, -2.0, 1.0, 3.0), (-4.0, 0.0, 0.5, 5.0)]) == (-4.0, -2.0, 1.0, 5.0)
