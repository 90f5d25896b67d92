"""The fork server: a process that has loaded what every node needs, and forks to start each node quickly.

It is the first process that the launcher starts, and it loads while the launcher still reads the match file. It opens
nothing and has one thread, so that a fork is safe: a session with the bus is opened only after the fork. If it dies or
hangs, the launcher starts processes in the ordinary way, and the nodes that run already are not affected.

The launcher sends requests over a socket, which is the server's standard input. A request is a JSON list of arguments
with two file descriptors: the leash, which becomes the standard input of the node, and the node's log. The answers are
`{"pid": n}` and, when that node has ended, `{"pid": n, "status": m}`.
"""

import atexit
import contextlib
import gc
import json
import logging
import os
import select
import signal
import socket
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from vrg.bus.stopping import StopSignal
from vrg.launch import child

PATIENCE = 5.0
"""The real time in s that the launcher waits for an answer. Forking itself takes milliseconds."""
REAPED = 2.0
"""The real time in s from the end of a node within which the server must have reported its status."""
LOADING = 60.0
"""The real time in s that the launcher waits for the first answer, because the server may still be loading."""
ORPHANED = 12.0
"""The real time in s from the launcher's death after which nodes are killed. Their own leash gives them 10 s."""
UNKNOWN = 255
"""The exit status that is assumed for a node whose end was not seen, because the server died before it."""
_MESSAGE = 1 << 16


class ForkServer:
    """The launcher's side of the fork server. `start` is quick; the first `fork` waits until the server has loaded.

    Attributes:
        stop: once this is set, nobody waits any more until the server has loaded.
    """

    def __init__(self) -> None:
        self.stop: StopSignal | None = None
        self._channel: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._statuses: dict[int, int] = {}
        self._pids: list[int] = []
        self._loaded = False

    @property
    def alive(self) -> bool:
        """Whether the server can take requests."""
        return self._channel is not None

    def start(self) -> None:
        """Start the server. If that fails, `alive` stays False."""
        try:
            os.close(os.pidfd_open(os.getpid()))
        except (AttributeError, OSError):
            # Without such handles (before Linux 5.3, or on another system) a node's end could be mistaken.
            return
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs, contextlib.suppress(OSError):
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "vrg.launch.fork_server"], stdin=theirs.fileno(), start_new_session=True
            )
            self._channel = ours

    def fork(self, arguments: tuple[str, ...], log: IO[bytes]) -> "Forked | None":
        """Fork a node. If the server does not answer, it is given up and the result is None.

        Args:
            arguments: the arguments of `vrg.launch.child`.
            log: the file that the node's output is written to.
        """
        if self._channel is None:
            return None
        leash, hold = os.pipe()
        try:
            message = json.dumps(arguments).encode()
            socket.send_fds(self._channel, [message], [leash, log.fileno()])
            deadline = time.monotonic() + (PATIENCE if self._loaded else LOADING)
            while not self._pids and self._channel is not None and time.monotonic() < deadline:
                # Once it has loaded, the answer is waited for: a node that nobody knows could not be stopped.
                if not self._loaded and self.stop is not None and self.stop.is_set():
                    break
                select.select([self._channel], [], [], 0.05)
                self.receive()
        except OSError:
            self.give_up()
        finally:
            os.close(leash)
        if not self._pids:
            self.give_up()
            os.close(hold)
            return None
        self._loaded = True
        return Forked(self, self._pids.pop(0), hold)

    def receive(self) -> None:
        """Take in the server's answers."""
        while self._channel is not None and select.select([self._channel], [], [], 0.0)[0]:
            data = self._channel.recv(_MESSAGE)
            if not data:
                self.give_up()
                return
            said = json.loads(data)
            if "status" in said:
                self._statuses[said["pid"]] = said["status"]
            else:
                # An earlier node may have had this pid.
                self._statuses.pop(said["pid"], None)
                self._pids.append(said["pid"])

    def status(self, pid: int) -> int | None:
        """The exit status of a node, negative if a signal ended it; None if the server has not reported its end."""
        self.receive()
        return self._statuses.pop(pid, None)

    def close(self) -> None:
        """End the server. The nodes go on. Idempotent."""
        self.give_up()
        if self._process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(1.0)

    def give_up(self) -> None:
        """Send the server no more requests. Idempotent."""
        if self._channel is not None:
            self._channel.close()
            self._channel = None
            if self._process is not None:
                # A frozen server would not notice that its channel is closed.
                self._process.kill()


@contextlib.contextmanager
def fork_server(*, wanted: bool = True) -> Iterator[ForkServer]:
    """A fork server that is stopped at the end. If it is not wanted, it is not started, and `fork` returns None.

    It is started only on Linux: on macOS a process that has loaded the system's libraries cannot fork safely.
    """
    server = ForkServer()
    if wanted and sys.platform == "linux":
        server.start()
    try:
        yield server
    finally:
        server.close()


