"""Bounds for code that a student has written: memory, output, and the time of a decision."""

import _thread
import contextlib
import faulthandler
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Final, NoReturn, TextIO

import psutil

from vrg.blame import DecisionTimeoutError, OutputFloodError, place_of_frame
from vrg.bus.stopping import StopSignal
from vrg.errors import StrategyError
from vrg.system import POSIX, bound_processor_time, in_main_thread

if POSIX:
    import resource

OUTPUT_LIMIT = 2_000_000
"""The number of characters that may be printed within OUTPUT_WINDOW."""
OUTPUT_WINDOW = 10.0
"""s"""
BUDGET = 5.0
"""The real time in s that a decision may take."""
_STUBBORN = 5.0
"""The real time in s more after which a decision that catches every exception ends the whole process."""
_STUCK = BUDGET + _STUBBORN + 2.0
"""The processor time in s after which the kernel ends a process that does not even let signals be handled, as in a
decision with a loop in C code."""
WRITE_ALLOWANCE = 100_000_000
"""The number of bytes that a strategy may write in a process that it shares, beyond _ALLOWED with each decision."""
_ALLOWED = 100_000
_TOLD = ("/proc/self/io", "/proc/thread-self/children")
_LOOK = 0.25
"""The real time in s between two looks at whether a decision goes on."""
_ALARM: Final = signal.SIGALRM if POSIX else signal.SIGABRT
"""The signal that lets the main thread look. Windows has none for it; of those that it has nothing else sends this."""


class MemoryBound:
    """Lets this process get so much more memory than it has, and not more; who asks for it gets a MemoryError.

    A context manager. macOS accepts the bound and does not keep it; on Windows, and outside the main thread,
    there is none.

    Args:
        megabytes: so much more.
    """

    def __init__(self, megabytes: int) -> None:
        self._more = megabytes * 1_000_000
        self._works = POSIX and in_main_thread()
        self._before = resource.getrlimit(resource.RLIMIT_DATA) if self._works else (0, 0)

    def __enter__(self) -> "MemoryBound":
        self.begin()
        return self

    def __exit__(self, *_: object) -> None:
        self.lift()

    def begin(self) -> None:
        """Bound it from now on, by what the process has now."""
        if not self._works:
            return
        _, hard = self._before
        wanted = getattr(psutil.Process().memory_info(), "data", 0) + self._more
        soft = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))

    def lift(self) -> None:
        """Bound it no more. This itself needs no memory."""
        if self._works:
            resource.setrlimit(resource.RLIMIT_DATA, self._before)


