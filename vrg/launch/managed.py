"""One process that the supervisor started."""

import contextlib
import os
import signal
import time
from pathlib import Path

import psutil
from msgspec import structs

from vrg.bus.messages import ProcessState, ProcessStatus
from vrg.errors import LaunchError
from vrg.launch import process_main
from vrg.launch.ending import Ending, told
from vrg.launch.fork_server import Child, ForkServer
from vrg.launch.process import Process
from vrg.launch.process_log import ProcessLog
from vrg.launch.pulses import StartupProbe
from vrg.launch.sandbox.excess import proc_text
from vrg.launch.strikes import Strikes
from vrg.system import POSIX

STOP_TIMEOUT = 5.0
"""The real time in s from SIGTERM to SIGKILL."""
HANDOVER = 2.0
"""The real time in s that a player has to stop its robot before it is killed."""
KILLED = 2.0
"""The real time in s within which a process ends that was killed, unless it waits for a device."""


class ManagedProcess:
    """A child process of the supervisor.

    It has an operating-system session of its own, so that Ctrl-C reaches only the supervisor. Its standard input is a
    leash: it is closed when the supervisor dies, and then the child stops.

    Args:
        spec: what to run. secret: a line that it is given on its standard input, where no list of processes and no log
            shows it; empty for none. log: the file that its output is appended to.
        server: the fork server that starts the child, as long as the server lives.

    Attributes:
        log: its log.
        ready: True when the child has reported that it is ready.
        strikes: counts how often it has failed, by monotonic time.
    """

    def __init__(self, spec: Process, log: Path, server: ForkServer, secret: str = "") -> None:
        self.spec, self._secret = spec, secret
        self._server = server
        self.log = ProcessLog(log)
        self.strikes = Strikes()
        self.ready = False
        self._probe = StartupProbe(0.0)
        self._log_begins = 0
        self._starts = 0
        self._measured: dict[int, psutil.Process | None] = {}
        self._process: Child | None = None
        self._ending: Ending | None = None

    @property
    def has_said(self) -> bool:
        """True if it has printed the text by which it reports that it is ready, since it was last started."""
        if not self.spec.says:
            return False
        with self.log.path.open("rb") as log:
            log.seek(self._log_begins)
            return self.spec.says.encode() in log.read()

    @property
    def pid(self) -> int | None:
        """The process id of the child; None while it does not run."""
        return self._process.pid if self._process and self._process.poll() is None else None

    @property
    def exit_status(self) -> int | None:
        """The exit status of the child, negative if a signal killed it; None while it runs or was never started."""
        return self._process.poll() if self._process else None

    @property
    def ending(self) -> Ending | None:
        """Why the child that has ended last says that it has; None if it has said nothing, as one that was killed."""
        if self._ending is None and self._process is not None and self.exit_status is not None:
            self._ending = told(self._process.stream)
        return self._ending

    def start(self) -> None:
        """Start the child.

        Raises:
            LaunchError: it cannot be started.
        """
        self.ready = False
        self._ending = None
        self._starts += 1
        self._probe = StartupProbe(time.monotonic())
        if self._process is not None:
            self._process.stream.close()
        try:
            with self.log.open() as log:
                self._log_begins = log.tell()
                module = "vrg" if self.spec.command else process_main.__name__
                self._process = self._server.run(
                    module, self.spec.arguments, log, forked=not self.spec.command, trusted=self.spec.trusted
                )
        except OSError as error:
            raise LaunchError(f"cannot be started: {error}", self.spec.name) from error
        if self._secret:
            # One that has ended already is seen to have.
            with contextlib.suppress(OSError):
                os.write(self._process.stream.fileno(), f"{self._secret}\n".encode())

    def stuck(self, now: float) -> str | None:
        """The reason, in words, why a process that is not ready will never be; None as long as it makes progress.

        Args:
            now: the monotonic time, s.
        """
        pid = self.pid
        if pid is None:
            return None
        return self._probe.stuck(pid, now)

    @property
    def memory(self) -> int:
        """The memory that it and its strategy use, bytes; 0 if it does not run."""
        used = 0
        for pid in self._family():
            with contextlib.suppress(psutil.Error):
                used += int(psutil.Process(pid).memory_info().rss)
        return used

    def _family(self) -> list[int]:
        """The process ids of the child and of what its main thread has started; none if it does not run."""
        if (pid := self.pid) is None:
            return []
        return [pid, *map(int, proc_text(pid, f"task/{pid}/children").split())]

    def status(self, machine: str) -> ProcessStatus:
        """Its status, on a machine of this name."""
        pid = self.pid
        state = ProcessState.ENDED if pid is None else ProcessState.RUNNING if self.ready else ProcessState.STARTING
        return ProcessStatus(
            name=self.spec.name,
            machine=machine,
            state=state,
            node=self.spec.node_id,
            pid=pid,
            cpu=self._load(),
            memory=self.memory,
            restarts=max(0, self._starts - 1),
        )

    def _load(self) -> float:
        """The part of a processor core that it and its strategy have used since the last call; 0.0 at the first."""
        family = self._family()
        self._measured = {pid: self._measured.get(pid) for pid in family}
        load = 0.0
        for pid, before in self._measured.items():
            with contextlib.suppress(psutil.Error):
                self._measured[pid] = process = before or psutil.Process(pid)
                load += float(process.cpu_percent())
        return round(load / 100, 3)

    def play(self, strategy: str) -> None:
        """Start the child, which has ended, with another strategy, as one that has never failed.

        Raises:
            LaunchError: it cannot be started.
        """
        self.spec = structs.replace(self.spec, strategy=strategy, trusted=False)
        self.strikes = Strikes()
        self.log.forget()
        self.start()

    def kill(self) -> None:
        """Kill a child that hangs; `pid` tells when it has ended. SIGKILL also ends a process that is stopped."""
        if self._process is not None:
            self._process.kill()

    def terminate(self) -> None:
        """Ask the child to stop."""
        if POSIX:
            self._signal(signal.SIGTERM)
            # A process that is stopped gets the request only when it runs again.
            self._signal(signal.SIGCONT)
        elif self._process is not None:
            self._process.stream.close()  # the end of its leash; SIGTERM would end it at once

    def _signal(self, number: int) -> None:
        if self._process is not None:
            self._process.send_signal(number)

    def wait_stopped(self, deadline: float) -> bool:
        """Wait for the end until the monotonic time `deadline`, then kill. Return whether it ended by itself."""
        if self._process is None:
            return True
        by_itself = self._process.wait(max(0.01, deadline - time.monotonic()))
        if not by_itself:
            self._process.kill()
            self._process.wait(KILLED)
        self._process.stream.close()
        return by_itself
