"""What the agent of another machine reports, which may be anything: it is checked, and kept for the launcher."""

import math
import time
from collections import deque
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from ipaddress import ip_address

from vrg import __version__
from vrg.bus.messages import ProcessStatus
from vrg.errors import LaunchError, MessageError
from vrg.launch.process import Process
from vrg.launch.process_log import ProcessLog
from vrg.launch.remote import wire
from vrg.launch.remote.travel import take_in
from vrg.plugins import Finding
from vrg.runs.events import EventKind, Notes
from vrg.runs.run_folder import RunFolder

TRIPS = 8
"""The number of newest round trips of which the quickest counts: it has waited least on its way."""
_FETCHED = 4_000_000_000
"""The number of bytes of files that an agent may send: recordings are long, but a disk is not endless."""
TEXT = 4000
"""The longest text of an agent that a person is shown, signs."""
_REFUSED = 100
"""The number of refused files that are named to a person."""
_OF_PROCESSES = frozenset(
    (
        EventKind.READY,
        EventKind.DIED,
        EventKind.KILLED,
        EventKind.VACATED,
        EventKind.STARTED,
        EventKind.REPLACED,
        EventKind.CLOSED,
    )
)
"""The kinds of events that an agent may note."""


@dataclass(frozen=True, order=True)
class Trip:
    """A round trip of a message to an agent.

    Args:
        took: the time it took, s. wall_offset: how far the wall clock there was ahead of this machine's then, s.
    """

    took: float
    wall_offset: float


