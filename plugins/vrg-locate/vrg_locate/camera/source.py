"""The settings and the node of a camera above the field."""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import Field, model_validator

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.topics import Keys
from vrg.errors import ConfigError
from vrg.localisation.source import SourceContext
from vrg.tables import Table
from vrg.types import Pose
from vrg_locate.camera.calibration import load_camera
from vrg_locate.camera.capture import TagSighting, TagStream
from vrg_locate.camera.detection import NUMBERS, Prints, Tag
from vrg_locate.camera.field import robot_at
from vrg_locate.camera.readers import Reader, Wanted, open_reader
from vrg_locate.source import RealSource

_SIZE: Final = 0.2
"""The share by which a tag may appear larger or smaller than it was printed."""
_MOVED: Final = 0.05
"""The distance from its place at which a tag on the floor is seen, m, if it or the camera has been moved."""
_BUMPED: Final = (0.5, 0.2)
"""The standard deviations, m and rad, of the errors of fixes an hour after two tags on the floor were last seen at
their places, as cameras are bumped or sag about once in so long. Variances grow evenly with the time since."""
_HOUR: Final = 3600.0
_UNCHECKED: Final = 5.0
"""The time in s without two tags on the floor after which it is said: robots hide them for less."""
_MIN_DEVIATIONS: Final = (0.005, math.radians(0.5))
"""The smallest standard deviations of a fix, m and rad, whatever the geometry: heights and times are not exact, and a
robot at 0.7 m/s drives 7 mm in 10 ms."""
NOISE: Final = 0.2
"""The standard deviation of each coordinate of a corner of a tag, pixels, in a picture of a good webcam."""


class RobotTag(Table):
    """The tag of a robot or a thing, which lies flat on it.

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
        tags: those of the robots and things, by their names.
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


class CameraSource(RealSource[TagSighting]):
    """Sees the tags that lie on robots, through a camera that has been calibrated to the field.

    Args:
        context: what it is made from. mailbox: its mailbox. keys: the keys of the match.
        monotonic: the clock by which pictures are stamped, s. Nodes read no clock, so it is given from outside.

    Raises:
        ConfigError: the calibration cannot be used.
    """

    settings = CameraSettings
    mark, items = "tag", "pictures"

    def __init__(
        self,
        context: SourceContext,
        mailbox: Mailbox,
        keys: Keys,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        assert isinstance(context.settings, CameraSettings)
        self._settings = settings = context.settings
        base = context.base
        camera = load_camera(base / settings.calibration)
        self._view = view = camera.view(base / settings.calibration)

        def opened() -> Reader:
            return open_reader(settings.camera, base, Wanted(view.lens.size, max(30.0, settings.rate)))

        stream = TagStream(opened, settings.rate, settings.prints, monotonic)
        marks = {tag.number: name for name, tag in settings.tags.items()}
        super().__init__(context, mailbox, keys, stream, marks, monotonic)
        self._floor = {tag.number: (tag.x, tag.y) for tag in camera.tags}
        self._checked: float | None = None
        """The time of the last picture with two tags on the floor at their places; at first that of the first one."""

    @classmethod
    def problems(cls, settings: Table, base: Path) -> list[str]:
        """Says that the calibration file cannot be used."""
        assert isinstance(settings, CameraSettings)
        try:
            file = base / settings.calibration
            load_camera(file).view(file)
        except ConfigError as error:
            return [str(error)]
        return []

    @classmethod
    def missing_here(cls, settings: Table, base: Path) -> list[str]:
        """Says that the camera cannot be opened, sends no pictures, or sends others than of its calibrated size."""
        assert isinstance(settings, CameraSettings)
        try:
            size = load_camera(base / settings.calibration).lens.size
            reader = open_reader(settings.camera, base, Wanted(size, max(30.0, settings.rate)))
        except ConfigError as error:
            return [str(error)]
        try:
            frame = reader.read()
        finally:
            reader.close()
        if frame is None:
            return [f"camera {settings.camera}: it sends no picture: look at its cable; another program may have it"]
        rows, columns = frame.picture.shape[:2]
        if (columns, rows) != size:
            return [
                f"camera {settings.camera}: its pictures have {columns} x {rows} pixels, but those of its calibration "
                f"{size[0]} x {size[1]}: calibrate it at the size that it sends"
            ]
        return []

    @classmethod
    def files(cls, settings: Table) -> list[str]:
        """The calibration file."""
        assert isinstance(settings, CameraSettings)
        return [settings.calibration]

    def captured(self) -> Iterable[tuple[float, TagSighting]]:
        """The pictures that were looked at since the last call."""
        return [(sighting.time, sighting) for sighting in self._stream.take()]

    def fixes_of(self, sighting: TagSighting) -> Iterable[Fix]:
        """The robots in a picture."""
        if sighting.size != self._view.lens.size:
            text = "its pictures have %d x %d pixels, but those of its calibration %d x %d: calibrate it again"
            self.ignore("size of pictures", sighting.size, text, *sighting.size, *self._view.lens.size)
            return
        right, wrong = self._floor_tags(sighting.tags)
        if wrong >= 2 and wrong >= right:
            text = "tags on the floor are not where they were: the camera has been moved: calibrate it to the field"
            self.ignore("moved", None, text)
            return
        if right >= 2 or self._checked is None:
            self._checked = sighting.time
        unchecked = sighting.time - self._checked
        if unchecked > _UNCHECKED:
            self.warn(
                "unchecked",
                "fewer than two tags on the floor are seen: nothing shows it if the camera is moved and robots are "
                "located wrongly, so their poses become less and less certain: lay tags, or see what hides them",
            )
        counts = Counter(tag.number for tag in sighting.tags)
        for tag in sighting.tags:
            name = self._robots.get(tag.number)
            if name is None:
                if tag.number not in self._floor:
                    self.count_unknown(tag.number)
            elif counts[tag.number] > 1:
                text = "tag %d of %s is seen twice: is one of them another's?"
                self.ignore("twice", tag.number, text, tag.number, name)
            elif (fix := self._fix(name, tag, unchecked)) is not None:
                yield fix

    def _fix(self, name: str, tag: Tag, unchecked: float) -> Fix | None:
        own = self._settings.tags[name]
        located = self._view.locate(tag.corners, own.height, self._settings.noise)
        if located is None:
            self.ignore("nowhere", tag.number, "tag %d of %s is where there is no field", tag.number, name)
            return None
        size = own.size or self._settings.size
        if not 1.0 - _SIZE <= located.side / size <= 1.0 + _SIZE:
            text = "tag %d of %s seems to be %.3f m wide, expected %.3f m: are its height and its size right?"
            self.ignore("size", tag.number, text, tag.number, name, located.side, size)
            return None
        robot = robot_at(located, own.offset)
        position, heading = (math.sqrt(unchecked / _HOUR) * bumped for bumped in _BUMPED)
        least = max(robot.position, _MIN_DEVIATIONS[0]), max(robot.heading, _MIN_DEVIATIONS[1])
        return Fix(name, robot.pose, *least, common=(position, heading))

    def _floor_tags(self, tags: list[Tag]) -> tuple[int, int]:
        """The numbers of tags on the floor that are seen at their places, and elsewhere."""
        right = wrong = 0
        for tag in tags:
            if (place := self._floor.get(tag.number)) is not None:
                ((x, y),) = self._view.unproject(np.array([tag.centre]), 0.0).tolist()
                there = math.dist((x, y), place) <= _MOVED
                right, wrong = right + there, wrong + (not there)
        return right, wrong
