"""`vrg play` and `vrg check`."""

import enum
import os
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState, Stage
from vrg.bus.node import Node
from vrg.bus.process import run_node
from vrg.bus.session import Session, open_session
from vrg.bus.stopping import Stop, stop_on_signals
from vrg.commands.options import MatchArgument
from vrg.config import MatchSetup, load_match, match_path
from vrg.coordinator.match import NOBODY
from vrg.errors import LaunchError
from vrg.launch import in_process, nodes
from vrg.launch.local import LocalMatch, free_endpoint
from vrg.launch.result import plot, write_result
from vrg.launch.run_folder import RunFolder
from vrg.ui.table import TerminalTable

LINGER = 5.0
"""s of real time that windows stay open when the game is over."""
ENDPOINTS_TRIED = 3
"""Launchers that are started at once can choose the same endpoint; all but one of them then choose again."""


class EngineName(enum.StrEnum):
    """What `--engine` may be."""

    PYBULLET = "pybullet"
    PLANAR = "planar"


EngineOption = Annotated[EngineName | None, typer.Option(help="Physics, in place of the match file's.")]
SeedOption = Annotated[int | None, typer.Option(min=0, help="Seed, in place of the match file's.")]


def check(match: MatchArgument) -> None:
    """Say whether a match file can be played, or everything that is wrong with it."""
    setup = load_match(match_path(match))
    book = setup.rulebook()
    rounds = "1 round" if book.rounds == 1 else f"{book.rounds} rounds"
    players = f"{len(setup.file.players)} players"
    typer.echo(f"{match}: good: {setup.file.game}, {players}, {rounds}, map {setup.file.map}")


def play(
    match: MatchArgument,
    in_process_: Annotated[
        bool, typer.Option("--in-process", help="All in one process, in lockstep, without the bus.")
    ] = False,
    engine: EngineOption = None,
    rate: Annotated[
        str | None, typer.Option(metavar="X|max", help="Match seconds per second; max only in one process.")
    ] = None,
    seed: SeedOption = None,
    headless: Annotated[bool, typer.Option("--headless", help="No window, also where there is a display.")] = False,
    runs: Annotated[Path, typer.Option(help="Folder for run folders.")] = Path("runs"),
    record: Annotated[bool, typer.Option(help="Record for Foxglove and the plot.")] = True,
) -> None:
    """Play a match on this machine, show it, and say who won and where the run is recorded."""
    speed = _rate(rate, in_process_)
    setup = load_match(match_path(match), engine=engine.value if engine else None, seed=seed, rate=speed or None)
    folder = RunFolder.create(runs, setup.file.name, datetime.now(), setup.text)
    console = Console(highlight=False)
    console.print(
        f"{setup.file.name}: {setup.file.game}, seed {setup.file.seed}, {setup.file.engine}; run in {folder.path}",
        soft_wrap=True,
    )
    show = _Show(console, window=not headless and _has_display(), record=record)
    if setup.physical and setup.file.rate != setup.world.rate:
        console.print(
            f"rate {setup.world.rate:g}, not {setup.file.rate:g}: {', '.join(setup.physical)} cannot be hurried"
        )
    state: RefereeState | None
    with stop_on_signals() as stop:
        if in_process_:
            paced = rate not in (None, "max")
            state = _play_in_process(setup, folder, show, _pace(stop, setup.file.rate if paced else None), paced=paced)
            failure = None
        else:
            state, failure = _play_processes(setup, folder, show, stop)
    _conclude(setup, folder, show, state, interrupted=stop.is_set(), failure=failure)
    if failure is not None:
        raise failure


@dataclass(frozen=True)
class _Show:
    """What people see of a match, and what is kept of it.

    Args:
        window: open the spectator. record: for Foxglove and the plot.
    """

    console: Console
    window: bool
    record: bool

    def announce(self, text: str) -> None:
        """Say what happens to the processes."""
        self.console.print(f"[yellow]{escape(text)}[/yellow]")


def _rate(rate: str | None, one_process: bool) -> float | None:
    """The number that was typed; None = not typed or `max`."""
    if rate is None or rate == "max":
        if rate == "max" and not one_process:
            raise typer.BadParameter(
                "max needs --in-process: processes are paced by the match clock", param_hint="--rate"
            )
        return None
    try:
        value = float(rate)
    except ValueError:
        value = -1.0
    if not 0.1 <= value <= 100:
        raise typer.BadParameter(f"expected 0.1 to 100 or max, got {rate!r}", param_hint="--rate")
    return value


