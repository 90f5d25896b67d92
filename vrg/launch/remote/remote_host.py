"""Another machine, as the launcher sees it: its agent does what it is told, and is brought up again when it is lost."""

import time
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from msgspec import structs

from vrg.bus.credentials import Credentials
from vrg.bus.messages import ProcessState, ProcessStatus
from vrg.bus.session import Session
from vrg.bus.stopping import StopSignal
from vrg.errors import LaunchError
from vrg.launch.host import GROUPS
from vrg.launch.keeping import files_of_strategy
from vrg.launch.managed import STOP_PATIENCE
from vrg.launch.remote import wire
from vrg.launch.remote.conversation import STARTING, Conversation
from vrg.launch.remote.lease import LEASE
from vrg.launch.remote.travel import file_parts

SILENT = LEASE + 2.0
"""The real time in s without a word from an agent after which its machine is away. Its lease has lapsed by then."""
QUIET = 3.0
"""The real time in s without a word from an agent, which speaks twice a second, after which play is halted. An agent
that ends a player that uses too much is silent for 2.5 s, and the referee takes players out after 5 s."""
AGAIN = 2.0
"""The real time in s after which a machine that is away is tried once more."""
_FETCH = 15.0
"""The real time in s without a word from an agent that sends files after which they are given up."""
_WAIT = 0.02
"""The longest real time in s between two looks at what an agent has said."""


