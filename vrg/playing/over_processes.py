"""Plays a match as processes, on this machine or several, and shows on the terminal how it goes."""

import contextlib
import threading
import traceback
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState
from vrg.bus.process import run_node
from vrg.bus.session import DEFAULT_ENDPOINT, Session, open_session
from vrg.bus.stopping import Stop
from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError
from vrg.hosts import host_of, port_of
from vrg.kinds import SPECTATOR, WEB
from vrg.launch.fork_server import ForkServer
from vrg.launch.host import Host
from vrg.launch.launched import LaunchedMatch
from vrg.launch.listening import Listening
from vrg.launch.plan import processes_at
from vrg.launch.remote.reaching import remote_hosts, router_endpoints, wait_for
from vrg.launch.remote.remote_host import RemoteHost, StartupStep
from vrg.launch.supervisor import Supervisor
from vrg.launch.vacancies import LAUNCHER
from vrg.playing.launch import Launch, Played
from vrg.runs.events import EventLog
from vrg.runs.run_folder import RunFolder
from vrg.seats.credentials import find_credentials
from vrg.seats.seat import Seat, SeatKind
from vrg.ui.table import TerminalTable

ENDPOINTS_TRIED = 3
"""The number of endpoints that are tried. Launchers that are started together may choose the same one at first."""


def play(
    launch: Launch,
    folder: RunFolder,
    server: ForkServer,
    stop: Stop,
    over: Callable[[RefereeState | None], None],
) -> Played:
    """Play a match as processes; see `vrg.playing.launch.Way`."""
    with ExitStack() as stack:
        course = _Course(launch, folder, server)
        launched = course.served(stop, stack)
        if launched is None:
            return Played(None)
        course.tell_of_router(launched)
        return course.run(launched, stop, over)


