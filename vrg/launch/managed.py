"""One process that the supervisor started."""

import os
import signal
import subprocess
import sys
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from vrg.errors import LaunchError

STOP_PATIENCE = 5.0
"""s of real time from SIGTERM to SIGKILL."""
RESTART_LIMIT = 5
RESTART_WINDOW = 60.0
"""More deaths than RESTART_LIMIT in this many seconds of real time, and the match is given up."""


@dataclass(frozen=True)
class ProcessSpec:
    """What to run.

    Args:
        name: of the process and of its log.
        arguments: of the `vrg` command.
        pulse: key of its pulse, whose first beat says that it is ready; None where it is no node of the match.
        group: processes of a lower group are ready before those of a higher one are started, and are stopped later.
        essential: without it there is no match.
        says: of a process without a pulse: what it prints once it is ready; the router prints nothing.
    """

    name: str
    arguments: tuple[str, ...]
    pulse: str | None
    group: int
    essential: bool = True
    says: str | None = None

    @property
    def is_router(self) -> bool:
        """The router is started before there is a bus to hear anybody on."""
        return self.pulse is None and self.says is None


class ManagedProcess:
    """A child in a session of its own, so that Ctrl-C reaches the supervisor alone.

    Its standard input is a leash: it ends when the supervisor dies, and the child stops then.
    """

    def __init__(self, spec: ProcessSpec, log: Path) -> None:
        self.spec = spec
        self.log = log
        self.deaths: deque[float] = deque()
        self.last_pulse = 0.0
        self.ready = False
        self._log_begins = 0
        self._process: subprocess.Popen[bytes] | None = None

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
        self.last_pulse = time.monotonic()
        try:
            with self.log.open("ab") as log:
                self._log_begins = log.tell()
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "vrg", *self.spec.arguments, "--leash"],
                    stdin=subprocess.PIPE,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
        except OSError as error:
            raise LaunchError(f"{self.spec.name}: cannot be started: {error}") from error

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
            os.kill(self._process.pid, signal.SIGTERM)
            # A frozen process takes the request only when it runs again.
            os.kill(self._process.pid, signal.SIGCONT)

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
