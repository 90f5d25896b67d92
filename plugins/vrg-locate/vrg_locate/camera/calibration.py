"""The file of a camera: its lens, and where it is. Commands write it, people can read it, and the source needs it.

[lens]
size = [1280, 720]                  # of its pictures: columns, rows
focal = [912.4, 911.8]              # pixels, across and down
centre = [641.2, 358.9]             # where the axis goes through the picture, pixels
distortion = [0.1, -0.2, 0.0, 0.0, 0.05]   # k1, k2, p1, p2, k3 of OpenCV
error = 0.21                        # root mean square of the calibration, pixels
[place]
position = [2.0, 1.5, 3.1]          # m, in the map's frame
right = [1.0, 0.0, 0.0]             # the axes of the camera in the map's frame
down = [0.0, -1.0, 0.0]
ahead = [0.0, 0.0, -1.0]
error = 0.6                         # root mean square of the points on the floor, pixels
[[tags]]                            # those on the floor that it was found by
number = 20
x = 0.0
y = 0.0
"""

from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import Field, ValidationError, model_validator

from vrg.errors import ConfigError, FileError
from vrg.files import read_text
from vrg.tables import Table, located, parsed, problems_of
from vrg_locate.camera.detection import NUMBERS
from vrg_locate.camera.field import FieldView, Place
from vrg_locate.camera.lens import Lens

Triple = tuple[float, float, float]
_Pixels = Annotated[int, Field(ge=16, le=20_000)]
_Positive = Annotated[float, Field(gt=0.0, le=1e6)]
_Error = Annotated[float, Field(ge=0.0, le=1e4)]
_SKEWED: Final = 0.01
"""By how much the axes of a camera may differ from unit vectors at right angles, as numbers in a file are rounded."""


class LensTable(Table):
    """The lens; see the module."""

    size: tuple[_Pixels, _Pixels]
    focal: tuple[_Positive, _Positive]
    centre: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    error: _Error

    @property
    def lens(self) -> Lens:
        """The lens."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return Lens(np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]), np.array(self.distortion), self.size)

    @classmethod
    def of(cls, lens: Lens, error: float) -> "LensTable":
        """The table of a lens. `error` is the root mean square of its calibration, pixels."""
        m, (k1, k2, p1, p2, k3) = lens.matrix.tolist(), lens.distortion.tolist()
        return cls(
            size=lens.size,
            focal=(m[0][0], m[1][1]),
            centre=(m[0][2], m[1][2]),
            distortion=(k1, k2, p1, p2, k3),
            error=error,
        )


class PlaceTable(Table):
    """The place; see the module."""

    position: Triple
    right: Triple
    down: Triple
    ahead: Triple
    error: _Error

    @model_validator(mode="after")
    def _axes(self) -> "PlaceTable":
        rows = np.array([self.right, self.down, self.ahead])
        if np.abs(rows @ rows.T - np.eye(3)).max() > _SKEWED or np.linalg.det(rows) < 0.0:
            raise ValueError("expected right, down and ahead of length 1 at right angles to each other")
        return self

    @property
    def place(self) -> Place:
        """The place. The axes are made exact."""
        left, _, right = np.linalg.svd(np.array([self.right, self.down, self.ahead]))
        return Place(left @ right, np.array(self.position))

    @classmethod
    def of(cls, place: Place, error: float) -> "PlaceTable":
        """The table of a place. `error` is the root mean square of the points that it was found by, pixels."""
        (right, down, ahead), position = place.rotation.tolist(), place.position.tolist()
        return cls(position=position, right=right, down=down, ahead=ahead, error=error)


class FloorTag(Table):
    """A tag on the floor.

    Args:
        number: which it is. x, y: where its middle is, in the map's frame, m.
    """

    number: Annotated[int, Field(ge=0, lt=NUMBERS)]
    x: float
    y: float


class CameraFile(Table):
    """The file of a camera; see the module. Without a place the camera has not been calibrated to the field yet."""

    lens: LensTable
    place: PlaceTable | None = None
    tags: tuple[FloorTag, ...] = ()

    def view(self, file: Path) -> FieldView:
        """The camera's view of the field.

        Raises:
            ConfigError: the file, which is named in the message, does not say where the camera is.
        """
        if self.place is None:
            raise ConfigError(
                f"{file}: expected a table [place], which says where the camera is: write it by "
                "`vrg locate calibrate field`"
            )
        return FieldView(self.lens.lens, self.place.place, self.place.error)


def load_camera(file: Path) -> CameraFile:
    """Read the file of a camera.

    Raises:
        ConfigError: it cannot be read, or its fields are wrong; tells all problems at once.
    """
    try:
        text = read_text(file)
    except (OSError, FileError) as error:
        raise ConfigError(f"{file}: expected the file that `vrg locate calibrate lens` writes: {error}") from None
    try:
        return CameraFile.model_validate(parsed(text, file))
    except ValidationError as error:
        raise ConfigError(located(problems_of(error), file, text)) from None


def camera_text(camera: CameraFile) -> str:
    """The text of a camera's file."""
    lens, place = camera.lens, camera.place
    lines = [
        "[lens]",
        f"size = {_row(lens.size)}  # pixels: columns, rows",
        f"focal = {_row(lens.focal)}  # pixels",
        f"centre = {_row(lens.centre)}  # pixels",
        f"distortion = {_row(lens.distortion)}  # k1, k2, p1, p2, k3 of OpenCV",
        f"error = {lens.error:.6g}  # root mean square, pixels",
    ]
    if place is not None:
        lines += [
            "",
            "[place]",
            f"position = {_row(place.position)}  # m, in the map's frame; the axes of the camera follow",
            f"right = {_row(place.right)}",
            f"down = {_row(place.down)}",
            f"ahead = {_row(place.ahead)}",
            f"error = {place.error:.6g}  # root mean square, pixels",
        ]
    for tag in camera.tags:
        lines += ["", "[[tags]]  # on the floor", f"number = {tag.number}", f"x = {tag.x!r}", f"y = {tag.y!r}"]
    return "\n".join(lines) + "\n"


def _row(numbers: tuple[float, ...]) -> str:
    return f"[{', '.join(f'{number:.9g}' for number in numbers)}]"
