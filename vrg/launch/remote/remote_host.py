"""Another machine, as the launcher sees it: its agent is brought up step by step, and again whenever it is lost."""

import enum
import math
import time
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from msgspec import structs

from vrg.bus.messages import ProcessState, ProcessStatus
from vrg.bus.session import Session
from vrg.bus.stopping import StopSignal
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError, MessageError
from vrg.launch.host import GROUPS
from vrg.launch.managed import STOP_TIMEOUT
from vrg.launch.plan import processes_at, seats_at
from vrg.launch.remote import wire
from vrg.launch.remote.reports import TEXT, AgentReports
from vrg.launch.remote.silence import LAUNCHER_TIMEOUT, Silence
from vrg.launch.remote.ssh import Connection
from vrg.launch.remote.travel import file_parts, files_in
from vrg.runs.events import Notes
from vrg.runs.keeping import files_of_strategy
from vrg.runs.run_folder import RunFolder
from vrg.seats.credentials import find_credentials
from vrg.seats.seat import Seat, SeatKind

AGENT_TIMEOUT = 3.0
"""The time in s without a message from an agent, which speaks twice a second, after which play is halted. The referee
takes players out after 5 s."""
AWAY_TIMEOUT = LAUNCHER_TIMEOUT + 2.0
"""The time in s without a message from an agent after which its machine is away. Its lease has lapsed by then."""
STARTING = 120.0
"""The time in s without a message from an agent after which it is given up while it starts something."""
RECONNECT_PERIOD = 2.0
"""The real time in s after which a machine that is away is tried once more."""
HEARTBEAT_PERIOD = 0.5
"""The real time in s between two signs of life of the launcher."""
_FETCH = 15.0
"""The time in s without a part of a file from an agent that sends files after which they are given up."""
_WAIT = 0.02
"""The longest real time in s between two looks at what an agent has sent."""
_BACKLOG = 16 * wire.PART
"""The number of bytes that may wait for an agent before no more files are read."""


class StartupStep(enum.IntEnum):
    """The steps by which a machine is brought up."""

    AWAY = enum.auto()
    LOADED = enum.auto()
    SERVED = enum.auto()
    JOINED = enum.auto()
    FIRST = enum.auto()
    PLAYS = enum.auto()