@dataclass(frozen=True)
class _Course:
    """The course of a match that is played as processes; the parameters are as for `play`."""

    launch: Launch
    folder: RunFolder
    server: ForkServer

    def tell_of_router(self, launched: LaunchedMatch) -> None:
        """Print where the router is, if it is not where one expects it."""
        hosts, console = self.launch.setup.hosts, self.launch.console
        if launched.keys is not None:
            console.print(
                f"router {launched.endpoint}, for seats only: commands of other users and machines need keys (yours "
                f"find them in {launched.keys})",
                soft_wrap=True,
            )
        elif not hosts and launched.endpoint != DEFAULT_ENDPOINT:
            console.print(
                f"router {launched.endpoint}: port {port_of(DEFAULT_ENDPOINT)} is taken by another match or program, "
                "or belongs to the robots",
                soft_wrap=True,
            )
        if (hosts or launched.keys is not None) and port_of(launched.endpoint) != port_of(DEFAULT_ENDPOINT):
            console.print(
                f"[yellow]another program has port {port_of(DEFAULT_ENDPOINT)}: the router uses port "
                f"{port_of(launched.endpoint)}, which a firewall may block for others[/yellow]",
                soft_wrap=True,
            )

    def run(self, launched: LaunchedMatch, stop: Stop, over: Callable[[RefereeState | None], None]) -> Played:
        """Play it, once the router answers."""
        setup, launch = self.launch.setup, self.launch
        done = threading.Event()
        table = threading.Thread(target=_show_table, args=(setup, launched, launch.console, done))
        bar = Progress(TextColumn("starting {task.description}"), BarColumn(), console=launch.console, transient=True)
        with bar as progress:
            task = progress.add_task("processes", total=len(launched.names) - 1)

            def ready(name: str) -> None:
                progress.update(task, advance=1, description=name)
                launch.ready(name, launched.endpoint)

            def started(_session: Session) -> None:
                progress.stop()
                table.start()

            def ending() -> None:
                done.set()
                for thread in (table, concluding):
                    if thread.ident is not None:
                        thread.join()
                if self.folder.again.exists():
                    # Until the match's processes have ended and the recording is read, there is something to see.
                    from vrg.ui.window.replay import OPENING, hold_place  # noqa: PLC0415 - pygame takes half a second

                    launch.announce(OPENING)
                    with contextlib.suppress(LaunchError):
                        hold_place(setup.name)

            def conclude() -> None:
                done.set()
                table.join()
                over(launched.state)
                launch.announce("close the window (Q) to end the match; Ctrl-C ends it, too")

            # A plot takes a second, in which the processes must be looked at.
            concluding = threading.Thread(target=conclude)

            try:
                launched.run(
                    stop,
                    progress=ready,
                    started=started,
                    ending=ending,
                    until_closed=concluding.start if launch.window else None,
                )
            except LaunchError as failure:
                return Played(launched.state, failure)
            except Exception as error:
                # A fault of VRG itself. What was played until then still has a result.
                path = launched.folder.logs / f"{LAUNCHER}.log"
                with contextlib.suppress(OSError), path.open("a", encoding="utf-8") as log:
                    traceback.print_exception(error, file=log)
                what = f"{type(error).__name__}: {error}"
                return Played(launched.state, LaunchError(f"the launcher itself has failed ({what}); see {path}"))
            return Played(launched.state)

    def served(self, stop: Stop, stack: ExitStack) -> LaunchedMatch | None:
        """Reach all machines of a match, and start its router; return None if that was interrupted.

        Args:
            stack: keys that are made for this run are deleted when it is closed.

        Raises:
            ConfigError, LaunchError: see `vrg.playing.launch.Way`; no process then runs.
        """
        setup, folder, launch = self.launch.setup, self.folder, self.launch
        sealed = launch.secured or any(setup.sandboxed(player.name, seats=False) for player in setup.players)
        if sealed and not setup.secret:
            # Where players cannot read the match's other files, its seed must not tell them what those hold.
            setup = setup.with_secret(folder.secret())
        folder.hand_out(setup)
        listening = Listening(setup.keys, EventLog(folder.events), [player.name for player in setup.players])
        remote = remote_hosts(
            setup, folder, window=launch.window, record=launch.record, announce=launch.announce, notes=listening
        )
        served = False
        try:
            if remote and not _reached(remote, launch, stop):
                return None
            keys: Path | None = None
            for attempt in range(1, ENDPOINTS_TRIED + 1):
                endpoints = router_endpoints(setup, remote, secure=launch.secured)
                # They are good for addresses, and another attempt only has another port.
                keys = keys or self._keys(endpoints.values(), stack)
                for host in remote.values():
                    host.keys = keys
                main, endpoint = setup.place.get("router", HERE), endpoints[setup.router_at(HERE)]
                here = Supervisor(
                    processes_at(
                        setup,
                        folder.path,
                        endpoint,
                        window=launch.window,
                        record=launch.record,
                        keys=keys,
                        views=launch.views,
                    ),
                    endpoint,
                    setup.keys,
                    folder.logs,
                    launch.announce,
                    self.server,
                    disqualify=setup.on_fault == "disqualify",
                    memory=setup.memory,
                    notes=listening,
                    secrets={} if launch.page is None else {WEB.process: launch.page.encoded()},
                    credentials=None if keys is None else find_credentials(keys, [Seat(SeatKind.LAUNCHER)]),
                )
                # The router of the match is started before those that are linked to it.
                hosts: list[Host] = [here, *remote.values()]
                hosts.sort(key=lambda host: host.machine != main)
                launched = LaunchedMatch(setup, folder, endpoint, hosts, launch.announce, listening, keys=keys)
                try:
                    served = launched.serve(stop)
                    return launched if served else None
                except LaunchError:
                    # Another launcher may have taken the port of this machine in between.
                    if attempt == ENDPOINTS_TRIED or remote:
                        raise
        finally:
            if not served:
                for host in remote.values():
                    host.close()
        return None

    def _keys(self, endpoints: Iterable[str], stack: ExitStack) -> Path | None:
        """The folder of the keys of all seats, good for routers at these endpoints; None in a match without seats.

        Raises:
            ConfigError: the keys that were given are not good for this match.
        """
        if not self.launch.secured:
            return None
        from vrg.launch.match_keys import keys_for  # noqa: PLC0415 - certificates take a tenth of a second

        addresses = [host_of(endpoint) for endpoint in endpoints]
        return stack.enter_context(keys_for(self.launch.setup.roster, self.launch.keys, datetime.now(UTC), addresses))


def _reached(remote: dict[str, RemoteHost], launch: Launch, stop: Stop) -> bool:
    """Reach the other machines, and show how far that is; return False if that was interrupted.

    Raises:
        LaunchError: some cannot be used; the message names all of them.
    """
    bar = Progress(TextColumn("reaching {task.description}"), BarColumn(), console=launch.console, transient=True)
    with bar as progress:
        task = progress.add_task(", ".join(remote), total=len(remote))
        problems = wait_for(
            remote, lambda host: host.is_at(StartupStep.LOADED), stop, lambda _name: progress.update(task, advance=1)
        )
    if problems:
        raise LaunchError("\n".join(map(str, problems.values())))
    return problems is not None


def _show_table(setup: MatchSetup, launched: LaunchedMatch, console: Console, done: threading.Event) -> None:
    credentials = launched.credentials_of(*SPECTATOR.seats_of("terminal"))
    with open_session(launched.endpoint, credentials=credentials) as session:
        table = TerminalTable("terminal", Mailbox(), setup.keys, console=console, processes=bool(setup.hosts))
        run_node(table, session, setup.keys, done)
