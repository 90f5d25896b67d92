"""The fork server itself, `python -P -m vrg.launch.forking MODULE...`: it loads modules, and forks at each request.

It opens nothing and has one thread, so that a fork is safe: a session with the bus is opened only after the fork. The
launcher sends requests over a socket, which is the server's standard input. A request is a JSON list of a module and
the arguments of its `main`, with three file descriptors: the standard input of the new process, which ends it when it
is closed; its log; and further environment variables, as JSON. The answers are `{"pid": n}`, with null for n if the
system has no room for another process, and when that process has ended `{"pid": n, "status": m}`.

What a process has started ends with it: its group is killed, and whatever has left the group becomes a child of the
server, as that of a dead parent does.
"""

import atexit
import contextlib
import ctypes
import gc
import importlib
import json
import logging
import os
import select
import signal
import socket
import sys
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from typing import NoReturn

from vrg.registry import added
from vrg.system import end_group

PRELOADED = (
    "vrg.launch.process_main",
    "vrg.agents.player",
    "vrg.launch.nodes.player",
    "vrg.bus.session",
    "vrg.hal.sim.driver",
    "vrg.playing.strategies",
    "vrg.launch.nodes.world",
    "vrg.launch.nodes.referee",
    "vrg.launch.nodes.recorder",
)
"""The modules that nodes of a match need, but none that start threads."""
_THREADS = "OPENBLAS_NUM_THREADS"
"""The environment variable by which numpy starts no threads when it is imported."""
ORPHANED = 12.0
"""The real time in s from the launcher's death after which processes are killed. Nodes end by themselves in 10 s."""
MAX_REQUEST_SIZE = 1 << 16
"""The length of the longest request, bytes."""
_MARK = "VRG_PROCESS"
"""The environment variable by which a process of the server marks what it starts."""
_SUBREAPER = 36
"""PR_SET_CHILD_SUBREAPER."""


def serve_forks(channel: socket.socket, patience: float = ORPHANED) -> None:
    """Fork at each request until the launcher closes the channel.

    Args:
        patience: the real time in s after which processes are then killed.
    """
    # Without it, what a process leaves behind would have no parent; then only its group is ended.
    ctypes.CDLL(None).prctl(_SUBREAPER, ctypes.c_ulong(1), ctypes.c_ulong(0), ctypes.c_ulong(0), ctypes.c_ulong(0))
    # Frozen objects are not touched by garbage collection, so they stay in memory pages that all processes share.
    gc.collect()
    gc.freeze()
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    children: set[int] = set()
    try:
        while _serve_one(channel, reader, children):
            pass
    except OSError:
        # A launcher that is killed while an answer waits for it resets the connection.
        pass
    finally:
        _end(children, patience)


def _serve_one(channel: socket.socket, reader: int, children: set[int]) -> bool:
    """Wait for a request or the end of a process, and deal with it; return False if the launcher is gone.

    Args:
        reader: the end of the pipe by which the end of a process wakes this up. children: the processes that run.

    Raises:
        OSError: the launcher is gone.
    """
    ready = select.select([channel.fileno(), reader], [], [])[0]
    if reader in ready:
        os.read(reader, 4096)
        ended = dict(_reap(children))
        _end_strays(children)
        for gone, status in ended.items():
            channel.send(json.dumps({"pid": gone, "status": status}).encode())
    if channel.fileno() in ready:
        data, descriptors, _, _ = socket.recv_fds(channel, MAX_REQUEST_SIZE, 3)
        if not data:
            return False
        pid: int | None = None
        with contextlib.suppress(OSError):  # the system has no room for another process now
            pid = os.fork()
        if pid == 0:
            stream, log, variables = descriptors
            become(json.loads(data), stream, log, _read(variables))
        if pid is not None:
            children.add(pid)
        for descriptor in descriptors:
            os.close(descriptor)
        channel.send(json.dumps({"pid": pid}).encode())
    return True


