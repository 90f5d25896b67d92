"""The agent: it runs on a machine that ssh has reached, and supervises the processes of a match there.

It does what the launcher says over the ssh connection. It ends, and stops its processes before, when this connection is
closed or its lease lapses. If it is killed, its processes notice that and end by themselves.
"""

import contextlib
import logging
import os
import shutil
import time
from collections.abc import Iterator
from functools import singledispatchmethod
from pathlib import Path

from vrg import __version__
from vrg.bus.credentials import Credentials, find_credentials, keep_key
from vrg.bus.mailbox import Mailbox
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.session import open_session
from vrg.bus.stopping import StopSignal
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError, VrgError
from vrg.launch.endpoints import free_endpoint
from vrg.launch.events import What
from vrg.launch.findings import examine
from vrg.launch.folder_lock import folder_lock, keys_folder, keys_lock, sweep
from vrg.launch.fork_server import ForkServer, fork_server
from vrg.launch.remote import wire
from vrg.launch.remote.channel import Channel
from vrg.launch.remote.lease import Lease
from vrg.launch.remote.log_reader import LogReader
from vrg.launch.remote.travel import parts_of, take_in
from vrg.launch.run_folder import RunFolder
from vrg.launch.seats import LAUNCHER
from vrg.launch.specs import specs
from vrg.launch.supervisor import Supervisor

log = logging.getLogger(__name__)

PERIOD = 0.5
"""The real time in s between two reports to the launcher."""
_POLL = 0.02
"""The longest real time in s between two looks at the processes."""
_BACKLOG = 16 * wire.PART
"""The number of bytes that may wait for the launcher before no more files and logs are read."""
_KEPT = 14 * 24 * 3600.0
"""The wall time in s for which a run that was not fetched, as its launcher was gone, is kept."""


