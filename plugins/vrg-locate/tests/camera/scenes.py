"""Pictures as a known camera would take them: printed sheets on the field or held up, with blur and noise."""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from vrg.types import Pose
from vrg_locate.camera import cv2
from vrg_locate.camera.detection import CELLS, tag_cells
from vrg_locate.camera.field import FieldView, Place
from vrg_locate.camera.lens import Board, Lens, Picture, board_picture

SIZE = (1280, 720)
CELL = 24
"""Pixels for a cell of a tag in the picture that is put on the field."""
LENS = Lens(
    np.array([[950.0, 0.0, 645.0], [0.0, 948.0, 352.0], [0.0, 0.0, 1.0]]),
    np.array([-0.28, 0.09, 0.0006, -0.0004, -0.01]),
    SIZE,
)
"""A webcam whose pictures bulge, so that its corners are off by some 40 pixels."""


def tag_picture(number: int, cell: int) -> Picture:
    """A tag with the white around it, `cell` pixels for each of its CELLS + 2 cells along a side."""
    cells = np.pad(~tag_cells(number), 1, constant_values=True)
    return np.kron(cells, np.ones((cell, cell), dtype=np.bool_)).astype(np.uint8) * np.uint8(255)


_known: dict[int, npt.NDArray[np.float64]] = {}
_GRID = 4
"""Of so many pixels in a row and in a column one is asked for: in between, rays are off by 0.006 pixels at most."""


def _rays(lens: Lens) -> npt.NDArray[np.float64]:
    """Where each pixel of a lens looks, shape (columns * rows, 2). It takes a second, so each lens is asked once."""
    if id(lens) not in _known:
        width, height = lens.size
        columns, rows = np.meshgrid(np.arange(0, width + _GRID, _GRID), np.arange(0, height + _GRID, _GRID))
        asked = lens.rays(np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64))
        across, down = np.meshgrid(
            np.arange(width, dtype=np.float32) / _GRID, np.arange(height, dtype=np.float32) / _GRID
        )
        parts = [cv2.remap(part.reshape(rows.shape), across, down, cv2.INTER_LINEAR) for part in asked.T]
        _known[id(lens)] = np.stack(parts, axis=-1).reshape(-1, 2)
    return _known[id(lens)]


