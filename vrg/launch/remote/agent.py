"""The agent: it runs on a machine that ssh has reached, and supervises the processes of a match there.

It obeys the orders that the launcher sends over the ssh connection. It ends, and stops its processes before, when this
connection is closed or its lease lapses. If it is killed, its processes notice that and end by themselves.
"""

import contextlib
import logging
import os
import time
from collections.abc import Iterator
from pathlib import Path

from vrg import __version__
from vrg.bus.mailbox import Mailbox
from vrg.bus.session import open_session
from vrg.bus.stopping import StopSignal
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError, VrgError
from vrg.launch.endpoints import free_endpoint
from vrg.launch.findings import examine
from vrg.launch.folder_lock import folder_lock, keys_folder, keys_lock, sweep
from vrg.launch.fork_server import ForkServer, fork_server
from vrg.launch.plan import processes_at
from vrg.launch.process import Process
from vrg.launch.remote import wire
from vrg.launch.remote.channel import Channel
from vrg.launch.remote.silence import LAUNCHER_TIMEOUT, Silence
from vrg.launch.remote.travel import LogReader, parts_of, take_in
from vrg.launch.supervisor import Supervisor
from vrg.launch.vacancies import LAUNCHER
from vrg.runs.events import EventKind
from vrg.runs.run_folder import RunFolder, delete
from vrg.seats.credentials import Credentials, find_credentials, keep_key
from vrg.seats.seat import Seat, SeatKind

log = logging.getLogger(__name__)

REPORT_PERIOD = 0.5
"""The real time in s between two reports to the launcher."""
_POLL = 0.02
"""The longest real time in s between two looks at the processes."""
_BACKLOG = 16 * wire.PART
"""The number of bytes that may wait for the launcher before no more files and logs are read."""
_RUN_RETENTION = 14 * 24 * 3600.0
"""The wall time in s for which a run that was not fetched, as its launcher was gone, is kept."""


