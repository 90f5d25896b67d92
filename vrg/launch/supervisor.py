"""The supervisor of one machine: it starts processes of a match, keeps them alive, and stops them cleanly."""

import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import ProcessStatus
from vrg.bus.session import Session, open_session
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Keys, router_alive
from vrg.config.files import HERE
from vrg.errors import BusError, CredentialsError, LaunchError
from vrg.kinds import SPECTATOR
from vrg.launch.fork_server import UNKNOWN_STATUS, ForkServer
from vrg.launch.greed import Greed
from vrg.launch.managed import HANDOVER, STOP_TIMEOUT, ManagedProcess
from vrg.launch.process import Process
from vrg.launch.process_main import FAILED_FOR_GOOD, HUNG
from vrg.launch.pulses import Pulses
from vrg.runs.events import EventKind, NoNotes, Notes
from vrg.seats.credentials import Credentials

CUT_OFF = 1.0
"""The real time in s without a connection to the router after which the router is taken to hang."""
ROUTER_START = 10.0
"""The real time in s from a router's start after which it must answer."""
NOTICE_TIMEOUT = 10.0
"""The real time in s without a sign of life of any process after which a person is informed."""
SAME_FAILURES = 3
"""The number of times that a process which the match cannot do without may end by the same error of its own."""
LOG_TAIL = 15
"""The number of last lines of a log that are shown when a process has ended."""
_PROGRESS = 0.5
"""The real time in s between two looks at whether starting processes make progress."""


