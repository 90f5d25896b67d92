"""A match as processes on this machine: who they are, and what their end means."""

import contextlib
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState, Stage
from vrg.bus.session import DEFAULT_ENDPOINT, Session, open_session
from vrg.config import MatchSetup
from vrg.errors import LaunchError
from vrg.launch.managed import ProcessSpec
from vrg.launch.registry import RunningMatch, register
from vrg.launch.run_folder import RunFolder
from vrg.launch.supervisor import Supervisor

POLL_PERIOD = 0.05
"""s of real time between looks at the processes."""


@dataclass(frozen=True)
class LocalEnding:
    """How a supervised match ended.

    Args:
        state: the referee's last, None if it never spoke.
        interrupted: by the user, before its end.
    """

    state: RefereeState | None
    interrupted: bool


def free_endpoint() -> str:
    """The default endpoint, or one on a free port where another router has that."""
    host, port = DEFAULT_ENDPOINT.removeprefix("tcp/").split(":")
    for candidate in (int(port), 0):
        with contextlib.suppress(OSError), socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, candidate))
            return f"tcp/{host}:{probe.getsockname()[1]}"
    raise OSError(f"no free port on {host}")


def specs(setup: MatchSetup, folder: RunFolder, endpoint: str, *, serve: bool, window: bool) -> list[ProcessSpec]:
    """The processes of a match, in the order of their start.

    Args:
        serve: a router of one's own.
        window: open the spectator.
    """
    keys, match = setup.keys, str(folder.match_file)
    common = ("--router", endpoint, "--run", str(folder.path), "--base", str(setup.base))
    found = [ProcessSpec("router", ("router", "--router", endpoint), None, 0)] if serve else []
    found.append(ProcessSpec("world", ("world", match, *common), keys.alive("world", "world"), 1))
    found.append(ProcessSpec("referee", ("coordinator", match, *common), keys.alive("coordinator", "referee"), 2))
    found.append(ProcessSpec("recorder", ("recorder", match, *common), keys.alive("recorder", "recorder"), 2))
    for player in setup.file.players:
        arguments = ("player", match, player.name, *common)
        found.append(ProcessSpec(player.name, arguments, keys.alive("player", player.name), 3))
    if window:
        found.append(ProcessSpec("spectator", ("spectator", match, *common), keys.alive("spectator", "window"), 2))
    return found


class LocalMatch:
    """A supervised match.

    Args:
        endpoint: of the router; one is started there unless `serve` is False.
        announce: told of what happens to the processes, in words.
    """

    def __init__(
        self,
        setup: MatchSetup,
        folder: RunFolder,
        endpoint: str,
        *,
        window: bool,
        announce: Callable[[str], None],
        serve: bool = True,
    ) -> None:
        self._setup = setup
        self._folder = folder
        self.endpoint = endpoint
        self._supervisor = Supervisor(
            specs(setup, folder, endpoint, serve=serve, window=window), endpoint, setup.keys, folder.logs, announce
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
        stop: threading.Event,
        *,
        progress: Callable[[str], None],
        started: Callable[[Session], None],
        ending: Callable[[], None],
        linger: float,
    ) -> LocalEnding:
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
        state: RefereeState | None = None
        try:
            with open_session(self.endpoint) as session, self._registered():
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
                        state = referee.latest.body
                    if state is not None and state.stage is Stage.GAME_OVER:
                        over_since = over_since or time.monotonic()
                        if time.monotonic() - over_since >= linger:
                            break
        finally:
            try:
                ending()
            finally:
                supervisor.stop()
        return LocalEnding(state, interrupted=stop.is_set())

    @contextlib.contextmanager
    def _registered(self) -> Iterator[None]:
        entry = RunningMatch(
            match=self._setup.file.name,
            router=self.endpoint,
            run=str(self._folder.path.resolve()),
            pid=os.getpid(),
        )
        path: Path = register(entry)
        try:
            yield
        finally:
            path.unlink(missing_ok=True)
