"""Starts processes: forked from a server that has loaded what they need, or with an interpreter of their own.

The server is the first process that the launcher starts, and it loads while the launcher still reads the match file. If
it dies or freezes, the launcher starts processes in the ordinary way, and those that run already are not affected.
What the server does is in `forking`.
"""

import atexit
import contextlib
import ctypes
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import IO

import psutil

from vrg.bus.stopping import StopSignal
from vrg.errors import LaunchError
from vrg.launch import forking
from vrg.launch.sandbox.variables import named_variables
from vrg.system import POSIX, end_group

UNKNOWN_STATUS = 255
"""The exit status that is assumed for a process whose end was not seen, because the server died before it."""
_LOOK = 0.01
"""The real time in s between two looks at whether a process has ended."""
_END = 2.0
"""The real time in s that the server may take to end what processes have left behind."""
_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG."""
_FROZEN = (psutil.STATUS_STOPPED, psutil.STATUS_TRACING_STOP, psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)


def cores() -> int:
    """The number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Child(ABC):
    """A process that was started: `main` of a module, in an operating-system session of its own.

    Attributes:
        pid: its process id. stream: the other end of its standard input. It ends once this is closed.
    """

    def __init__(self, pid: int, stream: socket.socket | IO[bytes]) -> None:
        self.pid = pid
        self.stream = stream

    def detached(self) -> int:
        """The descriptor of the other end of its standard input, by which it answers, too; `stream` is it no longer.

        Raises:
            LaunchError: on Windows it cannot answer.
        """
        if not isinstance(self.stream, socket.socket):
            self.kill()
            raise LaunchError("strategies and games in processes of their own need Linux or macOS")
        return self.stream.detach()

    @abstractmethod
    def poll(self) -> int | None:
        """The exit status, negative if a signal ended it; None while it runs."""

    @abstractmethod
    def send_signal(self, number: int) -> None:
        """Send it a signal, if it still runs."""

    def kill(self) -> None:
        """Kill it, if it still runs. What it has started ends with it."""
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float) -> bool:
        """Wait at most this many seconds for its end; whether it has ended."""
        deadline = time.monotonic() + timeout
        while self.poll() is None and time.monotonic() < deadline:
            self.rest()
        return self.poll() is not None

    def rest(self) -> None:
        """Let a moment pass, or less if it ends before."""
        time.sleep(_LOOK)


def _can_fork() -> bool:
    """True if processes can be forked here from a server. On macOS one that has loaded the system's libraries cannot
    fork safely; without handles of processes (before Linux 5.3) the end of a process could be mistaken."""
    if sys.platform != "linux":
        return False
    try:
        os.close(os.pidfd_open(os.getpid()))
    except OSError:
        return False
    return True


