"""Cameras, which take colour pictures of what is ahead of a robot."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors import png
from vrg.hal.sensors.depiction import Image
from vrg.hal.sensors.spec import Rate, SensorSpec
from vrg.types import Metres

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

BYTES_LIMIT = 8_000_000
"""The largest size of a picture on the bus, bytes."""

Angle = Annotated[float, Meta(gt=0.0, lt=math.pi)]
"""An angle of view, rad."""
_USUAL_FOV = math.radians(60)
PixelCount = Annotated[int, Meta(ge=1, le=png.SIDE_LIMIT)]
"""A width or a height in pixels."""


class Camera(SensorMessage, frozen=True, kw_only=True):
    """One picture of a camera.

    The world takes pictures only while a node asks for them: the match file (`camera = true` at a player), or a
    program that sends `CameraRequest`.

    Args:
        fov: the angle that the picture covers from its left to its right border, rad.
        data: the picture as a PNG file, RGB with 8 bits a channel.
    """

    kind = "camera"

    fov: Angle
    data: Annotated[bytes, Meta(max_length=BYTES_LIMIT)]

    def __post_init__(self) -> None:
        try:
            png.size_of(self.data)
        except ValueError as error:
            raise ValueError(f"data: {error}") from None

    @property
    def size(self) -> tuple[int, int]:
        """The width and the height, pixels."""
        return png.size_of(self.data)

    @property
    def image(self) -> "npt.NDArray[np.uint8]":
        """The picture: shape (height, width, 3), uint8, red, green and blue. The first row is the upper one.

        A pixel in column c is seen at the bearing atan((width / 2 - c - 0.5) / f) in the robot's frame, positive to the
        left, where f = width / 2 / tan(fov / 2); this holds for a camera that is not tilted. Each use unpacks the
        picture again, so keep what you get.

        Raises:
            ValueError: the file is damaged.
        """
        return png.decode(self.data)

    @property
    def words(self) -> str:
        """The size of the picture and of its file."""
        return f"{' x '.join(map(str, self.size))} pixels, {len(self.data) / 1000:.1f} KB"


@dataclass(frozen=True, kw_only=True)
class CameraSpec(SensorSpec):
    """A pinhole camera that looks straight ahead. It has no noise.

    Args:
        x: the distance ahead of the body's centre, m. height: the height above ground, m.
        tilt: the angle by which it looks above the horizon, rad; negative looks down.
        fov: the angle that it sees from left to right, rad.
        columns: the width of its pictures, pixels. rows: their height, pixels.
    """

    message = Camera
    simulation = "vrg.hal.sim.sensors.camera:CameraSimulation"
    synthesised = True
    depiction = Image

    x: Metres
    height: Metres
    tilt: Annotated[float, Meta(ge=-math.pi / 2, le=math.pi / 2)] = 0.0
    fov: Angle = _USUAL_FOV
    columns: PixelCount = 320
    rows: PixelCount = 240
    rate: Rate = 2.0

    def depict(self, reading: Camera) -> Image:
        """The picture."""
        return Image(reading.data)
