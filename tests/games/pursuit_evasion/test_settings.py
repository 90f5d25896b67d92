"""The surveillance area is a convex polygon; whatever is none is refused with the reason."""

import math
import random
import re
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.spatial import ConvexHull

from tests.games.pursuit_evasion.making import SQUARE
from vrg.games.pursuit_evasion.settings import Settings, not_convex
from vrg.types import Vector

PENTAGON = tuple((3 * math.cos(0.3 + i * math.tau / 5), 3 * math.sin(0.3 + i * math.tau / 5)) for i in range(5))


def test_a_convex_area_is_accepted_as_it_is() -> None:
    for area in (SQUARE, PENTAGON, SQUARE[:3]):
        assert Settings(area=area).area == area
        assert Settings(area=area).region.outline() == list(area)


def test_a_clockwise_area_is_accepted_too() -> None:
    made = Settings(area=SQUARE[::-1])
    assert set(made.area) == set(SQUARE)
    assert made.region.contains(5.0, 5.0)
    assert not made.region.contains(11.0, 5.0)


def test_a_corner_on_a_side_is_no_harm() -> None:
    assert Settings(area=((0, 0), (5, 0), (10, 0), (10, 10), (0, 10))).region.contains(5.0, 0.0)


def test_an_area_that_is_none_is_refused() -> None:
    expected: list[tuple[object, str]] = [
        (((0, 0), (10, 0), (5, 2), (5, 10)), "bends inwards"),
        (((0, 0), (10, 0), (10, 10), (5, 1), (0, 10)), r"corner 4, \(5, 1\), the border bends inwards"),
        (((0, 0), (10, 10), (10, 0), (0, 10)), "crosses itself"),
        (((0, 0), (4, 0), (4, 3), (0, 3), (4, 0), (4, 3)), "crosses itself|bends"),
        (((0, 0), (0, 0), (10, 0), (10, 10)), r"corner 2, \(0, 0\), is the same as the one before"),
        (((0, 0), (10, 0), (10, 10), (0, 0)), r"corner 1, \(0, 0\), is the same as the one before"),
        (((0, 0), (5, 5), (10, 10)), "on one line"),
        (((0, 0), (10, 10), (5, 5), (2, 2)), "on one line|crosses itself"),
        (((0, 0), (2, 0), (1, 0), (1, 1)), "crosses itself|bends"),
        ((*SQUARE, *SQUARE), "crosses itself"),
        (((0, 0), (10, 0)), "at least 3"),
        ((), "at least 3"),
        (((0, 0), (10, 0), (math.nan, 10)), "finite"),
        (((0, 0), (10, 0), (math.inf, 10)), "finite|less than"),
        (((0, 0), (10, 0), (10, 1e5)), "less than or equal to 10000"),
        (((0, 0), (10, 0), (10,)), "required|missing"),
    ]
    wrong = []
    for area, told in expected:
        try:
            Settings.model_validate({"area": area})
        except ValidationError as error:
            if not re.search(told, str(error), re.IGNORECASE):
                wrong.append(f"{area}, expected {told}: {error}")
        else:
            wrong.append(f"{area} is accepted")
    assert not wrong, "\n".join(wrong)


def test_a_star_is_refused() -> None:
    assert not_convex([PENTAGON[2 * i % 5] for i in range(5)]) is not None


def test_numbers_that_make_no_sense_are_refused() -> None:
    changes: list[dict[str, object]] = [
        {"capture_distance": 0},
        {"capture_distance": -1},
        {"capture_distance": math.nan},
        {"launch_window": -1},
        {"time": 0},
        {"time": math.inf},
        {"auction": 0},
        {"lost_after": 0},
        {"pursuer_speed": 0},
        {"intruder_speed": -0.5},
        {"lineup_limit": 0},
        {"size": 3},
    ]
    wrong = []
    for changed in changes:
        with suppress(ValidationError):
            Settings.model_validate({"area": SQUARE} | changed)
            wrong.append(str(changed))
    assert not wrong, "\n".join(wrong)