def looking(position: tuple[float, float, float], at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Place:
    """A camera that looks at a point, with +y of the map upwards in its picture."""
    ahead = np.subtract(at, position) / np.linalg.norm(np.subtract(at, position))
    right = np.cross(ahead, (0.0, 1.0, 0.0) if abs(ahead[1]) < 0.99 else (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    return Place(np.array([right, np.cross(ahead, right), ahead]), np.array(position))


def sheet_at(pose: Pose, height: float, sheet: tuple[float, float]) -> npt.NDArray[np.float64]:
    """The corners of a flat sheet in the map's frame, from its upper left one clockwise, m, shape (4, 3).

    Args:
        sheet: its length ahead, towards its upper edge, and its width, m.
    """
    cos, sin = np.cos(pose.theta), np.sin(pose.theta)
    a, b = sheet[0] / 2, sheet[1] / 2
    return np.array(
        [
            (pose.x + cos * u - sin * v, pose.y + sin * u + cos * v, height)
            for u, v in ((a, b), (a, -b), (-a, -b), (-a, b))
        ]
    )


class Scene:
    """A picture in the making, without distortion and larger than the camera's, so that nothing is lost at its borders.

    Args:
        view: the camera, with its lens. rng: of the floor's pattern and of the noise.
    """

    def __init__(self, view: FieldView, rng: np.random.Generator) -> None:
        self._view, self._rng = view, rng
        width, height = view.lens.size
        self._scale = 1.6
        self._canvas = (int(1.5 * width * self._scale), int(1.5 * height * self._scale))
        focal = view.lens.matrix[0, 0] * self._scale
        self._matrix = np.array([[focal, 0.0, self._canvas[0] / 2], [0.0, focal, self._canvas[1] / 2], [0.0, 0.0, 1.0]])
        rough = rng.normal(120.0, 12.0, (self._canvas[1] // 16, self._canvas[0] // 16)).astype(np.float32)
        self._shade = cv2.resize(rough, self._canvas)

    def put(self, picture: npt.NDArray[np.uint8], corners: npt.NDArray[np.float64]) -> None:
        """Lay a picture on a sheet whose corners are these, in the map's frame, m."""
        place = self._view.place
        local = (corners - place.position) @ place.rotation.T
        pixels = (local[:, :2] / local[:, 2:]) @ self._matrix[:2, :2].T + self._matrix[:2, 2]
        rows, columns = picture.shape
        ends = np.array([(0, 0), (columns, 0), (columns, rows), (0, rows)], dtype=np.float32) - 0.5
        turn = cv2.getPerspectiveTransform(ends, pixels.astype(np.float32))
        # A picture that is made smaller is blurred first, or its cells would flicker.
        shrunk = max(1.0, columns / max(1.0, float(np.hypot(*(pixels[1] - pixels[0])))))
        soft = cv2.GaussianBlur(picture, (0, 0), 0.4 * shrunk) if shrunk > 1.2 else picture
        # Only where the sheet is, as the whole picture takes a hundred times as long.
        low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 2, 0)
        high = np.minimum(np.ceil(pixels.max(axis=0)).astype(int) + 3, self._canvas)
        if (low >= high).any():
            return
        (left, upper), (width, height) = low.tolist(), (high - low).tolist()
        turn = np.array([[1.0, 0.0, -left], [0.0, 1.0, -upper], [0.0, 0.0, 1.0]]) @ turn
        flat = cv2.warpPerspective(soft, turn, (width, height), borderMode=cv2.BORDER_REPLICATE)
        there = np.zeros((height, width), dtype=np.uint8)
        cv2.fillConvexPoly(there, np.round((pixels - low) * 16).astype(np.int32), 255, cv2.LINE_AA, 4)
        share = there.astype(np.float32) / 255.0
        part = self._shade[upper : upper + height, left : left + width]
        part[:] = part * (1.0 - share) + (30.0 + 0.75 * flat.astype(np.float32)) * share

    def taken(self, blur: float = 0.7, noise: float = 3.0) -> npt.NDArray[np.uint8]:
        """The picture that the camera takes, in grey. `blur` is in pixels, `noise` in steps of 256."""
        width, height = self._view.lens.size
        rays = _rays(self._view.lens)
        places = (rays @ self._matrix[:2, :2].T + self._matrix[:2, 2]).astype(np.float32).reshape(height, width, 2)
        soft = cv2.GaussianBlur(self._shade, (0, 0), 0.7 * self._scale)
        shade = cv2.remap(soft, places[..., 0], places[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        if blur > 0.0:
            shade = cv2.GaussianBlur(shade, (0, 0), blur)
        return np.clip(shade + self._rng.normal(0.0, noise, shade.shape), 0, 255).astype(np.uint8)


def tags_on_field(
    view: FieldView, tags: Iterable[tuple[int, Pose, float]], size: float, rng: np.random.Generator, **how: float
) -> npt.NDArray[np.uint8]:
    """A picture of flat tags: of each its number, its pose and its height above the floor, m. `size` is of all, m."""
    scene = Scene(view, rng)
    whole = size * (CELLS + 2) / CELLS
    for number, pose, height in tags:
        scene.put(tag_picture(number, CELL), sheet_at(pose, height, (whole, whole)))
    return scene.taken(**how)


def boards_held_up(
    board: Board, count: int, rng: np.random.Generator, tilt: float = 0.6, **how: float
) -> list[npt.NDArray[np.uint8]]:
    """Pictures of a board that a person holds before the camera, tilted by up to `tilt` rad about two axes."""
    view = FieldView(LENS, Place(np.eye(3), np.zeros(3)))
    printed = np.pad(board_picture(board, 40), 40, constant_values=255)
    a, b = (board.columns + 2) * board.square / 2, (board.rows + 2) * board.square / 2
    taken = []
    for _ in range(count):
        turn = cv2.Rodrigues(np.array([*rng.uniform(-tilt, tilt, 2), rng.uniform(-0.5, 0.5)]))[0]
        middle = np.array([rng.uniform(-0.16, 0.16), rng.uniform(-0.09, 0.09), rng.uniform(0.3, 0.5)])
        scene = Scene(view, rng)
        scene.put(printed, np.array([(-a, -b, 0), (a, -b, 0), (a, b, 0), (-a, b, 0)]) @ np.asarray(turn).T + middle)
        taken.append(scene.taken(**how))
    return taken