class RemoteHost:
    """Another machine, as the launcher sees it; see `vrg.launch.host.Host`. It is reached at the first look.

    `_bring_up` is the way from an ssh connection to processes that play. It goes on at each look, up to the step that
    the launcher has named as its aim. When all has run once, a machine that is lost begins the same way again.

    Args:
        setup: the match. folder: the run folder here. What is in it now travels.
        prepare: the first order to each agent of that machine.
        announce: called with a text about each event that a person should know of.
        notes: the log of events of the processes there. clock: returns the monotonic time, s.

    Attributes:
        machine: its name in the match file. stop_orders: the numbers for `stop`.
        reports: what its agent has reported.
        router, upstream: the endpoint of the router that its processes use, and the one that this router is linked to;
            to be set before `start_router`. keys: the folder of the keys of all seats; None in a match without seats.
    """

    def __init__(
        self,
        setup: MatchSetup,
        folder: RunFolder,
        prepare: wire.Prepare,
        announce: Callable[[str], None],
        notes: Notes,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.machine = machine = prepare.machine
        self._reached = setup.machines[machine]
        self._folder = folder
        self._prepare = prepare
        self._announce = announce
        self._clock = clock
        self._travelling = files_in(folder.path)
        window, record = prepare.window, prepare.record
        planned = processes_at(setup, folder.path, "", window=window, record=record, machine=machine)
        self._seats = [Seat(SeatKind.HOST, machine), *seats_at(setup, machine, window=window, record=record)]
        self.stop_orders = sorted({spec.stop_order for spec in planned})
        self.router = ""
        self.reports = AgentReports(machine, planned, folder, self._tell, notes, clock, self._travelling)
        self.upstream: str | None = None
        self.keys: Path | None = None
        self._vacant: set[str] = set()
        self._played: dict[str, list[wire.FilePart | wire.Play]] = {}
        self._substitutes = 0
        # How far it is to be brought up, and how far it is.
        self._aim, self._step = StartupStep.LOADED, StartupStep.AWAY
        self._has_played = False
        self._failure: str | None = None
        self._script: Iterator[None] = iter(())
        self._connection: Connection[wire.ToLauncher] | None = None
        self._lost: list[Connection[wire.ToLauncher]] = []
        # These hold for the present connection, or for the last one.
        self._silence = Silence(0.0)
        self._tried = self._beat_sent = -math.inf
        self._sent = 0
        self._stopping: dict[int, int] = {}
        self._fetching: int | None = None

    def aim(self, step: StartupStep) -> None:
        """Let it be brought up to a step, as far as it is not yet. Then call `is_at` again and again."""
        self._aim = step

    def is_at(self, step: StartupStep) -> bool:
        """Look once whether it has reached a step.

        Raises:
            LaunchError: it cannot.
        """
        self._look()
        if self._failure is not None:
            raise LaunchError(f"{self.machine}: {self._failure}")
        return self._step >= step

    def _bring_up(self) -> Iterator[None]:
        """From a connection to processes that play; each wait is for the agent, or for the aim.

        Raises:
            LaunchError: the agent cannot do it. OSError: a file or a key cannot be read here.
        """
        while not self.reports.home:
            yield
        self._send(structs.replace(self._prepare, logs=self.reports.log_ends))
        for name in self._travelling:
            for part in file_parts(self._folder.path / name, name):
                self._send(part)
                while self._backlog > _BACKLOG:
                    yield
        yield from self._ask(wire.Load())
        yield from self._come_to(StartupStep.LOADED, before=StartupStep.SERVED)
        for there in [find_credentials(self.keys, [seat]) for seat in self._seats] if self.keys is not None else ():
            for path in (there.certificate, there.private_key, there.authority):
                self._send(wire.KeyFile(there.common_name, path.name, path.read_bytes()))
        yield from self._ask(wire.Serve(self.router, self.upstream))
        yield from self._come_to(StartupStep.SERVED, before=StartupStep.JOINED)
        yield from self._ask(wire.Join())
        yield from self._come_to(StartupStep.JOINED, before=StartupStep.FIRST)
        yield from self._ask(wire.Begin(GROUPS[0], sorted(self._vacant)))
        yield from self._come_to(StartupStep.FIRST, before=StartupStep.PLAYS)
        yield from self._ask(wire.Begin(GROUPS[1], sorted(self._vacant)))
        self._step = StartupStep.PLAYS
        for message in (message for played in self._played.values() for message in played):
            self._send(message)
        if self._has_played:
            run = "runs" if len(self.names) == 1 else "run"
            self._tell(f" is back: {', '.join(self.names)} {run} again")
        self._has_played = True

    def _come_to(self, step: StartupStep, *, before: StartupStep) -> Iterator[None]:
        """It has reached a step. Wait until the next one is asked for."""
        self._step = step
        while self._aim < before:
            yield

    def _ask(self, order: wire.ToAgent) -> Iterator[None]:
        """Send an order and wait until it is done."""
        number = self._send(order)
        while self.reports.done < number:
            yield

    def _send(self, message: wire.ToAgent) -> int:
        """Send a message to the agent, and return its number; without a connection it is lost."""
        if self._connection is not None:
            self._connection.channel.send(message)
            self._sent += 1
        return self._sent

    @property
    def names(self) -> list[str]:
        """The names of its processes."""
        return self.reports.names

    @property
    def _backlog(self) -> int:
        """The number of bytes that wait to be sent."""
        return 0 if self._connection is None else self._connection.channel.backlog

    def _look(self, patience: float = 0.0) -> None:
        """Take in what the agent has sent, go on with bringing it up, and let it know that the launcher lives.

        Args:
            patience: the longest real time in s to wait for a message.
        """
        now = self._clock()
        try:
            if self._connection is None:
                if (
                    self._aim is not StartupStep.AWAY
                    and self._failure is None
                    and now - self._tried >= RECONNECT_PERIOD
                ):
                    self._connect(now)
                return
            channel = self._connection.channel
            before = channel.received
            for message in channel.pump(patience):
                self.reports.take(
                    message, self._sent, starting=not self._has_played, fetching=self._fetching is not None
                )
            next(self._script, None)
        except MessageError as error:
            self._lose(f"its agent has sent an invalid message: {error}")
        except OSError as error:
            self._lose(str(error))
        except LaunchError as error:
            if self._has_played and self._step is not StartupStep.PLAYS:
                self._lose(str(error))
            else:
                self._failure = str(error)
        else:
            now = self._clock()
            # A long message may take a while on a slow link.
            silence = self._silence.look(now, heard=channel.received > before)
            if self._connection.ended:
                # To find out why may take a while, and play goes on.
                self._lose("" if self._has_played else self._connection.why_ended())
            elif silence > (patient := AWAY_TIMEOUT if self._step is StartupStep.PLAYS else STARTING):
                self._lose(f"nothing was heard from {self._reached.host} for {patient:g} s")
            elif self.reports.home and now - self._beat_sent >= HEARTBEAT_PERIOD:
                self._beat_sent = now
                self._send(wire.Beat(now))

    def _connect(self, now: float) -> None:
        self._tried = now
        self._silence = Silence(now)
        self._sent = 0
        self.reports.begin()
        frames: wire.Frames[wire.ToLauncher] = wire.Frames(wire.ToLauncher, wire.BANNER)  # type: ignore[arg-type]  # a union
        log = self._folder.logs / f"host-{self.machine}.log"
        self._connection = Connection(self.machine, self._reached, log, "node host", frames)
        self._script = self._bring_up()

    def _lose(self, why: str) -> None:
        """Give the agent up, which then stops its processes and ends. The next agent is another one.

        Args:
            why: the reason, in words; empty if only its absence is known.
        """
        if self._connection is not None:
            self._connection.end()
            self._lost = [lost for lost in (*self._lost, self._connection) if not lost.gone]
        self._connection, self._tried = None, self._clock()
        step, self._step = self._step, StartupStep.AWAY
        if self._aim is StartupStep.AWAY:
            return
        if not self._has_played:
            self._failure = self._failure or why
        elif step is StartupStep.PLAYS:
            self._tell(
                f" is away ({', '.join(self.names)}): its robots stand still; VRG tries again until it answers"
                f"{why and f' ({why})'}"
            )
        elif why:
            self._tell(f": {why}")

    def _tell(self, text: str) -> None:
        """Tell a person something about this machine."""
        self._announce(f"{self.machine}{text[:TEXT]}")

    def keep(self) -> None:
        """Let the agent know that the launcher lives, and take in what it sends."""
        self._look()

    def start_router(self, stop: StopSignal, meanwhile: Callable[[], None] = lambda: None) -> bool:
        """Start the router, if it runs there, and wait until it answers. Return False if `stop` was set before.

        Args:
            meanwhile: called again and again while it waits.

        Raises:
            LaunchError: the router cannot serve there.
        """
        self.aim(StartupStep.SERVED)
        while not self.is_at(StartupStep.SERVED):
            meanwhile()
            if stop.wait(_WAIT):
                return False
        return True

    def attach(self, session: Session) -> None:
        """Let the agent connect to the router."""
        self.aim(StartupStep.JOINED)

    def begin(self, group: int) -> None:
        """Let the agent start all processes of a group."""
        self.aim(StartupStep.FIRST if group == GROUPS[0] else StartupStep.PLAYS)

    @property
    def starting(self) -> Collection[str]:
        """The names of the processes that may not be ready yet."""
        return self.names if self._step < self._aim else ()

    def started(self) -> list[str]:
        """The processes that have become ready since the last call.

        Raises:
            LaunchError: a process ended before it was ready, or makes no progress, or the machine is away.
        """
        self.poll()
        return self.reports.take_ready()

    def poll(self) -> None:
        """Take in what the agent sends. If its machine is away, try to reach it again.

        Raises:
            LaunchError: an essential process there has died too often.
        """
        self.is_at(self._aim)

    @property
    def trouble(self) -> str | None:
        """Why the machine cannot be relied on now, in words; None if it can."""
        away = self._has_played and (self._step is not StartupStep.PLAYS or self._silence.seconds > AGENT_TIMEOUT)
        return f"{self.machine} does not answer ({', '.join(self.names)})" if away else None

    def take_failed(self) -> dict[str, str]:
        """The players that have failed for good since the last call, each with the reason."""
        failed, self.reports.failed = self.reports.failed, {}
        # An agent that takes the place of this one does not start them either.
        self._vacant |= set(failed)
        return failed

    def play(self, name: str, strategy: str) -> None:
        """Let a player play by another strategy, whose files travel.

        Raises:
            LaunchError: the machine is away, or a file cannot be read.
        """
        if self._step is not StartupStep.PLAYS:
            raise LaunchError(f"{self.machine}, where {name} runs, does not answer: try again when it does")
        self._substitutes += 1
        self._vacant.discard(name)
        sent: list[wire.FilePart | wire.Play] = []
        try:
            target, copies = files_of_strategy(strategy, Path("substitutes", str(self._substitutes)))
            for place, source in copies.items():
                files = list(source.rglob("*.py")) if source.is_dir() else [source]
                for file in files:
                    sent += file_parts(file, (place / file.relative_to(source)).as_posix())
        except OSError as error:
            raise LaunchError(f"{strategy}: cannot be read: {error}") from error
        # An agent that takes the place of this one is sent the same.
        self._played[name] = [*sent, wire.Play(name, target)]
        for message in self._played[name]:
            self._send(message)

    def statuses(self) -> list[ProcessStatus]:
        """The state of each of its processes."""
        if self._step is StartupStep.PLAYS or not self._has_played:
            return self.reports.statuses
        away = ProcessState.AWAY
        return [structs.replace(s, state=away, pid=None, cpu=0.0, memory=0) for s in self.reports.statuses]

    def stop(self, order: int) -> None:
        """Ask the processes of one number to stop. From now on it is not brought up again."""
        self.aim(StartupStep.AWAY)
        self._stopping[order] = self._send(wire.StopOrder(order))

    def wait_stopped(self, order: int, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Wait until the processes of one number have stopped.

        Args:
            meanwhile: called again and again while it waits.
        """
        deadline = self._clock() + 2 * STOP_TIMEOUT
        number = self._stopping[order]
        self._wait(lambda: self.reports.done >= number or self._clock() > deadline, meanwhile)
        if self._step is not StartupStep.AWAY and self.reports.done < number:
            self._tell(f" does not answer: its processes stop by themselves within {LAUNCHER_TIMEOUT:g} s")
            self._lose("")

    def fetch(self) -> None:
        """Begin to bring what the processes there have written into the run folder."""
        if self._connection is not None and self._step is not StartupStep.AWAY:
            self._fetching = self._send(wire.Fetch())

    def close(self, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Wait until everything was fetched, if that was begun, and end the agent. Idempotent.

        Args:
            meanwhile: called again and again while it waits.
        """
        self.aim(StartupStep.AWAY)
        fetching = self._fetching
        if fetching is not None:
            self.reports.arrived = self._clock()
            self._wait(
                lambda: self.reports.done >= fetching or self._clock() - self.reports.arrived > _FETCH, meanwhile
            )
        done = self._connection is not None and (fetching is None or self.reports.done >= fetching)
        if done:
            self._send(wire.Goodbye())
            deadline = self._clock() + _FETCH
            self._wait(lambda: not self._backlog or self._clock() > deadline, meanwhile)
        elif self.reports.statuses:
            self._announce(
                f"the files of the processes on {self.machine} were not fetched; they are there in "
                f"{self.reports.home}/{self._prepare.run}"
            )
        self.reports.statuses = []
        for connection in filter(None, (*self._lost, self._connection)):
            connection.end(patience=STOP_TIMEOUT if done else 0.0)
        self._lost, self._connection = [], None

    def _wait(self, condition: Callable[[], bool], meanwhile: Callable[[], None]) -> None:
        """Wait until a condition holds, or the agent is lost."""
        while self._connection is not None and not condition():
            self._look(_WAIT)
            meanwhile()