class AgentReports:
    """What one agent after another of a machine has reported.

    Args:
        machine: its name in the match file. specs: its processes. folder: the run folder here.
        tell: called with a text about the machine that a person should know of. notes: the log of events there.
        clock: returns the monotonic time, s. travelling: the files of the run that were sent there.

    Attributes:
        names: the names of its processes.
        peer: this machine's address, as it is seen there; empty if that is not known.
        home: the folder there below which the run lies; empty before the agent of this connection has reported it.
        endpoint: where a router can be started there; empty if none runs there.
        findings: what was found out about the machine. trips: the newest round trips to the agent.
        done: the number of the last order of this connection that was carried out.
        statuses: the state of each process. log_ends: how far each log was received, bytes.
        failed: the players that have failed for good since it was emptied, each with the reason.
        arrived: the time at which a part of one was received last, s.
    """

    def __init__(
        self,
        machine: str,
        specs: Sequence[Process],
        folder: RunFolder,
        tell: Callable[[str], None],
        notes: Notes,
        clock: Callable[[], float],
        travelling: Collection[str],
    ) -> None:
        self._machine, self._folder, self._travelling = machine, folder, travelling
        self._tell, self._notes, self._clock = tell, notes, clock
        self._own = {spec.name: spec for spec in specs}
        self.names = list(self._own)
        self.peer = self.home = self.endpoint = ""
        self.findings: list[Finding] = []
        self.trips: deque[Trip] = deque(maxlen=TRIPS)
        self.done = 0
        self.statuses: list[ProcessStatus] = []
        self.log_ends: dict[str, int] = {}
        self.failed: dict[str, str] = {}
        self.arrived = -math.inf
        self._ready: list[str] = []
        self._logs: dict[str, ProcessLog] = {}
        self._kept: set[str] = set()
        self._refused: set[str] = set()
        self._fetched = 0

    def begin(self) -> None:
        """Another connection begins, with an agent that has carried out nothing."""
        self.home, self.done = "", 0

    def take_ready(self) -> list[str]:
        """The processes that have become ready since the last call."""
        ready, self._ready = self._ready, []
        return ready

    def take(self, message: wire.ToLauncher, sent: int, *, starting: bool, fetching: bool) -> None:
        """Take in a message of the agent, which may hold anything.

        Args:
            sent: the number of the last order to it. starting: True until all of its processes have run once.
            fetching: True if files were asked for.

        Raises:
            MessageError: no agent sends this. LaunchError: the agent tells that the match cannot go on.
        """
        match message:
            case wire.Hello():
                self._take_hello(message)
            case wire.Loaded():
                self.endpoint, self.findings = message.endpoint, message.findings
            case wire.Done() if message.order <= sent:
                self.done = max(self.done, message.order)
            case wire.Failed():
                raise LaunchError(message.text)
            case wire.Notice():
                self._tell(f": {message.text}")
            case wire.Noted():
                self._take_note(message, starting=starting)
            case wire.Status():
                self._take_status(message)
            case wire.LogText():
                self._take_log(message)
            case wire.FilePart() if fetching:
                self._fetched += len(message.data)
                if self._fetched > _FETCHED:
                    raise MessageError(f"more than {_FETCHED // 1_000_000} MB of files")
                if message.path not in self._travelling and self._keep(message):
                    self.arrived = self._clock()
            case _:
                raise MessageError(f"{type(message).__name__} was not asked for")

    def _take_hello(self, hello: wire.Hello) -> None:
        if hello.version != __version__:
            raise LaunchError(f"expected VRG {__version__} there, got {hello.version}: install the same version")
        try:
            self.peer = hello.peer and str(ip_address(hello.peer))
        except ValueError as error:
            raise MessageError(f"expected the launcher's address: {error}") from None
        self.home = hello.home or "."

    def _take_note(self, note: wire.Noted, *, starting: bool) -> None:
        self._check(note.process)
        if note.what not in _OF_PROCESSES or (note.what is EventKind.VACATED and not self._own[note.process].plays):
            raise MessageError(f"expected what can happen to {note.process}, got {note.what!r}")
        text = note.text[:TEXT]
        if note.what is EventKind.READY and starting:
            self._ready.append(note.process)
        if note.what is EventKind.VACATED:
            self.failed[note.process] = text
        if note.at_next_clock:
            self._notes.note_at_next_clock(note.what, note.process)
        else:
            self._notes.note(note.what, note.process, text, status=note.status)

    def _take_status(self, status: wire.Status) -> None:
        names = [process.name for process in status.processes]
        self._check(*names)
        own = {(process.name, process.machine, process.node) for process in status.processes}
        if own - {(spec.name, self._machine, spec.node_id) for spec in self._own.values()} or len(own) < len(names):
            raise MessageError(f"expected each process of {self._machine} once, got {names}")
        self.statuses, self.names = status.processes, names
        if status.beat:
            took = max(0.0, self._clock() - status.beat - status.held)
            self.trips.append(Trip(took, status.wall + took / 2 - time.time()))

    def _take_log(self, added: wire.LogText) -> None:
        self._check(added.name)
        self.log_ends[added.name] = added.end
        path = f"logs/{added.name}.log"
        if self._keep(wire.FilePart(path, added.text, begins=False)):
            self._logs.setdefault(added.name, ProcessLog(self._folder.path / path)).grow(self._clock())

    def _check(self, *names: str) -> None:
        """Make sure that processes are this machine's.

        Raises:
            MessageError: they are not.
        """
        if strange := [name for name in names if name not in self._own]:
            raise MessageError(f"expected processes of {self._machine} ({', '.join(self._own)}), got {strange}")

    def _keep(self, part: wire.FilePart) -> bool:
        """Keep a part of a file that a process there has written; return whether that can be done.

        What another machine has written, such as the journal, is not for this one to change.
        """
        try:
            if part.path not in self._kept and (self._folder.path / part.path).exists():
                raise LaunchError("the run folder has such a file already")
            take_in(self._folder.path, part)
        except (OSError, LaunchError) as error:
            if part.path not in self._refused and len(self._refused) < _REFUSED:
                self._refused.add(part.path)
                self._tell(f": {part.path!r} cannot be kept: {error}")
            return False
        self._kept.add(part.path)
        return True
