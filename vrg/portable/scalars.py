"""Arithmetic that gives the same bits on every computer, so that a seed gives the same match there.

IEEE 754 fixes the last bit of `+`, `-`, `*`, `/` and `sqrt`, and of what is exact anyway (`floor`, `fmod`, `ldexp`),
but not of sines, powers and products of matrices: `math.sin` is the C library's, which gives other last bits where it
may use fused multiply-add, and a product of matrices is that of a BLAS, which chooses its code by the processor. What
takes part in a match uses this module instead. `math.hypot` and `math.dist` are Python's own code, and may be used; but
in a function that is also compiled they would be the C library's.

The polynomials are those of fdlibm 5.3 (Sun Microsystems, 1993: k_sin.c, k_cos.c, e_rem_pio2.c, s_atan.c, e_exp.c,
e_log.c). A compiled function gives the same bits, as long as the compiler contracts no product and sum into one
operation. `vrg.portable.arrays` has the same for arrays.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any, Final

VERSION: Final = 1
"""The number of these functions' results: it rises when a last bit of any of them changes."""
FAR: Final = 2.0**20
"""The angle in rad up to which the cosine and the sine are exact to a unit in the last place."""
_TO_QUARTERS: Final = 6.36619772367581382433e-01  # 2 / pi
_WHOLE: Final = 1.5 * 2.0**52  # added and taken away again, it rounds to a whole number, ties to even
_Q1, _Q2, _Q3 = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21  # their sum is pi / 2
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


def cos_sin(angle: float) -> tuple[float, float]:
    """The cosine and the sine of an angle, rad: the unit vector in its direction.

    Both are exact to a unit in the last place for angles up to FAR; the sine of -0.0 is 0.0. Beyond that the angle is
    first taken modulo the nearest number to 2 pi, which changes it by up to 4e-17 of itself.

    Raises:
        ValueError: the angle is infinite.
    """
    if not abs(angle) <= FAR:
        if math.isnan(angle):
            return angle, angle
        if math.isinf(angle):
            raise ValueError("expected a finite angle")
        angle = math.copysign(abs(angle) % math.tau, angle)
    quarters, cos, sin = within_a_quarter(angle)
    quarter = int(quarters) & 3
    if quarter == 0:
        return cos, sin
    if quarter == 1:
        return -sin, cos
    if quarter == 2:
        return -cos, -sin
    return sin, -cos


def hypot(x: float, y: float) -> float:
    """The length of a vector, which is not so long that its square is no number."""
    return math.sqrt(x * x + y * y)


def square(value: float) -> float:
    """The number times itself: `value ** 2` would be a power of the C library's."""
    return value * value


def total(values: Iterable[float]) -> float:
    """The sum of numbers, one after the other: the built-in `sum` keeps what it loses from Python 3.12 on."""
    result = 0.0
    for value in values:
        result += value
    return result


def inverse(rows: Sequence[Sequence[float]]) -> list[list[float]]:
    """The inverse of a small symmetric positive definite matrix by its square root (Cholesky), row by row.

    Raises:
        ValueError: the matrix is not positive definite.
    """
    n = len(rows)
    # The inverse of the lower triangle L of the matrix = L L', row by row.
    lower = [[0.0] * n for _ in rows]
    inverted = [[0.0] * n for _ in rows]
    for i, row in enumerate(rows):
        for j in range(i + 1):
            left = row[j]
            for k in range(j):
                left -= lower[i][k] * lower[j][k]
            if i > j:
                lower[i][j] = left / lower[j][j]
            elif left > 0.0:
                lower[i][i] = math.sqrt(left)
            else:
                raise ValueError("expected a positive definite matrix; make its diagonal larger")
        for j in range(i):
            left = 0.0
            for k in range(j, i):
                left -= lower[i][k] * inverted[k][j]
            inverted[i][j] = left / lower[i][i]
        inverted[i][i] = 1.0 / lower[i][i]
    result = [[0.0] * n for _ in rows]
    for i in range(n):
        for j in range(i + 1):
            both = 0.0
            for k in range(i, n):
                both += inverted[k][i] * inverted[k][j]
            result[i][j] = result[j][i] = both
    return result


def within_a_quarter(angle: Any) -> Any:
    """The multiple of pi / 2 that is nearest to an angle, and the cosine and the sine of the rest.

    Args:
        angle: a number, or an array of numbers, up to FAR, rad.
    """
    quarters = angle * _TO_QUARTERS + _WHOLE - _WHOLE
    rest, less = angle - quarters * _Q1, quarters * _Q2
    near = rest - less
    less = quarters * _Q3 - ((rest - near) - less)
    x = near - less
    tail = (near - x) - less  # of the rest of the angle, which is x + tail
    z = x * x
    half = 0.5 * z
    sin = x + (z * x * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6))))) + tail)
    small = z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6))))) - x * tail
    cos = 1.0 - half
    return quarters, cos + (((1.0 - cos) - half) + small), sin


def cos(angle: float) -> float:
    """The cosine of an angle, rad; see `cos_sin`."""
    return cos_sin(angle)[0]


def sin(angle: float) -> float:
    """The sine of an angle, rad; see `cos_sin`."""
    return cos_sin(angle)[1]


def tan(angle: float) -> float:
    """The tangent of an angle, rad, to two units in the last place; see `cos_sin`."""
    cosine, sine = cos_sin(angle)
    return sine / cosine


