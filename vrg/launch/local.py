"""A match as processes on this machine: which they are, and how they are started, watched and stopped."""

import contextlib
import os
import socket
import time
from collections.abc import Callable
from pathlib import Path

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState, Stage
from vrg.bus.session import DEFAULT_ENDPOINT, Session, open_session
from vrg.bus.stopping import StopSignal
from vrg.config.setup import MatchSetup, write_setup
from vrg.launch.child import arguments_of
from vrg.launch.fork_server import ForkServer
from vrg.launch.managed import ProcessSpec
from vrg.launch.run_folder import RunFolder
from vrg.launch.running import RunningMatch, registered
from vrg.launch.supervisor import WINDOW, Supervisor

LINGER = 1.0
"""The real time in s that all processes go on after the game is over, so that everybody hears how it ended."""
POLL_PERIOD = 0.05
"""The real time in s between two looks at the processes."""


def free_endpoint() -> str:
    """The default endpoint, or one on a free port if another router has the default one.

    Raises:
        OSError: there is no free port.
    """
    host, port = DEFAULT_ENDPOINT.removeprefix("tcp/").split(":")
    for candidate in (int(port), 0):
        with contextlib.suppress(OSError), socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, candidate))
            return f"tcp/{host}:{probe.getsockname()[1]}"
    raise OSError(f"no free port on {host}")


def specs(setup: MatchSetup, folder: RunFolder, endpoint: str, *, window: bool, record: bool) -> list[ProcessSpec]:
    """The processes of a match, the router first.

    The router starts first, then all others at once. Only players of physical robots wait, until all companions are
    ready.

    Args:
        window: True adds the spectator. record: True adds the recorder.
    """
    keys, run = setup.keys, folder.path.resolve()

    def node(name: str, kind: str, as_: str, *, group: int = 1, stop: int = 1, essential: bool = True) -> ProcessSpec:
        arguments = arguments_of(kind, router=endpoint, run=run, name=as_)
        pulse, seat = keys.pulse(kind, as_).key, kind == "player"
        return ProcessSpec(name, arguments, pulse, group, stop, essential, seat=seat)

    found = [
        ProcessSpec("router", arguments_of("router", router=endpoint), None, 0, 3),
        node("world", "world", "world", stop=2),
        node("referee", "coordinator", "referee"),
    ]
    for companion in setup.companions:
        arguments = (*companion.arguments, "--leash")
        found.append(ProcessSpec(companion.name, arguments, None, 1, 2, says=companion.says, command=True))
    if record:
        found.append(node("recorder", "recorder", "recorder", essential=False))
    if window:
        found.append(node(WINDOW, "spectator", "window", essential=False))
    for player in setup.players:
        waits = player.physical and bool(setup.companions)
        found.append(node(player.name, "player", player.name, group=2 if waits else 1, stop=0))
    return found


class LocalMatch:
    """A match as supervised processes.

    Args:
        setup: the match. folder: its run folder.
        endpoint: the endpoint at which the router is started.
        window: True opens the spectator. record: True runs the recorder.
        announce: called with a text about each event that a person should know of.
        server: the fork server that starts the processes; see `Supervisor`.

    Attributes:
        state: the last state of the referee; None as long as there is none.
    """

    def __init__(
        self,
        setup: MatchSetup,
        folder: RunFolder,
        endpoint: str,
        *,
        window: bool,
        record: bool,
        announce: Callable[[str], None],
        server: ForkServer | None = None,
    ) -> None:
        self._setup = setup
        self._announce = announce
        self._folder = folder
        self.endpoint = endpoint
        self.state: RefereeState | None = None
        self._supervisor = Supervisor(
            specs(setup, folder, endpoint, window=window, record=record),
            endpoint,
            setup.keys,
            folder.logs,
            announce,
            server,
            disqualify=setup.on_fault == "disqualify",
            memory=setup.memory,
        )

    @property
    def names(self) -> list[str]:
        """The names of the processes."""
        return [p.spec.name for p in self._supervisor.processes]

    def serve(self, stop: StopSignal) -> bool:
        """Start the router; `run` starts the other processes.

        Returns:
            False if `stop` was set before the router answered; no process then runs.

        Raises:
            LaunchError: the router cannot serve at the endpoint; no process then runs.
        """
        write_setup(self._setup, self._folder.setup)
        served = False
        try:
            served = self._supervisor.start_router(stop)
        finally:
            if not served:
                self._supervisor.stop()
        return served

    def run(
        self,
        stop: StopSignal,
        *,
        progress: Callable[[str], None],
        started: Callable[[Session], None],
        ending: Callable[[], None],
        until_closed: bool,
    ) -> None:
        """Start, supervise and stop the processes of the match. No process is left behind, whatever happens.

        Args:
            stop: set it to break the match off.
            progress: called with the name of each process that is ready.
            started: called with the launcher's session when all processes are ready.
            ending: called before the processes are stopped.
            until_closed: go on after the game is over until the window is closed.

        Raises:
            LaunchError: a process does not start or dies too often.
        """
        supervisor = self._supervisor
        try:
            with open_session(self.endpoint, stop=stop) as session, self._registered():
                mailbox = Mailbox()
                referee = mailbox.subscribe(self._setup.keys.referee_state)
                session.attach(mailbox)
                if not supervisor.start(session, stop, progress):
                    return
                started(session)
                over_since: float | None = None
                while not stop.wait(POLL_PERIOD):
                    supervisor.poll()
                    session.receive()
                    mailbox.handover(0.0)
                    if referee.latest is not None:
                        self.state = referee.latest.body
                    if self.state is not None and self.state.stage is Stage.GAME_OVER:
                        shown = until_closed and supervisor.shows
                        if over_since is None and shown:
                            self._announce("the game is over: close the window (Q) to end the match")
                        over_since = over_since or time.monotonic()
                        if not shown and time.monotonic() - over_since >= LINGER:
                            break
        finally:
            try:
                ending()
            finally:
                supervisor.stop()

    def _registered(self) -> contextlib.AbstractContextManager[None]:
        return registered(
            RunningMatch(
                match=self._setup.name,
                router=self.endpoint,
                run=str(self._folder.path.resolve()),
                pid=os.getpid(),
                folder=str(Path.cwd()),
            )
        )
