"""A picture with what was found in it drawn on it, for people who set a camera up."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg_locate.camera import cv2
from vrg_locate.camera.detection import Tag
from vrg_locate.camera.field import FieldView, Located
from vrg_locate.camera.lens import Picture

Colour = tuple[int, int, int]

_OUTLINE: Final = (0, 220, 255)
_AHEAD: Final = (40, 40, 255)
_LEFT: Final = (60, 200, 60)
_ORIGIN: Final = (255, 160, 60)
_DARK: Final = (0, 0, 0)
_AXIS: Final = 0.5
"""The length of the drawn axes of the map, m."""


def words_of(tag: Tag, located: Located | None) -> str:
    """A tag in words, with its pose and how well that is known."""
    if located is None:
        return f"tag {tag.number}: no place on the field"
    pose = located.pose
    return (
        f"tag {tag.number}: x {pose.x:.3f} m, y {pose.y:.3f} m, heading {math.degrees(pose.theta):.1f} degrees, "
        f"to {1000 * located.position:.1f} mm and {math.degrees(located.heading):.2f} degrees; "
        f"{located.side:.3f} m wide"
    )


def drawn(
    picture: Picture, tags: Sequence[Tag], view: FieldView | None = None, located: Sequence[Located | None] = ()
) -> Picture:
    """The picture with outlines, numbers, axes and poses.

    Args:
        picture: grey, or blue, green and red. tags: those that were found.
        view: what the camera sees of the field; None if that is not known, so that there are no poses.
        located: where each tag is; red is where its upper edge is, and green is to its left.
    """
    canvas = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture, np.uint8).copy()
    scale = max(0.5, canvas.shape[1] / 1800)
    if view is not None:
        _draw_origin(canvas, view, scale)
    for index, tag in enumerate(tags):
        cv2.polylines(canvas, [_whole(tag.corners)], True, _OUTLINE, max(1, round(2 * scale)), cv2.LINE_AA)
        middle = np.array(tag.centre)
        _arrow(canvas, middle, (tag.corners[0] + tag.corners[1]) / 2, _AHEAD, scale)
        _arrow(canvas, middle, (tag.corners[0] + tag.corners[3]) / 2, _LEFT, scale)
        lines = [str(tag.number)]
        found = located[index] if index < len(located) else None
        if found is not None:
            lines += [
                f"{found.pose.x:.3f}, {found.pose.y:.3f} m",
                f"{math.degrees(found.pose.theta):.1f} deg",
            ]
        _write(canvas, lines, middle, tag.corners, scale)
    return canvas


def _draw_origin(canvas: Picture, view: FieldView, scale: float) -> None:
    """The axes of the map, if their ends are in the picture."""
    ends = view.project(np.array([(0.0, 0.0, 0.0), (_AXIS, 0.0, 0.0), (0.0, _AXIS, 0.0)]))
    size = np.array(canvas.shape[1::-1])
    if not np.isfinite(ends).all() or (np.abs(ends) > 2 * size).any():
        return
    for end, name in ((ends[1], "x"), (ends[2], "y")):
        _arrow(canvas, ends[0], end, _ORIGIN, scale)
        _text(canvas, name, end + 6.0, scale)


def _arrow(canvas: Picture, start: npt.ArrayLike, end: npt.ArrayLike, colour: Colour, scale: float) -> None:
    first, last = _whole(np.array([start, end])).reshape(2, 2).tolist()
    cv2.arrowedLine(canvas, first, last, colour, max(1, round(2 * scale)), cv2.LINE_AA, tipLength=0.25)


def _write(canvas: Picture, lines: Sequence[str], middle: npt.NDArray[np.float64], corners: npt.NDArray[np.float64],
           scale: float) -> None:  # fmt: skip
    """Lines of text to the right of a tag, or to its left where there is no room."""
    width = max(cv2.getTextSize(line, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0][0] for line in lines)
    left = corners[:, 0].max() + 6.0
    if left + width > canvas.shape[1]:
        left = corners[:, 0].min() - 6.0 - width
    upper = middle[1] - 17.0 * scale * (len(lines) - 1)
    for number, line in enumerate(lines):
        _text(canvas, line, np.array([left, upper + 36.0 * scale * number + 9.0 * scale]), scale)


def _text(canvas: Picture, text: str, place: npt.NDArray[np.float64], scale: float) -> None:
    u, v = np.round(place).astype(int).tolist()
    weight = max(1, round(1.5 * scale))
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, weight)
    cv2.rectangle(canvas, (u - 2, v - height - 2), (u + width + 2, v + below), _DARK, cv2.FILLED)
    cv2.putText(canvas, text, (u, v), cv2.FONT_HERSHEY_SIMPLEX, scale, _OUTLINE, weight, cv2.LINE_AA)


def _whole(points: npt.NDArray[np.float64]) -> npt.NDArray[np.int32]:
    """Points as OpenCV draws them, shape (n, 1, 2)."""
    return np.round(points).astype(np.int32).reshape(-1, 1, 2)


def encoded(picture: Picture) -> bytes:
    """A picture as a PNG file."""
    return bytes(cv2.imencode(".png", picture)[1])
