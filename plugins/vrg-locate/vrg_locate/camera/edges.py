"""The corners of tags, refined to a fraction of a pixel: lines are fitted to the sides of each black square.

OpenCV's own refinement of corners is made for the crossings of a chessboard. At the corner of a square it is drawn
inwards by blur, by up to half a pixel. An edge between black and white is not, so each corner is where two lines meet,
as in the second version of the AprilTag detector (J. Wang, E. Olson, AprilTag 2, IROS 2016, section III).
"""

from typing import Final

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_SAMPLES: Final = 24
"""The places along a side where the edge is looked for."""
_ENDS: Final = 0.12
"""The share of a side at either end where its neighbours disturb."""
_STEP: Final = 0.25
"""The distance between two brightnesses across an edge, pixels."""
_REACHES: Final = ((0.75, 3.0), (0.5, 2.0))
"""The reach within which the edge is looked for in each round: in cells of the tag, and at most in pixels."""
_FARTHEST: Final = 4.0
"""The way that a corner may move, pixels. One that moves farther was half covered, and stays."""


def refined(grey: npt.NDArray[np.uint8], squares: Floats, cell: Floats) -> Floats:
    """The corners of black squares, better than they were.

    Args:
        grey: the picture. squares: the corners in order, clockwise in the picture, pixels, shape (n, 4, 2).
        cell: the length of a cell of each tag, pixels, shape (n,).
    """
    found = squares
    for share, most in _REACHES:
        found = _closer(grey, found, np.minimum(share * cell, most))
    moved = np.hypot(*np.moveaxis(found - squares, -1, 0))
    good = np.isfinite(moved).all(axis=1) & (moved.max(axis=1, initial=0.0) <= _FARTHEST)
    return np.where(good[:, None, None], found, squares)


def _closer(grey: npt.NDArray[np.uint8], squares: Floats, reach: Floats) -> Floats:
    """One round. What has no edge within reach, pixels, shape (n,), becomes NaN."""
    start, end = squares, np.roll(squares, -1, axis=1)
    along = end - start
    outwards = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    outwards /= np.maximum(np.hypot(outwards[..., 0], outwards[..., 1]), 1e-9)[..., None]
    shares = np.linspace(_ENDS, 1.0 - _ENDS, _SAMPLES)
    places = start[:, :, None] + shares[:, None] * along[:, :, None]  # (n, 4, samples, 2)
    steps = np.arange(-np.ceil(_REACHES[0][1] / _STEP), np.ceil(_REACHES[0][1] / _STEP) + 1) * _STEP
    # Brightness is needed a pixel farther out, as its slope is the difference over two pixels.
    wide = np.concatenate([steps[:4] - 1.0, steps, steps[-4:] + 1.0])
    points = places[..., None, :] + wide[:, None] * outwards[:, :, None, None]  # (n, 4, samples, wide, 2)
    shade = _brightness(grey, points)
    slope = shade[..., 8:] - shade[..., :-8]
    near = np.abs(steps) <= reach[:, None, None, None]
    weight = np.where(near & (slope > 0.0), slope, 0.0) ** 2
    total = weight.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        off = (weight * steps).sum(axis=-1) / total
    good = total > 0.05 * total.max(axis=-1, keepdims=True, initial=1e-9)
    weights = np.where(good, np.sqrt(total), 0.0)
    edge = places + np.where(good, off, 0.0)[..., None] * outwards[:, :, None]
    return _meeting(*_lines(edge, weights))


def _brightness(grey: npt.NDArray[np.uint8], points: Floats) -> Floats:
    """The brightness at points between the pixels; outside of the picture that of its border."""
    rows, columns = grey.shape
    u = np.clip(points[..., 0], 0.0, columns - 1.001)
    v = np.clip(points[..., 1], 0.0, rows - 1.001)
    left, upper = u.astype(np.intp), v.astype(np.intp)
    a, b = u - left, v - upper
    flat, place = grey.ravel(), upper * columns + left
    above = (1.0 - a) * flat[place] + a * flat[place + 1]
    below = (1.0 - a) * flat[place + columns] + a * flat[place + columns + 1]
    shade: Floats = (1.0 - b) * above + b * below
    return shade


def _lines(points: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """The lines nearest to the points of each side: a point and a direction of each, shape (n, 4, 2)."""
    total = np.maximum(weights.sum(axis=-1), 1e-9)[..., None]
    middle = (weights[..., None] * points).sum(axis=-2) / total
    apart = points - middle[..., None, :]
    spread = np.einsum("...s,...si,...sj->...ij", weights, apart, apart)
    direction = np.linalg.eigh(spread)[1][..., :, 1]
    return middle, direction


def _meeting(points: Floats, directions: Floats) -> Floats:
    """The corners between each line and the one before it, shape (n, 4, 2)."""
    before, other = np.roll(points, 1, axis=1), np.roll(directions, 1, axis=1)
    across = other[..., 0] * directions[..., 1] - other[..., 1] * directions[..., 0]
    apart = points - before
    with np.errstate(invalid="ignore", divide="ignore"):
        way = (apart[..., 0] * directions[..., 1] - apart[..., 1] * directions[..., 0]) / across
    return before + way[..., None] * other
