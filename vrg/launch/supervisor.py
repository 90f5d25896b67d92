"""Starts the processes of a match in order, keeps them alive, and stops them cleanly."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from vrg.bus.mailbox import Mailbox
from vrg.bus.session import Session, open_session
from vrg.bus.topics import Keys, router_alive
from vrg.errors import BusError, LaunchError
from vrg.launch.managed import STOP_PATIENCE, ManagedProcess, ProcessSpec

READY_PATIENCE = 30.0
"""s of real time for a process to become ready."""
HUNG = 2.5
"""s of real time without a pulse after which a running process is taken to hang; it beats every 0.5 s."""
CUT_OFF = 1.0
"""s of real time without a link to the router after which it is taken to hang."""
ROUTER_START = 10.0
"""s of real time that a router has from its start until it must answer."""
SETTLE = 4.0
"""s of real time after a start of the router in which missing pulses mean nothing."""


class Supervisor:
    """The processes of one match on this machine.

    Args:
        specs: the first is the router, at `endpoint`.
        announce: told, in words, of everything that a person should know.
    """

    def __init__(
        self, specs: Sequence[ProcessSpec], endpoint: str, keys: Keys, logs: Path, announce: Callable[[str], None]
    ) -> None:
        self._endpoint = endpoint
        self._announce = announce
        self._mailbox = Mailbox()
        self._pulses = self._mailbox.subscribe(keys.pulse())
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
        session.attach(self._mailbox)
        for group in sorted({p.spec.group for p in self.processes if not p.spec.is_router}):
            members = [p for p in self.processes if p.spec.group == group and not p.spec.is_router]
            for member in members:
                member.start()
            self._wait_ready(members, progress)

    def start_router(self) -> None:
        """Start the router.

        Raises:
            LaunchError: it does not answer, or another one has taken its endpoint.
        """
        for router in [p for p in self.processes if p.spec.is_router]:
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
            self._feel_pulses()
            for process in waiting:
                process.ready = process.ready or process.has_said
                if process.ready:
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
            LaunchError: a process without which there is no match died too often.
        """
        self._feel_pulses()
        now = time.monotonic()
        for process in list(self.processes):
            if process.exit_status is not None:
                self._bury(process, now)
        self._find_hung(now)

    def _feel_pulses(self) -> None:
        if self._session is None:
            return
        self._session.receive()
        self._mailbox.handover(0.0)
        felt = {pulse.key for pulse in self._pulses.take()}
        for process in self.processes:
            if process.spec.pulse in felt and process.pid is not None:
                process.ready = True
                process.last_pulse = time.monotonic()

    def _bury(self, process: ManagedProcess, now: float) -> None:
        name, status = process.spec.name, process.exit_status
        how = f"was killed by signal {-status}" if status is not None and status < 0 else f"ended with status {status}"
        if status == 0 and not process.spec.essential:
            self.processes.remove(process)
            self._announce(f"{name} was closed; the match goes on")
        elif process.note_death(now):
            self._announce(f"{name} {how}: started again (log: {process.log})")
            process.start()
            if process.spec.is_router:
                self._router_since = now
        elif process.spec.essential:
            raise LaunchError(f"{name} {how}, too often to go on:\n{process.last_words()}")
        else:
            self.processes.remove(process)
            self._announce(f"{name} {how}, too often: the match goes on without it (log: {process.log})")

    def _find_hung(self, now: float) -> None:
        if self._session is None:
            return
        if not self._session.connected:
            self._cut_since = self._cut_since or now
            if now - self._cut_since > CUT_OFF and now - self._router_since > ROUTER_START:
                for router in [p for p in self.processes if p.spec.is_router and p.pid]:
                    self._announce("router does not answer: killed")
                    router.kill()
            return
        if self._cut_since is not None:
            self._cut_since = None
            self._router_since = now
        if now - self._router_since < SETTLE:
            return
        for process in self.processes:
            if process.spec.pulse is None or process.pid is None:
                continue
            limit = HUNG if process.ready else READY_PATIENCE
            if now - max(process.last_pulse, self._router_since) > limit:
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
