"""The figures of what lies on a field."""

import math
from dataclasses import replace

import pytest
from msgspec import structs

from vrg.bus.messages import Zone
from vrg.colours import GREEN, PURPLE, WHITE
from vrg.figures import dashes, room, rounded
from vrg.games import UNKNOWN_GAME, look
from vrg.games.game import Marker, Style
from vrg.regions import Circle, Polygon, Rectangle, Region, Sector
from vrg.types import Pose

REGIONS = (
    Rectangle(17.0, -20.0, 22.0, -17.0),
    Circle(21.0, -24.0, 3.0),
    Sector(16.0, -32.0, 6.0, 0.0, math.pi / 2),
    Polygon(((17.0, -30.0), (25.0, -30.0), (21.0, -20.0))),
)
FIELD = Zone(name="field", kind="field", region=Rectangle(16.0, -32.0, 26.0, -13.0))


def of_zone(region: Region, kind: str = "start", name: str = "harbour", team: str | None = None):
    """The figure of one zone on a field."""
    found = look.ground(UNKNOWN_GAME, (FIELD, Zone(name=name, kind=kind, region=region, team=team)), ())
    return next(figure for figure in found if figure.name == f"zone {name}")


def test_a_wall_is_drawn_as_high_as_it_is() -> None:
    low, high = REGIONS[0], REGIONS[1]
    walls = look.ground(UNKNOWN_GAME, (FIELD,), (structs.replace(low, z_max=0.4), high))[-2:]
    assert [figure.shapes[0].height for figure in walls] == [0.4, look.WALL_HEIGHT]


@pytest.mark.parametrize("region", REGIONS)
def test_the_stripes_of_a_safe_zone_end_at_its_border(region) -> None:
    stripes = [shape for shape in of_zone(region, "safe").shapes if not shape.closed]
    assert len(stripes) > 5
    assert max(abs(region.signed_distance(*end)) for stripe in stripes for end in stripe.points) < 0.01


def test_a_large_safe_zone_has_few_stripes() -> None:
    shapes = of_zone(Rectangle(0.0, 0.0, 400.0, 300.0), "safe").shapes
    assert 20 < len(shapes) < 70


@pytest.mark.parametrize("region", REGIONS)
def test_the_name_of_a_zone_has_room_about_its_middle(region) -> None:
    writing = of_zone(region).writing
    assert writing is not None
    assert (writing.lines, writing.middle) == (("HARBOUR",), region.middle)
    x, y = region.middle
    for letters, (along_x, along_y) in zip(writing.along, ((1, 0), (0, 1)), strict=True):
        half = 0.75 * letters * len("HARBOUR") / 2
        for side in (-1, 1):
            assert region.contains(x + side * half * along_x, y + side * half * along_y)


def test_a_name_of_two_words_takes_two_lines_where_these_are_larger() -> None:
    narrow, wide = of_zone(Rectangle(0.0, 0.0, 2.0, 2.0), name="red home"), of_zone(REGIONS[0], name="red home")
    assert narrow.writing is not None
    assert wide.writing is not None
    assert (narrow.writing.lines, wide.writing.lines) == (("RED", "HOME"), ("RED HOME",))


def test_the_name_of_a_teams_circle_stands_below_what_lies_in_its_middle() -> None:
    writing = of_zone(REGIONS[1], team="red").writing
    assert writing is not None
    assert 0.4 * 3.0 < writing.drop < 0.8 * 3.0


def test_a_name_without_letters_is_not_painted() -> None:
    assert of_zone(REGIONS[0], name="_").writing is None


@pytest.mark.parametrize(("size", "most"), [(10.0, 22), (300.0, 64), (3000.0, 64)])
def test_the_grid_of_a_large_field_is_coarser(size, most) -> None:
    assert most / 4 < len(look.grid(Rectangle(0.0, 0.0, size, size))) <= most


def test_a_large_zone_has_no_name_which_would_lie_below_those_in_it() -> None:
    assert of_zone(REGIONS[0], "half").writing is None


def test_the_border_lies_above_zones_and_walls_above_the_border() -> None:
    found = look.ground(UNKNOWN_GAME, (FIELD, Zone(name="a", kind="start", region=REGIONS[0])), [REGIONS[1]])
    assert [figure.name for figure in found] == ["field field", "zone a", "border field", "wall 0"]
    assert found[-1].shapes[0].height == look.WALL_HEIGHT


@pytest.mark.parametrize("sign", list(Marker))
def test_the_sign_of_a_role_fits_its_circle_and_a_cross_does_not_turn(sign) -> None:
    shape = look.marker(sign, 1.0, WHITE)
    assert max(math.hypot(*point) for point in shape.points) + shape.radius < 1.32
    assert shape.still == (sign is Marker.CROSS)


def test_a_small_robot_is_drawn_large_enough_to_be_seen() -> None:
    style = Style(PURPLE, Marker.SQUARE)
    figure = look.robot("ann", Pose(1.0, 2.0, 0.5), style, (0.2, 0.1), physical=True)
    body = next(shape for shape in figure.shapes if shape.fill == PURPLE)
    length = max(x for x, _ in body.points) - min(x for x, _ in body.points)
    assert figure.least * length == pytest.approx(look.SMALLEST)
    nose = max(x for shape in figure.shapes for x, _ in shape.points)
    assert look.reach((0.2, 0.1)) == pytest.approx(nose, abs=0.001)


def test_a_ring_grows_and_thins_where_something_was_called() -> None:
    begin, end = (look.flash(0, (0.0, 0.0), "tag", share) for share in (0.0, 1.0))
    assert end.shapes[0].radius == pytest.approx(2 * begin.shapes[0].radius)
    assert end.shapes[0].width < begin.shapes[0].width / 2
    assert begin.label is not None
    assert (begin.label.words, begin.label.plate) == ("TAG", begin.shapes[0].line)


def test_a_rounded_rectangle_is_as_large_as_it_is_asked_for_and_goes_round_once() -> None:
    points = rounded(2.0, 1.0, 0.2)
    assert (max(x for x, _ in points), max(y for _, y in points)) == pytest.approx((1.0, 0.5))
    turns = [a[0] * b[1] - a[1] * b[0] for a, b in zip(points, [*points[1:], points[0]], strict=True)]
    assert min(turns) > 0.0
    assert sum(turns) / 2 == pytest.approx(2.0 - (4 - math.pi) * 0.04, abs=0.01)


def test_dashes_cover_six_tenths_of_a_line() -> None:
    found = [shape.points for shape in dashes([(0.0, 0.0), (3.0, 0.0), (3.0, 4.0)], GREEN, 1.0, 0.5)]
    assert sum(math.dist(a, b) for a, b in found) == pytest.approx(0.6 * 7.0)
    assert list(dashes([(1.0, 1.0), (1.0, 1.0)], GREEN, 1.0, 0.5)) == []


def test_the_room_in_a_region_is_measured_through_its_middle() -> None:
    assert room(Rectangle(0.0, 0.0, 4.0, 2.0)) == pytest.approx((4.0, 2.0))
    assert room(Circle(1.0, 1.0, 2.0)) == pytest.approx((4.0, 4.0))


def test_a_placeholder_that_is_none_stays_as_it_is() -> None:
    game = replace(UNKNOWN_GAME, score_words={"red": "box{es} and flag{s}"})
    assert [game.counted("red", points) for points in (1, 2)] == ["box{es} and flag", "box{es} and flags"]
    assert not game.counted("blue", 2)
