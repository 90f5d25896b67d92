"""The tags in a picture: AprilTags of the family 36h11, found by OpenCV.

A pixel's coordinates (u, v) count columns to the right and rows down; (0, 0) is the middle of the upper left pixel.
"""

from typing import Final, Literal

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from vrg_locate.camera import cv2
from vrg_locate.camera.edges import refined
from vrg_locate.camera.lens import Picture

Floats = npt.NDArray[np.float64]

NUMBERS: Final = 587
"""The number of tags in the family; they are counted from 0."""
CELLS: Final = 8
"""The cells along a side of a tag, its black border included. A white one must be around them."""
Prints = Literal["opencv", "apriltag"]
"""The origin of printed tags: `vrg locate tags`, as OpenCV has them, or AprilTag's own pictures and what follows them,
such as moms-apriltag, in which each tag is turned by half a turn."""
_WINDOWS: Final = (7, 25)
"""The pixels of which the mean is the threshold between black and white."""
_FAMILY: Final = cv2.aruco.DICT_APRILTAG_36h11


class Tag(Struct, frozen=True):
    """A tag in a picture.

    Args:
        number: which of the family it is.
        corners: those of its black square, pixels, shape (4, 2): upper left, upper right, lower right, lower left, as
            it was printed.
    """

    number: int
    corners: Floats

    @property
    def centre(self) -> tuple[float, float]:
        """The middle of the square, where its diagonals meet, also in a view from the side, pixels."""
        (ax, ay), (bx, by), (cx, cy), (dx, dy) = self.corners.tolist()
        across = (cx - ax) * (dy - by) - (cy - ay) * (dx - bx)
        if across == 0.0:
            return (ax + cx) / 2, (ay + cy) / 2
        way = ((bx - ax) * (dy - by) - (by - ay) * (dx - bx)) / across
        return ax + way * (cx - ax), ay + way * (cy - ay)

    @property
    def side(self) -> float:
        """The mean length of a side, pixels."""
        return float(np.hypot(*(self.corners - np.roll(self.corners, -1, axis=0)).T).mean())


class TagDetector:
    """Finds tags in pictures.

    Args:
        prints: whose prints they are.
    """

    def __init__(self, prints: Prints = "opencv") -> None:
        self._half_turn = 2 if prints == "apriltag" else 0
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        # Two thresholds find what three do, for two thirds of the time; one alone misses small tags.
        settings.adaptiveThreshWinSizeMin = _WINDOWS[0]
        settings.adaptiveThreshWinSizeMax = _WINDOWS[1]
        settings.adaptiveThreshWinSizeStep = _WINDOWS[1] - _WINDOWS[0]
        self._detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(_FAMILY), settings)

    def detect(self, grey: Picture) -> list[Tag]:
        """The tags in a grey picture, shape (rows, columns), sorted by their numbers. One may be there twice.

        Raises:
            ValueError: the picture is not grey, or not of bytes.
        """
        if grey.ndim != 2 or grey.dtype != np.uint8:
            raise ValueError(f"expected a grey picture of bytes, got {grey.dtype} of the shape {grey.shape}")
        corners, numbers, _ = self._detector.detectMarkers(grey)
        if numbers is None:
            return []
        tags = [
            Tag(int(n), np.asarray(c, np.float64).reshape(4, 2))
            for n, c in zip(np.ravel(numbers), corners, strict=True)
        ]
        better = refined(grey, np.array([tag.corners for tag in tags]), np.array([tag.side / CELLS for tag in tags]))
        found = [
            Tag(tag.number, np.roll(four, self._half_turn, axis=0)) for tag, four in zip(tags, better, strict=True)
        ]
        return sorted(found, key=lambda tag: (tag.number, *tag.corners[0].tolist()))


def tag_cells(number: int) -> npt.NDArray[np.bool_]:
    """The cells of a tag, its border included: shape (CELLS, CELLS), rows from above, True where it is black.

    Raises:
        ValueError: there is no such tag.
    """
    if not 0 <= number < NUMBERS:
        raise ValueError(f"expected the number of a tag from 0 to {NUMBERS - 1}, got {number}")
    dictionary = cv2.aruco.getPredefinedDictionary(_FAMILY)
    cells: npt.NDArray[np.bool_] = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, CELLS)) < 128
    return cells


def grey_of(picture: Picture) -> Picture:
    """A picture in grey, shape (rows, columns), of one that is grey or of the colours blue, green and red."""
    if picture.ndim == 2:
        return picture
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