def _reap(children: set[int]) -> Iterator[tuple[int, int]]:
    """Bury all that has ended; yield the process id and the exit status of those that were asked for."""
    while True:
        try:
            ended = os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        except ChildProcessError:
            return
        if ended is None:
            return
        if ended.si_pid in children:
            end_group(ended.si_pid)  # as long as it is not buried, its group's number belongs to no other
        status = os.waitstatus_to_exitcode(os.waitpid(ended.si_pid, 0)[1])
        if ended.si_pid in children:
            children.discard(ended.si_pid)
            yield ended.si_pid, status


def _end_strays(children: set[int]) -> None:
    """Kill what processes have started and left behind: it has become a child of this one, and its end is seen.

    What bears the mark of a process that still runs is left to it: a driver's daemon, for example.
    """
    own = f"/proc/self/task/{os.getpid()}/children"
    try:
        with open(own, encoding="ascii") as file:
            pids = [int(word) for word in file.read().split()]
    except OSError:
        import psutil  # noqa: PLC0415 - only a kernel without the list above needs it

        pids = [child.pid for child in psutil.Process().children()]
    for pid in pids:
        if pid not in children and _owner(pid) not in children:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)


def _owner(pid: int) -> int | None:
    """The process that has started another one, by its mark; None if that has none, or has ended."""
    try:
        with open(f"/proc/{pid}/environ", "rb") as file:
            marks = [part for part in file.read().split(b"\0") if part.startswith(f"{_MARK}=".encode())]
        return int(marks[0].partition(b"=")[2]) if marks else None
    except (OSError, ValueError):
        return None


def _end(children: set[int], patience: float) -> None:
    """Wait until all processes have ended by themselves, or kill them: what should end them may be stuck."""
    deadline = time.monotonic() + patience
    while True:
        for _ in _reap(children):
            pass
        _end_strays(children if time.monotonic() < deadline else set())
        try:
            # Strays that have just been killed are still to be buried.
            os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        except ChildProcessError:
            return
        time.sleep(0.02)


def _read(variables: int) -> dict[str, str]:
    """The variables in a file. Only the new process reads them: what the server has read, all that it forks have."""
    found: dict[str, str] = json.loads(os.pread(variables, os.fstat(variables).st_size, 0))
    return found


def become(request: Sequence[str], stream: int, log: int, variables: Mapping[str, str]) -> NoReturn:
    """Run as a process that was just forked, and never return.

    Args:
        request: the module and the arguments of its `main`. stream, log: descriptors of its standard input and output.
        variables: further environment variables.
    """
    status = 1
    try:
        os.setsid()
        for name, value in variables.items():
            os.environ.setdefault(name, value)  # from those that are there already, the title finds its place
        os.environ[_MARK] = str(os.getpid())
        signal.set_wakeup_fd(-1)
        for descriptor, standard in ((stream, 0), (log, 1), (log, 2)):
            os.dup2(descriptor, standard)
        # Nothing else that was open before is for it. What was open stays frozen, and is never closed again.
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if "numpy.random" in sys.modules:  # Python reseeds its own generator; this one would draw the same in all
            sys.modules["numpy.random"].seed()
        status = importlib.import_module(request[0]).main(request[1:])
        atexit._run_exitfuncs()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(Exception):
            logging.shutdown()
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


@contextlib.contextmanager
def _one_thread() -> Iterator[None]:
    """Import numpy without threads, unless the environment says how many. What is forked may start some later."""
    if _THREADS in os.environ:
        yield
        return
    os.environ[_THREADS] = "1"
    try:
        yield
    finally:
        del os.environ[_THREADS]


def main() -> None:
    """Run as the server. If something has started a second thread, end at once, because forks would not be safe."""
    with socket.socket(fileno=os.dup(0)) as channel:
        with _one_thread():
            for module in sys.argv[1:]:
                importlib.import_module(module)
        added()  # takes each process 15 ms otherwise
        if os.path.exists("/proc/self/task") and len(os.listdir("/proc/self/task")) > 1:
            return
        serve_forks(channel)


if __name__ == "__main__":
    main()