class ForkServer:
    """The launcher's side of the server. `start` is quick; the first process waits until the server has loaded.

    Attributes:
        stop: once this is set, no process waits any more until the server has loaded.
    """

    def __init__(self) -> None:
        self.stop: StopSignal | None = None
        self._channel: socket.socket | None = None
        self._pid = 0
        self._process: subprocess.Popen[bytes] | None = None
        self._statuses: dict[int, int] = {}
        self._pids: list[int | None] = []
        self._loaded = False

    @property
    def alive(self) -> bool:
        """True if the server can take requests."""
        return self._channel is not None

    def start(self, preload: Sequence[str] = forking.PRELOADED) -> None:
        """Start the server. If that fails, or anywhere but on Linux, `alive` stays False.

        Args:
            preload: the modules that it loads.
        """
        if not _can_fork():
            return
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs, contextlib.suppress(OSError):
            command = [sys.executable, "-P", "-m", forking.__name__, *preload]
            self._process = subprocess.Popen(
                command, stdin=theirs.fileno(), start_new_session=True, env=named_variables(os.environ)
            )
            self._pid = self._process.pid
            self._channel = ours

    def start_as_fork(self) -> None:
        """Start the server as a fork of this process, which must have one thread. Processes know what it knows now.

        Where `start` starts none, neither does this.
        """
        if not _can_fork():
            return
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._pid = os.fork()
        if self._pid == 0:
            try:
                ours.close()
                atexit._clear()  # what this process does at its end is not for others to do
                forking.serve_forks(theirs, patience=0.0)
            finally:
                os._exit(0)
        theirs.close()
        self._channel, self._loaded = ours, True

    def run(
        self, module: str, arguments: Sequence[str], log: IO[bytes], *, forked: bool = True, trusted: bool = False
    ) -> Child:
        """Start a process.

        Args:
            module: its `main` is called with the arguments, and returns the exit status.
            log: the file that its output is written to. forked: False gives it an interpreter of its own.
            trusted: True gives it all environment variables of this process, False those that strangers may know.

        Raises:
            OSError: it cannot be started.
        """
        # With -P, a folder `vrg` or a file `random.py` in the working directory does not hide this package or the
        # library's module.
        command = [sys.executable, "-P", "-m", module, *arguments]
        if not POSIX:
            # Ctrl-C reaches no other group.
            group = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=log, stderr=subprocess.STDOUT, bufsize=0, creationflags=group
            )
            assert process.stdin is not None
            return Spawned(process, process.stdin)
        ours, theirs = socket.socketpair()
        with theirs:
            pid = self._fork([module, *arguments], theirs, log, trusted=trusted) if forked else None
            if pid is not None:
                return _Forked(self, pid, ours)
            try:
                process = subprocess.Popen(
                    command, stdin=theirs.fileno(), stdout=log, stderr=subprocess.STDOUT, start_new_session=True,
                    env=None if trusted else named_variables(os.environ),
                )  # fmt: skip
            except OSError:
                ours.close()
                raise
            return Spawned(process, ours)

    def _fork(self, request: Sequence[str], stream: socket.socket, log: IO[bytes], *, trusted: bool) -> int | None:
        """Let the server fork; None if it is gone, or frozen, or still loads when `stop` is set."""
        if self._channel is None:
            return None
        with contextlib.suppress(OSError):
            with os.fdopen(os.memfd_create("variables"), "wb", buffering=0) as variables:
                # The server must not read them: what it has read is in the memory of all that it forks.
                variables.write(json.dumps(dict(os.environ) if trusted else {}).encode())
                descriptors = [stream.fileno(), log.fileno(), variables.fileno()]
                socket.send_fds(self._channel, [json.dumps(request).encode()], descriptors)
            # The answer is waited for: a process that is not known could not be stopped.
            while not self._pids and self._channel is not None and not self.frozen():
                if not self._loaded and self.stop is not None and self.stop.is_set():
                    break
                _readable(self._channel, 0.05)
                self.receive()
        if not self._pids:
            self.close(0.0)
            return None
        self._loaded = True
        return self._pids.pop(0)

    def receive(self) -> None:
        """Take in the server's answers."""
        while self._channel is not None and _readable(self._channel, 0.0):
            try:
                data = self._channel.recv(forking.MAX_REQUEST_SIZE, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return  # another thread has taken the answer in
            except OSError:
                data = b""
            if not data:
                self.close(0.0)
                return
            message = json.loads(data)
            if "status" in message:
                self._statuses[message["pid"]] = message["status"]
            else:
                # An earlier process may have had this pid.
                self._statuses.pop(message["pid"], None)
                self._pids.append(message["pid"])

    def status(self, pid: int) -> int | None:
        """The exit status of a process, negative if a signal ended it; None if the server has not reported its end."""
        self.receive()
        return self._statuses.pop(pid, None)

    def frozen(self) -> bool:
        """True if the server is stopped or dead. One that is only slow is waited for."""
        try:
            return psutil.Process(self._pid).status() in _FROZEN
        except psutil.Error:
            return True

    def close(self, patience: float = _END) -> None:
        """End the server, and what its processes have left behind; they themselves go on. Idempotent.

        Args:
            patience: the real time in s that it has to end by itself.
        """
        if self._channel is None:
            return
        self._channel.close()
        self._channel = None
        deadline = time.monotonic() + patience
        while not self.frozen() and time.monotonic() < deadline:
            time.sleep(_LOOK)
        # A frozen server does not notice that its channel is closed.
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        else:
            with contextlib.suppress(ProcessLookupError, ChildProcessError):
                os.kill(self._pid, signal.SIGKILL)
                os.waitpid(self._pid, 0)


class OwnForks(ForkServer):
    """Starts processes as forks of this one, which must have one thread. They know what it knows, and end with it.

    For Linux: only its kernel ends them.
    """

    def run(
        self, module: str, arguments: Sequence[str], log: IO[bytes], *, forked: bool = True, trusted: bool = False
    ) -> Child:
        """Start a process; see `ForkServer.run`."""
        ours, theirs = socket.socketpair()
        with theirs:
            parent, pid = os.getpid(), os.fork()
            if pid == 0:
                atexit._clear()  # what this process does at its end is not for others to do
                _end_with(parent)
                forking.become([module, *arguments], theirs.fileno(), log.fileno(), {})
        return _OwnFork(pid, ours)


def _end_with(parent: int) -> None:
    """Let the kernel kill this process as soon as its parent has ended."""
    ctypes.CDLL(None).prctl(_DEATH_SIGNAL, ctypes.c_ulong(signal.SIGKILL))
    if os.getppid() != parent:
        os._exit(1)


@contextlib.contextmanager
def fork_server(*, wanted: bool = True, preload: Sequence[str] = forking.PRELOADED) -> Iterator[ForkServer]:
    """A fork server that is stopped at the end. If it is not wanted, every process gets an interpreter of its own."""
    server = ForkServer()
    if wanted:
        server.start(preload)
    try:
        yield server
    finally:
        server.close()


class _Forked(Child):
    """A process that the server has forked. When it ends, the server ends its group and what it has left behind."""

    def __init__(self, server: ForkServer, pid: int, stream: socket.socket) -> None:
        super().__init__(pid, stream)
        self._server = server
        self._status: int | None = None
        self._handle = -1
        # The handle tells this process from a later one with the same number. If it has ended, there is none.
        with contextlib.suppress(ProcessLookupError):
            self._handle = os.pidfd_open(pid)

    def poll(self) -> int | None:
        """The exit status; None while it runs, and until the server has reported it."""
        if self._status is None:
            self._status = self._server.status(self.pid)
        if self._status is None and self._gone():
            if self._server.alive and self._server.frozen():
                self._server.close(0.0)
            # The report may have come meanwhile.
            self._status = self._server.status(self.pid)
            if self._status is None and not self._server.alive:
                self._status = UNKNOWN_STATUS
                end_group(self.pid)
        if self._status is not None and self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
        return self._status

    def send_signal(self, number: int) -> None:
        """Send it a signal, if it still runs."""
        if self._handle >= 0 and self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._handle, number)
            if number == signal.SIGKILL and not self._server.alive:
                end_group(self.pid)

    def rest(self) -> None:
        """Let a moment pass, or less if it ends before."""
        if self._gone(_LOOK):
            time.sleep(_LOOK / 10)  # the server has not reported it yet

    def _gone(self, patience: float = 0.0) -> bool:
        """True if it has ended; waits at most this many seconds for it."""
        return self._handle < 0 or _readable(self._handle, patience)