class RemoteHost:
    """See the module, and `vrg.launch.host.Host`. Nothing happens before `connect`.

    Args:
        machine: its name in the match file. talk: the conversation with its agent.
        announce: called with a text about each event that a person should know of.

    Attributes:
        machine, talk: as given.
    """

    def __init__(self, machine: str, talk: Conversation, announce: Callable[[str], None]) -> None:
        self.machine = machine
        self.talk = talk
        self._announce = announce
        self._router = ""
        self._seats: Sequence[Credentials] = ()
        self._upstream: str | None = None
        self._group: int | None = None
        self._resuming = False
        self._asked = False
        self._substitutes = 0
        self._vacant: set[str] = set()
        self._played: dict[str, list[wire.FilePart | wire.Play]] = {}
        self._quiet = False
        self._closed = False
        self._tried = 0.0

    def connect(self) -> None:
        """Begin to reach the machine. Then call `loaded` again and again.

        Raises:
            LaunchError: there is no ssh.
        """
        self._tried = time.monotonic()
        self.talk.connect()

    def loaded(self) -> bool:
        """Look once whether the agent has read the match.

        Raises:
            LaunchError: the machine cannot be reached, or the match cannot be played there.
        """
        self.talk.hear()
        self.talk.check()
        return self.talk.loaded

    @property
    def names(self) -> list[str]:
        """The names of its processes."""
        return self.talk.names

    def use_router(self, endpoint: str, upstream: str | None = None) -> None:
        """The router that its processes use is, or will be, at this endpoint.

        Args:
            upstream: the endpoint of the router of the match, if that machine has a further one.
        """
        self._router, self._upstream = endpoint, upstream

    def use_keys(self, seats: Sequence[Credentials]) -> None:
        """The keys of the seats of its processes and of its agent, which travel before the router is started."""
        self._seats = seats

    def keep(self) -> None:
        """Let the agent know that the launcher lives, and take in what it says."""
        self.talk.hear()

    def start_router(self, stop: StopSignal, meanwhile: Callable[[], None] = lambda: None) -> bool:
        """Start the router, if it runs there, and wait until it answers. Return False if `stop` was set before.

        Args:
            meanwhile: called again and again while it waits.

        Raises:
            LaunchError: the router cannot serve there.
        """
        self.begin_router()
        while not self.talk.served:
            self.talk.hear()
            self.talk.check()
            meanwhile()
            if stop.wait(_WAIT):
                return False
        return True

    def begin_router(self) -> None:
        """Begin to start the router, if it runs there.

        Raises:
            LaunchError: keys cannot be read.
        """
        for seat in self._seats:
            for path in (seat.certificate, seat.private_key, seat.authority):
                try:
                    self.talk.say(wire.KeyFile(seat.common_name, path.name, path.read_bytes()))
                except OSError as error:
                    raise LaunchError(f"{path}: cannot be read: {error.strerror}") from error
        self.talk.say(wire.Serve(self._router, self._upstream))

    def attach(self, session: Session) -> None:
        """Let the agent connect to the router."""
        self.join()

    def join(self) -> None:
        """Let the agent connect to the router. Then call `loaded` until it has `joined`."""
        self.talk.say(wire.Join())

    def examine(self) -> None:
        """Begin to check whether the match can be played there. Then call `loaded` until there are `findings`."""
        self.talk.say(wire.Examine())

    def begin(self, group: int) -> None:
        """Let the agent start all processes of a group."""
        self._group = group
        self.talk.say(wire.Begin(group))

    @property
    def starting(self) -> Collection[str]:
        """The names of the processes that may not be ready yet."""
        return self.names if self._group is not None else ()

    def started(self) -> list[str]:
        """The processes that have become ready since the last call.

        Raises:
            LaunchError: a process ended before it was ready, or makes no progress, or the machine is away.
        """
        self.talk.hear()
        self.talk.check()
        if self._group in self.talk.begun:
            self._group = None
        ready, self.talk.ready = self.talk.ready, []
        return ready

    def poll(self) -> None:
        """Take in what the agent says. If its machine is away, try to reach it again.

        Raises:
            LaunchError: an essential process there has died too often.
        """
        self._quiet = True
        if not self.talk.open:
            if time.monotonic() - self._tried > AGAIN:
                self._resuming, self._asked, self._group = True, False, None
                try:
                    self.connect()
                except LaunchError as error:
                    self._announce(f"{self.machine}: {error}")
            return
        self.talk.hear()
        silence = time.monotonic() - self.talk.heard
        self._quiet = silence > QUIET
        if not self.talk.present or silence > (STARTING if self._resuming else SILENT):
            if not self._resuming:
                self._announce(
                    f"{self.machine} is away ({', '.join(self.names)}): its robots stand; it is tried again until it "
                    "answers"
                )
            self._lose()
        elif self._resuming:
            self._resume()
        else:
            self.talk.check()

    def _resume(self) -> None:
        """Bring up again what ran on a machine that was away."""
        if self.talk.failure is not None:
            self._announce(f"{self.machine}: {self.talk.failure}")
            self._lose()
        elif self.talk.loaded and not self._asked:
            self._asked = True
            self.begin_router()
            self.join()
            self.talk.say(wire.Vacant(sorted(self._vacant)))
            self.begin(GROUPS[0])
        elif self._group in self.talk.begun:
            later = [group for group in GROUPS if group > (self._group or 0)]
            if later:
                self.begin(later[0])
                return
            self._resuming, self._group = False, None
            for message in (message for played in self._played.values() for message in played):
                self.talk.say(message)
            run = "runs" if len(self.names) == 1 else "run"
            self._announce(f"{self.machine} is back: {', '.join(self.names)} {run} again")

    @property
    def trouble(self) -> str | None:
        """Why the machine cannot be relied on now, in words; None if it can."""
        away = self._quiet or self._resuming
        return f"{self.machine} does not answer ({', '.join(self.names)})" if away else None

    def take_failed(self) -> dict[str, str]:
        """The players that have failed for good since the last call, each with the reason."""
        failed, self.talk.failed = self.talk.failed, {}
        # An agent that takes the place of this one does not start them either.
        self._vacant |= set(failed)
        return failed

    def play(self, name: str, strategy: str) -> None:
        """Let a player play by another strategy, whose files travel.

        Raises:
            LaunchError: the machine is away, or a file cannot be read.
        """
        if not self.talk.open or self._resuming:
            raise LaunchError(f"{self.machine}, where {name} runs, does not answer: try again when it does")
        self._substitutes += 1
        self._vacant.discard(name)
        said: list[wire.FilePart | wire.Play] = []
        try:
            target, copies = files_of_strategy(strategy, Path("substitutes", str(self._substitutes)))
            for place, source in copies.items():
                files = list(source.rglob("*.py")) if source.is_dir() else [source]
                for file in files:
                    said += file_parts(file, (place / file.relative_to(source)).as_posix())
        except OSError as error:
            raise LaunchError(f"{strategy}: cannot be read: {error}") from error
        # An agent that takes the place of this one is told the same.
        self._played[name] = [*said, wire.Play(name, target)]
        for message in self._played[name]:
            self.talk.say(message)

    def statuses(self) -> list[ProcessStatus]:
        """How each of its processes is."""
        if self.talk.open and not self._resuming:
            return self.talk.statuses
        away = ProcessState.AWAY
        return [structs.replace(s, state=away, pid=None, cpu=0.0, memory=0) for s in self.talk.statuses]

    @property
    def stop_orders(self) -> Collection[int]:
        """The numbers for `stop`."""
        return self.talk.stop_orders

    def stop(self, order: int) -> None:
        """Ask the processes of one number to stop."""
        self.talk.stopped.discard(order)
        self.talk.say(wire.StopOrder(order))

    def wait_stopped(self, order: int, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Wait until the processes of one number have stopped.

        Args:
            meanwhile: called again and again while it waits.
        """
        deadline = time.monotonic() + 2 * STOP_PATIENCE
        while self.talk.present and order not in self.talk.stopped and time.monotonic() < deadline:
            self.talk.hear(_WAIT)
            meanwhile()
        if order not in self.talk.stopped and self.talk.loaded:
            self._announce(f"{self.machine} does not answer: its processes stop by themselves within {LEASE:g} s")
            self._lose()

    def fetch(self) -> None:
        """Begin to bring what the processes there have written into the run folder."""
        if self.talk.present and self.talk.loaded:
            self.talk.fetch()

    def close(self, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Wait until everything was fetched, if that was begun, and end the agent. Idempotent.

        Args:
            meanwhile: called again and again while it waits.
        """
        if self._closed:
            return
        self._closed = True
        ready = self.talk.present and self.talk.loaded
        if ready and self.talk.fetching:
            self.talk.heard = time.monotonic()
            while self.talk.present and not self.talk.fetched and time.monotonic() - self.talk.heard < _FETCH:
                self.talk.hear(_WAIT)
                meanwhile()
        done = self.talk.fetched or (ready and not self.talk.fetching)
        # Where the match could not be read, nothing has been written.
        if done or (self.talk.present and not self.talk.names):
            self.talk.say(wire.Goodbye())
            self.talk.heard = time.monotonic()
            while self.talk.present and self.talk.backlog and time.monotonic() - self.talk.heard < _FETCH:
                self.talk.hear(_WAIT)
                meanwhile()
        if self.talk.names and not done:
            self._announce(
                f"what the processes on {self.machine} have written was not fetched; it is there in "
                f"{self.talk.home}/{self.talk.run}"
            )
        self.talk.lose(patience=STOP_PATIENCE if done else 0.0)

    def _lose(self) -> None:
        """Give the agent up. What comes next is another one."""
        self.talk.lose()
        self._tried = time.monotonic()