class Supervisor:
    """Supervises those processes of a match that run on this machine.

    Args:
        specs: the processes, the router first if it runs here.
        endpoint: the endpoint of the router. keys: the keys of the match. logs: the folder for the logs.
        announce: called with a text about each event that a person should know of.
        server: the fork server that starts the processes; without one each gets an interpreter of its own.
        disqualify: True disqualifies a player that has failed for good; False halts the match.
        memory: the most memory that a player's process may use, MB.
        machine: the name of this machine in the match file. notes: the log of events of the processes.
        secrets: the line that a process alone is given on its standard input, by its name.
        credentials: those of the supervisor's own seat; None in a match without seats.

    Attributes:
        processes: the processes, without those that have ended and are not started again. machine: as given.
    """

    def __init__(
        self,
        specs: Sequence[Process],
        endpoint: str,
        keys: Keys,
        logs: Path,
        announce: Callable[[str], None],
        server: ForkServer | None = None,
        *,
        disqualify: bool = True,
        memory: int = 2000,
        machine: str = HERE,
        notes: Notes | None = None,
        secrets: Mapping[str, str] = MappingProxyType({}),
        credentials: Credentials | None = None,
    ) -> None:
        self._endpoint = endpoint
        self._credentials = credentials
        self._announce = announce
        self.machine = machine
        self._notes = notes or NoNotes()
        self._failed: dict[str, str] = {}
        self._errors: Counter[tuple[str, str]] = Counter()
        self._disqualify = disqualify
        self._mailbox = Mailbox()
        self._beats = self._mailbox.subscribe(keys.pulse(), only=[spec.pulse for spec in specs if spec.pulse])
        self._pulses = Pulses(time.monotonic())
        self._greed = Greed(memory)
        self._session: Session | None = None
        self._router_since = time.monotonic()
        self._cut_since: float | None = None
        self._told_of_quiet = False
        self._starting: list[ManagedProcess] = []
        self._looked = 0.0
        self._vacant: set[str] = set()
        self._endings: dict[str, Iterator[None]] = {}
        self.processes = [
            ManagedProcess(spec, logs / f"{spec.name}.log", server or ForkServer(), secrets.get(spec.name, ""))
            for spec in specs
        ]
        self._router = next((process for process in self.processes if process.spec.is_router), None)

    @property
    def names(self) -> list[str]:
        """The names of the processes, without those that have ended and are not started again."""
        return [p.spec.name for p in self.processes]

    def attach(self, session: Session) -> None:
        """Hear the processes' signs of life over this session from now on."""
        self._session = session
        session.attach(self._mailbox)

    def leave_vacant(self, names: Collection[str]) -> None:
        """Do not start these players until they play by another strategy."""
        self._vacant |= set(names)

    def begin(self, group: int) -> None:
        """Start all processes of a group. Then call `started` again and again until it has named all of them.

        Raises:
            LaunchError: a process cannot be started.
        """
        vacant = self._vacant
        members = [
            p for p in self.processes if p.spec.group == group and not p.spec.is_router and p.spec.name not in vacant
        ]
        for member in members:
            self._start(member)
        self._starting = [member for member in members if member.spec.name not in self._vacant]
        self._looked = time.monotonic()

    def _start(self, process: ManagedProcess) -> None:
        """Start a process. A player that cannot be started, as on a full disk, has failed for good.

        Raises:
            LaunchError: another process cannot be started.
        """
        try:
            process.start()
        except LaunchError as error:
            if not process.spec.plays:
                raise
            self._vacate(process, error.text)

    @property
    def starting(self) -> Collection[str]:
        """The names of the processes that were begun and are not ready yet."""
        return [p.spec.name for p in self._starting]

    def started(self) -> list[str]:
        """Look once at the processes that are starting, and name those that have become ready since.

        Raises:
            LaunchError: a process ended before it was ready, or makes no progress. The message has the end of its log.
        """
        self._take_pulses()
        self._go_on_ending()
        if self._router is not None and self._router.exit_status is not None:
            self._check_start(self._router)
        now = time.monotonic()
        look, self._looked = (True, now) if now - self._looked > _PROGRESS else (False, self._looked)
        ready = []
        for process in [p for p in self._starting if p.spec.name not in self._endings]:
            if process.ready:
                self._starting.remove(process)
                ready.append(process.spec.name)
            elif look or process.exit_status is not None:
                try:
                    self._check_start(process)
                except LaunchError:
                    # One student's bug does not keep the others from playing; a robot that is not there does.
                    absent = process.spec.physical and process.exit_status == 1
                    if absent or not (process.spec.plays and self._disqualify):
                        raise
                    self._starting.remove(process)
                    if process.exit_status is None:
                        self._end(process, self._given_up(process, "it does not start", patience=0.0))
                    else:
                        self._vacate(process, self._what_it_said(process))
        return ready

    def keep(self) -> None:
        """Nothing is to be done: this is the launcher's own machine, or the agent's."""

    def fetch(self) -> None:
        """Nothing is to be done: the run folder is here."""

    def start_router(self, stop: StopSignal, meanwhile: Callable[[], None] = lambda: None) -> bool:
        """Start the router and wait until it answers. Return False if `stop` was set before.

        Raises:
            LaunchError: the router ended or makes no progress, for example because another one has its endpoint.
        """
        router = self._router
        if router is None:
            return True
        router.start()
        self._router_since = time.monotonic()
        while not self._answers(router):
            self._check_start(router)
            meanwhile()
            if stop.wait(0.02):
                return False
        router.ready = True
        return True

    def _answers(self, router: ManagedProcess) -> bool:
        """True if the router that was started answers. Another router at the same endpoint does not count."""
        try:
            with open_session(self._endpoint, patience=0.0, credentials=self._credentials) as session:
                return router.pid is not None and bool(session.alive(router_alive(router.pid)))
        except CredentialsError as error:
            raise LaunchError(str(error)) from None
        except BusError:
            return False

    @staticmethod
    def _check_start(process: ManagedProcess) -> None:
        """Raise LaunchError if a process has ended before it was ready, or makes no progress."""
        name = process.spec.name
        if process.exit_status is not None:
            how = f"ended with status {process.exit_status} before it was ready"
            raise LaunchError(f"{name} {how}:\n{process.log.last_words(LOG_TAIL)}")
        stuck = process.stuck(time.monotonic())
        if stuck is not None:
            raise LaunchError(f"{name} {stuck}; see {process.log.path}\n{process.log.last_words(LOG_TAIL)}")

    def poll(self) -> None:
        """Look at all processes once: restart those that have died, and kill those that hang.

        Raises:
            LaunchError: an essential process has died too often.
        """
        self._take_pulses()
        self._go_on_ending()
        now = time.monotonic()
        for process in list(self.processes):
            if process.exit_status is not None and not self._is_out(process):
                self._reap(process, now)
        self._find_hung(now)
        for process, why in self._greed.look(self.processes, now):
            if not self._is_out(process):
                # It works, so it can stop its robot.
                self._end(process, self._given_up(process, why, patience=HANDOVER))

    def play(self, name: str, strategy: str) -> None:
        """Let a player of this machine play by another strategy, in a new process, once the present one has ended."""
        (process,) = (p for p in self.processes if p.spec.name == name and p.spec.plays)
        self._notes.note(EventKind.REPLACED, name, f"plays with {strategy}")
        self._end(process, self._replaced(process, strategy))

    def _is_out(self, process: ManagedProcess) -> bool:
        """True if it is not supervised: it is being ended, or has failed for good."""
        return process.spec.name in self._endings or process.spec.name in self._vacant

    def _end(self, process: ManagedProcess, ending: Iterator[None]) -> None:
        """End a process step by step, so that nothing waits for it: one that waits for a device may never end."""
        self._pulses.forget(process.spec.name)
        self._endings[process.spec.name] = ending
        self._go_on_ending()

    def _go_on_ending(self) -> None:
        for name, ending in list(self._endings.items()):
            try:
                next(ending)
            except StopIteration:
                if self._endings.get(name) is ending:
                    del self._endings[name]

    def _given_up(self, process: ManagedProcess, why: str, *, patience: float) -> Iterator[None]:
        """End a player for good. Its process may take `patience` s to end."""
        self._vacate(process, why, kill=False)
        yield from self._ended(process, patience)

    def _hung(self, process: ManagedProcess, what: str, now: float) -> Iterator[None]:
        """Kill a process that hangs. It is started again then, unless it is a player that has hung before."""
        name = process.spec.name
        self._notes.note(EventKind.KILLED, name, what)
        process.kill()
        if process.spec.plays and not process.strikes.hang(now):
            self._vacate(process, f"it {what}, again")
        else:
            self._announce(f"{name} {what}: killed")
        while process.pid is not None:
            yield

    def _replaced(self, process: ManagedProcess, strategy: str) -> Iterator[None]:
        """End a player's process, and start it with another strategy."""
        yield from self._ended(process, HANDOVER)
        name = process.spec.name
        self._vacant.discard(name)
        try:
            process.play(strategy)
        except LaunchError as error:
            self._vacate(process, error.text)

    @staticmethod
    def _ended(process: ManagedProcess, patience: float) -> Iterator[None]:
        """Ask a process to stop, kill it if it does not within `patience` s, and go on when it has ended."""
        deadline = time.monotonic() + patience
        if patience:
            process.terminate()
        while process.pid is not None:
            if time.monotonic() >= deadline:
                process.kill()
            yield

    def _vacate(self, process: ManagedProcess, why: str, *, kill: bool = True) -> None:
        """A player has failed for good. It is not started again until a person gives it another strategy."""
        self._notes.note(EventKind.VACATED, process.spec.name, why)
        if kill:
            process.kill()
        name = process.spec.name
        self._vacant.add(name)
        self._failed[name] = why

    @property
    def trouble(self) -> None:
        """None: this machine answers."""
        return

    def take_failed(self) -> dict[str, str]:
        """The players that have failed for good since the last call, each with the reason."""
        failed, self._failed = self._failed, {}
        return failed

    def statuses(self) -> list[ProcessStatus]:
        """The state of each of the processes."""
        return [process.status(self.machine) for process in self.processes]

    def _take_pulses(self) -> None:
        if self._session is not None:
            self._session.receive()
        self._mailbox.handover(0.0)
        felt = {pulse.key for pulse in self._beats.take()}
        alive = [p for p in self.processes if p.spec.pulse in felt and p.pid is not None]
        for process in [*alive, *(p for p in self.processes if p.spec.says and not p.ready and p.has_said)]:
            self._is_ready(process)
        self._pulses.record((process.spec.name for process in alive), time.monotonic())

    def _is_ready(self, process: ManagedProcess) -> None:
        if not process.ready:
            process.ready = True
            self._notes.note(EventKind.READY, process.spec.name)

    def _reap(self, process: ManagedProcess, now: float) -> None:
        name, status = process.spec.name, process.exit_status
        how = _how_it_ended(status)
        self._pulses.forget(name)
        # Where the fork server has died, it is not known how a node has ended: a window was closed, most likely.
        if status in (0, UNKNOWN_STATUS) and not process.spec.essential:
            self.processes.remove(process)
            self._announce(f"{'the window' if name == SPECTATOR.process else name} was closed")
            self._notes.note(EventKind.CLOSED, name)
            return
        what = self._what_it_said(process)
        self._notes.note(EventKind.DIED, name, what, status=status)
        again = process.strikes.hang(now) if status == HUNG else process.strikes.failure(now)
        if process.spec.plays and status == FAILED_FOR_GOOD:
            self._vacate(process, what)
        elif again and not self._repeats(process):
            subject = name if process.ending is None else f"{name}:"  # its own words are no end of a sentence
            self._announce(f"{subject} {what}: started again (log: {process.log.path})")
            self._start(process)
            self._notes.note(EventKind.STARTED, name)
            if process.spec.is_router:
                self._router_since = now
        elif process.spec.plays:
            self._vacate(process, f"it {'hangs again' if status == HUNG else 'fails too often'}: {what}")
        elif process.spec.essential:
            raise LaunchError(f"{name} {how}, too often to continue:\n{process.log.last_words(LOG_TAIL)}")
        else:
            self.processes.remove(process)
            self._announce(f"{name} {how}, too often to start it again (log: {process.log.path})")

    def _repeats(self, process: ManagedProcess) -> bool:
        """Whether a process has ended by the same error of its own again and again, such as one of a game's rules.

        Between two of them an official lets the match go on, which may take any time.
        """
        if process.spec.plays or not process.spec.essential or process.ending is None:
            return False
        same = process.spec.name, process.ending.error
        self._errors[same] += 1
        return self._errors[same] >= SAME_FAILURES

    @staticmethod
    def _what_it_said(process: ManagedProcess) -> str:
        """Why a process has ended, as it says itself; or its status, with the last line of its log if it has failed."""
        if process.ending is not None:
            return process.ending.why
        status = process.exit_status
        words = process.log.last_words(1) if status is not None and 0 < status != UNKNOWN_STATUS else ""
        return ": ".join(filter(None, (_how_it_ended(status), words)))

    def _find_hung(self, now: float) -> None:
        if self._session is None:
            return
        router = self._router if self._router is not None and self._router.pid else None
        if not self._session.connected:
            self._cut_since = self._cut_since or now
            if router and now - self._cut_since > CUT_OFF and now - self._router_since > ROUTER_START:
                self._announce("router does not answer: killed")
                self._notes.note(EventKind.KILLED, router.spec.name, "does not answer")
                router.kill()
            return
        back = self._cut_since is not None
        if back:
            self._cut_since = None
            self._router_since = now
        if router and not router.ready and (back or now - self._router_since > CUT_OFF):
            router.ready = True
            self._notes.note_at_next_clock(EventKind.READY, router.spec.name)
        hung = self._pulses.hung()
        for process in self.processes:
            stuck = None if process.ready or not process.spec.pulse else process.stuck(now)
            if process.pid is not None and (process.spec.name in hung or stuck) and not self._is_out(process):
                self._end(process, self._hung(process, stuck or "hangs", now))
        quiet = self._pulses.silence(now) > NOTICE_TIMEOUT
        if quiet and not self._told_of_quiet:
            self._announce(
                f"no process of the match has given a sign of life for {NOTICE_TIMEOUT:g} s: waiting for them"
            )
        self._told_of_quiet = quiet

    @property
    def stop_orders(self) -> set[int]:
        """The numbers for `stop`."""
        return {p.spec.stop_order for p in self.processes}

    def stop(self, order: int) -> None:
        """Ask the processes of one number to stop."""
        for member in self.processes:
            if member.spec.stop_order == order:
                member.terminate()

    def wait_stopped(self, order: int, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Wait until the processes of one number have stopped. One that does not stop in time is killed."""
        deadline = time.monotonic() + STOP_TIMEOUT
        for member in self.processes:
            meanwhile()
            if member.spec.stop_order == order and not member.wait_stopped(deadline):
                self._announce(f"{member.spec.name} did not stop within {STOP_TIMEOUT:g} s: killed")

    def close(self, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Stop all processes, players first and the router last. Idempotent."""
        for order in sorted(self.stop_orders):
            self.stop(order)
            self.wait_stopped(order, meanwhile)


def _how_it_ended(status: int | None) -> str:
    if status == UNKNOWN_STATUS:
        return "has ended in an unknown way, because the fork server died"
    return f"was killed by signal {-status}" if status is not None and status < 0 else f"ended with status {status}"
