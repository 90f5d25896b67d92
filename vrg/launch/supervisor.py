"""Starts the processes of a match in order, keeps them alive, and stops them cleanly."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from vrg.bus.session import Session, open_session
from vrg.bus.topics import Keys, router_alive
from vrg.errors import BusError, LaunchError
from vrg.launch.managed import STOP_PATIENCE, ManagedProcess, ProcessSpec

READY_PATIENCE = 30.0
"""s of real time for a process to become ready."""
HUNG_AFTER = 1.0
"""s of real time without its liveliness token after which a running process is taken to hang. The token itself goes
one lease after a process freezes."""
SETTLE = 4.0
"""s of real time after a start of the router in which missing tokens mean nothing."""


class Supervisor:
    """The processes of one match on this machine.

    Args:
        specs: the first is the router, unless `endpoint` is served by somebody else.
        announce: told, in words, of everything that a person should know.
    """

    def __init__(
        self, specs: Sequence[ProcessSpec], endpoint: str, keys: Keys, logs: Path, announce: Callable[[str], None]
    ) -> None:
        self._endpoint = endpoint
        self._keys = keys
        self._announce = announce
        self._alive: dict[str, bool] = {}
        self._session: Session | None = None
        self._router_since = time.monotonic()
        self._cut_since: float | None = None
        self.processes = [ManagedProcess(spec, logs / f"{spec.name}.log") for spec in specs]

    def start(self, session: Session, progress: Callable[[str], None]) -> None:
        """Start everything but the router, which already runs; each group waits for the one before.

        Args:
            progress: told the name of each process that is ready.

        Raises:
            LaunchError: a process ended or was not ready in time; says what it said last.
        """
        self._session = session
        session.watch_alive(f"{self._keys.root}/alive/**", self._alive.__setitem__)
        for group in sorted({p.spec.group for p in self.processes if p.spec.token}):
            members = [p for p in self.processes if p.spec.group == group and p.spec.token]
            for member in members:
                member.start()
            self._wait_ready(members, progress)

    def start_router(self) -> None:
        """Start the router, if it is this supervisor's.

        Raises:
            LaunchError: it does not answer, or another one has taken its endpoint.
        """
        for router in [p for p in self.processes if p.spec.token is None]:
            router.start()
            self._router_since = time.monotonic()
            try:
                with open_session(self._endpoint, patience=READY_PATIENCE) as session:
                    self._wait_own(router, session)
            except BusError as error:
                raise LaunchError(f"{router.spec.name}: {error}\n{router.last_words()}") from error

    def _wait_own(self, router: ManagedProcess, session: Session) -> None:
        """Wait until the router that answers is the one that was started, and not one that was faster."""
        deadline = time.monotonic() + READY_PATIENCE
        while (pid := router.pid) is not None and time.monotonic() < deadline:
            if session.alive(router_alive(pid)):
                router.ready = True
                return
            time.sleep(0.02)
        raise LaunchError(f"{router.spec.name} does not serve at {self._endpoint}:\n{router.last_words()}")

    def _wait_ready(self, members: list[ManagedProcess], progress: Callable[[str], None]) -> None:
        deadline = time.monotonic() + READY_PATIENCE
        while waiting := [p for p in members if not p.ready]:
            for process in waiting:
                if self._alive.get(process.spec.token or ""):
                    process.ready = True
                    progress(process.spec.name)
                elif process.exit_status is not None:
                    raise LaunchError(
                        f"{process.spec.name} ended with status {process.exit_status} before it was ready:\n"
                        f"{process.last_words()}"
                    )
                elif time.monotonic() > deadline:
                    raise LaunchError(
                        f"{process.spec.name} was not ready within {READY_PATIENCE:g} s; see {process.log}"
                    )
            time.sleep(0.01)

    def poll(self) -> None:
        """Look after everybody once: restart what died, kill what hangs.

        Raises:
            LaunchError: a process died too often.
        """
        now = time.monotonic()
        for process in self.processes:
            if process.exit_status is not None:
                self._bury(process, now)
        self._find_hung(now)

    def _bury(self, process: ManagedProcess, now: float) -> None:
        name, status = process.spec.name, process.exit_status
        how = f"was killed by signal {-status}" if status is not None and status < 0 else f"ended with status {status}"
        if not process.spec.restart or (status == 0 and process.spec.name == "spectator"):
            if process in self.processes:
                self.processes.remove(process)
                self._announce(f"{name} {how}")
            return
        if not process.note_death(now):
            raise LaunchError(f"{name} {how}, too often to go on:\n{process.last_words()}")
        self._announce(f"{name} {how}: started again (log: {process.log})")
        process.start()
        if process.spec.token is None:
            self._router_since = now

    def _find_hung(self, now: float) -> None:
        if self._session is None:
            return
        if not self._session.connected:
            self._cut_since = self._cut_since or now
            if now - max(self._cut_since, self._router_since) > HUNG_AFTER:
                for router in [p for p in self.processes if p.spec.token is None and p.pid]:
                    self._announce("router does not answer: killed")
                    router.kill()
            return
        if self._cut_since is not None:
            self._cut_since = None
            self._router_since = now
        for process in self.processes:
            token = process.spec.token
            if token is None or process.pid is None:
                continue
            if self._alive.get(token):
                process.ready = True
                process.missing_since = None
                continue
            if not process.ready or now - self._router_since < SETTLE:
                continue
            process.missing_since = process.missing_since or now
            if now - process.missing_since > HUNG_AFTER:
                self._announce(f"{process.spec.name} hangs: killed")
                process.kill()

    def stop(self) -> None:
        """Stop everybody, players first, the router last; bounded."""
        for group in sorted({p.spec.group for p in self.processes}, reverse=True):
            members = [p for p in self.processes if p.spec.group == group]
            for member in members:
                member.terminate()
            deadline = time.monotonic() + STOP_PATIENCE
            for member in members:
                if not member.wait_stopped(deadline):
                    self._announce(f"{member.spec.name} did not stop within {STOP_PATIENCE:g} s: killed")
