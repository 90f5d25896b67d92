"""From metres to pixels."""

import math
from dataclasses import replace

import pytest

from tests.ui import synthetic
from vrg.bus import messages as m
from vrg.regions import Circle
from vrg.ui.scene import Scene
from vrg.ui.view import MARGIN, extent, fit

TALL = (16.0, -32.0, 26.0, -13.0)


def test_a_tall_field_is_turned_in_a_wide_window():
    view = fit(TALL, (0, 0, 940, 800))
    assert view.turned
    assert view.scale == pytest.approx(940 / 19)


def test_a_tall_field_stands_in_a_tall_window():
    view = fit(TALL, (0, 0, 400, 900))
    assert not view.turned
    assert view.scale == pytest.approx(40.0)


@pytest.mark.parametrize("area", [(0, 0, 940, 800), (30, 20, 400, 900), (0, 0, 50, 50)])
def test_the_whole_field_is_within_the_area(area):
    view = fit(TALL, area)
    for x in TALL[0::2]:
        for y in TALL[1::2]:
            px, py = view.point(x, y)
            assert area[0] - 1e-6 <= px <= area[0] + area[2] + 1e-6
            assert area[1] - 1e-6 <= py <= area[1] + area[3] + 1e-6


@pytest.mark.parametrize("area", [(0, 0, 940, 800), (0, 0, 400, 900)])
@pytest.mark.parametrize("theta", [0.0, 0.7, math.pi / 2, -2.5])
def test_headings_turn_with_the_view(area, theta):
    view = fit(TALL, area)
    ax, ay = view.point(20.0, -20.0)
    bx, by = view.point(20.0 + math.cos(theta), -20.0 + math.sin(theta))
    assert math.atan2(ay - by, bx - ax) == pytest.approx(math.remainder(view.angle(theta), 2 * math.pi))


def test_a_quarter_turn_does_not_mirror():
    view = fit(TALL, (0, 0, 940, 800))
    (ox, oy), (xx, xy), (yx, yy) = view.point(0, 0), view.point(1, 0), view.point(0, 1)
    cross = (xx - ox) * (yy - oy) - (xy - oy) * (yx - ox)
    assert cross < 0, "on a screen, where y is down, a right-handed pair has a negative cross product"


@pytest.mark.parametrize("area", [(0, 0, 940, 800), (30, 20, 400, 900)])
def test_the_place_of_a_pixel_is_where_its_point_came_from(area):
    view = fit(TALL, area)
    assert view.place(*view.point(20.0, -17.5)) == pytest.approx((20.0, -17.5))


def test_zones_of_every_shape_are_in_sight(scene_at):
    scene = scene_at(0.0, zones=synthetic.four_shapes())
    x_min, y_min, x_max, y_max = extent(scene)
    points = [point for zone in scene.zones for point in zone.region.outline()]
    assert all(x_min < x < x_max and y_min < y < y_max for x, y in points)
    circle = m.Zone(name="circle", kind="field", region=Circle(0.0, 1.0, 2.0))
    assert extent(replace(scene_at(0.0, zones=[circle]), starts=())) == pytest.approx(
        (-2.0 - MARGIN, -1.0 - MARGIN, 2.0 + MARGIN, 3.0 + MARGIN)
    )


def test_without_zones_walls_or_bodies_there_is_still_an_extent(scene_at):
    x_min, y_min, x_max, y_max = extent(Scene())
    assert x_max > x_min
    assert y_max > y_min
    assert extent(scene_at(1.0, zones=[]))[0] < 16.0
