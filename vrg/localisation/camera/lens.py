"""The lens of a camera: where a point in front of it is seen, and how that is measured with a printed board.

A point (x, y, z) in the camera's frame has x to the right, y down and z ahead. The model is OpenCV's: a pinhole, two
or three terms of radial distortion and two of tangential distortion.
"""

from typing import Final

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from vrg.localisation.camera.opencv import cv2

Floats = npt.NDArray[np.float64]

_ROUNDS: Final = 60
"""The most rounds of the search for what a distorted point was."""
_EXACT: Final = 1e-10
"""The change in the last of them, of the tangent of the angle to the axis."""
_STEP: Final = 1e-6
"""The difference of tangents over which a slope is measured."""
_FARTHEST: Final = 0.3
"""The largest change in one round."""


class Lens(Struct, frozen=True):
    """The relation of a camera's pixels and directions.

    Args:
        matrix: of the pinhole, pixels, shape (3, 3). distortion: k1, k2, p1, p2, k3, shape (5,).
        size: of the pictures that it holds for: columns, rows.
    """

    matrix: Floats
    distortion: Floats
    size: tuple[int, int]

    def rays(self, pixels: Floats) -> Floats:
        """The directions in which pixels look, as x and y at z = 1 in the camera's frame, shape (n, 2)."""
        if not len(pixels):
            return np.empty((0, 2))
        wanted = np.asarray(pixels, dtype=np.float64)
        found = (wanted - self.matrix[:2, 2]) / np.diag(self.matrix)[:2]
        # By Newton's method: OpenCV's own search does not end at the edge of a wide lens.
        for _ in range(_ROUNDS):
            there, right, below = (self._at(found + shift) for shift in ((0.0, 0.0), (_STEP, 0.0), (0.0, _STEP)))
            slopes = np.stack((right - there, below - there), axis=-1) / _STEP
            by = np.linalg.solve(slopes, (wanted - there)[..., None])[..., 0]
            found = found + by / np.maximum(1.0, np.linalg.norm(by, axis=1) / _FARTHEST)[:, None]
            if np.abs(by).max() < _EXACT:
                break
        return found

    def _at(self, rays: Floats) -> Floats:
        """The pixels where points in these directions are seen."""
        return self.pixels(np.column_stack((rays, np.ones(len(rays)))))

    def pixels(self, points: Floats) -> Floats:
        """The pixels where points in front of the camera are seen, shape (n, 2).

        Args:
            points: in the camera's frame, m, shape (n, 3).
        """
        if not len(points):
            return np.empty((0, 2))
        ahead = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 3)
        found, _ = cv2.projectPoints(ahead, np.zeros(3), np.zeros(3), self.matrix, self.distortion)
        return np.asarray(found, dtype=np.float64).reshape(-1, 2)
