"""The arithmetic of a match: within a unit in the last place, and the same bits on every computer."""

import hashlib
import math
import re
import struct
from collections.abc import Callable
from fractions import Fraction
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.portable.arrays import cos_sin_array, hypot, inverted, normals, product, turn_order
from vrg.portable.scalars import FAR, acos, asin, atan2, cos, cos_sin, exp, log, sin, square, tan, total

ONE = 1 << 220
"""1 as a fixed-point number, which the functions below compute with: they are the measure."""
ANGLES = st.one_of(
    st.floats(-7.0, 7.0), st.floats(-FAR, FAR), st.integers(-1000, 1000).map(lambda n: n * math.pi / 4)
).filter(lambda angle: angle == 0.0 or abs(angle) > 1e-9)
LENGTHS = st.one_of(st.just(0.0), st.floats(1e-9, 1e9), st.floats(-1e9, -1e-9), st.floats(-30.0, 30.0))


def fixed(value: float) -> int:
    above, below = value.as_integer_ratio()
    return above * ONE // below


def series(x: int, sign: int, first: int) -> int:
    """The sum of sign^k x^n / n! for n = first, first + 2, and so on; with a step of 1 where the sign is 0."""
    step = 2 if sign else 1
    term = ONE if first == 0 else x
    total, n = term, first
    while term:
        for _ in range(step):
            n += 1
            term = term * x // (n * ONE)
        term = term * sign if sign else term
        total += term
        if abs(term) <= 1:
            break
    return total


def arc_tangent(y: int, x: int) -> int:
    """Of y / x, at most 1 in size, by Newton's method from the C library's."""
    angle = fixed(math.atan2(y / ONE, x / ONE))
    for _ in range(4):
        s, c = series(angle, -1, 1), series(angle, -1, 0)
        angle += (y * c - x * s) * ONE // (x * c + y * s)
    return angle


HALF_TURN = 4 * arc_tangent(ONE, ONE)


def units(found: float, exact: int) -> float:
    """How many units in the last place a number is off."""
    return float(abs(fixed(found) - exact) / Fraction(math.ulp(exact / ONE)) / ONE)