class Agent:
    """See the module; a context manager, which ends with no process left.

    Args:
        channel: the connection to the launcher. home: the folder for the folders of runs.
        stop: set it to end the agent.
    """

    def __init__(self, channel: Channel[wire.ToAgent], home: Path, stop: StopSignal) -> None:
        self._channel = channel
        self._home = home
        self._stop = stop
        self._resources = contextlib.ExitStack()
        self._machine = ""
        self._endpoint = ""
        self._record = self._window = False
        self._folder: RunFolder | None = None
        self._keys: Path | None = None
        self._brought: set[str] = set()
        self._setup: MatchSetup | None = None
        self._server = ForkServer()
        self._supervisor: Supervisor | None = None
        self._mailbox = Mailbox()
        self._session_open = False
        self._lease = Lease(time.monotonic())
        self._group: int | None = None
        self._begun = False
        self._broken = False
        self._logs: LogReader | None = None
        self._sending: Iterator[wire.FilePart] | None = None
        self._reported = 0.0
        self._beat: tuple[float, float] = (0.0, 0.0)
        self._done = False

    def __enter__(self) -> "Agent":
        return self

    def __exit__(self, *_: object) -> None:
        try:
            if self._supervisor is not None:
                self._supervisor.close()
        finally:
            self._resources.close()

    def run(self) -> None:
        """Do what the launcher says until it says goodbye, is gone, or `stop` is set."""
        self._channel.send_bytes(wire.BANNER)
        self._channel.send(wire.Hello(version=__version__, peer=_addresses()[1], home=str(self._home)))
        while not self._done and not self._stop.is_set():
            for message in self._channel.pump(_POLL):
                self._attempt(message)
            if self._channel.closed:
                log.info("stopping: the launcher has closed the connection")
                return
            self._look_after()
            now = time.monotonic()
            if self._lease.lapsed(now):
                log.info("stopping: nothing is heard of the launcher")
                return
            if now - self._reported >= PERIOD:
                self._reported = now
                self._report(now)
            self._send_files()

    def _attempt(self, message: wire.ToAgent) -> None:
        """Do what the launcher says, or say why it cannot be done."""
        try:
            self._do(message)
        except (VrgError, OSError) as error:
            log.warning("%s: %s", type(message).__name__, error)
            # A player that cannot be replaced does not end the match.
            aside = self._begun and isinstance(message, wire.Play | wire.FilePart)
            self._channel.send(wire.Said(str(error)) if aside else wire.Failed(str(error)))
        # What the launcher has said while this took long waits in the pipe.
        self._lease.renew(time.monotonic())

    @singledispatchmethod
    def _do(self, message: wire.ToAgent) -> None:
        raise LaunchError(f"expected something that an agent does, got {message!r}")

    @_do.register
    def _(self, message: wire.Prepare) -> None:
        self._machine = message.machine
        sweep(self._home, time.time() - _KEPT)
        if message.display is not None:
            os.environ["DISPLAY"] = message.display
        folder = RunFolder(self._home / message.run)
        folder.prepare()
        self._resources.enter_context(folder_lock(folder.path))
        self._folder = folder
        # The agent that has just been killed for this run has left its keys, too.
        self._forget_keys()
        self._resources.callback(self._forget_keys)
        self._logs = LogReader(folder.logs, message.logs)
        # It loads what processes need while the files come.
        self._server = self._resources.enter_context(fork_server())
        self._server.stop = self._stop

    @_do.register
    def _(self, message: wire.FilePart) -> None:
        take_in(self._run_folder.path, message)
        self._brought.add(message.path)

    @_do.register
    def _(self, message: wire.KeyFile) -> None:
        if self._keys is None:
            self._keys = self._keys_folder
            self._keys.mkdir(mode=0o700)
            self._resources.enter_context(keys_lock(self._keys))
        keep_key(self._keys, message.seat, message.name, message.data)

    @_do.register
    def _(self, message: wire.Load) -> None:
        folder = self._run_folder
        self._window, self._record = message.window, message.record
        self._setup = setup = load_match(folder.match_file).with_secret(message.secret)
        folder.hand_out(setup)
        planned = specs(setup, folder.path, "", window=self._window, record=self._record, machine=self._machine)
        address = message.address or _addresses()[0]
        endpoint = free_endpoint(address) if address and planned and planned[0].is_router else ""
        orders = sorted({spec.stop_order for spec in planned})
        self._channel.send(wire.Loaded(endpoint=endpoint, names=[spec.name for spec in planned], stop_orders=orders))

    @_do.register
    def _(self, _message: wire.Examine) -> None:
        if self._setup is None:
            raise LaunchError(f"expected {wire.Load.__name__} first")
        self._channel.send(wire.Examined(examine(self._setup, self._run_folder.match_file, self._machine)))

    @_do.register
    def _(self, message: wire.Serve) -> None:
        if self._setup is None or self._supervisor is not None:
            raise LaunchError(f"expected {wire.Load.__name__} and then one {wire.Serve.__name__}")
        setup, folder = self._setup, self._run_folder
        self._endpoint = message.endpoint
        self._supervisor = Supervisor(
            specs(
                setup,
                folder.path,
                message.endpoint,
                window=self._window,
                record=self._record,
                machine=self._machine,
                upstream=message.upstream,
                keys=self._keys,
            ),
            message.endpoint,
            setup.keys,
            folder.logs,
            lambda text: self._channel.send(wire.Said(text)),
            self._server,
            disqualify=setup.on_fault == "disqualify",
            memory=setup.memory,
            machine=self._machine,
            notes=_NotesToLauncher(self._channel),
            credentials=self._credentials,
        )
        if self._supervisor.start_router(self._stop):
            self._channel.send(wire.Served())

    @_do.register
    def _(self, _message: wire.Join) -> None:
        if self._setup is None:
            raise LaunchError(f"expected {wire.Load.__name__} first")
        self._mailbox.subscribe(self._setup.keys.pulse(LAUNCHER, LAUNCHER))
        session = self._resources.enter_context(
            open_session(self._endpoint, stop=self._stop, credentials=self._credentials)
        )
        self._present.attach(session)
        session.attach(self._mailbox)
        self._session_open = True
        self._channel.send(wire.Joined())

    @_do.register
    def _(self, message: wire.Vacant) -> None:
        self._present.leave_vacant(message.names)

    @_do.register
    def _(self, message: wire.Begin) -> None:
        self._present.begin(message.group)
        self._group = message.group
        self._begun = True

    @_do.register
    def _(self, message: wire.Play) -> None:
        self._present.play(message.name, message.strategy)

    @_do.register
    def _(self, message: wire.StopOrder) -> None:
        if self._supervisor is not None:
            # From now on an end is no failure.
            self._broken = True
            self._supervisor.stop(message.order)
            self._supervisor.wait_stopped(message.order)
        self._channel.send(wire.Stopped(message.order))

    @_do.register
    def _(self, _message: wire.Fetch) -> None:
        folder = self._run_folder
        kept_there = {folder.setup.name, *self._brought}
        kept_there |= {path.relative_to(folder.path).as_posix() for path in folder.logs.glob("*.log")}
        self._sending = parts_of(folder.path, kept_there, self._cannot_send)

    @_do.register
    def _(self, _message: wire.Goodbye) -> None:
        if self._folder is not None:
            shutil.rmtree(self._folder.path, ignore_errors=True)
        self._done = True

    @_do.register
    def _(self, message: wire.Beat) -> None:
        self._beat = (message.sent, time.monotonic())

    @property
    def _credentials(self) -> Credentials | None:
        """The keys of this agent's own seat; None in a match without seats."""
        return None if self._keys is None else find_credentials(self._keys, [Seat(SeatKind.HOST, self._machine)])

    @property
    def _keys_folder(self) -> Path:
        return keys_folder(self._run_folder.path)

    def _forget_keys(self) -> None:
        shutil.rmtree(self._keys_folder, ignore_errors=True)

    @property
    def _run_folder(self) -> RunFolder:
        if self._folder is None:
            raise LaunchError(f"expected {wire.Prepare.__name__} first")
        return self._folder

    @property
    def _present(self) -> Supervisor:
        if self._supervisor is None:
            raise LaunchError(f"expected {wire.Serve.__name__} first")
        return self._supervisor

    def _look_after(self) -> None:
        """Look at all processes once, and tell what has happened to them."""
        supervisor = self._supervisor
        if supervisor is None or not self._begun:
            return
        if self._session_open and self._mailbox.inlets[0].take():
            self._lease.renew(time.monotonic())
        if self._broken:
            return
        try:
            if self._group is not None:
                for name in supervisor.started():
                    self._channel.send(wire.Ready(name))
                if not supervisor.starting:
                    self._channel.send(wire.Begun(self._group))
                    self._group = None
            else:
                supervisor.poll()
        except LaunchError as error:
            self._broken = True
            self._channel.send(wire.Failed(str(error)))
        self._mailbox.handover(0.0)
        for name, why in supervisor.take_failed().items():
            self._channel.send(wire.Vacated(name, why))

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
        if self._logs is not None:
            for text in self._logs.new_text():
                self._channel.send(text)

    def _cannot_send(self, name: str, error: OSError) -> None:
        self._channel.send(wire.Said(f"{name} cannot be sent: {error.strerror}"))

    def _send_files(self) -> None:
        """Go on sending files, if the launcher has asked for them."""
        while self._sending is not None and self._channel.backlog < _BACKLOG:
            part = next(self._sending, None)
            if part is not None:
                self._channel.send(part)
                continue
            self._sending = None
            while self._logs is not None and (texts := list(self._logs.new_text())):
                for text in texts:
                    self._channel.send(text)
            self._channel.send(wire.Fetched())


class _NotesToLauncher:
    """Tells the launcher what happens to processes."""

    def __init__(self, channel: Channel[wire.ToAgent]) -> None:
        self._channel = channel

    def note(self, what: What, process: str | None = None, text: str = "", *, status: int | None = None) -> None:
        self._channel.send(wire.Noted(what, process or "", text, status))

    def note_at_next_clock(self, what: What, process: str) -> None:
        self._channel.send(wire.Noted(what, process, at_next_clock=True))


def _addresses() -> tuple[str, str]:
    """This machine's address and the launcher's, as sshd tells them; empty if it tells none that others can use."""
    words = os.environ.get("SSH_CONNECTION", "").split()
    if len(words) != 4:
        return "", ""
    # An address of one link only, such as fe80::1%eth0, means nothing on another machine.
    own, peer = ("" if "%" in word or word.lower().startswith("fe80:") else word for word in (words[2], words[0]))
    return own, peer