_SPLIT: Final = 2.0**27 + 1.0
_SHORT: Final = 1e-140
_LONG: Final = 1e140
_A0, _A1, _A2 = 3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01
_A3, _A4, _A5 = -1.11111104054623557880e-01, 9.09088713343650656196e-02, -7.69187620504482999495e-02
_A6, _A7, _A8 = 6.66107313738753120669e-02, -5.83357013379057348645e-02, 4.97687799461593236017e-02
_A9, _A10 = -3.65315727442169155270e-02, 1.62858201153657823623e-02
_HALF_TURN: Final = (3.14159265358979311600e00, 1.22464679914735317636e-16)  # pi as a sum of two
_QUARTER_TURN: Final = (1.57079632679489655800e00, 6.12323399573676603587e-17)  # pi / 2
_EIGHTH_TURN: Final = (7.85398163397448278999e-01, 3.06161699786838301793e-17)  # pi / 4, the arc tangent of 1
_OF_HALF: Final = (4.63647609000806093515e-01, 2.26987774529616870924e-17)  # the arc tangent of 1 / 2


def atan2(y: float, x: float) -> float:
    """The direction of the vector (x, y) from +x, within [-pi, pi], rad.

    It is exact to a unit in the last place where the numbers are 0 or from 1e-140 to 1e140, and else to two.
    """
    a, b = abs(y), abs(x)
    if not (a < math.inf and b < math.inf):
        if math.isnan(a) or math.isnan(b):
            return math.nan
        a, b = 1.0 if a == math.inf else 0.0, 1.0 if b == math.inf else 0.0
    steep = a > b
    if steep:
        a, b = b, a
    if b > _LONG:
        a, b = a * 0.25, b * 0.25  # so that their sum is a number
    # The angle of the flatter one of (b, a) and (a, b) is base + lower + the arc tangent of u + rest.
    rest = base = lower = u = 0.0
    if 16.0 * a >= 11.0 * b:
        if b > 0.0:
            u = (a - b) / (a + b)
            base, lower = _EIGHTH_TURN
    elif 16.0 * a >= 7.0 * b:
        u = (a - 0.5 * b) / (b + 0.5 * a)
        base, lower = _OF_HALF
    else:
        u = a / b
        if a > _SHORT and b < _LONG:
            # What the division has left: a - u b, with the product as an exact sum (Dekker 1971).
            c, d = _SPLIT * u, _SPLIT * b
            u1, b1 = c - (c - u), d - (d - b)
            u2, b2 = u - u1, b - b1
            product = u * b
            rest = ((a - product) - (((u1 * b1 - product) + u1 * b2 + u2 * b1) + u2 * b2)) / b
    z = u * u
    w = z * z
    odd = z * (_A0 + w * (_A2 + w * (_A4 + w * (_A6 + w * (_A8 + w * _A10)))))
    even = w * (_A1 + w * (_A3 + w * (_A5 + w * (_A7 + w * _A9))))
    part = u - (u * (odd + even) - rest)
    if steep:
        (base, lower), part = _less(_QUARTER_TURN, base, lower), -part
    if math.copysign(1.0, x) < 0.0:
        (base, lower), part = _less(_HALF_TURN, base, lower), -part
    return math.copysign(base + (lower + part), y)


def _less(turn: tuple[float, float], base: float, lower: float) -> tuple[float, float]:
    """A turn without a smaller one, both as sums of two."""
    left = turn[0] - base
    return left, (turn[1] - lower) + ((turn[0] - left) - base)


def asin(value: float) -> float:
    """The angle within [-pi / 2, pi / 2] whose sine is a value, rad, to two units in the last place.

    Raises:
        ValueError: the value is not within [-1, 1].
    """
    return atan2(value, math.sqrt((1.0 - value) * (1.0 + value)))


def acos(value: float) -> float:
    """The angle within [0, pi] whose cosine is a value, rad, to two units in the last place.

    Raises:
        ValueError: the value is not within [-1, 1].
    """
    return atan2(math.sqrt((1.0 - value) * (1.0 + value)), value)


_LN2: Final = (6.93147180369123816490e-01, 1.90821492927058770002e-10)
_P1, _P2, _P3 = 1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05
_P4, _P5 = -1.65339022054652515390e-06, 4.13813679705723846039e-08


def exp(power: float) -> float:
    """The number e to a power, to a unit in the last place.

    Raises:
        OverflowError: the result is above all numbers.
    """
    if not abs(power) < 745.2:  # beyond which the result is 0, or too large
        if power > 0.0:
            raise OverflowError(f"e to the power {power:g} is too large")
        return power if math.isnan(power) else 0.0
    doublings = power * 1.44269504088896338700e00 + _WHOLE - _WHOLE
    high, low = power - doublings * _LN2[0], doublings * _LN2[1]
    x = high - low
    z = x * x
    c = x - z * (_P1 + z * (_P2 + z * (_P3 + z * (_P4 + z * _P5))))
    return math.ldexp(1.0 - ((low - (x * c) / (2.0 - c)) - high), int(doublings))


_L1, _L2, _L3 = 6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01
_L4, _L5, _L6 = 2.222219843214978396e-01, 1.818357216161805012e-01, 1.531383769920937332e-01
_L7: Final = 1.479819860511658591e-01


def log(value: float) -> float:
    """The natural logarithm, to a unit in the last place.

    Raises:
        ValueError: the value is not a finite number above 0.
    """
    if not 0.0 < value < math.inf:
        raise ValueError("expected a finite number above 0")
    part, doublings = math.frexp(value)
    if part < math.sqrt(0.5):
        part, doublings = 2.0 * part, doublings - 1
    f = part - 1.0
    s, half = f / (2.0 + f), 0.5 * f * f
    z = s * s
    w = z * z
    rest = w * (_L2 + w * (_L4 + w * _L6)) + z * (_L1 + w * (_L3 + w * (_L5 + w * _L7)))
    return doublings * _LN2[0] - ((half - (s * (half + rest) + doublings * _LN2[1])) - f)
