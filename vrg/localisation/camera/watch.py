"""The thread that looks for tags in pictures, so that the node which publishes them waits for nothing."""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final

from msgspec import Struct

from vrg.localisation.camera.capture import Capture
from vrg.localisation.camera.detection import Prints, Tag, TagDetector, grey_of
from vrg.localisation.camera.readers import Frame, Reader

log = logging.getLogger(__name__)

_QUEUE_LENGTH: Final = 50
"""The pictures whose tags wait to be taken; older ones are of no use."""
_PATIENCE: Final = 0.1
_ENDING: Final = 2.0


class Sighting(Struct, frozen=True):
    """The tags of a picture.

    Args:
        time: when it was taken, monotonic, s. tags: those in it. size: of the picture: columns, rows.
    """

    time: float
    tags: list[Tag]
    size: tuple[int, int]


class Watch:
    """A camera and a thread that looks for tags in its newest picture.

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
        self._capture = Capture(open_, monotonic)
        self._period = 1.0 / rate
        self._detector = TagDetector(prints)
        self._found: deque[Sighting] = deque(maxlen=_QUEUE_LENGTH)
        self._stop = threading.Event()
        self._trouble: str | None = None
        self._thread = threading.Thread(target=self._run, name="tags", daemon=True)
        self._due = -1e9

    def start(self) -> None:
        """Begin to read and to look."""
        self._capture.start()
        self._thread.start()

    def close(self) -> None:
        """End both threads."""
        self._stop.set()
        self._capture.close()
        if self._thread.is_alive():
            self._thread.join(_ENDING)

    def take(self) -> list[Sighting]:
        """The pictures that were looked at since the last call, the oldest first."""
        found = []
        while self._found:
            found.append(self._found.popleft())
        return found

    def problem(self) -> str | None:
        """The reason why there are no pictures, in words; None if there are."""
        return self._trouble or self._capture.problem()

    def _run(self) -> None:
        while not self._stop.is_set():
            frame = self._capture.newest(_PATIENCE)
            if frame is not None and self._is_due(frame):
                try:
                    picture = grey_of(frame.picture)
                    size = (picture.shape[1], picture.shape[0])
                    self._found.append(Sighting(frame.time, self._detector.detect(picture), size))
                    self._trouble = None
                except Exception as error:  # one picture must not end the search in all others
                    log.exception("a picture cannot be looked at")
                    self._trouble = f"a picture cannot be looked at: {type(error).__name__}: {error}"

    def _is_due(self, frame: Frame) -> bool:
        # Pictures do not come quite evenly, so that the time between two is measured over many.
        if frame.time < self._due:
            return False
        self._due = max(self._due, frame.time - self._period) + self._period
        return True
