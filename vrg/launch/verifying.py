"""Plays each second of a match twice from the same state, and compares what comes of it.

At the beginning of a second the process forks. The copy plays this second and answers with the digests of its last
step; the match itself plays it, too. What depends on the state alone is the same in both. What depends on something
else, such as a clock, a file, an identifier of the process or a thread, differs sooner or later.
"""

import contextlib
import gc
import os
import signal
import stat
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection, Pipe
from typing import Final, NoReturn, Self

from vrg.errors import LaunchError
from vrg.system import POSIX

if POSIX:
    import fcntl

PATIENCE: Final = 60.0
"""The real time in s for which the match waits for its copy."""
Digested = Callable[[float, Mapping[str, str]], None]
"""Takes the match time of a step in s, and the digest of what each node has published in it."""


class Verification:
    """See the module. A context manager, which ends a copy that still plays.

    Call it with the digests of a step once a second, as `vrg.bus.lockstep.Lockstep` does.

    Args:
        digested: called with the same; None only compares.
        copied: called in each copy, which has the memory of the match, but not its timers.

    Raises:
        LaunchError: by the call, where the two differ; or this is not Linux.
    """

    def __init__(self, digested: Digested | None, copied: Callable[[], None]) -> None:
        if not hasattr(os, "memfd_create"):
            raise LaunchError("a match can be played twice at once on Linux alone: leave --verify out")
        self._digested, self._copied = digested, copied
        self._copy: tuple[int, Connection] | None = None
        self._answer: Connection | None = None

    def __call__(self, time: float, nodes: Mapping[str, str]) -> None:
        """Compare the digests of a step with those of the copy, and begin the next second."""
        self.compare(time, nodes)
        if self._digested is not None:
            self._digested(time, nodes)
        ours, theirs = Pipe()
        pid = os.fork()
        if pid == 0:
            ours.close()
            self._copy, self._answer = None, theirs
            _write_nowhere()
            self._copied()
            return
        theirs.close()
        self._copy = pid, ours

    def compare(self, time: float, nodes: Mapping[str, str]) -> None:
        """Compare digests with those of the copy, which ends then."""
        if self._answer is not None:
            _leave(self._answer, (time, dict(nodes)))
        if self._copy is None:
            return
        _, pipe = self._copy
        first = f"the second before {time:.2f} s of match time was not the same when it was played twice"
        try:
            if not pipe.poll(PATIENCE):
                raise LaunchError(f"{first}: the copy has not gone on for {PATIENCE:g} s: does a strategy use threads?")
            when, other = pipe.recv()
        except (EOFError, OSError):
            raise LaunchError(f"{first}: the copy has ended before: does a strategy end its process?") from None
        finally:
            self.__exit__()
        if (when, other) != (time, dict(nodes)):
            differing = [name for name in sorted({*nodes, *other}) if nodes.get(name) != other.get(name)]
            names = ", ".join(differing) or "the match"
            advice = "look for a clock, a random number without a seed, a file, or an order of a set in its code"
            raise LaunchError(f"{first}: {names} published something else: {advice}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._answer is not None:
            os._exit(1)  # the copy leaves nothing, whatever it has met
        if self._copy is not None:
            pid, pipe = self._copy
            self._copy = None
            pipe.close()
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def _leave(pipe: Connection, answer: tuple[float, Mapping[str, str]]) -> NoReturn:
    pipe.send(answer)
    os._exit(0)


def _write_nowhere() -> None:
    """Let whatever this process writes to files and to its output go nowhere: the match itself writes there."""
    gc.disable()  # what it frees would only be copied
    for name in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            written = fcntl.fcntl(int(name), fcntl.F_GETFL) & os.O_ACCMODE != os.O_RDONLY
            if int(name) in (1, 2) or (written and stat.S_ISREG(os.fstat(int(name)).st_mode)):
                # A file in memory, as nothing else can be flushed to disk.
                os.dup2(os.memfd_create("nowhere"), int(name))
