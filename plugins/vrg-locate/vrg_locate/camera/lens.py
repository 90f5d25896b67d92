"""The lens of a camera: where a point in front of it is seen, and how that is measured with a printed board.

A point (x, y, z) in the camera's frame has x to the right, y down and z ahead. The model is OpenCV's: a pinhole, two
or three terms of radial distortion and two of tangential distortion.

The board is a chessboard, with or without small markers in its white squares. With markers (ChArUco) it is found also
where a part of it is out of the picture, so that it can be held into the corners, where a lens distorts most.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from vrg_locate.camera import cv2

Floats = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]
"""The pixels of a picture: shape (height, width) where it is grey, and (height, width, 3) where it has colours."""

_ROUNDS: Final = 60
"""The most rounds of the search for what a distorted point was."""
_EXACT: Final = 1e-10
"""The change in the last of them, of the tangent of the angle to the axis."""
_STEP: Final = 1e-6
"""The difference of tangents over which a slope is measured."""
_FARTHEST: Final = 0.3
"""The largest change in one round."""
LEAST_PICTURES: Final = 8
"""The number of pictures of the board that a lens is calibrated from."""
_LEAST_CORNERS: Final = 12
_BLURRED: Final = 2.0
"""The standard deviation of blur from which on a picture is refused, pixels."""
_POOR: Final = 1.0
"""The root mean square error from which on a calibration is refused, pixels per 1000 pixels of width."""
_VAGUE: Final = 0.01
"""The share of the focal length that its standard deviation may be."""
_MARKERS: Final = cv2.aruco.DICT_4X4_250


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


class Board(Struct, frozen=True):
    """A chessboard.

    Args:
        columns, rows: its squares. square: the length of their sides, m.
        marker: that of the markers in the white ones, m; None for none.
    """

    columns: int = 9
    rows: int = 6
    square: float = 0.028
    marker: float | None = 0.021


class BoardView(Struct, frozen=True):
    """A board in a picture.

    Args:
        points: the inner corners that were found, in the board's frame, m, shape (n, 3).
        pixels: where they are seen, shape (n, 2). blur: the standard deviation of the picture's blur, pixels.
        size: of the picture: columns, rows.
    """

    points: Floats
    pixels: Floats
    blur: float
    size: tuple[int, int]

    @property
    def refusal(self) -> str | None:
        """The reason why the view is of no use, in words; None if it is."""
        if self.blur > _BLURRED:
            return f"it is blurred by {self.blur:.1f} pixels: hold board and camera still, and use more light"
        return None


class LensFound(Struct, frozen=True):
    """A lens that was calibrated.

    Args:
        lens: it. error: the root mean square of all corners, pixels. each: that of each view, pixels.
    """

    lens: Lens
    error: float
    each: list[float]


def find_board(grey: Picture, board: Board) -> BoardView | None:
    """The board in a grey picture; None if there is none, or too little of it."""
    found = _crossings(grey, board) if board.marker is None else _marked_crossings(grey, board)
    if found is None or len(found[0]) < _LEAST_CORNERS:
        return None
    points, pixels = found
    return BoardView(points, pixels, _blur(grey, points, pixels, board.square), (grey.shape[1], grey.shape[0]))


def board_picture(board: Board, square: int) -> Picture:
    """The board, with `square` pixels for a side of its squares, and nothing around it."""
    size = (board.columns * square, board.rows * square)
    if board.marker is None:
        rows, columns = np.indices((board.rows, board.columns))
        cells = ((rows + columns) % 2 == 1).astype(np.uint8) * np.uint8(255)
        return np.kron(cells, np.ones((square, square), dtype=np.uint8))
    return np.asarray(_charuco(board, board.marker).generateImage(size, marginSize=0), dtype=np.uint8)


def calibrated(views: Sequence[BoardView]) -> LensFound:
    """The lens by the views of a board.

    Raises:
        ValueError: there are too few, or they are of several sizes, or they say too little, or do not fit together.
    """
    views = [view for view in views if view.refusal is None]
    if len(views) < LEAST_PICTURES:
        raise ValueError(f"expected at least {LEAST_PICTURES} sharp pictures that show the board, got {len(views)}")
    sizes = sorted({view.size for view in views})
    if len(sizes) > 1:
        raise ValueError(f"expected pictures of one size, got {', '.join(f'{w} x {h}' for w, h in sizes)}")
    ((width, height),) = sizes
    points = [view.points.astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32).reshape(-1, 1, 2) for view in views]
    try:
        error, matrix, distortion, turns, ways, _, _, each = cv2.calibrateCameraExtended(
            points, pixels, (width, height), np.eye(3), np.zeros(5)
        )
    except cv2.error as problem:
        raise ValueError(f"no lens fits these pictures: {problem.err}") from None
    lens = Lens(np.asarray(matrix, np.float64), np.asarray(distortion, np.float64).ravel()[:5], (width, height))
    poses = [(np.asarray(turn, np.float64), np.asarray(way, np.float64)) for turn, way in zip(turns, ways, strict=True)]
    _check(_vagueness(lens, views, poses, float(error)), float(error), width)
    return LensFound(lens, float(error), np.ravel(each).tolist())


def _vagueness(lens: Lens, views: Sequence[BoardView], poses: Sequence[tuple[Floats, Floats]], error: float) -> float:
    """The standard deviation of the focal length as a share of it.

    OpenCV tells one, too, but in a case that has no solution, as of boards that are never tilted, it is far too small.
    """
    information = np.zeros((9, 9))
    for view, (turn, way) in zip(views, poses, strict=True):
        _, changes = cv2.projectPoints(view.points, turn, way, lens.matrix, lens.distortion)
        pose, own = np.asarray(changes)[:, :6], np.asarray(changes)[:, 6:15]
        # What a view says of the lens is what its own unknown pose leaves of it.
        information += own.T @ (own - pose @ np.linalg.lstsq(pose, own, rcond=None)[0])
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-12))
    spread = np.diag(np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-14, hermitian=True)) * scale**2
    focal = np.diag(lens.matrix)[:2]
    return float((error / math.sqrt(2.0) * np.sqrt(np.maximum(spread[:2], 0.0)) / focal).max())


def _check(vague: float, error: float, width: int) -> None:
    if not (math.isfinite(error) and vague <= _VAGUE):
        raise ValueError(
            f"these pictures say too little: the focal length is known to {100 * vague:.1f} %, expected "
            f"{100 * _VAGUE:g} % or better: tilt the board to all sides by 30 to 45 degrees, "
            "near and far, and into the picture's corners"
        )
    if error > _POOR * width / 1000:
        raise ValueError(
            f"these pictures do not fit together: corners are off by {error:.2f} pixels, expected at most "
            f"{_POOR * width / 1000:.2f}: is the board flat, and the zoom or the focus the same in all of them?"
        )


def _charuco(board: Board, marker: float) -> cv2.aruco.CharucoBoard:
    markers = cv2.aruco.getPredefinedDictionary(_MARKERS)
    return cv2.aruco.CharucoBoard((board.columns, board.rows), board.square, marker, markers)


def _marked_crossings(grey: Picture, board: Board) -> tuple[Floats, Floats] | None:
    """The inner corners of a board with markers: points of the board, m, and pixels."""
    assert board.marker is not None
    made = _charuco(board, board.marker)
    pixels, numbers, _, _ = cv2.aruco.CharucoDetector(made).detectBoard(grey)
    if numbers is None or pixels is None or not len(numbers):
        return None
    points = np.asarray(made.getChessboardCorners(), dtype=np.float64)[np.ravel(numbers)]
    return points, np.asarray(pixels, dtype=np.float64).reshape(-1, 2)


def _crossings(grey: Picture, board: Board) -> tuple[Floats, Floats] | None:
    """The inner corners of a board without markers, all of which must be seen."""
    shape = (board.columns - 1, board.rows - 1)
    good, pixels = cv2.findChessboardCornersSB(grey, shape, flags=cv2.CALIB_CB_ACCURACY)
    if not good:
        return None
    rows, columns = np.indices((shape[1], shape[0]))
    points = np.column_stack([columns.ravel(), rows.ravel(), np.zeros(rows.size)]) * board.square
    return points.astype(np.float64), np.asarray(pixels, dtype=np.float64).reshape(-1, 2)


def _blur(grey: Picture, points: Floats, pixels: Floats, square: float) -> float:
    """The standard deviation of the blur, pixels: between neighbouring corners there is an edge of black and white.

    Across an edge that was blurred by a Gaussian the greatest slope is the contrast divided by sigma * sqrt(2 pi).
    """
    found = []
    for step in ((square, 0.0, 0.0), (0.0, square, 0.0)):
        apart = np.abs(points[:, None] + step - points[None]).max(axis=-1) < square / 10
        for one, other in np.argwhere(apart).tolist():
            along = pixels[other] - pixels[one]
            length = float(np.hypot(*along))
            reach = max(2.0, 0.1 * length)
            across = np.array([-along[1], along[0]]) / max(length, 1e-9)
            ways = np.arange(-reach, reach + 0.25, 0.25)
            line = ((pixels[one] + pixels[other]) / 2 + ways[:, None] * across).astype(np.float32)
            shade = cv2.remap(grey, line[None, :, 0], line[None, :, 1], cv2.INTER_LINEAR).astype(np.float64)[0]
            contrast, slope = float(np.ptp(shade)), float(np.abs(shade[4:] - shade[:-4]).max())
            if slope > 0.0:
                found.append(contrast / (slope * math.sqrt(2 * math.pi)))
    return float(np.median(found)) if found else math.inf