class Forked:
    """A node that the fork server has forked. It is used like a `subprocess.Popen`."""

    def __init__(self, server: ForkServer, pid: int, leash: int) -> None:
        self.pid = pid
        self.stdin = os.fdopen(leash, "wb")
        self._server = server
        self._status: int | None = None
        self._gone_since = 0.0
        self._handle = -1
        # The handle tells this process from a later one with the same number. If the node has ended, there is none.
        with contextlib.suppress(ProcessLookupError):
            self._handle = os.pidfd_open(pid)

    def poll(self) -> int | None:
        """The exit status of the node; None while it runs."""
        if self._status is None:
            self._status = self._server.status(self.pid)
        if self._status is None and self._gone(0.0):
            now = time.monotonic()
            self._gone_since = self._gone_since or now
            if not self._server.alive or now - self._gone_since > REAPED:
                # The server is frozen, or has lost it.
                self._server.give_up()
                self._status = UNKNOWN
        if self._status is not None and self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
        return self._status

    def send_signal(self, number: int) -> None:
        """Send the node a signal, if it still runs."""
        if self._handle >= 0 and self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._handle, number)

    def kill(self) -> None:
        """End the node at once."""
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end of the node, and return its exit status.

        Raises:
            subprocess.TimeoutExpired: it has not ended within `timeout` s.
        """
        deadline = time.monotonic() + (1e9 if timeout is None else timeout)
        while self.poll() is None:
            left = deadline - time.monotonic()
            if left <= 0:
                raise subprocess.TimeoutExpired(f"process {self.pid}", timeout or 0.0)
            if self._gone(min(left, 0.05)):
                time.sleep(0.01)
        return self._status or 0

    def _gone(self, patience: float) -> bool:
        """Whether the node has ended; waits at most `patience` seconds for it."""
        if self._handle < 0:
            return True
        return bool(select.select([self._handle], [], [], patience)[0])


def _serve(channel: socket.socket) -> None:
    """Fork at each request until the launcher closes the channel."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    children: set[int] = set()
    try:
        while _serve_one(channel, reader, writer, children):
            pass
    except OSError:
        # A launcher that is killed while an answer waits for it resets the connection.
        pass
    finally:
        _end(children)


def _serve_one(channel: socket.socket, reader: int, writer: int, children: set[int]) -> bool:
    """Wait for a request or the end of a node, and deal with it; return False if the launcher is gone.

    Args:
        reader, writer: the ends of the pipe by which the end of a node wakes this up. children: the nodes that run.

    Raises:
        OSError: the launcher is gone.
    """
    ready = select.select([channel.fileno(), reader], [], [])[0]
    if reader in ready:
        os.read(reader, 4096)
        children -= set(_reap(channel))
    if channel.fileno() in ready:
        data, descriptors, _, _ = socket.recv_fds(channel, _MESSAGE, 2)
        if not data:
            return False
        pid = os.fork()
        if pid == 0:
            signal.set_wakeup_fd(-1)
            for descriptor in (reader, writer):
                os.close(descriptor)
            channel.close()
            _become(json.loads(data), *descriptors)
        children.add(pid)
        for descriptor in descriptors:
            os.close(descriptor)
        channel.send(json.dumps({"pid": pid}).encode())
    return True


def _end(children: set[int]) -> None:
    """Kill the nodes that have not ended by themselves a while after the launcher died: their own leash may be stuck.

    A launcher that ends in the ordinary way kills this server before.
    """
    deadline = time.monotonic() + ORPHANED
    while children and time.monotonic() < deadline:
        time.sleep(0.1)
        with contextlib.suppress(ChildProcessError):
            while (pid := os.waitpid(-1, os.WNOHANG)[0]) != 0:
                children.discard(pid)
    for pid in children:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def _reap(channel: socket.socket) -> Iterator[int]:
    """Report the nodes that have ended, and yield their process ids."""
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if pid == 0:
            return
        yield pid
        ended = {"pid": pid, "status": os.waitstatus_to_exitcode(status)}
        with contextlib.suppress(OSError):
            channel.send(json.dumps(ended).encode())


def _become(arguments: list[str], leash: int, log: int) -> None:
    """Run as the node in the forked process, and never return."""
    status = 1
    try:
        os.setsid()
        for descriptor, standard in ((leash, 0), (log, 1), (log, 2)):
            os.dup2(descriptor, standard)
        os.close(leash)
        os.close(log)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        status = child.main(arguments)
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


def _preload() -> None:
    """Import what most nodes need, but nothing that starts threads, such as numpy."""
    import vrg.agents.player  # noqa: PLC0415
    import vrg.bus.session  # noqa: PLC0415
    import vrg.hal.sim.driver  # noqa: PLC0415
    import vrg.launch.sandbox.player  # noqa: PLC0415
    import vrg.launch.sandbox.seal  # noqa: F401, PLC0415

    # Frozen objects are not touched by garbage collection, so they stay in memory pages that all nodes share.
    gc.collect()
    gc.freeze()


def main() -> None:
    """Run as the server. If something has started a second thread, end at once, because forks would not be safe."""
    if Path("/proc/self/task").exists() and len(os.listdir("/proc/self/task")) > 1:
        return
    with socket.socket(fileno=os.dup(0)) as channel:
        _preload()
        _serve(channel)


if __name__ == "__main__":
    main()
