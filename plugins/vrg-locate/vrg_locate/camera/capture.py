"""The tags in the newest pictures: one thread reads pictures, another one looks for tags in them.

Pictures are read all the time, because a camera queues them, and one from the queue is old: while tags are looked for
in a picture, those that come are dropped but for the newest.
"""

import logging
import math
import time
from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from vrg.errors import ConfigError
from vrg_locate.camera.detection import Prints, Tag, TagDetector, grey_of
from vrg_locate.camera.readers import CameraFrame, Reader
from vrg_locate.stream import LiveStream, Pace

log = logging.getLogger(__name__)

SILENCE: Final = 1.0
"""The time in s without a new picture after which a camera counts as having stopped or frozen."""
_QUEUE_LENGTH: Final = 50
"""The pictures whose tags wait to be taken; older ones are of no use."""
_PATIENCE: Final = 0.1


class PictureStream(LiveStream[CameraFrame]):
    """The newest picture of a camera or a file.

    A picture of a camera that equals the one before bit for bit does not count: a camera that works has noise.

    Args:
        open_: opens where pictures come from; it may raise a ConfigError. monotonic: the clock of their times, s.
    """

    def __init__(self, open_: Callable[[], Reader], monotonic: Callable[[], float] = time.monotonic) -> None:
        super().__init__("camera", SILENCE, 1, monotonic)
        self._open = open_
        self._repeats = False

    def listen(self) -> str:
        """Read pictures until there are none any more. A file is read once."""
        reader = self._open()
        try:
            problem = self._read(reader)
        except ConfigError as error:
            problem = str(error)
        finally:
            reader.close()
        if not reader.live:
            self.report(problem)
            self.ending.wait()
        return problem

    def silent(self, silence: float) -> str:
        """Says that the camera has frozen, or sends nothing."""
        if self._repeats:
            return "it has frozen: it sends the same picture again and again: unplug it and plug it in"
        return f"it has sent no picture for {silence:.0f} s: is its cable plugged in?"

    def _read(self, reader: Reader) -> str:
        before: npt.NDArray[np.uint8] | None = None
        while not self.ending.is_set() and (frame := reader.read()) is not None:
            self._repeats = reader.live and before is not None and np.array_equal(before, frame.picture)
            before = frame.picture
            if not self._repeats:
                self.put(frame)
        live = "it sends no pictures any more: is its cable plugged in?"
        return live if reader.live else "the pictures of the file are over"


class TagSighting(Struct, frozen=True):
    """The tags of a picture.

    Args:
        time: when it was taken, monotonic, s. tags: those in it. size: of the picture: columns, rows.
    """

    time: float
    tags: list[Tag]
    size: tuple[int, int]


class TagStream(LiveStream[TagSighting]):
    """The tags in the newest pictures.

    Args:
        open_: opens where pictures come from; it may raise a ConfigError.
        rate: the most pictures in a second that are looked at. prints: whose prints the tags are.
        monotonic: the clock of the pictures' times, s.
    """

    def __init__(
        self,
        open_: Callable[[], Reader],
        rate: float,
        prints: Prints = "opencv",
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__("tags", math.inf, _QUEUE_LENGTH, monotonic)
        self._pictures = PictureStream(open_, monotonic)
        self._pace = Pace(rate)
        self._detector = TagDetector(prints)

    def start(self) -> None:
        """Begin to read and to look."""
        self._pictures.start()
        super().start()

    def close(self) -> None:
        """End both threads. Idempotent."""
        super().close()
        self._pictures.close()

    def problem(self) -> str | None:
        """The reason why there are no tags or no pictures, in words; None if there are."""
        return super().problem() or self._pictures.problem()

    def listen(self) -> str:
        """Look for tags in the newest picture until nobody needs them."""
        while not self.ending.is_set():
            for frame in self._pictures.take(_PATIENCE):
                if self._pace.takes(None, frame.time):
                    self._look(frame)
        return ""

    def _look(self, frame: CameraFrame) -> None:
        try:
            picture = grey_of(frame.picture)
            self.put(TagSighting(frame.time, self._detector.detect(picture), (picture.shape[1], picture.shape[0])))
        except Exception as error:  # one picture must not end the search in all others
            log.exception("a picture cannot be processed")
            self.report(f"a picture cannot be processed: {type(error).__name__}: {error}")
