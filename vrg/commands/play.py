"""`vrg play` and `vrg check`."""

import contextlib
import enum
import os
import sys
import threading
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState
from vrg.bus.node import Node
from vrg.bus.process import run_node, stop_on_signals
from vrg.bus.session import Session, open_session
from vrg.commands.options import MatchArgument
from vrg.config import MatchSetup, load_match, match_path
from vrg.errors import LaunchError, VrgError
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
    players = f"{len(setup.file.players)} players"
    typer.echo(f"{match}: good: {setup.file.game}, {players}, {book.rounds} rounds, map {setup.file.map}")


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
        f"{setup.file.name}: {setup.file.game}, seed {setup.file.seed}, {setup.file.engine}; run in {folder.path}"
    )
    window = not headless and _has_display()
    with stop_on_signals() as stop:
        state: RefereeState | None
        try:
            if in_process_:
                paced = rate is not None and rate != "max"
                state = _play_in_process(
                    setup, folder, console, stop, window=window and paced, record=record, paced=paced
                )
            else:
                state = _play_processes(setup, folder, console, stop, window=window)
        except VrgError as error:
            write_result(setup, folder, None, f"failed: {error}")
            raise
        interrupted = stop.is_set()
    _conclude(setup, folder, console, state, interrupted, record=record)
    if interrupted:
        raise typer.Exit(130)


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
    setup: MatchSetup,
    folder: RunFolder,
    console: Console,
    stop: threading.Event,
    *,
    window: bool,
    record: bool,
    paced: bool,
) -> RefereeState:
    watchers: list[Node] = [TerminalTable("terminal", Mailbox(), setup.keys, console=console)]
    if record:
        watchers.append(nodes.recorder_node(setup, folder))
    if window:
        watchers.append(nodes.spectator_node(setup, "window", folder.path))
    pace = _pace(stop, setup.file.rate) if paced else lambda _time: not stop.is_set()
    with nodes.open_journal(setup, folder) as journal:
        return in_process.play(setup, journal, watchers=watchers, pace=pace).state


def _pace(stop: threading.Event, rate: float) -> Callable[[float], bool]:
    began = time.monotonic()

    def wait(match_time: float) -> bool:
        return not stop.wait(max(0.0, began + match_time / rate - time.monotonic()))

    return wait


def _play_processes(
    setup: MatchSetup, folder: RunFolder, console: Console, stop: threading.Event, *, window: bool
) -> RefereeState | None:
    local = _served(setup, folder, console, window=window)
    done = threading.Event()
    table = threading.Thread(target=_show_table, args=(setup, local.endpoint, console, done))
    with Progress(TextColumn("starting {task.description}"), BarColumn(), console=console, transient=True) as progress:
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

        linger = LINGER if window else 1.0
        return local.run(stop, progress=ready, started=started, ending=ending, linger=linger).state


def _served(setup: MatchSetup, folder: RunFolder, console: Console, *, window: bool) -> LocalMatch:
    """A match whose router runs, at the first endpoint where it can."""

    def announce(text: str) -> None:
        console.print(f"[yellow]{text}[/yellow]")

    for _ in range(ENDPOINTS_TRIED - 1):
        local = LocalMatch(setup, folder, free_endpoint(), window=window, announce=announce)
        with contextlib.suppress(LaunchError):
            local.serve()
            return local
    local = LocalMatch(setup, folder, free_endpoint(), window=window, announce=announce)
    local.serve()
    return local


def _show_table(setup: MatchSetup, endpoint: str, console: Console, done: threading.Event) -> None:
    with open_session(endpoint) as session:
        run_node(TerminalTable("terminal", Mailbox(), setup.keys, console=console), session, setup.keys, done)


def _conclude(
    setup: MatchSetup,
    folder: RunFolder,
    console: Console,
    state: RefereeState | None,
    interrupted: bool,
    *,
    record: bool,
) -> None:
    result = write_result(setup, folder, state, "interrupted" if interrupted else "game over")
    if record:
        try:
            plot(setup, folder)
        except (OSError, ValueError) as error:
            console.print(f"[yellow]no plot of the trajectories: {error}[/yellow]")
    score = ", ".join(f"{team} {points}" for team, points in result["score"].items())
    if interrupted:
        console.print(f"[bold]Interrupted[/bold] ({score})")
    else:
        console.print(
            f"[bold]{str(result['winner']).capitalize()} win[/bold] ({score}, {result['play_time']:.1f} s of play)"
        )
    console.print(f"Recorded in {folder.path}: result.json, journal.jsonl, recording.mcap (Foxglove), trajectories.png")
