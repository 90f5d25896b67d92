"""Frames as they arrive: a thread reads what the process writes that listens to the capture system."""

import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import IO, Final

import msgspec

from vrg.localisation.mocap.frames import Frame, Request, Trouble, read
from vrg.system import POSIX

SILENCE: Final = 3.0
"""The time in s without a rigid body after which a system counts as seeing nothing. It is longer than the patience of a
request, so that of a system from which nothing comes at all that is told."""
_RETRY_PERIOD: Final = 1.0
"""The time in s between two attempts to reach a system."""
_ENDING: Final = 1.0
"""The time that a process which has closed its output may take to end, s."""
_QUEUE_LENGTH: Final = 512
"""The number of frames that wait for a node that does not tick."""


class Stream:
    """The frames of a capture system. One that cannot be reached, or stops, is tried again every second.

    Args:
        request: the system. monotonic: the clock of the frames' times, s.
        program: the command that is given the request and writes the frames.
    """

    def __init__(
        self,
        request: Request,
        monotonic: Callable[[], float] = time.monotonic,
        program: tuple[str, ...] = (sys.executable, "-P", "-m", "vrg.localisation.mocap.reader"),
    ) -> None:
        self._command = (*program, msgspec.json.encode(request).decode())
        self._host, self._patience = request.options.get("hostname", request.system), request.patience
        self._monotonic = monotonic
        self._frames: deque[Frame] = deque(maxlen=_QUEUE_LENGTH)
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        self._trouble: str | None = None
        self._seen = monotonic()
        """The time at which there was a rigid body last, monotonic, s."""
        self._thread = threading.Thread(target=self._run, name="capture", daemon=True)

    def start(self) -> None:
        """Begin to listen."""
        self._seen = self._monotonic()
        self._thread.start()

    def close(self) -> None:
        """End the process and the thread. Idempotent."""
        with self._lock:
            self._stop.set()
            if self._process is not None:
                self._process.kill()
        if self._thread.is_alive():
            self._thread.join()

    def take(self) -> list[Frame]:
        """The frames since the last call, the oldest first."""
        found = []
        while self._frames:
            found.append(self._frames.popleft())
        return found

    def problem(self) -> str | None:
        """The reason why there are no rigid bodies, in words; None if there are."""
        with self._lock:
            if self._trouble is not None:
                return self._trouble
            quiet = self._monotonic() - self._seen
        if quiet <= SILENCE:
            return None
        return (
            f"{self._host} has shown no rigid body for {quiet:.0f} s: does it run, are bodies enabled, and are they in "
            "sight?"
        )

    def _run(self) -> None:
        while not self._stop.is_set():
            if (process := self._begun()) is not None:
                assert process.stdout is not None
                try:
                    with process.stdout:
                        words = self._listen(process.stdout)
                except (OSError, msgspec.MsgspecError) as error:
                    process.kill()
                    words = f"{self._host}: what has come from it cannot be read: {error}"
                status = _status(process)
                self._tell(words or self._ending(status))
            self._stop.wait(_RETRY_PERIOD)

    def _begun(self) -> subprocess.Popen[bytes] | None:
        with self._lock:
            if self._stop.is_set():
                return None
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
            )
            return self._process

    def _listen(self, stream: IO[bytes]) -> str | None:
        """Keep the frames of a process until it ends, and return what it has told last."""
        while (message := read(stream)) is not None:
            if isinstance(message, Trouble):
                return f"{self._host}: {message.text}"
            self._frames.append(message)
            with self._lock:
                self._trouble = None
                if message.bodies:
                    self._seen = self._monotonic()
        return None

    def _ending(self, status: int) -> str:
        if POSIX and status == -signal.SIGALRM:
            return (
                f"nothing was received from {self._host} for {self._patience:g} s: is it on, does it stream, and "
                "is `host` right?"
            )
        return f"what listens to {self._host} has ended with status {status}: does `system` fit what runs there?"

    def _tell(self, words: str) -> None:
        with self._lock:
            self._trouble = words


def _status(process: subprocess.Popen[bytes]) -> int:
    """The status with which a process ends that has nothing more to write."""
    try:
        return process.wait(_ENDING)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()