def test_the_defaults_are_those_of_the_rules() -> None:
    made = Settings(area=SQUARE)
    assert made.capture_distance == 1.0
    assert made.pursuer_speed is made.intruder_speed is None


points = st.lists(st.tuples(st.floats(-30, 30), st.floats(-30, 30)), min_size=6, max_size=15)


def hull(corners: list[Vector]) -> list[Vector] | None:
    """The corners of the convex hull, counter-clockwise; None if it is hardly wider than a line."""
    array = np.array(corners)
    if np.linalg.svd(array - array.mean(axis=0), compute_uv=False)[1] < 1.0:
        return None
    return [corners[i] for i in ConvexHull(array).vertices]


def far_apart(corners: list[Vector]) -> bool:
    return all(math.dist(a, b) > 1e-3 for a, b in zip(corners, corners[1:] + corners[:1], strict=True))


def bends(corners: list[Vector]) -> list[float]:
    """The sine of the turn at each corner."""
    made = []
    for i, b in enumerate(corners):
        a, c = corners[i - 1], corners[(i + 1) % len(corners)]
        cross = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
        made.append(cross / (math.dist(a, b) * math.dist(b, c)))
    return made


@given(points, st.integers(0, 20), st.booleans())
def test_the_hull_of_any_points_is_accepted_from_any_corner_and_either_way_round(
    some: list[Vector], first: int, clockwise: bool
) -> None:
    corners = hull(some)
    if corners is None or not far_apart(corners):
        return
    turned = [corners[(i + first) % len(corners)] for i in range(len(corners))]
    made = Settings(area=tuple(turned[::-1] if clockwise else turned))
    x, y = np.mean(corners, axis=0).tolist()
    assert made.region.contains(x, y)


@given(points, st.randoms(use_true_random=False))
def test_corners_out_of_order_are_refused(some: list[Vector], rng: random.Random) -> None:
    corners = hull(some)
    if corners is None or len(corners) < 4 or min(map(abs, bends(corners))) < 1e-3 or not far_apart(corners):
        return
    mixed = rng.sample(corners, len(corners))
    at = mixed.index(corners[0])
    turned = mixed[at:] + mixed[:at]
    in_order = turned in (corners, [corners[0], *corners[:0:-1]])
    assert (not_convex(mixed) is None) == in_order


@given(points, st.integers(0, 20), st.floats(0.05, 0.9))
def test_a_corner_that_is_pushed_inwards_is_refused(some: list[Vector], which: int, how_far: float) -> None:
    corners = hull(some)
    if corners is None or len(corners) < 4 or min(map(abs, bends(corners))) < 1e-3 or not far_apart(corners):
        return
    i = which % len(corners)
    (ax, ay), (bx, by) = corners[i - 1], corners[(i + 1) % len(corners)]
    middle = (ax + bx) / 2, (ay + by) / 2
    x, y = np.mean([c for j, c in enumerate(corners) if j != i], axis=0).tolist()
    corners[i] = middle[0] + how_far * (x - middle[0]), middle[1] + how_far * (y - middle[1])
    if min(map(abs, bends(corners))) < 1e-3:
        return
    with pytest.raises(ValidationError):
        Settings(area=tuple(corners))


def test_what_is_accepted_is_an_area_also_if_it_is_large() -> None:
    """Corners on straight sides, with coordinates of some kilometres, are rounded a little to the wrong side."""
    rng = random.Random(1)
    refused = 0
    for _ in range(300):
        turn, size = rng.uniform(0, math.tau), rng.uniform(1e3, 7e3)
        c, s = size * math.cos(turn), size * math.sin(turn)
        (ax, ay), (bx, by) = (-c, -s), (c, s)
        shares = sorted(rng.uniform(0.1, 0.9) for _ in range(3))
        side = [(ax + (bx - ax) * share, ay + (by - ay) * share) for share in shares]
        area = ((ax, ay), *side, (bx, by), (-0.9 * s, 0.9 * c))
        if not_convex(area) is not None:
            refused += 1
            continue
        assert Settings(area=area).region.contains(-0.1 * s, 0.1 * c)
    assert refused < 300, "some are accepted"
