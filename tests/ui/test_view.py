"""From metres to pixels."""

import math
from dataclasses import replace

import pytest

from vrg.bus import messages as m
from vrg.regions import Circle
from vrg.testing.views import synthetic
from vrg.ui.scene import Scene
from vrg.ui.view import MARGIN, extent, fit

TALL = (16.0, -32.0, 26.0, -13.0)


@pytest.mark.parametrize(("area", "turned", "scale"), [((940, 800), True, 940 / 19), ((400, 900), False, 40.0)])
def test_a_tall_field_is_turned_in_a_wide_window_only(area, turned, scale):
    view = fit(TALL, (0, 0, *area))
    assert (view.turned, view.scale) == (turned, pytest.approx(scale))


@pytest.mark.parametrize("area", [(0, 0, 940, 800), (30, 20, 400, 900), (0, 0, 50, 50)])
def test_the_whole_field_is_within_the_area_and_a_pixel_knows_its_place(area):
    view = fit(TALL, area)
    for x in TALL[0::2]:
        for y in TALL[1::2]:
            px, py = view.point(x, y)
            assert view.place(px, py) == pytest.approx((x, y))
            assert area[0] - 1e-6 <= px <= area[0] + area[2] + 1e-6
            assert area[1] - 1e-6 <= py <= area[1] + area[3] + 1e-6


@pytest.mark.parametrize("area", [(0, 0, 940, 800), (0, 0, 400, 900)])
@pytest.mark.parametrize("theta", [0.0, 0.7, math.pi / 2, -2.5])
def test_headings_turn_with_the_view(area, theta):
    view = fit(TALL, area)
    ax, ay = view.point(20.0, -20.0)
    bx, by = view.point(20.0 + math.cos(theta), -20.0 + math.sin(theta))
    assert math.atan2(ay - by, bx - ax) == pytest.approx(math.remainder(view.angle(theta), 2 * math.pi))


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
