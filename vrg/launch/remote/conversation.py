"""What the launcher and one agent say to each other, and what is known of the agent's machine by it."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import singledispatchmethod

from vrg import __version__
from vrg.bus.messages import ProcessStatus
from vrg.config.files import Machine
from vrg.errors import LaunchError, MessageError
from vrg.launch.events import Notes
from vrg.launch.findings import Finding
from vrg.launch.process_log import ProcessLog
from vrg.launch.remote import wire
from vrg.launch.remote.ssh import Connection
from vrg.launch.remote.travel import file_parts, files_in, take_in
from vrg.launch.run_folder import RunFolder

BEAT = 0.5
"""The real time in s between two signs of life of the launcher."""
STARTING = 120.0
"""The real time in s without a word from an agent after which it is given up while it starts something."""
TRIPS = 8
"""The number of newest words there and back of which the quickest counts: it has waited least on its way."""


@dataclass(frozen=True)
class Visit:
    """What every agent of a match is told.

    Args:
        run: the name of the run. window: True if a spectator is opened somewhere.
        record: True if the recorder runs somewhere. secret: see `vrg.config.setup.MatchSetup`.
    """

    run: str
    window: bool
    record: bool
    secret: str = ""


@dataclass(frozen=True, order=True)
class Trip:
    """A word to an agent and back.

    Args:
        took: the time it took, s. wall_offset: how far the wall clock there was ahead of this machine's then, s.
    """

    took: float
    wall_offset: float


class Conversation:
    """See the module. Nothing is said before `connect`; it may be called again when the agent was lost.

    Args:
        machine: the machine's name in the match file. reached: how it is reached.
        folder: the run folder on this machine. What is in it now travels.
        visit: what every agent is told.
        announce: called with a text about each event that a person should know of.
        notes: told what happens to the processes there.

    Attributes:
        heard: the monotonic time at which something was heard last, s.
        peer: this machine's address, as it is seen there; empty if that is not known.
        home: the folder there for the folders of runs.
        endpoint: where a router can be started there; empty if none runs there.
        names: the names of the processes there. stop_orders: the numbers of `vrg.launch.remote.wire.StopOrder`.
        loaded: whether the agent has read the match. served: whether its router answers, if one runs there.
        joined: whether it is connected to the router. begun: the groups whose processes are all ready.
        stopped: the numbers whose processes have stopped. run: the name of the run on that machine.
        fetching: whether files were asked for. fetched: whether all have come.
        ready: the processes that have become ready. failed: the players that have failed for good, with the reasons.
        failure: what could not be done, in words; None if nothing failed.
        statuses: how the processes are. findings: what was found out about the machine; None before it was examined.
        trips: the newest words to the agent and back, at most TRIPS.
    """

    def __init__(
        self,
        machine: str,
        reached: Machine,
        folder: RunFolder,
        visit: Visit,
        announce: Callable[[str], None],
        notes: Notes,
    ) -> None:
        self._machine = machine
        self._reached = reached
        self._folder = folder
        self._visit = visit
        self._announce = announce
        self._notes = notes
        self._travelling = files_in(folder.path)
        self._connection: Connection | None = None
        self._log_ends: dict[str, int] = {}
        self._kept: set[str] = set()
        self._refused: set[str] = set()
        self._logs: dict[str, ProcessLog] = {}
        self._beaten = 0.0
        self.fetching = False
        self.run = visit.run
        self.heard = 0.0
        self.peer = self.home = ""
        self.endpoint = ""
        self.names: list[str] = []
        self.stop_orders: list[int] = []
        self.statuses: list[ProcessStatus] = []
        self.failed: dict[str, str] = {}
        self.findings: list[Finding] | None = None
        self.trips: deque[Trip] = deque(maxlen=TRIPS)
        self._forget()

    def _forget(self) -> None:
        """What was known of an agent before does not hold for the next one."""
        self.loaded = self.served = self.joined = self.fetched = False
        self.begun: set[int] = set()
        self.stopped: set[int] = set()
        self.ready: list[str] = []
        self.failure: str | None = None

    def connect(self) -> None:
        """Begin to reach the machine.

        Raises:
            LaunchError: there is no ssh.
        """
        self._forget()
        self.heard = time.monotonic()
        log = self._folder.logs / f"host-{self._machine}.log"
        self._connection = Connection(self._machine, self._reached, log)

    @property
    def open(self) -> bool:
        """Whether there is a connection, which may have ended by itself."""
        return self._connection is not None

    @property
    def present(self) -> bool:
        """Whether there is a connection that has not ended."""
        return self._connection is not None and not self._connection.ended

    def say(self, message: wire.ToAgent) -> None:
        """Say something to the agent; without a connection it is lost."""
        if self._connection is not None:
            self._connection.channel.send(message)

    @property
    def backlog(self) -> int:
        """The number of bytes that wait to be sent."""
        return 0 if self._connection is None else self._connection.channel.backlog

    def fetch(self) -> None:
        """Ask for what the processes have written; it is put into the run folder as it comes."""
        self.fetched, self.fetching = False, True
        self.say(wire.Fetch())

    def lose(self, *, patience: float = 0.0) -> None:
        """Give the connection up. The agent then stops its processes and ends.

        Args:
            patience: the real time in s that ssh may take to end by itself.
        """
        if self._connection is not None:
            self._connection.close(patience=patience)
        self._connection = None
        self._forget()

    def check(self) -> None:
        """Make sure that nothing has failed.

        Raises:
            LaunchError: the agent has said that something failed, or is gone.
        """
        if self.failure is not None:
            raise LaunchError(f"{self._machine}: {self.failure}")
        if self._connection is not None and time.monotonic() - self.heard > STARTING:
            raise LaunchError(f"{self._machine} ({self._reached.host}): nothing was heard of it for {STARTING:g} s")
        if self._connection is not None and self._connection.ended:
            raise LaunchError(f"{self._machine} ({self._reached.host}): {self._connection.why_ended()}")

    def hear(self, patience: float = 0.0) -> None:
        """Take in what the agent has said, and tell it that the launcher lives.

        Args:
            patience: the longest real time in s to wait for a word.
        """
        if self._connection is None:
            return
        before = self._connection.channel.received
        try:
            for message in self._connection.channel.pump(patience):
                self._take(message)
        except (MessageError, OSError) as error:
            self.failure = str(error)
            return
        now = time.monotonic()
        # A long message may take a while on a slow link.
        if self._connection.channel.received > before:
            self.heard = now
        if self.home and now - self._beaten >= BEAT:
            self._beaten = now
            self.say(wire.Beat(now))

    @singledispatchmethod
    def _take(self, message: wire.ToLauncher) -> None:
        raise MessageError(f"expected something that an agent says, got {message!r}")

    @_take.register
    def _(self, message: wire.Hello) -> None:
        if message.version != __version__:
            self.failure = f"expected VRG {__version__} there, got {message.version}: install the same version"
            return
        self.peer, self.home = message.peer, message.home
        self.say(
            wire.Prepare(
                run=self._visit.run, machine=self._machine, display=self._reached.display, logs=dict(self._log_ends)
            )
        )
        for name in self._travelling:
            for part in file_parts(self._folder.path / name, name):
                self.say(part)
        visit = self._visit
        self.say(
            wire.Load(window=visit.window, record=visit.record, address=self._reached.address, secret=visit.secret)
        )

    @_take.register
    def _(self, message: wire.Loaded) -> None:
        self.loaded = True
        self.endpoint, self.names, self.stop_orders = message.endpoint, message.names, message.stop_orders

    @_take.register
    def _(self, _message: wire.Served) -> None:
        self.served = True

    @_take.register
    def _(self, message: wire.Examined) -> None:
        self.findings = message.findings

    @_take.register
    def _(self, _message: wire.Joined) -> None:
        self.joined = True

    @_take.register
    def _(self, message: wire.Ready) -> None:
        self.ready.append(message.name)

    @_take.register
    def _(self, message: wire.Begun) -> None:
        self.begun.add(message.group)

    @_take.register
    def _(self, message: wire.Failed) -> None:
        self.failure = message.text

    @_take.register
    def _(self, message: wire.Said) -> None:
        self._announce(f"{self._machine}: {message.text}")

    @_take.register
    def _(self, message: wire.Noted) -> None:
        if message.at_next_clock:
            self._notes.note_at_next_clock(message.what, message.process)
        else:
            self._notes.note(message.what, message.process, message.text, status=message.status)

    @_take.register
    def _(self, message: wire.Vacated) -> None:
        self.failed[message.name] = message.why

    @_take.register
    def _(self, message: wire.Stopped) -> None:
        self.stopped.add(message.order)

    @_take.register
    def _(self, message: wire.LogText) -> None:
        self._log_ends[message.name] = message.end
        path = f"logs/{message.name}.log"
        if self._keep(wire.FilePart(path, message.text, begins=False)):
            log = self._logs.setdefault(message.name, ProcessLog(self._folder.path / path))
            log.grow(time.monotonic())

    @_take.register
    def _(self, message: wire.Status) -> None:
        self.statuses = message.processes
        self.names = [status.name for status in message.processes]
        if message.beat:
            took = max(0.0, time.monotonic() - message.beat - message.held)
            self.trips.append(Trip(took, message.wall + took / 2 - time.time()))

    @_take.register
    def _(self, message: wire.FilePart) -> None:
        if self.fetching and message.path not in self._travelling:
            self._keep(message)

    def _keep(self, part: wire.FilePart) -> bool:
        """Keep a part of a file that a process there has written; return whether that can be done.

        What another machine has written, such as the journal, is not for this one to change.
        """
        try:
            if part.path not in self._kept and (self._folder.path / part.path).exists():
                raise LaunchError("the run folder has such a file already")
            take_in(self._folder.path, part)
        except (OSError, LaunchError) as error:
            if part.path not in self._refused:
                self._refused.add(part.path)
                self._announce(f"{self._machine}: {part.path!r} cannot be kept: {error}")
            return False
        self._kept.add(part.path)
        return True

    @_take.register
    def _(self, _message: wire.Fetched) -> None:
        self.fetched = True
