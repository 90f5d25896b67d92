"""Pictures as they are taken: a thread reads, and only the newest counts.

A thread of its own reads all the time, because a camera queues pictures, and one from the queue is old.
"""

import threading
import time
from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg.errors import ConfigError
from vrg.localisation.camera.readers import Frame, Reader

SILENCE: Final = 1.0
"""The time in s without a new picture after which a camera counts as having stopped or frozen."""
_RETRY_PERIOD: Final = 1.0
"""The time in s between two attempts to open a camera."""
_ENDING: Final = 15.0
"""The time that a thread which reads may take to end, s: OpenCV gives up a silent camera after 10 s."""


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
        """The reason why there are no pictures, in words; None if there are."""
        with self._news:
            quiet = self._monotonic() - self._seen
            if self._trouble is not None:
                return self._trouble
            if self._over:
                return "the pictures of the file are over"
            if quiet <= SILENCE:
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
                self._stop.wait(_RETRY_PERIOD)
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
            self._stop.wait(_RETRY_PERIOD)

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
