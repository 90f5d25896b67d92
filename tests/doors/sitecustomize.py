"""What VRG meets on a system without the doors of Linux: for its modules alone, what is named here does not exist.

Python runs this at the start of each process that has this folder on its PYTHONPATH, so that the processes that VRG
starts meet the same. The standard library and the packages keep what they have: on such a system they have code of
their own for it. The variable VRG_SYSTEM names the system: `darwin` or `win32`.
"""

import builtins
import faulthandler
import fcntl
import os
import select
import signal
import socket
import stat
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

SYSTEM = os.environ["VRG_SYSTEM"]
VRG = f"{Path(__file__).resolve().parents[2] / 'vrg'}{os.sep}"

LINUX_ALONE = {
    "os": "pidfd_open memfd_create sched_getaffinity sched_setaffinity waitid P_ALL WEXITED WNOWAIT O_PATH O_TMPFILE",
    "signal": "pidfd_send_signal",
    "select": "epoll POLLRDHUP",
    "socket": "AF_CAN SO_RCVBUFFORCE",
}
POSIX_ALONE = {
    "os": (
        "fork forkpty getuid geteuid getgid getegid getpgid getpgrp setsid setpgid killpg wait wait3 wait4 "
        "WNOHANG WIFEXITED pread pwrite O_NOFOLLOW O_NONBLOCK O_NOCTTY O_CLOEXEC O_DIRECTORY fwalk statvfs fdatasync "
        "fchmod fchown chown lchown mkfifo mknod nice uname sysconf getloadavg set_blocking openpty ttyname"
    ),
    "signal": (
        "SIGALRM SIGVTALRM SIGPROF SIGHUP SIGUSR1 SIGUSR2 SIGCHLD SIGKILL SIGSTOP SIGCONT SIGPIPE SIGQUIT setitimer "
        "getitimer ITIMER_REAL ITIMER_VIRTUAL ITIMER_PROF pthread_kill pthread_sigmask sigwait sigpending pause alarm"
    ),
    "select": "poll POLLIN POLLHUP kqueue",
    "socket": "AF_UNIX send_fds recv_fds",
    "faulthandler": "register unregister",
}
MODULES = {"fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "posix"} if SYSTEM == "win32" else set()


class Shut(ModuleType):
    """A module without some of its names.

    Args:
        module: the whole one. missing: the names that it does not have. instead: what others mean on that system.
    """

    def __init__(self, module: ModuleType, missing: str = "", **instead: Any) -> None:
        super().__init__(module.__name__)
        self.__dict__.update(_module=module, _missing=frozenset(missing.split()), _instead=instead)

    def __getattr__(self, name: str) -> Any:
        if name in self._missing:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r} on {SYSTEM}")
        return self._instead[name] if name in self._instead else getattr(self._module, name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._module, name, value)


def _socket_pair() -> tuple[socket.socket, socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        ours = socket.create_connection(listening.getsockname())
        return ours, listening.accept()[0]


def _select_sockets(*arguments: Any) -> Any:
    for waited in arguments[:3]:
        for one in waited:
            number = one if isinstance(one, int) else one.fileno()
            if not stat.S_ISSOCK(os.fstat(number).st_mode):
                raise OSError(10038, "an operation was attempted on something that is not a socket")
    return select.select(*arguments)


def _end_at_once(pid: int, number: int) -> None:
    os.kill(pid, signal.SIGKILL if number else 0)


class _Popen(subprocess.Popen):  # type: ignore[type-arg]
    def __init__(self, *arguments: Any, **options: Any) -> None:
        for stream in ("stdin", "stdout", "stderr"):
            number = options.get(stream)
            if isinstance(number, int) and number >= 0 and stat.S_ISSOCK(os.fstat(number).st_mode):
                raise OSError(9, "a socket is no file")
        super().__init__(*arguments, **options)

    def send_signal(self, number: int) -> None:
        super().send_signal(signal.SIGKILL)


def _locking(file: int, mode: int, _size: int) -> None:
    """Lock a part of a file as the C library of Windows does: here all of it."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | (fcntl.LOCK_NB if mode == MSVCRT.LK_NBLCK else 0))
    except BlockingIOError as error:
        raise PermissionError(13, "another process has locked it") from error


MSVCRT: Any = ModuleType("msvcrt")
MSVCRT.LK_LOCK, MSVCRT.LK_NBLCK, MSVCRT.locking = 1, 2, _locking

SEEN: dict[str, ModuleType] = {
    "sys": Shut(sys, platform=SYSTEM),
    **{name: Shut(sys.modules[name], names) for name, names in LINUX_ALONE.items()},
}
if SYSTEM == "win32":
    both = {name: f"{names} {LINUX_ALONE.get(name, '')}" for name, names in POSIX_ALONE.items()}
    SEEN |= {
        "os": Shut(os, both["os"], name="nt", kill=_end_at_once),
        "signal": Shut(signal, both["signal"]),
        "select": Shut(select, both["select"], select=_select_sockets),
        "socket": Shut(socket, both["socket"], socketpair=_socket_pair),
        "faulthandler": Shut(faulthandler, both["faulthandler"]),
        "subprocess": Shut(subprocess, Popen=_Popen),
        "msvcrt": MSVCRT,
    }

_import = builtins.__import__


def _imported(name: str, globals: Any = None, locals: Any = None, fromlist: Any = (), level: int = 0) -> ModuleType:
    if f"{(globals or {}).get('__package__') or ''}.".startswith("vrg."):
        if name in MODULES:
            raise ModuleNotFoundError(f"No module named {name!r} on {SYSTEM}", name=name)
        if name in SEEN:
            return SEEN[name]
    return _import(name, globals, locals, fromlist, level)


def _asks(path: Any) -> bool:
    return isinstance(path, str | bytes | os.PathLike) and os.fsdecode(path).startswith("/proc/")


def _by_vrg() -> bool:
    """True if a module of VRG calls, and no package between."""
    frame = sys._getframe(2)
    while (
        frame is not None and frame.f_code.co_filename != __file__ and "site-packages" not in frame.f_code.co_filename
    ):
        if frame.f_code.co_filename.startswith(VRG):
            return True
        frame = frame.f_back  # type: ignore[assignment]
    return False


def _is_open(path: Any) -> bool:
    """True if this process has a file open, which Windows then neither renames nor deletes."""
    try:
        named = os.stat(path)
    except (OSError, TypeError):
        return False
    if not stat.S_ISREG(named.st_mode):
        return False
    for number in os.listdir("/proc/self/fd"):
        try:
            found = os.fstat(int(number))
        except OSError:
            continue
        if (found.st_dev, found.st_ino) == (named.st_dev, named.st_ino):
            return True
    return False


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if event in ("open", "os.listdir", "os.scandir"):
        if _asks(arguments[0]) and _by_vrg():
            raise FileNotFoundError(2, "no such file on this system", arguments[0])
    elif event in ("os.rename", "os.remove") and SYSTEM == "win32":
        for path in arguments[: 2 if event == "os.rename" else 1]:
            if _is_open(path) and _by_vrg():
                raise PermissionError(13, "the file is open", path)


builtins.__import__ = _imported
sys.addaudithook(_audit)
