"""The arithmetic of `vrg.portable.scalars` for arrays: cosines and sines, lengths, and small matrices."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg.portable.scalars import FAR, cos_sin, inverse, within_a_quarter

Floats = npt.NDArray[np.float64]

_FEW: Final = 32
"""The number of angles up to which one by one is faster than all together."""

_LEAST: Final = 1e-300
_STEPS: Final = 1.5 * 2.0**32  # added and taken away again, it rounds to multiples of 2^-20


def cos_sin_array(angles: Floats) -> tuple[Floats, Floats]:
    """The cosines and the sines of angles, rad: of each what `cos_sin` gives, but NaN of one that is infinite."""
    if angles.size <= _FEW:
        try:
            pairs = np.array([cos_sin(angle) for angle in angles.ravel().tolist()]).reshape(*angles.shape, 2)
        except ValueError:  # one is infinite
            pass
        else:
            return pairs[..., 0], pairs[..., 1]
    if not np.abs(angles).max(initial=0.0) <= FAR:
        with np.errstate(invalid="ignore"):
            angles = np.where(np.abs(angles) > FAR, np.fmod(angles, math.tau), angles)
    quarters, cos, sin = within_a_quarter(angles)
    quarter = quarters - 4.0 * np.floor(quarters * 0.25)
    first = quarter == 1.0
    turned = first | (quarter == 3.0)
    cosines, sines = np.where(turned, sin, cos), np.where(turned, cos, sin)
    np.negative(cosines, out=cosines, where=first | (quarter == 2.0))
    np.negative(sines, out=sines, where=quarter >= 2.0)
    return cosines, sines


def hypot(x: Floats, y: Floats) -> Floats:
    """The lengths of vectors, which are not so long that their squares are no numbers."""
    length: Floats = np.sqrt(x * x + y * y)
    return length


def normals(rng: np.random.Generator, shape: int | tuple[int, ...]) -> Floats:
    """Draw numbers of the standard normal distribution, rounded to steps of 2^-20.

    They come from numpy's ziggurat, which is made of whole numbers but for its edges: of a hundred numbers one is
    compared with an exponential of the C library, and of 4,000 one is computed by its logarithm. The steps are so
    coarse that what differs in its last bit is rounded to the same number, but for one draw in 10^15.
    """
    drawn: Floats = rng.standard_normal(shape)
    drawn += _STEPS
    drawn -= _STEPS
    return drawn


def turn_order(x: Floats, y: Floats) -> Floats:
    """Numbers from -2 to 2 that rise with the directions of vectors (x, y) from -pi to pi, without their angles.

    They are where the directions meet the square through the unit vectors of both axes, counted in its sides; 0 for a
    vector of no length.
    """
    along = y / np.maximum(np.abs(x) + np.abs(y), _LEAST)
    order: Floats = np.where(x >= 0.0, along, np.copysign(2.0, y) - along)
    return order


def product(first: Floats, second: Floats) -> Floats:
    """The product of two small matrices, or of a matrix and a vector, whose sums are taken in the order of the rows.

    Args:
        first: shape (rows, inner), inner at least 1. second: shape (inner, columns) or (inner,).

    Returns:
        shape (rows, columns) or (rows,).
    """
    if second.ndim == 1:
        return product(first, second[:, None])[:, 0]
    total: Floats = first[:, :1] * second[:1]
    for k in range(1, first.shape[1]):
        total += first[:, k : k + 1] * second[k : k + 1]
    return total


def inverted(matrix: Floats) -> Floats:
    """The inverse of a small symmetric positive definite matrix, shape (n, n); see `vrg.portable.scalars.inverse`.

    Raises:
        ValueError: the matrix is not positive definite.
    """
    result: Floats = np.array(inverse(matrix.tolist()))
    return result