class HostAgent:
    """Supervises the processes of a match on this machine, as the launcher tells it.

    Args:
        channel: the connection to the launcher. home: the folder for the folders of runs.
        stop: set it to end the agent.
    """

    # The first orders bring these: `Prepare` two of them, and `Load` the set-up.
    _order: wire.Prepare
    _folder: RunFolder
    _setup: MatchSetup

    def __init__(self, channel: Channel[wire.ToAgent], home: Path, stop: StopSignal) -> None:
        self._channel = channel
        self._home = home
        self._stop = stop
        self._resources = contextlib.ExitStack()
        self._logs: LogReader | None = None
        self._keys: Path | None = None
        self._brought: set[str] = set()
        self._server = ForkServer()
        self._supervisor: Supervisor | None = None
        self._endpoint = ""
        self._mailbox = Mailbox()
        # The orders that are not done yet, by their numbers; and whether the processes are watched besides, or stopped.
        self._jobs: dict[int, tuple[wire.ToAgent, Iterator[None]]] = {}
        self._received = 0
        self._watches = self._stopping = False
        self._silence = Silence(time.monotonic())
        self._reported = 0.0
        self._beat = (0.0, 0.0)
        self._done = False

    def run(self) -> None:
        """Obey the launcher until it ends the connection, is gone, or `stop` is set. No process is left then."""
        with self._resources:
            self._run()

    def _run(self) -> None:
        self._channel.send_bytes(wire.BANNER)
        self._channel.send(wire.Hello(version=__version__, peer=_addresses()[1], home=str(self._home)))
        while not self._done and not self._stop.is_set():
            messages = self._channel.pump(_POLL)
            for order in messages:
                self._received += 1
                self._jobs[self._received] = (order, self._obey(order))
                self._go_on(self._received)
            if self._channel.closed:
                log.info("stopping: the launcher has closed the connection")
                return
            for number in list(self._jobs):
                self._go_on(number)
            self._look_after()
            now = time.monotonic()
            beats = self._mailbox.inlets[0].take() if self._mailbox.inlets else []
            if self._silence.look(now, heard=bool(messages or beats)) > LAUNCHER_TIMEOUT:
                log.info("stopping: nothing is heard from the launcher")
                return
            if now - self._reported >= REPORT_PERIOD:
                self._reported = now
                self._report(now)

    def _go_on(self, number: int) -> None:
        """Go on with an order, and tell when it is done, or why it cannot be done."""
        order, job = self._jobs[number]
        try:
            next(job)
        except StopIteration:
            if not isinstance(order, wire.FilePart | wire.KeyFile | wire.Beat):
                self._channel.send(wire.Done(number))
        except (VrgError, OSError) as error:
            log.warning("%s: %s", type(order).__name__, error)
            # A player that cannot be replaced does not end the match.
            aside = self._watches and isinstance(order, wire.Play | wire.FilePart)
            self._channel.send(wire.Notice(str(error)) if aside else wire.Failed(str(error)))
        else:
            return
        del self._jobs[number]

    def _obey(self, order: wire.ToAgent) -> Iterator[None]:
        """Obey an order step by step."""
        match order:
            case wire.Prepare():
                self._prepare(order)
            case wire.FilePart():
                take_in(self._folder.path, order)
                self._brought.add(order.path)
            case wire.KeyFile():
                self._take_key(order)
            case wire.Load():
                self._load()
            case wire.Serve():
                self._serve(order)
            case wire.Join():
                self._join()
            case wire.Begin():
                yield from self._begin(order)
            case wire.Play():
                self._present.play(order.name, order.strategy)
            case wire.StopOrder():
                self._stop_order(order)
            case wire.Fetch():
                yield from self._fetch()
            case wire.Goodbye():
                delete(self._folder.path)
                self._done = True
            case wire.Beat():
                self._beat = (order.sent, time.monotonic())

    def _prepare(self, message: wire.Prepare) -> None:
        sweep(self._home, time.time() - _RUN_RETENTION)
        if message.display is not None:
            os.environ["DISPLAY"] = message.display
        folder = RunFolder(self._home / message.run)
        folder.prepare()
        self._resources.enter_context(folder_lock(folder.path))
        self._order, self._folder = message, folder
        # The agent that has just been killed for this run has left its keys, too.
        self._forget_keys()
        self._resources.callback(self._forget_keys)
        self._logs = LogReader(folder.logs, message.logs)
        # It loads what processes need while the files come.
        self._server = self._resources.enter_context(fork_server())
        self._server.stop = self._stop

    def _take_key(self, message: wire.KeyFile) -> None:
        if self._keys is None:
            self._keys = keys_folder(self._folder.path)
            self._keys.mkdir(mode=0o700)
            self._resources.enter_context(keys_lock(self._keys))
        keep_key(self._keys, message.seat, message.name, message.data)

    def _load(self) -> None:
        folder, order = self._folder, self._order
        self._setup = setup = load_match(folder.match_file).with_secret(order.secret)
        folder.hand_out(setup)
        planned = self._processes()
        address = order.address or _addresses()[0]
        endpoint = free_endpoint(address) if address and planned and planned[0].is_router else ""
        findings = examine(setup, folder.match_file, order.machine) if order.examine else []
        self._channel.send(wire.Loaded(endpoint, findings))

    def _processes(self, upstream: str | None = None) -> list[Process]:
        """The processes that run here."""
        order = self._order
        return processes_at(
            self._setup, self._folder.path, self._endpoint,
            window=order.window, record=order.record, machine=order.machine, upstream=upstream, keys=self._keys,
        )  # fmt: skip

    def _serve(self, message: wire.Serve) -> None:
        setup = self._setup
        self._endpoint = message.endpoint
        self._supervisor = Supervisor(
            self._processes(message.upstream),
            message.endpoint,
            setup.keys,
            self._folder.logs,
            lambda text: self._channel.send(wire.Notice(text)),
            self._server,
            disqualify=setup.on_fault == "disqualify",
            memory=setup.memory,
            machine=self._order.machine,
            notes=self,
            credentials=self._credentials,
        )
        self._resources.callback(self._supervisor.close)
        self._supervisor.start_router(self._stop)

    def _join(self) -> None:
        self._mailbox.subscribe(self._setup.keys.pulse(LAUNCHER, LAUNCHER))
        session = self._resources.enter_context(
            open_session(self._endpoint, stop=self._stop, credentials=self._credentials)
        )
        self._present.attach(session)
        session.attach(self._mailbox)

    def _begin(self, message: wire.Begin) -> Iterator[None]:
        supervisor = self._present
        self._watches = False
        supervisor.leave_vacant(message.vacant)
        supervisor.begin(message.group)
        while supervisor.starting:
            supervisor.started()
            yield
            if self._stopping:
                return
        self._watches = True

    def _stop_order(self, message: wire.StopOrder) -> None:
        # From now on an end is no failure.
        self._watches, self._stopping = False, True
        if self._supervisor is not None:
            self._supervisor.stop(message.order)
            self._supervisor.wait_stopped(message.order)

    def _fetch(self) -> Iterator[None]:
        folder = self._folder
        kept_there = {folder.setup.name, *self._brought}
        kept_there |= {path.relative_to(folder.path).as_posix() for path in folder.logs.glob("*.log")}
        for part in parts_of(folder.path, kept_there, self._cannot_send):
            while self._channel.backlog > _BACKLOG:
                yield
            self._channel.send(part)
        while self._send_logs():
            yield

    @property
    def _present(self) -> Supervisor:
        if self._supervisor is None:
            raise LaunchError(f"expected {wire.Serve.__name__} first")
        return self._supervisor

    @property
    def _credentials(self) -> Credentials | None:
        """The keys of this agent's own seat; None in a match without seats."""
        seat = Seat(SeatKind.HOST, self._order.machine)
        return None if self._keys is None else find_credentials(self._keys, [seat])

    def _forget_keys(self) -> None:
        delete(keys_folder(self._folder.path))

    def _look_after(self) -> None:
        """Look at all processes once, and tell what has happened to them."""
        if self._supervisor is None:
            return
        try:
            if self._watches:
                self._supervisor.poll()
        except LaunchError as error:
            self._watches = False
            self._channel.send(wire.Failed(str(error)))
        self._mailbox.handover(0.0)

    def _report(self, now: float) -> None:
        """Tell how the processes are and what they have logged."""
        if self._channel.backlog > _BACKLOG:
            return
        if self._supervisor is not None:
            sent, arrived = self._beat
            statuses = self._supervisor.statuses()
            self._channel.send(
                wire.Status(processes=statuses, beat=sent, held=max(0.0, now - arrived), wall=time.time())
            )
        self._send_logs()

    def _send_logs(self) -> bool:
        """Send what processes have added to their logs; return whether that was anything."""
        texts = [] if self._logs is None else list(self._logs.new_text())
        for text in texts:
            self._channel.send(text)
        return bool(texts)

    def note(self, what: EventKind, process: str | None = None, text: str = "", *, status: int | None = None) -> None:
        """Tell the launcher what has happened to a process; see `vrg.runs.events.Notes`."""
        self._channel.send(wire.Noted(what, process or "", text, status))

    def note_at_next_clock(self, what: EventKind, process: str) -> None:
        """Tell the launcher what counts as soon as the world's clock is heard again."""
        self._channel.send(wire.Noted(what, process, at_next_clock=True))

    def _cannot_send(self, name: str, error: OSError) -> None:
        self._channel.send(wire.Notice(f"{name} cannot be sent: {error.strerror}"))


def _addresses() -> tuple[str, str]:
    """This machine's address and the launcher's, as sshd tells them; empty if it tells none that others can use."""
    words = os.environ.get("SSH_CONNECTION", "").split()
    if len(words) != 4:
        return "", ""
    # An address of one link only, such as fe80::1%eth0, means nothing on another machine.
    own, peer = ("" if "%" in word or word.lower().startswith("fe80:") else word for word in (words[2], words[0]))
    return own, peer
