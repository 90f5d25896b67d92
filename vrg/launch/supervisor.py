"""The supervisor, which starts the processes of a match in order, keeps them alive, and stops them cleanly."""

import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from vrg.bus.mailbox import Mailbox
from vrg.bus.session import Session, open_session
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Keys, router_alive
from vrg.errors import BusError, LaunchError
from vrg.launch.child import FAILED_FOR_GOOD
from vrg.launch.fork_server import UNKNOWN, ForkServer
from vrg.launch.managed import STOP_PATIENCE, ManagedProcess, ProcessSpec
from vrg.launch.pulses import Pulses
from vrg.launch.seats import Seats

CUT_OFF = 1.0
"""The real time in s without a connection to the router after which the router is taken to hang."""
ROUTER_START = 10.0
"""The real time in s from a router's start after which it must answer."""
QUIET = 10.0
"""The real time in s without a sign of life of any process after which a person is told."""
WINDOW = "spectator"
"""The name of the process of the window that the launcher opens."""
LINES = 15
"""The number of last lines of a log that are shown when a process has ended."""
_LOOK = 0.02
"""The real time in s between two looks at whether starting processes are ready."""
_PROGRESS = 0.5
"""The real time in s between two looks at whether starting processes make progress."""


class Supervisor:
    """Supervises the processes of one match on this machine.

    Args:
        specs: the processes, the router first.
        endpoint: the endpoint of the router. keys: the keys of the match. logs: the folder for the logs.
        announce: called with a text about each event that a person should know of.
        server: the fork server that starts the processes; without one each gets an interpreter of its own.
        disqualify: True disqualifies a player that has failed for good; False halts the match.
        memory: the most memory that a player's process may use, MB.
    """

    def __init__(
        self,
        specs: Sequence[ProcessSpec],
        endpoint: str,
        keys: Keys,
        logs: Path,
        announce: Callable[[str], None],
        server: ForkServer | None = None,
        *,
        disqualify: bool = True,
        memory: int = 2000,
    ) -> None:
        self._endpoint = endpoint
        self._announce = announce
        self._mailbox = Mailbox()
        self._beats = self._mailbox.subscribe(keys.pulse())
        self._pulses = Pulses(time.monotonic())
        self._seats = Seats(self._mailbox, keys, announce, disqualify=disqualify, memory=memory)
        self._session: Session | None = None
        self._router_since = time.monotonic()
        self._cut_since: float | None = None
        self._told_of_quiet = False
        self.processes = [ManagedProcess(spec, logs / f"{spec.name}.log", server or ForkServer()) for spec in specs]

    @property
    def shows(self) -> bool:
        """Whether a window shows the match."""
        return any(p.spec.name == WINDOW for p in self.processes)

    @property
    def _routers(self) -> list[ManagedProcess]:
        return [p for p in self.processes if p.spec.is_router]

    def start(self, session: Session, stop: StopSignal, progress: Callable[[str], None]) -> bool:
        """Start all processes but the router, which runs already. Each group waits until the one before is ready.

        Args:
            session: the launcher's session.
            stop: set it to break the start off.
            progress: called with the name of each process that is ready.

        Returns:
            False if the start was broken off.

        Raises:
            LaunchError: a process ended before it was ready, or makes no progress. The message has the end of its log.
        """
        self._session = session
        session.attach(self._mailbox)
        for group in sorted({p.spec.group for p in self.processes if not p.spec.is_router}):
            members = [p for p in self.processes if p.spec.group == group and not p.spec.is_router]
            for member in members:
                if stop.is_set():
                    return False
                member.start()
            for ready in self._waiting(members, stop):
                if ready is None:
                    return False
                progress(ready.spec.name)
        return True

    def start_router(self, stop: StopSignal) -> bool:
        """Start the router and wait until it answers. Return False if `stop` was set before.

        Raises:
            LaunchError: the router ended or makes no progress, for example because another one has its endpoint.
        """
        for router in self._routers:
            router.start()
            self._router_since = time.monotonic()
            while not self._answers(router):
                self._check_start(router)
                if stop.wait(_LOOK):
                    return False
            router.ready = True
        return True

    def _answers(self, router: ManagedProcess) -> bool:
        """Whether the router that was started answers. Another router at the same endpoint does not count."""
        try:
            with open_session(self._endpoint, patience=0.0) as session:
                return router.pid is not None and bool(session.alive(router_alive(router.pid)))
        except BusError:
            return False

    def _waiting(self, members: Sequence[ManagedProcess], stop: StopSignal) -> Iterable[ManagedProcess | None]:
        """Yield each of the members when it is ready; yield None and end if `stop` is set."""
        waiting = list(members)
        looked = time.monotonic()
        while waiting:
            self._feel_pulses()
            for router in [p for p in self._routers if p.exit_status is not None]:
                self._check_start(router)
            now = time.monotonic()
            look, looked = (True, now) if now - looked > _PROGRESS else (False, looked)
            for process in list(waiting):
                process.ready = process.ready or process.has_said
                if process.ready:
                    waiting.remove(process)
                    yield process
                elif look or process.exit_status is not None:
                    try:
                        self._check_start(process)
                    except LaunchError:
                        # One student's bug does not keep the others from playing; a robot that is not there does.
                        students = process.exit_status in (None, FAILED_FOR_GOOD)
                        if not (process.spec.seat and self._seats.disqualify and students):
                            raise
                        waiting.remove(process)
                        if process.exit_status is None:
                            where = process.where()
                            self._seats.vacate(process, f"it does not start{f' ({where})' if where else ''}")
                        else:
                            self._seats.vacate(process, process.log.last_words(1).removeprefix("vrg: "))
            if stop.wait(_LOOK):
                yield None
                return

    @staticmethod
    def _check_start(process: ManagedProcess) -> None:
        """Raise LaunchError if a process has ended before it was ready, or makes no progress."""
        name = process.spec.name
        if process.exit_status is not None:
            raise LaunchError(
                f"{name} ended with status {process.exit_status} before it was ready:\n{process.log.last_words(LINES)}"
            )
        stuck = process.stuck(time.monotonic())
        if stuck is not None:
            raise LaunchError(f"{name} {stuck}; see {process.log.path}\n{process.log.last_words(LINES)}")

    def poll(self) -> None:
        """Look at all processes once: restart those that have died, and kill those that hang.

        Raises:
            LaunchError: an essential process has died too often.
        """
        self._feel_pulses()
        now = time.monotonic()
        for process in list(self.processes):
            if process.exit_status is not None and process.spec.name not in self._seats.vacant:
                self._bury(process, now)
        self._find_hung(now)
        for process in self._seats.look(self.processes, now):
            self._pulses.forget(process.spec.name)
        if self._session is not None:
            self._session.send(self._mailbox.collect())

    def _feel_pulses(self) -> None:
        if self._session is None:
            return
        self._session.receive()
        self._mailbox.handover(0.0)
        felt = {pulse.key for pulse in self._beats.take()}
        alive = [p for p in self.processes if p.spec.pulse in felt and p.pid is not None]
        for process in alive:
            process.ready = True
        for process in self.processes:
            if process.spec.pulse in felt and process.pid is None:
                self._seats.take(process.spec.name, time.monotonic())
        self._pulses.feel((process.spec.name for process in alive), time.monotonic())

    def _bury(self, process: ManagedProcess, now: float) -> None:
        name, status = process.spec.name, process.exit_status
        how = _how_it_ended(status)
        self._pulses.forget(name)
        # Where the fork server has died, nobody knows how a node has ended: a window was closed, most likely.
        if status in (0, UNKNOWN) and not process.spec.essential:
            self.processes.remove(process)
            self._announce(f"{name} was closed")
            return
        words = process.log.last_words(1) if status is not None and 0 < status != UNKNOWN else ""
        # What VRG itself has said last is better than the status that goes with it.
        what = words.removeprefix("vrg: ") if words.startswith("vrg: ") else ": ".join(filter(None, (how, words)))
        if process.spec.seat and status == FAILED_FOR_GOOD:
            self._seats.vacate(process, what)
        elif process.strikes.failure(now):
            self._announce(f"{name} {what}: started again (log: {process.log.path})")
            process.start()
            if process.spec.is_router:
                self._router_since = now
        elif process.spec.seat:
            self._seats.vacate(process, f"it fails too often: {what}")
        elif process.spec.essential:
            raise LaunchError(f"{name} {how}, too often to go on:\n{process.log.last_words(LINES)}")
        else:
            self.processes.remove(process)
            self._announce(f"{name} {how}, too often: the match goes on without it (log: {process.log.path})")

    def _find_hung(self, now: float) -> None:
        if self._session is None:
            return
        if not self._session.connected:
            self._cut_since = self._cut_since or now
            if now - self._cut_since > CUT_OFF and now - self._router_since > ROUTER_START:
                for router in [p for p in self._routers if p.pid]:
                    self._announce("router does not answer: killed")
                    router.kill()
            return
        if self._cut_since is not None:
            self._cut_since = None
            self._router_since = now
        hung = self._pulses.hung()
        for process in self.processes:
            stuck = None if process.ready or process.spec.pulse is None else process.stuck(now)
            if process.pid is not None and (process.spec.name in hung or stuck):
                where = process.where() if process.spec.seat else ""
                what = f"{stuck or 'hangs'}{f' ({where})' if where else ''}"
                self._pulses.forget(process.spec.name)
                process.kill()
                if process.spec.seat and not process.strikes.hang(now):
                    self._seats.vacate(process, f"it {what}, again")
                else:
                    self._announce(f"{process.spec.name} {what}: killed")
        quiet = self._pulses.silence(now) > QUIET
        if quiet and not self._told_of_quiet:
            self._announce(f"no process of the match has given a sign of life for {QUIET:g} s: waiting for them")
        self._told_of_quiet = quiet

    def stop(self) -> None:
        """Stop all processes, players first and the router last. A process that does not stop in time is killed."""
        for order in sorted({p.spec.stop_order for p in self.processes}):
            members = [p for p in self.processes if p.spec.stop_order == order]
            for member in members:
                member.terminate()
            deadline = time.monotonic() + STOP_PATIENCE
            for member in members:
                if not member.wait_stopped(deadline):
                    self._announce(f"{member.spec.name} did not stop within {STOP_PATIENCE:g} s: killed")


def _how_it_ended(status: int | None) -> str:
    if status == UNKNOWN:
        return "has ended, nobody knows how, because the fork server has died"
    return f"was killed by signal {-status}" if status is not None and status < 0 else f"ended with status {status}"
