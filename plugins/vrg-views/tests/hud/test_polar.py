"""The geometry of the laser's and the sonars' plots, and what they tell in words."""

import math
from typing import Any

import pytest
from displays import ROBOT, ring, scan

from vrg.hal.sensors.depiction import Cones, Rays
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sensors.sonar import SonarSpec
from vrg_views.hud.polar import REACHES, RINGS, echoes, nearest, nearest_words, polar_plot, reach_for

AREA = (100, 50, 400, 200)
RIGHT, LEFT = -math.pi / 2, math.pi / 2


def test_a_half_circle_fills_an_area_twice_as_wide_as_high() -> None:
    plot = polar_plot(AREA, RIGHT, LEFT, 10.0)
    assert plot.origin == pytest.approx((300, 250))
    assert plot.scale == pytest.approx(20.0)


def test_ahead_is_up_and_left_is_left() -> None:
    plot = polar_plot(AREA, RIGHT, LEFT, 10.0)
    assert plot.polar(10.0, 0.0) == pytest.approx((300, 50))
    assert plot.polar(10.0, LEFT) == pytest.approx((100, 250))
    assert plot.at(0.0, -10.0) == pytest.approx((500, 250))


def test_every_beam_is_in_the_area() -> None:
    wrong = []
    for fov in (0.5, 1.0, 2.0, math.pi, 4.0, 5.5, math.tau):
        for area in (AREA, (0, 0, 100, 300), (0, 0, 300, 300)):
            plot = polar_plot(area, -fov / 2, fov / 2, 5.0)
            left, top, width, height = area
            for step in range(101):
                x, y = plot.polar(5.0, fov * (step / 100 - 0.5))
                if not (left - 1e-6 <= x <= left + width + 1e-6 and top - 1e-6 <= y <= top + height + 1e-6):
                    wrong.append(f"{fov} rad in {area}, step {step}: {x}, {y}")
    assert not wrong, "\n".join(wrong)


def test_how_far_a_plot_reaches_does_not_flicker() -> None:
    assert reach_for(4.0, None) == 5.0
    assert reach_for(5.1, 5.0) == 8.0
    assert reach_for(4.9, 8.0) == 8.0
    assert reach_for(3.9, 8.0) == 5.0
    assert reach_for(1e4, None) == REACHES[-1]


def test_rings_are_at_round_parts_of_the_reach() -> None:
    for reach, step in RINGS.items():
        assert 2 <= reach / step <= 6
        assert reach / step == round(reach / step)


def rays(distance: float, **near: Any) -> Rays:
    spec = ROBOT.sensor(LaserSpec)
    assert spec is not None
    return spec.depict(scan(distance, **near))


def cones(**near: float) -> Cones:
    spec = ROBOT.sensor(SonarSpec)
    assert spec is not None
    found = spec.depict(ring(**near))
    assert found is not None
    return found


def test_the_nearest_thing_in_a_scan() -> None:
    found = rays(4.0, nearest=(120, 1.5))
    assert nearest(found) == pytest.approx((1.5, math.radians(30)))
    assert nearest_words(found) == "nearest 1.50 m at +30°"
    assert nearest(rays(30.0)) is None
    assert nearest_words(rays(30.0)) == "nothing within 30 m"
    assert len(echoes(rays(30.0, nearest=(3, 2.0)))[0]) == 1


def test_the_nearest_echo_of_a_ring() -> None:
    assert nearest(cones(_0=2.0, _3=1.0)) == pytest.approx((1.0, math.radians(10)))
    assert nearest_words(cones(_3=1.0)) == "nearest 1.00 m at +10°"
    assert nearest(cones()) is None


def test_a_cone_begins_at_its_transducer_and_ends_at_the_range() -> None:
    found = cones(_0=2.0)
    first, *arc = found.outline(0, 7)
    assert first == (found.places[0].x, found.places[0].y)
    assert {round(math.dist(first, point), 6) for point in arc} == {2.0}
    bearings = [math.atan2(y - first[1], x - first[0]) for x, y in (arc[0], arc[-1])]
    assert bearings[1] - bearings[0] == pytest.approx(found.angle)
