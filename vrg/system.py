"""Features of some operating systems, their substitutes on the others, and the time since the start.

VRG is developed and tested on Linux. Here is what Windows lacks and several modules need. A module that alone needs
such a call has a fall-back of its own; where there is none, a sentence names the lack. docs/install.md lists them.
"""

import contextlib
import os
import signal
import threading
import time
from typing import IO, Any, Final

POSIX: Final = hasattr(os, "fork")
"""False on Windows.

There a process cannot be asked to stop by a signal, the standard input of a process cannot be a socket, only sockets
can be waited for by `select`, and neither timers nor a terminal's end are signals.
"""
if POSIX:
    import fcntl
else:
    import msvcrt

FILE_FLAGS: Final[int] = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
"""The flags with which a file is opened that no other program inherits; Windows changes ends of lines otherwise."""
UNWAITED_FLAGS: Final[int] = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
"""The flags with which nothing is waited for when something is opened that may be a pipe or a terminal."""
_FAR: Final = 1 << 40
"""The place in bytes of what is locked in a file of Windows, which nobody can read or write meanwhile."""


def in_main_thread() -> bool:
    """True if this is the main thread. It alone hears signals, and what bounds its code bounds the whole process."""
    return threading.current_thread() is threading.main_thread()


def lock(file: int | IO[Any], *, shared: bool = False, wait: bool = False) -> bool:
    """Lock an open file until it is closed, also by the end of this process; return whether it could be locked.

    Args:
        shared: others may hold such a lock, too; on Windows nobody may. wait: wait until nobody holds it.

    Raises:
        OSError: this file cannot be locked.
    """
    number = file if isinstance(file, int) else file.fileno()
    if POSIX:
        try:
            fcntl.flock(number, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            return False
        return True
    here = os.lseek(number, 0, os.SEEK_CUR)
    os.lseek(number, _FAR, os.SEEK_SET)
    try:
        msvcrt.locking(number, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    except PermissionError:
        return False
    finally:
        os.lseek(number, here, os.SEEK_SET)
    return True


def write_at(file: int, data: bytes, at: int) -> int:
    """Write into a file at a place, and return the number of bytes that were written.

    Raises:
        OSError: it cannot be written.
    """
    if POSIX:
        return os.pwrite(file, data, at)
    os.lseek(file, at, os.SEEK_SET)
    return os.write(file, data)


def end_group(pid: int) -> None:
    """Kill a process that was started in a group of its own, and all of the group.

    On Windows: the process, and what it has started; if it has ended, what it has left behind goes on.
    """
    if POSIX:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(pid, signal.SIGKILL)
        return
    import psutil  # noqa: PLC0415 - the fork server, which needs this module, does not load it

    with contextlib.suppress(psutil.Error):
        process = psutil.Process(pid)
        for one in (process, *process.children(recursive=True)):
            with contextlib.suppress(psutil.Error):
                one.kill()


def bound_processor_time(seconds: float) -> None:
    """Let the kernel end this process after this many seconds of processor time; 0 for never. Windows never does."""
    if POSIX:
        signal.setitimer(signal.ITIMER_VIRTUAL, seconds)


_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""The system's clock for it; a system without it has one that may stand still."""


def boot_time() -> float:
    """The s since this computer was started, also those for which it slept: motors are awake meanwhile."""
    return time.clock_gettime(_CLOCK)
