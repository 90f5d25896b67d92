"""Plays a match as processes, on this machine or several, and shows on the terminal how it goes."""

import contextlib
import threading
import traceback
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console
from rich.markup import escape
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
from vrg.kinds import SPECTATOR
from vrg.launch.fork_server import ForkServer
from vrg.launch.host import Host
from vrg.launch.launched import LaunchedMatch
from vrg.launch.listening import Listening
from vrg.launch.remote.reaching import remote_hosts, router_endpoints, wait_for
from vrg.launch.remote.remote_host import RemoteHost, StartupStep
from vrg.launch.specs import specs
from vrg.launch.supervisor import Supervisor
from vrg.launch.vacancies import LAUNCHER
from vrg.runs.events import EventLog
from vrg.runs.run_folder import RunFolder
from vrg.seats.credentials import find_credentials
from vrg.seats.seat import Seat, SeatKind
from vrg.types import printable
from vrg.ui.table import TerminalTable
from vrg.ui.web.admission import Admission

ENDPOINTS_TRIED = 3
"""The number of endpoints that are tried. Launchers that are started together may choose the same one at first."""


@dataclass(frozen=True)
class Show:
    """The views of a match, and its recordings.

    Args:
        console: where texts are printed.
        window: True opens the window that the game names. record: True records for Foxglove and the plot.
        page: where browsers see it, and who may do what there; None serves no page.
        served: where further views serve it, as `specs` has it.
        ready: called with the name of each process that is ready, and the endpoint of the match's router.
    """

    console: Console
    window: bool
    record: bool
    page: Admission | None = None
    served: Mapping[str, str] = field(default_factory=dict)
    ready: Callable[[str, str], None] = lambda _process, _endpoint: None

    def announce(self, *texts: str) -> None:
        """Print what happens to the processes, unless the terminal is gone: the match does not depend on it."""
        for text in texts:
            with contextlib.suppress(OSError):
                self.console.print(f"[yellow]{escape(printable(text, lines=True))}[/yellow]", soft_wrap=True)


