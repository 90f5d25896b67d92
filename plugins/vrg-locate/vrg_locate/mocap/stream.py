"""Frames as they arrive, from the process that listens to the capture system."""

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Final

import msgspec

from vrg.system import POSIX
from vrg_locate.mocap.frames import MocapFrame, Request, Trouble, read
from vrg_locate.stream import LiveStream

SILENCE: Final = 3.0
"""The time in s without a rigid body after which a system counts as seeing nothing. It is longer than the patience of a
request, so that a system that sends nothing at all is reported."""
_ENDING: Final = 1.0
"""The time that a process which has closed its output may take to end, s."""
_QUEUE_LENGTH: Final = 512
"""The number of frames that wait for a node that does not tick."""


class FrameStream(LiveStream[MocapFrame]):
    """The frames of a capture system.

    Args:
        request: the system. monotonic: the clock of the frames' times, s.
        program: the command that is given the request and writes the frames.
    """

    def __init__(
        self,
        request: Request,
        monotonic: Callable[[], float] = time.monotonic,
        program: tuple[str, ...] = (sys.executable, "-P", "-m", "vrg_locate.mocap.reader"),
    ) -> None:
        super().__init__("capture", SILENCE, _QUEUE_LENGTH, monotonic)
        self._command = (*program, msgspec.json.encode(request).decode())
        self._host, self._patience = request.options.get("hostname", request.system), request.patience
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def close(self) -> None:
        """End the process and the thread. Idempotent."""
        with self._lock:
            self.ending.set()
            if self._process is not None:
                self._process.kill()
        super().close()

    def silent(self, silence: float) -> str:
        """That the system shows no rigid body."""
        return (
            f"{self._host} has shown no rigid body for {silence:.0f} s: does it run, are bodies enabled, and are they "
            "in sight?"
        )

    def listen(self) -> str:
        """Keep the frames of a process until it ends."""
        with self._lock:
            if self.ending.is_set():
                return ""
            process = self._process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
            )
        assert process.stdout is not None
        problem = None
        try:
            with process.stdout as output:
                while (message := read(output)) is not None:
                    if isinstance(message, Trouble):
                        problem = f"{self._host}: {message.text}"
                        break
                    self.put(message, counts=bool(message.bodies))
        except (OSError, msgspec.MsgspecError) as error:
            process.kill()
            problem = f"{self._host}: what arrives from it cannot be read: {error}"
        return self._status(process, problem)

    def _status(self, process: subprocess.Popen[bytes], problem: str | None) -> str:
        """Wait for the end of a process that has nothing more to write, and return why it has ended."""
        try:
            status = process.wait(_ENDING)
        except subprocess.TimeoutExpired:
            process.kill()
            status = process.wait()
        if problem is not None:
            return problem
        if POSIX and status == -signal.SIGALRM:
            return (
                f"nothing was received from {self._host} for {self._patience:g} s: is it on, does it stream, and "
                "is `host` right?"
            )
        return f"what listens to {self._host} has ended with status {status}: does `system` fit what runs there?"