def _has_display() -> bool:
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    from vrg.ui.spectator import display_available  # noqa: PLC0415 - whoever has no display waits for no window library

    return display_available()


def _play_in_process(
    setup: MatchSetup, folder: RunFolder, show: _Show, pace: Callable[[float], bool], *, paced: bool
) -> RefereeState:
    watchers: list[Node] = [TerminalTable("terminal", Mailbox(), setup.keys, console=show.console)]
    if show.record:
        watchers.append(nodes.recorder_node(setup, folder))
    if show.window and paced:
        watchers.append(nodes.spectator_node(setup, "window", folder.path))
    with nodes.open_journal(setup, folder) as journal:
        return in_process.play(setup, journal, watchers=watchers, pace=pace).state


def _pace(stop: Stop, rate: float | None) -> Callable[[float], bool]:
    """What waits for real time between ticks; without a rate it only looks whether to stop."""
    began = time.monotonic()

    def wait(match_time: float) -> bool:
        pause = began + match_time / rate - time.monotonic() if rate else 0.0
        return not (stop.wait(pause) if pause > 0 else stop.is_set())

    return wait


def _play_processes(
    setup: MatchSetup, folder: RunFolder, show: _Show, stop: Stop
) -> tuple[RefereeState | None, LaunchError | None]:
    """The referee's last state, and why the match had to be given up, if it had."""
    local = _served(setup, folder, show)
    done = threading.Event()
    table = threading.Thread(target=_show_table, args=(setup, local.endpoint, show.console, done))
    bar = Progress(TextColumn("starting {task.description}"), BarColumn(), console=show.console, transient=True)
    with bar as progress:
        task = progress.add_task("processes", total=len(local.names) - 1)

        def ready(name: str) -> None:
            progress.update(task, advance=1, description=name)

        def started(_session: Session) -> None:
            progress.stop()
            table.start()

        def ending() -> None:
            done.set()
            if table.ident is not None:
                table.join()

        linger = LINGER if show.window else 1.0
        try:
            local.run(stop, progress=ready, started=started, ending=ending, linger=linger)
        except LaunchError as failure:
            return local.state, failure
        return local.state, None


def _served(setup: MatchSetup, folder: RunFolder, show: _Show) -> LocalMatch:
    """A match whose router runs, at the first endpoint where it can."""
    attempt = 1
    while True:
        local = LocalMatch(
            setup, folder, free_endpoint(), window=show.window, record=show.record, announce=show.announce
        )
        try:
            local.serve()
            return local
        except LaunchError:
            if attempt == ENDPOINTS_TRIED:
                raise
            attempt += 1


def _show_table(setup: MatchSetup, endpoint: str, console: Console, done: threading.Event) -> None:
    with open_session(endpoint) as session:
        run_node(TerminalTable("terminal", Mailbox(), setup.keys, console=console), session, setup.keys, done)


def _conclude(
    setup: MatchSetup,
    folder: RunFolder,
    show: _Show,
    state: RefereeState | None,
    *,
    interrupted: bool,
    failure: LaunchError | None,
) -> None:
    """Write and say how it ended.

    Raises:
        typer.Exit: 130 interrupted, 1 broken off; a match that was over is neither.
    """
    over = state is not None and state.stage is Stage.GAME_OVER
    if failure is not None:
        said = str(failure).splitlines()
        ended = f"given up: {said[0].rstrip(':')}" + (f": {said[-1]}" if len(said) > 1 else "")
    elif over:
        ended = "ended by an official" if state and state.winner == NOBODY else "game over"
    else:
        ended = "interrupted" if interrupted else "broken off: it took too long"
    result = write_result(setup, folder, state, ended)
    if show.record and folder.recordings():
        try:
            plot(setup, folder)
        except (OSError, ValueError) as error:
            show.announce(f"no plot of the trajectories: {error}")
    points = [f"{team} {score}" for team, score in result["score"].items()]
    if state is not None:
        points.append(f"{state.total:.1f} s of play")
    summary = f" ({', '.join(points)})" if points else ""
    headline = f"{str(result['winner']).capitalize()} win" if ended == "game over" else ended[0].upper() + ended[1:]
    show.console.print(f"[bold]{escape(headline)}[/bold]{summary}", soft_wrap=True)
    kept = (folder.result, folder.journal, *folder.recordings(), folder.plot)
    show.console.print(f"Recorded in {folder.path}: {', '.join(p.name for p in kept if p.exists())}", soft_wrap=True)
    if not over and failure is None:
        raise typer.Exit(130 if interrupted else 1)
