"""Plane geometry, against brute force and symmetry."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vrg.geometry import SIGMAS, corners, ellipse, interpolate, outline_distance, wrap
from vrg.types import Pose, Uncertainty

coordinates = st.floats(-5, 5)
poses = st.builds(Pose, coordinates, coordinates, st.floats(-10, 10))
sizes = st.tuples(st.floats(0.1, 2), st.floats(0.1, 2))


@given(st.floats(-100, 100))
def test_a_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrap(angle)
    assert -math.pi <= wrapped < math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-9)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-9)


@given(poses, poses)
def test_interpolation_ends_at_its_ends_and_turns_the_short_way(a: Pose, b: Pose) -> None:
    end = interpolate(a, b, 1.0)
    assert (end.x, end.y) == pytest.approx((b.x, b.y))
    assert abs(wrap(end.theta - b.theta)) < 1e-9
    assert abs(interpolate(a, b, 0.5).theta - a.theta) <= math.pi / 2 + 1e-9


def _outline(pose: Pose, size: tuple[float, float], n: int = 60) -> np.ndarray:
    points = corners(pose, *size)
    edges = zip(points, points[1:] + points[:1], strict=True)
    return np.concatenate([np.linspace(p, q, n) for p, q in edges])


@given(poses, poses, sizes, sizes)
def test_outline_distance_agrees_with_brute_force(a: Pose, b: Pose, a_size, b_size) -> None:  # type: ignore[no-untyped-def]
    distance = outline_distance(a, b, a_size, b_size)
    assert distance == pytest.approx(outline_distance(b, a, b_size, a_size), abs=1e-9)
    one, other = _outline(a, a_size), _outline(b, b_size)
    sampled = float(np.min(np.linalg.norm(one[:, None] - other[None], axis=2)))
    if distance > 0:
        assert sampled - 0.06 <= distance <= sampled + 1e-9
    else:
        assume(sampled > 0.06)  # one lies inside the other
        assert min(a_size[0] * a_size[1], b_size[0] * b_size[1]) > 0


@given(poses, sizes)
def test_a_body_inside_another_touches_it(pose: Pose, size: tuple[float, float]) -> None:
    assert outline_distance(pose, pose, size, (size[0] / 3, size[1] / 3)) == 0.0


@given(st.floats(0.01, 2.0), st.floats(0.01, 2.0), st.floats(-math.pi, math.pi))
def test_each_corner_of_an_ellipse_is_as_unlikely_as_the_others(a: float, b: float, turn: float) -> None:
    """The covariance is that of a long axis `a` and a short one `b`, turned."""
    c, s = math.cos(turn), math.sin(turn)
    covariance = np.array([[c, -s], [s, c]]) @ np.diag([a * a, b * b]) @ np.array([[c, s], [-s, c]])
    known = Uncertainty(covariance[0, 0], covariance[0, 1], covariance[1, 1], 0.0)
    longer, shorter, _ = known.ellipse
    assert (longer, shorter) == pytest.approx((max(a, b), min(a, b)), abs=1e-5)
    for x, y in ellipse(3.0, -1.0, known):
        away = np.array([x - 3.0, y + 1.0])
        assert away @ np.linalg.solve(covariance, away) == pytest.approx(SIGMAS**2, rel=1e-3)
