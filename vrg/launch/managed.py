"""One process that the supervisor started."""

import signal
import subprocess
import sys
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path

import psutil

from vrg.errors import LaunchError
from vrg.launch.fork_server import Forked, ForkServer

STOP_PATIENCE = 5.0
"""s of real time from SIGTERM to SIGKILL."""
IDLE_PATIENCE = 30.0
"""s of real time that a process may do nothing at all before it is ready."""
BUSY_PATIENCE = 60.0
"""s of processor time that a process may use before it is ready: an endless loop uses up any."""
_WORKS = 0.01
"""s of processor time; using less between two looks counts as doing nothing."""
_STALL = 2.0
"""s of real time; a longer pause between two looks counts for no more than this."""
RESTART_LIMIT = 5
RESTART_WINDOW = 60.0
"""More deaths than RESTART_LIMIT in this many seconds of real time, and the match is given up."""


@dataclass(frozen=True)
class ProcessSpec:
    """What to run.

    Args:
        name: of the process and of its log.
        arguments: of `vrg.launch.child`, or of the `vrg` command where this is no node of VRG's.
        command: it is the `vrg` command.
        pulse: key of its pulse, whose first beat says that it is ready; None where it is no node of the match.
        group: processes of a lower group are ready before those of a higher one are started.
        stop_order: processes of a lower number are stopped before those of a higher one.
        essential: without it there is no match.
        says: of a process without a pulse: what it prints once it is ready; the router prints nothing.
    """

    name: str
    arguments: tuple[str, ...]
    pulse: str | None
    group: int
    stop_order: int
    essential: bool = True
    says: str | None = None
    command: bool = False

    @property
    def interpreter(self) -> tuple[str, ...]:
        """The arguments of a Python interpreter of its own."""
        # -P: a folder `vrg` or a file `random.py` where somebody works must not be taken for this package or the
        # library.
        return ("-P", "-m", "vrg" if self.command else "vrg.launch.child", *self.arguments)

    @property
    def is_router(self) -> bool:
        """The router is started before there is a bus to hear anybody on."""
        return self.pulse is None and self.says is None


class ManagedProcess:
    """A child in a session of its own, so that Ctrl-C reaches the supervisor alone.

    Its standard input is a leash: it ends when the supervisor dies, and the child stops then.

    Args:
        server: becomes the child, as long as it lives.
    """

    def __init__(self, spec: ProcessSpec, log: Path, server: ForkServer) -> None:
        self.spec = spec
        self._server = server
        self.log = log
        self.deaths: deque[float] = deque()
        self.ready = False
        self._looked = 0.0
        self._idle = 0.0
        self._worked = 0.0
        self._log_begins = 0
        self._process: subprocess.Popen[bytes] | Forked | None = None

    @property
    def has_said(self) -> bool:
        """Whether it has printed what it prints once it is ready, since it was started last."""
        if self.spec.says is None:
            return False
        with self.log.open("rb") as log:
            log.seek(self._log_begins)
            return self.spec.says.encode() in log.read()

    @property
    def pid(self) -> int | None:
        """Of the running child."""
        return self._process.pid if self._process and self._process.poll() is None else None

    @property
    def exit_status(self) -> int | None:
        """None while it runs; negative = killed by that signal."""
        return self._process.poll() if self._process else None

    def start(self) -> None:
        """Start the child.

        Raises:
            LaunchError: it cannot be started.
        """
        self.ready = False
        self._looked, self._idle, self._worked = time.monotonic(), 0.0, 0.0
        try:
            with self.log.open("ab") as log:
                self._log_begins = log.tell()
                forked = None if self.spec.command else self._server.fork(self.spec.arguments, log)
                self._process = forked or subprocess.Popen(
                    [sys.executable, *self.spec.interpreter],
                    stdin=subprocess.PIPE,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
        except OSError as error:
            raise LaunchError(f"{self.spec.name}: cannot be started: {error}") from error

    def stuck(self, now: float) -> str | None:
        """Why a process that is not ready will not be, in words; None as long as it makes progress.

        Progress is processor time: however long a slow and busy machine takes, a process that gets on is waited for.
        """
        pid = self.pid
        if pid is None:
            return None
        try:
            times = psutil.Process(pid).cpu_times()
        except psutil.Error:
            return None
        used = times.user + times.system
        # Where the whole machine has stalled, this process was not idle for longer than the others.
        self._idle += min(now - self._looked, _STALL)
        self._looked = now
        if used - self._worked > _WORKS:
            self._idle, self._worked = 0.0, used
        if used > BUSY_PATIENCE:
            return f"has used {used:.0f} s of processor time and is not ready"
        if self._idle > IDLE_PATIENCE:
            return f"is not ready and has done nothing for {IDLE_PATIENCE:g} s"
        return None

    def note_death(self, now: float) -> bool:
        """Remember a death; False when it has died too often to be started again."""
        self.deaths.append(now)
        while self.deaths and now - self.deaths[0] > RESTART_WINDOW:
            self.deaths.popleft()
        return len(self.deaths) <= RESTART_LIMIT

    def kill(self) -> None:
        """Kill a child that hangs, and wait for it; SIGKILL also ends a stopped process."""
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.wait()

    def terminate(self) -> None:
        """Ask it to stop."""
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
            # A frozen process takes the request only when it runs again.
            self._process.send_signal(signal.SIGCONT)

    def wait_stopped(self, deadline: float) -> bool:
        """Wait for the end until the monotonic time `deadline`, then kill; whether it ended by itself."""
        if self._process is None:
            return True
        try:
            self._process.wait(max(0.01, deadline - time.monotonic()))
            return True
        except subprocess.TimeoutExpired:
            self.kill()
            return False
        finally:
            if self._process.stdin:
                self._process.stdin.close()

    def last_words(self, lines: int = 15) -> str:
        """The end of its log."""
        try:
            text = self.log.read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""
        return "\n".join(text.splitlines()[-lines:])