@given(ANGLES)
def test_cosine_and_sine_are_within_a_unit_in_the_last_place(angle: float) -> None:
    rest = fixed(angle) % (2 * HALF_TURN)
    for found, exact in zip(cos_sin(angle), (series(rest, -1, 0), series(rest, -1, 1)), strict=True):
        assert units(found, exact) < 1.0
    assert (cos(angle), sin(angle)) == cos_sin(angle)
    assert units(tan(angle), series(rest, -1, 1) * ONE // series(rest, -1, 0)) < 2.0


@given(st.floats(-1e-9, 1e-9))
def test_a_small_angle_is_its_own_sine(angle: float) -> None:
    assert cos_sin(angle) == (1.0, angle)
    assert math.copysign(1.0, cos_sin(-0.0)[1]) == 1.0
    assert atan2(angle, 1.0) == angle


@given(LENGTHS, LENGTHS)
def test_a_direction_is_within_a_unit_in_the_last_place(y: float, x: float) -> None:
    if min(abs(x), abs(y)) < 1e-9 or not 1e-9 < abs(y / x) < 1e9:
        assert atan2(y, x) == pytest.approx(math.atan2(y, x), rel=1e-15, abs=1e-300)
        return
    a, b = fixed(abs(y)), fixed(abs(x))
    exact = arc_tangent(a, b) if a <= b else HALF_TURN // 2 - arc_tangent(b, a)
    exact = exact if x > 0.0 else HALF_TURN - exact
    assert units(abs(atan2(y, x)), exact) < 1.0
    assert math.copysign(1.0, atan2(y, x)) == math.copysign(1.0, y)


@pytest.mark.parametrize("y", [0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan, 5e-324, 1e308])
@pytest.mark.parametrize("x", [0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan, 5e-324, 1e308])
def test_the_direction_of_special_vectors_is_that_of_the_c_library(y: float, x: float) -> None:
    assert struct.pack("d", atan2(y, x)) == struct.pack("d", math.atan2(y, x)) or math.isnan(math.atan2(y, x))
    assert math.isnan(atan2(y, x)) == math.isnan(math.atan2(y, x))


@given(st.floats(-1.0, 1.0))
def test_arcs_are_within_two_units_in_the_last_place(value: float) -> None:
    assert abs(asin(value) - math.asin(value)) <= 2.0 * math.ulp(math.asin(value))
    assert abs(acos(value) - math.acos(value)) <= 2.0 * math.ulp(math.acos(value))


@given(st.floats(-30.0, 30.0))
def test_a_power_of_e_is_within_a_unit_in_the_last_place(power: float) -> None:
    assert units(exp(power), series(fixed(power), 0, 0)) < 1.0


@given(st.floats(1e-300, 1e300))
def test_a_logarithm_is_within_two_units_of_the_c_librarys(value: float) -> None:
    assert abs(log(value) - math.log(value)) <= 2.0 * math.ulp(math.log(value))


def test_what_has_no_result_is_refused() -> None:
    for refused, error in ((lambda: cos_sin(math.inf), ValueError), (lambda: asin(1.1), ValueError),
                           (lambda: acos(-1.1), ValueError), (lambda: exp(710.0), OverflowError),
                           (lambda: exp(1e9), OverflowError), (lambda: log(0.0), ValueError),
                           (lambda: log(math.inf), ValueError)):  # fmt: skip
        with pytest.raises(error):
            refused()
    assert math.isnan(cos_sin(math.nan)[0])
    assert math.isnan(exp(math.nan))
    assert exp(-1e9) == exp(-math.inf) == 0.0
    assert cos_sin(3e9) == pytest.approx((math.cos(3e9), math.sin(3e9)), abs=1e-6)


@given(st.lists(st.one_of(ANGLES, st.floats(-1e12, 1e12)), max_size=99))
def test_arrays_give_the_same_bits_as_numbers(angles: list[float]) -> None:
    cosines, sines = cos_sin_array(np.array(angles))
    for angle, *found in zip(angles, cosines.tolist(), sines.tolist(), strict=True):
        assert struct.pack("2d", *found) == struct.pack("2d", *cos_sin(angle))


def test_arrays_keep_their_shape_and_have_no_number_for_infinite_angles() -> None:
    angles = np.array([[0.0, math.pi], [math.inf, math.nan]])
    cosines, sines = cos_sin_array(angles)
    assert cosines.tolist()[0] == [1.0, -1.0]
    assert sines[0, 0] == 0.0
    assert np.isnan(cosines[1]).all()
    assert np.isnan(sines[1]).all()
    assert [a.shape for a in cos_sin_array(np.zeros((2, 0)))] == [(2, 0), (2, 0)]


@given(st.integers(1, 6), st.integers(0, 99))
def test_small_matrices(size: int, seed: int) -> None:
    some = np.random.default_rng(seed).uniform(-1.0, 1.0, (size, size + 1))
    matrix = product(some, some.T) + np.eye(size)
    assert np.allclose(matrix, some @ some.T + np.eye(size))
    assert np.allclose(product(inverted(matrix), matrix), np.eye(size), atol=1e-12)
    assert np.allclose(product(some, some[0]), some @ some[0])
    with pytest.raises(ValueError, match="positive definite"):
        inverted(-matrix)


@given(st.lists(st.floats(-math.pi, math.pi), min_size=2, unique=True))
def test_the_order_of_turns_is_that_of_their_angles(angles: list[float]) -> None:
    order = turn_order(*cos_sin_array(np.array(sorted(angles))))
    assert (np.diff(order) >= 0.0).all()
    assert (np.abs(order) <= 2.0).all()
    assert turn_order(np.array([1.0, 0.0, -3.0, 0.0, -1.0]), np.array([0.0, 2.0, 0.0, -2.0, -0.0])).tolist() == [
        0.0, 1.0, 2.0, -1.0, -2.0,
    ]  # fmt: skip


def test_draws_are_normal_and_rounded() -> None:
    drawn, exact = (draw(np.random.default_rng(3), 20_000) for draw in (normals, np.random.Generator.standard_normal))
    assert abs(drawn - exact).max() <= 2.0**-21
    assert np.array_equal(drawn * 2.0**20, np.rint(drawn * 2.0**20))


def test_sums_and_squares_are_those_of_simple_steps() -> None:
    assert total([0.1] * 10) == 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 + 0.1 == 0.9999999999999999
    assert total([]) == 0.0
    assert square(0.1) == 0.1 * 0.1


def test_lengths() -> None:
    assert hypot(np.array([3.0, 0.0]), np.array([-4.0, 0.0])).tolist() == [5.0, 0.0]


def _matrices(value: float) -> list[list[float]]:
    some = np.array([[value, 1.3, -0.7], [0.1, value + 0.3, 2.9]])
    square_one = product(some, some.T) + np.eye(2)
    return product(inverted(square_one), some).tolist()


RESULTS: dict[str, tuple[Callable[[float], object], str]] = {
    "cosine and sine": (cos_sin, "754fbe4f02665504"),
    "direction": (lambda value: atan2(value, 1.3 - value * value), "bcef0ebf75823be0"),
    "power of e": (exp, "afd52cbe0770904d"),
    "logarithm": (lambda value: log(value * value + 1e-9), "7f2fc782633f6d7b"),
    "tangent and arcs": (lambda value: (tan(value), asin(value / 66.0), acos(value / 66.0)), "2f7bd2422b1c9d4e"),
    "small matrices": (_matrices, "a22c2bb2993b80ea"),
    "draws": (lambda value: normals(np.random.default_rng(int(value * 1e3) % 9973), 2).tolist(), "88a099675f3224ff"),
    "what Python computes itself": (
        lambda value: (
            math.hypot(value, 1.3), math.dist((value, 0.1), (0.7, value * 3.0)), math.remainder(value, 0.7)
        ),
        "e2e64cd74168dccc",
    ),
}  # fmt: skip
"""Functions of a number, and the digest of 9,500 results."""


@pytest.mark.parametrize("name", RESULTS)
def test_the_bits_are_those_of_every_computer(name: str) -> None:
    function, expected = RESULTS[name]
    results = [function(number * 0.0137 - 65.0) for number in range(9_500)]
    assert hashlib.sha256(repr(results).encode()).hexdigest()[:16] == expected


def test_what_strategies_are_told_to_use_is_there() -> None:
    text = (Path(__file__).parents[1] / "docs" / "players.md").read_text(encoding="utf-8")
    found = re.findall(r"^    from (vrg\.portable\.\w+) import (.*)$", text, re.MULTILINE)
    assert len(found) == 2
    for module, names in found:
        assert all(callable(getattr(import_module(module), name)) for name in names.split(", "))