@dataclass
class Launch:
    """A match that is played as processes.

    Args:
        secured: True lets only processes with keys in.
        keys: the folder of the keys of the match's seats; None makes keys for this run alone.
    """

    setup: MatchSetup
    folder: RunFolder
    show: Show
    server: ForkServer
    secured: bool
    keys: Path | None

    def play(
        self, stop: Stop, over: Callable[[RefereeState | None], None]
    ) -> tuple[RefereeState | None, LaunchError | None]:
        """Play it. Return the last state of the referee, and the error if the match was given up.

        Args:
            over: called with the state when the game is over and a window goes on showing it.

        Raises:
            ConfigError: the keys that were given are not good for this match.
            LaunchError: a machine cannot be used, or the router cannot run anywhere.
        """
        with ExitStack() as stack:
            launched = self._served(stop, stack)
            if launched is None:
                return None, None
            self._tell_of_router(launched)
            return self._run(launched, stop, over)

    def _tell_of_router(self, launched: LaunchedMatch) -> None:
        hosts, console = self.setup.hosts, self.show.console
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
                f"{port_of(launched.endpoint)}, which a firewall may keep others from[/yellow]",
                soft_wrap=True,
            )

    def _run(
        self, launched: LaunchedMatch, stop: Stop, over: Callable[[RefereeState | None], None]
    ) -> tuple[RefereeState | None, LaunchError | None]:
        setup, show = self.setup, self.show
        done = threading.Event()
        table = threading.Thread(target=_show_table, args=(setup, launched, show.console, done))
        bar = Progress(TextColumn("starting {task.description}"), BarColumn(), console=show.console, transient=True)
        with bar as progress:
            task = progress.add_task("processes", total=len(launched.names) - 1)

            def ready(name: str) -> None:
                progress.update(task, advance=1, description=name)
                show.ready(name, launched.endpoint)

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

                    show.announce(OPENING)
                    with contextlib.suppress(LaunchError):
                        hold_place(setup.name)

            def conclude() -> None:
                done.set()
                table.join()
                over(launched.state)
                show.announce("close the window (Q) to end the match; Ctrl-C ends it, too")

            # A plot takes a second, in which the processes must be looked at.
            concluding = threading.Thread(target=conclude)

            try:
                launched.run(
                    stop,
                    progress=ready,
                    started=started,
                    ending=ending,
                    until_closed=concluding.start if show.window else None,
                )
            except LaunchError as failure:
                return launched.state, failure
            except Exception as error:
                # A fault of VRG itself. What was played until then still has a result.
                path = launched.folder.logs / f"{LAUNCHER}.log"
                with contextlib.suppress(OSError), path.open("a", encoding="utf-8") as log:
                    traceback.print_exception(error, file=log)
                what = f"{type(error).__name__}: {error}"
                return launched.state, LaunchError(f"the launcher itself has failed ({what}); see {path}")
            return launched.state, None

    def _served(self, stop: Stop, stack: ExitStack) -> LaunchedMatch | None:
        """Reach all machines of a match, and start its router; return None if that was interrupted.

        Args:
            stack: keys that are made for this run are deleted when it is closed.

        Raises:
            ConfigError, LaunchError: see `play`; no process then runs.
        """
        setup, folder, show = self.setup, self.folder, self.show
        sealed = self.secured or any(setup.sandboxed(player.name, seats=False) for player in setup.players)
        if sealed and not setup.secret:
            # Where players cannot read the match's other files, its seed must not tell them what those hold.
            setup = setup.with_secret(folder.secret())
        folder.hand_out(setup)
        listening = Listening(setup.keys, EventLog(folder.events), [player.name for player in setup.players])
        remote = remote_hosts(
            setup, folder, window=show.window, record=show.record, announce=show.announce, notes=listening
        )
        served = False
        try:
            if remote and not _reached(remote, show, stop):
                return None
            keys: Path | None = None
            for attempt in range(1, ENDPOINTS_TRIED + 1):
                endpoints = router_endpoints(setup, remote, secure=self.secured)
                # They are good for addresses, and another attempt only has another port.
                keys = keys or self._keys(endpoints.values(), stack)
                for host in remote.values():
                    host.keys = keys
                main, endpoint = setup.place.get("router", HERE), endpoints[setup.router_at(HERE)]
                here = Supervisor(
                    specs(
                        setup,
                        folder.path,
                        endpoint,
                        window=show.window,
                        record=show.record,
                        keys=keys,
                        page=show.page,
                        served=show.served,
                    ),
                    endpoint,
                    setup.keys,
                    folder.logs,
                    show.announce,
                    self.server,
                    disqualify=setup.on_fault == "disqualify",
                    memory=setup.memory,
                    notes=listening,
                    credentials=None if keys is None else find_credentials(keys, [Seat(SeatKind.LAUNCHER)]),
                )
                # The router of the match is started before those that are linked to it.
                hosts: list[Host] = [here, *remote.values()]
                hosts.sort(key=lambda host: host.machine != main)
                launched = LaunchedMatch(setup, folder, endpoint, hosts, show.announce, listening, keys=keys)
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
        if not self.secured:
            return None
        from vrg.launch.match_keys import keys_for  # noqa: PLC0415 - certificates take a tenth of a second

        addresses = [host_of(endpoint) for endpoint in endpoints]
        return stack.enter_context(keys_for(self.setup.roster, self.keys, datetime.now(UTC), addresses))


def _reached(remote: dict[str, RemoteHost], show: Show, stop: Stop) -> bool:
    """Reach the other machines, and show how far that is; return False if that was interrupted.

    Raises:
        LaunchError: some cannot be used; the message tells of all of them.
    """
    bar = Progress(TextColumn("reaching {task.description}"), BarColumn(), console=show.console, transient=True)
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
