"""Pictures of a camera, of a video file or of a folder, as they are taken: a thread reads, and only the newest counts.

A thread of its own reads all the time, because a camera queues pictures, and one from the queue is old.
"""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from vrg.errors import ConfigError
from vrg.localisation.camera.opencv import cv2

SILENT: Final = 1.0
"""The time in s without a new picture after which a camera counts as having stopped or frozen."""
_AGAIN: Final = 1.0
"""The time in s between two attempts to open a camera."""
_FOLDER_RATE: Final = 10.0
"""The pictures in a second that are taken from a folder."""
_ENDING: Final = 15.0
"""How long a thread that reads may take to end, s: OpenCV gives up a silent camera after 10 s."""
SUFFIXES: Final = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""What the names of pictures end in."""


class Frame(Struct, frozen=True):
    """A picture.

    Args:
        picture: shape (rows, columns) or (rows, columns, 3), blue, green and red.
        time: when it was taken, monotonic, s.
    """

    picture: npt.NDArray[np.uint8]
    time: float


class Wanted(Struct, frozen=True):
    """What a camera is asked for; it may do something else.

    Args:
        size: of its pictures: columns, rows; None for its own. rate: pictures in a second.
    """

    size: tuple[int, int] | None = None
    rate: float = 30.0


_ANY: Final = Wanted()


class Reader(Protocol):
    """Where pictures come from.

    Attributes:
        live: True for a camera, which takes a picture anew each time; False for a file, which ends.
    """

    live: bool

    def read(self) -> Frame | None:
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

    def read(self) -> Frame | None:
        """The next picture."""
        if not self._files:
            return None
        picture = read_picture(self._files.pop())
        return Frame(picture, self._pace.wait())

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
        # Without compression a USB camera sends few large pictures in a second. A lens that focuses anew is another.
        self._capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
        if wanted.size is not None:
            self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, wanted.size[0])
            self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, wanted.size[1])
        self._capture.set(cv2.CAP_PROP_FPS, wanted.rate)
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        self._capture.set(cv2.CAP_PROP_AUTOFOCUS, 0)

    def read(self) -> Frame | None:
        """The next picture; None if the camera is gone, or the file ends."""
        good, picture = self._capture.read()
        now = time.monotonic()
        if not good or picture is None:
            return None
        if self._pace is not None:
            return Frame(np.asarray(picture, dtype=np.uint8), self._pace.wait())
        # Linux notes by the monotonic clock when a picture was taken, which is before it has been sent and unpacked.
        taken = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
        return Frame(np.asarray(picture, dtype=np.uint8), taken if 0.0 <= now - taken < SILENT else now)

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
        data = file.read_bytes()
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


class Capture:
    """The thread that reads pictures.

    A camera that is missing or stops is opened again every second. Of a camera no picture counts that is the same as
    the one before, bit for bit: a camera that works has noise.

    Args:
        open_: opens where pictures come from; it may raise a ConfigError. monotonic: the clock of their times, s.
    """

    def __init__(self, open_: Callable[[], Reader], monotonic: Callable[[], float] = time.monotonic) -> None:
        self._open, self._monotonic = open_, monotonic
        self._stop = threading.Event()
        self._news = threading.Condition()
        self._frame: Frame | None = None
        self._trouble: str | None = None
        self._repeats = False
        self._over = False
        self._seen = monotonic()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._seen = self._monotonic()
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(_ENDING)

    def newest(self, patience: float = 0.0) -> Frame | None:
        """The newest picture, if it has not been handed over yet; each is handed over at most once.

        Args:
            patience: how long to wait for one, s.
        """
        with self._news:
            self._news.wait_for(lambda: self._frame is not None, patience)
            frame, self._frame = self._frame, None
        return frame

    def problem(self) -> str | None:
        """Why there are no pictures, in words; None if there are."""
        with self._news:
            quiet = self._monotonic() - self._seen
            if self._trouble is not None:
                return self._trouble
            if self._over:
                return "the pictures of the file are over"
            if quiet <= SILENT:
                return None
            if self._repeats:
                return "it has frozen: it sends the same picture again and again: unplug it and plug it in"
            return f"it has sent no picture for {quiet:.0f} s: is its cable plugged in?"

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                reader = self._open()
            except ConfigError as error:
                self._tell(str(error))
                self._stop.wait(_AGAIN)
                continue
            try:
                self._read(reader)
            except ConfigError as error:
                self._tell(str(error))
            finally:
                reader.close()
            if not reader.live:
                self._over = True
                return
            self._stop.wait(_AGAIN)

    def _read(self, reader: Reader) -> None:
        before: npt.NDArray[np.uint8] | None = None
        while not self._stop.is_set():
            frame = reader.read()
            if frame is None:
                if reader.live:
                    self._tell("it sends no pictures any more: is its cable plugged in?")
                return
            same = reader.live and before is not None and np.array_equal(before, frame.picture)
            before = frame.picture
            with self._news:
                self._trouble, self._repeats = None, same
                if not same:
                    self._frame, self._seen = frame, self._monotonic()
                    self._news.notify_all()

    def _tell(self, words: str) -> None:
        with self._news:
            self._trouble, self._frame = words, None
