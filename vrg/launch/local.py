"""A match as processes on this machine: who they are, and what their end means."""

import contextlib
import os
import socket
import time
from collections.abc import Callable

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState, Stage
from vrg.bus.session import DEFAULT_ENDPOINT, Session, open_session
from vrg.bus.stopping import StopSignal
from vrg.config.setup import MatchSetup, write_setup
from vrg.launch.child import arguments_of
from vrg.launch.fork_server import ForkServer
from vrg.launch.managed import ProcessSpec
from vrg.launch.registry import RunningMatch, registered
from vrg.launch.run_folder import RunFolder
from vrg.launch.supervisor import Supervisor

POLL_PERIOD = 0.05
"""s of real time between looks at the processes."""


def free_endpoint() -> str:
    """The default endpoint, or one on a free port where another router has that."""
    host, port = DEFAULT_ENDPOINT.removeprefix("tcp/").split(":")
    for candidate in (int(port), 0):
        with contextlib.suppress(OSError), socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, candidate))
            return f"tcp/{host}:{probe.getsockname()[1]}"
    raise OSError(f"no free port on {host}")


def specs(setup: MatchSetup, folder: RunFolder, endpoint: str, *, window: bool, record: bool) -> list[ProcessSpec]:
    """The processes of a match, in the order of their start.

    All start at once, after the router; only players whose robots need a companion wait until that is ready.

    Args:
        window: open the spectator. record: run the recorder.
    """
    keys, run = setup.keys, folder.path.resolve()

    def node(name: str, kind: str, as_: str, *, group: int = 1, stop: int = 1, essential: bool = True) -> ProcessSpec:
        arguments = arguments_of(kind, router=endpoint, run=run, name=as_)
        return ProcessSpec(name, arguments, keys.pulse(kind, as_).key, group, stop, essential)

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
        found.append(node("spectator", "spectator", "window", essential=False))
    for player in setup.players:
        waits = player.physical and bool(setup.companions)
        found.append(node(player.name, "player", player.name, group=2 if waits else 1, stop=0))
    return found


class LocalMatch:
    """A supervised match. `state` is the referee's last, None as long as it has not spoken.

    Args:
        endpoint: of the router, which is started there.
        window: open the spectator. record: run the recorder.
        announce: told of what happens to the processes, in words.
        server: see `Supervisor`.
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
        )

    @property
    def names(self) -> list[str]:
        """Of the processes."""
        return [p.spec.name for p in self._supervisor.processes]

    def serve(self, stop: StopSignal) -> bool:
        """Start the router; `run` starts the others. False where it was broken off by `stop`, and nothing runs.

        Raises:
            LaunchError: it cannot serve at the endpoint; nothing runs.
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
        linger: float,
    ) -> None:
        """Start, watch over and stop the match that is served. Whatever happens, no process is left behind.

        Args:
            stop: set it to break the match off.
            progress: told each process that is ready.
            started: called once all are, with the launcher's session.
            ending: called before the processes are stopped.
            linger: s of real time that everything stays after the game is over, for those who watch.

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
                        over_since = over_since or time.monotonic()
                        if time.monotonic() - over_since >= linger:
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
            )
        )
