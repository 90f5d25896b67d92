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
from vrg.config import MatchSetup
from vrg.errors import LaunchError
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

    Args:
        window: open the spectator. record: run the recorder.
    """
    keys, match = setup.keys, str(folder.match_file)
    common = ("--router", endpoint, "--run", str(folder.path), "--base", str(setup.base))

    def node(name: str, group: int, *command: str, kind: str, as_: str, essential: bool = True) -> ProcessSpec:
        return ProcessSpec(name, (*command, *common), keys.pulse(kind, as_).key, group, essential)

    found = [
        ProcessSpec("router", ("router", "--router", endpoint), None, 0),
        node("world", 1, "world", match, kind="world", as_="world"),
        node("referee", 2, "coordinator", match, kind="coordinator", as_="referee"),
    ]
    for companion in setup.companions:
        found.append(ProcessSpec(companion.name, companion.arguments, None, 1, says=companion.says))
    if record:
        found.append(node("recorder", 2, "recorder", match, kind="recorder", as_="recorder", essential=False))
    if window:
        found.append(node("spectator", 2, "spectator", match, kind="spectator", as_="window", essential=False))
    for player in setup.file.players:
        found.append(node(player.name, 3, "player", match, player.name, kind="player", as_=player.name))
    return found


class LocalMatch:
    """A supervised match. `state` is the referee's last, None as long as it has not spoken.

    Args:
        endpoint: of the router, which is started there.
        window: open the spectator. record: run the recorder.
        announce: told of what happens to the processes, in words.
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
    ) -> None:
        self._setup = setup
        self._folder = folder
        self.endpoint = endpoint
        self.state: RefereeState | None = None
        self._supervisor = Supervisor(
            specs(setup, folder, endpoint, window=window, record=record), endpoint, setup.keys, folder.logs, announce
        )

    @property
    def names(self) -> list[str]:
        """Of the processes."""
        return [p.spec.name for p in self._supervisor.processes]

    def serve(self) -> None:
        """Start the router; `run` starts the others.

        Raises:
            LaunchError: it cannot serve at the endpoint; nothing runs.
        """
        try:
            self._supervisor.start_router()
        except LaunchError:
            self._supervisor.stop()
            raise

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
                supervisor.start(session, progress)
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
                match=self._setup.file.name,
                router=self.endpoint,
                run=str(self._folder.path.resolve()),
                pid=os.getpid(),
            )
        )