def _readable(file: int | socket.socket, patience: float) -> bool:
    """Wait at most this many seconds until a file can be read. Unlike `select`, this takes more than 1,024 files."""
    waiting = select.poll()
    waiting.register(file, select.POLLIN)
    return bool(waiting.poll(1000 * patience))


class _OwnFork(Child):
    """A fork of this process, which any thread may look at. When it ends, its group does."""

    def __init__(self, pid: int, stream: socket.socket) -> None:
        super().__init__(pid, stream)
        self._status: int | None = None
        self._looking = threading.RLock()

    def poll(self) -> int | None:
        """The exit status; None while it runs."""
        with self._looking:
            return self._poll()

    def _poll(self) -> int | None:
        if self._status is None:
            # As long as it is not buried, its group's number belongs to no other.
            ended = os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
            if ended is not None:
                end_group(self.pid)
                self._status = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self._status

    def send_signal(self, number: int) -> None:
        """Send it a signal, if it still runs."""
        with self._looking:  # nobody buries it meanwhile
            if self._poll() is None:
                os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill it and its whole group, if it still runs."""
        with self._looking:
            if self._poll() is None:
                end_group(self.pid)


class Spawned(Child):
    """A process with an interpreter of its own. When it ends, its group does."""

    def __init__(self, process: "subprocess.Popen[bytes]", stream: socket.socket | IO[bytes]) -> None:
        super().__init__(process.pid, stream)
        self._process = process

    def poll(self) -> int | None:
        """The exit status; None while it runs."""
        running = self._process.returncode is None
        status = self._process.poll()
        if running and status is not None:
            end_group(self.pid)
        return status

    def send_signal(self, number: int) -> None:
        """Send it a signal, if it still runs."""
        if self.poll() is None:
            self._process.send_signal(number)

    def kill(self) -> None:
        """Kill it and its whole group, if it still runs."""
        if self.poll() is None:
            end_group(self.pid)
