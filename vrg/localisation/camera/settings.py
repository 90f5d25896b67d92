"""The settings of a camera above the field."""

import math
from typing import Annotated, Final

from pydantic import Field, model_validator

from vrg.localisation.camera.detection import NUMBERS, Prints
from vrg.tables import Table
from vrg.types import Pose

NOISE: Final = 0.2
"""The standard deviation of each coordinate of a corner of a tag, pixels, in a picture of a good webcam."""


class RobotTag(Table):
    """The tag of a robot, which lies flat on it.

    Args:
        number: which tag. height: of the tag above the floor, m.
        x, y: where its middle is on the robot: ahead of the robot's centre and to its left, m.
        heading: the direction of the tag's upper edge, degrees, counter-clockwise from straight ahead.
        size: the length of its black square's sides, m; that of the source's table if missing.
    """

    number: Annotated[int, Field(ge=0, lt=NUMBERS)]
    height: Annotated[float, Field(ge=0.0, le=10.0)]
    x: Annotated[float, Field(ge=-10.0, le=10.0)] = 0.0
    y: Annotated[float, Field(ge=-10.0, le=10.0)] = 0.0
    heading: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0
    size: Annotated[float, Field(gt=0.0, le=10.0)] | None = None

    @property
    def offset(self) -> Pose:
        """The pose of the tag in the robot's frame."""
        return Pose(self.x, self.y, math.radians(self.heading))


class CameraSettings(Table):
    """The table of a source of the kind `camera`.

    Args:
        camera: the index of a USB camera, its device such as /dev/video2, or a video file or a folder of pictures.
        calibration: the file that the commands `vrg locate calibrate` have written, relative to the match file.
        tags: those of the robots, by the robots' names.
        size: the length of the sides of the tags' black squares, m. prints: whose prints the tags are.
        rate: the most pictures in a second that are looked at.
        noise: the standard deviation of each coordinate of a corner of a tag, pixels; see benchmarks/camera.py.
    """

    camera: int | str
    calibration: str
    tags: Annotated[dict[str, RobotTag], Field(min_length=1)]
    size: Annotated[float, Field(gt=0.0, le=10.0)] = 0.15
    prints: Prints = "opencv"
    rate: Annotated[float, Field(gt=0.0, le=200.0)] = 15.0
    noise: Annotated[float, Field(gt=0.0, le=10.0)] = NOISE

    @model_validator(mode="after")
    def _distinct(self) -> "CameraSettings":
        owners: dict[int, str] = {}
        for robot, tag in self.tags.items():
            if (other := owners.setdefault(tag.number, robot)) != robot:
                raise ValueError(f"expected a tag for each robot, got number {tag.number} for {other} and for {robot}")
        return self
