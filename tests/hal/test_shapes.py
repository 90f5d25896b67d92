"""Boxes and circles: overlap and the way out of it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.sim.shapes import Box, Circle, apart, box_edges, box_gap, boxes_touch, circle_gap, circle_touches, outline

place = st.floats(-2, 2)
size = st.floats(0.1, 2)
angle = st.floats(-math.pi, math.pi)
box = st.builds(Box, place, place, angle, size, size)
circle = st.builds(Circle, place, place, size)


def inside(b: Box, x: float, y: float, margin: float) -> bool:
    c, s = math.cos(b.heading), math.sin(b.heading)
    u, v = (x - b.x) * c + (y - b.y) * s, (y - b.y) * c - (x - b.x) * s
    return abs(u) <= b.length / 2 + margin and abs(v) <= b.width / 2 + margin


def grid(b: Box) -> list[tuple[float, float]]:
    c, s = math.cos(b.heading), math.sin(b.heading)
    return [
        (b.x + u * b.length * c - v * b.width * s, b.y + u * b.length * s + v * b.width * c)
        for u in np.linspace(-0.5, 0.5, 12)
        for v in np.linspace(-0.5, 0.5, 12)
    ]


@given(box, box)
def test_a_point_in_both_boxes_means_that_they_touch(a: Box, b: Box) -> None:
    if any(inside(b, x, y, -1e-6) for x, y in grid(a)):
        assert boxes_touch(a, b)


@given(box, box)
def test_moving_out_along_the_normal_frees_a_box(a: Box, b: Box) -> None:
    gap = box_gap(a, b)
    if gap.distance < 0:
        push = 1e-6 - gap.distance
        assert not boxes_touch(Box(a.x + push * gap.nx, a.y + push * gap.ny, a.heading, a.length, a.width), b)


@given(box, box)
def test_touching_is_mutual(a: Box, b: Box) -> None:
    assert box_gap(a, b).distance == pytest.approx(box_gap(b, a).distance, abs=1e-9)


@given(box, box, st.one_of(st.just(0.0), st.floats(-0.5, 0.5)))
def test_boxes_are_apart_exactly_where_their_gap_is_so_large(a: Box, b: Box, distance: float) -> None:
    gap = box_gap(a, b).distance
    assert apart(outline(a), outline(b), distance) == (gap >= distance)
    assert apart(outline(a), outline(b), gap)


@given(box, circle)
def test_moving_out_along_the_normal_frees_a_box_from_a_circle(b: Box, c: Circle) -> None:
    gap = circle_gap(b, c)
    assert circle_touches(b, c) == (gap.distance < 0)
    if any(math.hypot(x - c.x, y - c.y) < c.radius - 1e-6 for x, y in grid(b)):
        assert gap.distance < 0
    if gap.distance < 0:
        push = 1e-6 - gap.distance
        assert not circle_touches(Box(b.x + push * gap.nx, b.y + push * gap.ny, b.heading, b.length, b.width), c)


def test_the_gap_names_the_side_that_touches() -> None:
    body = Box(0.0, 0.0, 0.0, 0.5, 0.4)
    wall = box_gap(body, Box(0.36, 0.0, 0.0, 0.2, 10.0))
    assert wall.distance == pytest.approx(0.01)
    assert (wall.nx, wall.ny) == pytest.approx((-1.0, 0.0))
    assert (wall.x, wall.y) == pytest.approx((0.25, 0.0))
    post = circle_gap(body, Circle(0.0, 0.3, 0.05))
    assert post.distance == pytest.approx(0.05)
    assert (post.x, post.y) == pytest.approx((0.0, 0.2))


def test_outlines_are_counter_clockwise() -> None:
    edges = box_edges(np.array([(1.0, 2.0, 0.5, 3.0, 1.0)]))
    area = (edges[:, 0] * edges[:, 3] - edges[:, 2] * edges[:, 1]).sum() / 2
    assert area == pytest.approx(3.0)
    assert np.array_equal(edges[:, 2:], np.roll(edges[:, :2], -1, axis=0))