class BoundedOutput:
    """A text stream that takes so much within a while, and then raises an exception where it is written to.

    Args:
        stream: what is written goes there, and it does everything else. now: returns the time, s.
    """

    def __init__(self, stream: TextIO, now: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._now = now
        self._since = now()
        self._count = 0

    def __getattr__(self, name: str) -> Any:
        """Everything else is as in the stream below."""
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text.

        Raises:
            OutputFloodError: too much was written.
        """
        if self._now() - self._since > OUTPUT_WINDOW:
            self._since, self._count = self._now(), 0
        self._count += len(text)
        if self._count > OUTPUT_LIMIT:
            raise OutputFloodError(
                f"it has printed more than {OUTPUT_LIMIT // 1_000_000} MB within {OUTPUT_WINDOW:g} s"
            )
        return self._stream.write(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write some texts; see `write`."""
        for line in lines:
            self.write(line)


@contextmanager
def printing_to(stream: BoundedOutput) -> Iterator[None]:
    """Let what is printed go to a stream."""
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(stream):
        yield


def say_where_on_request() -> None:
    """Let this process write to its log where it is when it gets SIGUSR1, even in an endless loop, or crashes."""
    faulthandler.enable()
    if POSIX:
        faulthandler.register(signal.SIGUSR1)


class DecisionAlarm:
    """Ends a decision that takes too long, or that goes on when the match is to stop; a context manager.

    Signals do it, of a timer or, on Windows, of a thread, which cannot interrupt a decision with a loop in C code. The
    thread ends the program where the decision has had them ignored.

    Only the main thread can be interrupted, so in another thread nothing is bounded. A timer (ITIMER_REAL) that this
    program has set goes on at the end; one of processor time (ITIMER_VIRTUAL) is cleared.

    Args:
        stop: what tells that the match is to stop; None if nothing does.
    """

    def __init__(self, stop: StopSignal | None) -> None:
        self._stop = stop
        self._looks = 0
        self._deciding = False
        self._decisions = 0
        self._over = threading.Event()
        self._before: object = None
        self._timer = 0.0, 0.0
        self._works = in_main_thread()

    def __enter__(self) -> "DecisionAlarm":
        if self._works:
            self._before = signal.signal(_ALARM, self._look)
            self._timer = self._tick(_LOOK, _LOOK)
            bound_processor_time(_STUCK)
            if POSIX:
                # It tells where it was, and then ends.
                faulthandler.register(signal.SIGVTALRM, file=sys.__stderr__ or 2, all_threads=False, chain=True)
            self._watch()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self._works:
            self._tick(0.0)
            signal.signal(_ALARM, self._before)  # type: ignore[arg-type]
            self._tick(*self._timer)
            bound_processor_time(0.0)
            if POSIX:
                faulthandler.unregister(signal.SIGVTALRM)

    def begin(self) -> None:
        """A decision begins. Until its `end` a DecisionTimeoutError may come at any point."""
        self._looks, self._decisions, self._deciding = 0, self._decisions + 1, True

    def end(self) -> None:
        """It has been made."""
        self._deciding = False

    @staticmethod
    def _tick(seconds: float, period: float = 0.0) -> tuple[float, float]:
        """Let the kernel send the alarm, and return the timer before; on Windows the thread sends it."""
        return signal.setitimer(signal.ITIMER_REAL, seconds, period) if POSIX else (0.0, 0.0)

    def _watch(self) -> None:
        """Watch in a thread of its own whether signals still end a decision."""
        over = self._over = threading.Event()
        threading.Thread(target=self._guard, args=(over, threading.get_ident()), daemon=True).start()

    def _guard(self, over: threading.Event, main: int) -> None:
        decision = looks = 0
        while not over.wait(_LOOK):
            if not POSIX:
                _thread.interrupt_main(_ALARM)
            looks = looks + 1 if self._deciding and decision == self._decisions else 0
            decision = self._decisions
            if looks * _LOOK >= _STUCK:
                _end_match("ignores the signals that end a decision", sys._current_frames().get(main))

    def _look(self, _number: int, frame: FrameType | None) -> None:
        # Signals are handled, so nothing is stuck. Setting the kernel's timer for each decision would cost more than
        # many decisions take.
        bound_processor_time(_STUCK)
        if not self._deciding:
            return
        # Looks are counted, not seconds, because a computer that slept is no fault of the strategy's.
        self._looks += 1
        stopping = self._stop is not None and self._stop.is_set()
        if self._looks * _LOOK >= BUDGET + _STUBBORN:
            _end_match("cannot be interrupted", frame)
        if stopping or self._looks * _LOOK >= BUDGET:
            why = "the match is to stop" if stopping else f"a decision may take {BUDGET:g} s"
            raise DecisionTimeoutError(f"it was still deciding after {self._looks * _LOOK:g} s ({why})")


def _end_match(why: str, frame: FrameType | None) -> NoReturn:
    """End this program, as a strategy does not end its decision, and tell where in its code that is."""
    print(f"vrg: a strategy {why} ({place_of_frame(frame)}): the match is ended", file=sys.__stderr__, flush=True)
    os._exit(1)


class Footprint:
    """The traces of one strategy's code in a process that it shares: processes, and bytes on the disk.

    Only Linux tells them. Those of threads that it has started are not seen.
    """

    def __init__(self) -> None:
        self._files: tuple[int, ...] | None = None
        self._written = 0
        self._before = (0, b"")

    def begin(self) -> None:
        """Its code runs from now on, in the main thread."""
        if self._files is None and sys.platform == "linux":
            with contextlib.suppress(OSError):  # a kernel that does not tell them
                self._files = tuple(os.open(path, os.O_RDONLY) for path in _TOLD)
        self._before = self._look()

    def end(self) -> None:
        """Its code has run. What it has started is killed.

        Raises:
            StrategyError: it has started a process, or written too much.
        """
        written, children = self._look()
        self._written = max(0, self._written + written - self._before[0] - _ALLOWED)
        if children != self._before[1] and (started := set(children.split()) - set(self._before[1].split())):
            for pid in map(int, started):
                with contextlib.suppress(ProcessLookupError, ChildProcessError):
                    os.kill(pid, signal.SIGKILL)
                    os.waitpid(pid, 0)
            raise StrategyError("it has started a process: where strategies share one, none may be started", final=True)
        if self._written > WRITE_ALLOWANCE:
            raise StrategyError(f"it has written more than {WRITE_ALLOWANCE // 1_000_000} MB", final=True)

    def close(self) -> None:
        """Look no more. Idempotent."""
        for file in self._files or ():
            os.close(file)
        self._files = None

    def _look(self) -> tuple[int, bytes]:
        """The number of bytes that this process has written, and the processes that this thread has started."""
        if self._files is None:
            return 0, b""
        return int(os.pread(self._files[0], 200, 0).split(None, 4)[3]), os.pread(self._files[1], 10_000, 0)


class Bounded:
    """Runs a student's code in a match in one process; a context manager that can be used again and again.

    Args:
        alarm: ends it when it takes too long. footprint: what it leaves behind.

    Attributes:
        output: what it prints goes there; None lets it print, and so does any thread but the main one.
    """

    def __init__(self, alarm: DecisionAlarm, footprint: Footprint) -> None:
        self._alarm = alarm
        self._footprint = footprint
        self.output: BoundedOutput | None = None
        self._caught = in_main_thread()
        self._before = sys.stdout, sys.stderr

    def __enter__(self) -> None:
        self._before = sys.stdout, sys.stderr
        if self.output is not None and self._caught:
            sys.stdout = sys.stderr = self.output
        self._footprint.begin()
        self._alarm.begin()

    def __exit__(self, *_: object) -> None:
        self._alarm.end()
        if self._caught:
            sys.stdout, sys.stderr = self._before
        self._footprint.end()

    def close(self) -> None:
        """Its code runs no more. Idempotent."""
        self._footprint.close()
        if self.output is not None:
            self.output.close()
