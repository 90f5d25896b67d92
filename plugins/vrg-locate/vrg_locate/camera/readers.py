"""The readers of pictures: a camera, a video file or a folder."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from vrg.errors import ConfigError
from vrg.files import read_bytes
from vrg_locate.camera import cv2

_PLAUSIBLE: Final = 60.0
"""The age in s of a picture from which on its time cannot be by the clock that it should be by."""
_FOLDER_RATE: Final = 10.0
"""The pictures in a second that are taken from a folder."""
SUFFIXES: Final = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""The endings of the names of pictures."""


class CameraFrame(Struct, frozen=True):
    """A picture.

    Args:
        picture: shape (rows, columns) or (rows, columns, 3), blue, green and red.
        time: when it was taken, monotonic, s.
    """

    picture: npt.NDArray[np.uint8]
    time: float


class Wanted(Struct, frozen=True):
    """The wishes that a camera is asked for; it may do something else.

    Args:
        size: of its pictures: columns, rows; None for its own. rate: pictures in a second.
    """

    size: tuple[int, int] | None = None
    rate: float = 30.0


_ANY: Final = Wanted()


class Reader(Protocol):
    """The origin of pictures.

    Attributes:
        live: True for a camera, which takes a new picture each time; False for a file, which ends.
    """

    live: bool

    def read(self) -> CameraFrame | None:
        """The next picture, once it is time for it; None if there is none any more."""

    def close(self) -> None:
        """Let the camera or the file go."""


class FolderReader:
    """The pictures of a folder, by their names, ten in a second; the last one ends it."""

    live = False

    def __init__(self, folder: Path, sleep: Callable[[float], object] = time.sleep) -> None:
        self._files = sorted(file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES)
        if not self._files:
            raise ConfigError(f"{folder}: expected pictures in this folder ({', '.join(SUFFIXES)}), found none")
        self._files.reverse()
        self._pace = _Pace(_FOLDER_RATE, sleep)

    def read(self) -> CameraFrame | None:
        """The next picture."""
        if not self._files:
            return None
        picture = read_picture(self._files.pop())
        return CameraFrame(picture, self._pace.wait())

    def close(self) -> None:
        """Nothing is open."""


class VideoReader:
    """A camera, or a video file, which is played at its own rate.

    Args:
        camera: the index of a camera, its device, or a file. wanted: what a camera is asked for.

    Raises:
        ConfigError: it cannot be opened.
    """

    def __init__(self, camera: int | str, wanted: Wanted = _ANY, sleep: Callable[[float], object] = time.sleep) -> None:
        self.live = isinstance(camera, int) or camera.startswith("/dev/")
        self._capture = cv2.VideoCapture(camera, cv2.CAP_V4L2 if self.live else cv2.CAP_ANY)
        if not self._capture.isOpened():
            what = "a camera" if self.live else "a video file"
            known = f"; there are {', '.join(cameras()) or 'none'}" if self.live else ""
            raise ConfigError(f"camera {camera}: expected {what} that can be opened{known}")
        if self.live:
            self._ask(wanted)
            self._pace = None
        else:
            rate = self._capture.get(cv2.CAP_PROP_FPS)
            self._pace = _Pace(rate if 0.1 <= rate <= 1000.0 else _FOLDER_RATE, sleep)

    def _ask(self, wanted: Wanted) -> None:
        # Without compression a USB camera sends few large pictures in a second. A lens that focuses again is another.
        self._capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
        if wanted.size is not None:
            self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, wanted.size[0])
            self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, wanted.size[1])
        self._capture.set(cv2.CAP_PROP_FPS, wanted.rate)
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        self._capture.set(cv2.CAP_PROP_AUTOFOCUS, 0)

    def read(self) -> CameraFrame | None:
        """The next picture; None if the camera is gone, or the file ends."""
        good, picture = self._capture.read()
        now = time.monotonic()
        if not good or picture is None:
            return None
        if self._pace is not None:
            return CameraFrame(np.asarray(picture, dtype=np.uint8), self._pace.wait())
        # Linux notes by the monotonic clock when a picture was taken, which is before it has been sent and unpacked.
        taken = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
        return CameraFrame(
            np.asarray(picture, dtype=np.uint8), taken if taken > 0.0 and 0.0 <= now - taken < _PLAUSIBLE else now
        )

    def close(self) -> None:
        """Let it go."""
        self._capture.release()


class _Pace:
    """The times at which the pictures of a file are due."""

    def __init__(self, rate: float, sleep: Callable[[float], object]) -> None:
        self._period, self._sleep = 1.0 / rate, sleep
        self._due: float | None = None

    def wait(self) -> float:
        """Wait until the next picture is due, and return when that is, monotonic, s. Nothing late is made up for."""
        now = time.monotonic()
        due = now if self._due is None else max(self._due, now - self._period)
        self._due = due + self._period
        if due > now:
            self._sleep(due - now)
        return due


def cameras() -> list[str]:
    """The devices of cameras that there are."""
    return sorted(str(path) for path in Path("/dev").glob("video*"))


def read_picture(file: Path) -> npt.NDArray[np.uint8]:
    """The picture in a file: blue, green and red, shape (rows, columns, 3).

    Raises:
        ConfigError: there is none.
    """
    try:
        data = read_bytes(file)
    except OSError as error:
        raise ConfigError(f"{file}: expected a picture: {error.strerror}") from None
    picture = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR) if data else None
    if picture is None:
        raise ConfigError(f"{file}: expected a picture such as PNG or JPEG, this is none")
    return np.asarray(picture, dtype=np.uint8)


def open_reader(camera: int | str, base: Path, wanted: Wanted = _ANY) -> Reader:
    """Open a camera, a video file or a folder of pictures.

    Args:
        camera: its index, its device, or a path. base: the folder that a relative path starts from.

    Raises:
        ConfigError: it cannot be opened.
    """
    if isinstance(camera, int) or camera.startswith("/dev/"):
        return VideoReader(camera, wanted)
    path = base / camera
    if not path.exists():
        raise ConfigError(f"camera {camera}: expected the index of a camera, its device, or a file, found none there")
    return FolderReader(path) if path.is_dir() else VideoReader(str(path))
