"""The course of `vrg play`: it plays a match, shows it on the terminal, and prints how it ended."""

from dataclasses import replace
from pathlib import Path

import typer
from rich.console import Console

from vrg.bus.messages import DISQUALIFIED
from vrg.commands.groups import PlayOptions
from vrg.commands.options import no_window
from vrg.commands.page import open_page, page_of, print_links
from vrg.commands.plan import print_plan
from vrg.config.loading import load_match, match_path
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.hal.sim.engines import BULLET, default_engine
from vrg.kinds import SPECTATOR, WEB, Opening, kind_shown
from vrg.launch.fork_server import ForkServer
from vrg.launch.plan import planned, window_of
from vrg.launch.process import Process
from vrg.playing.apart import DEADLINE
from vrg.playing.launch import How, Launch
from vrg.playing.match import new_run, play, prepare, sealing, undriven
from vrg.registry import loaded
from vrg.runs.run_folder import RunFolder
from vrg.ui.web.drawers import DRAWERS


def play_match(
    match: str, options: PlayOptions, server: ForkServer, base: Path | None = None
) -> tuple[RunFolder, MatchSetup] | None:
    """Play a match, show it, and print who won and where the run is recorded.

    Args:
        match: a match file, or a game's name. options: of the command.
        server: the fork server that starts the match's processes.
        base: the folder that relative paths in the match file start from; its own if missing.

    Returns:
        the run and the set-up; None if nothing was started.

    Raises:
        ConfigError: the match file has problems.
        LaunchError: a process does not start, or dies too often.
        typer.Exit: with status 130 if the match was interrupted, or 1 if it was broken off or everybody disqualified.
    """
    setup = load_match(
        match_path(match), base=base, engine=options.engine, seed=options.seed, rate=options.speed,
        sandbox=options.sandbox, virtual=options.sim,
    )  # fmt: skip
    if options.here or options.in_process:
        setup = setup.all_here()
    console = Console(highlight=False, emoji=False)
    here = not options.headless and SPECTATOR.process not in setup.place
    why_none = no_window() if here else None
    window = not options.headless and why_none is None
    if window:
        window_of(setup)  # that of a package that is missing here is refused before anything is started
    if options.dry_run:
        print_plan(setup, console, window=window, record=options.record, web=options.address is not None)
        return None
    keys = None if options.seats is False else options.keys
    secured = keys is not None or (setup.has_seats if options.seats is None else options.seats)
    how = How.IN_PROCESS if options.in_process else How.LOCKSTEP if options.lockstep else How.PROCESSES
    launch = Launch(
        setup=setup, how=how, console=console, window=window, record=options.record,
        paced=options.speed is not None, trusted=options.sandbox is False, deadline=options.deadline or DEADLINE,
        secured=secured and not options.steps, keys=keys,
    )  # fmt: skip
    launch = _shown(prepare(launch, server), options)
    setup = launch.setup
    if why_none is not None and (launch.paced or not launch.steps):
        launch.announce(f"no window: {why_none}")
    launch.announce(*sealing(setup, seats=launch.secured))
    launch.announce(*undriven(setup, [view.name for view in launch.views]))
    folder = new_run(launch, options.runs)
    lacking = " (PyBullet is not installed)" if setup.engine == default_engine() != BULLET else ""
    about = f"{setup.name}: {setup.game}, seed {setup.seed}, {setup.engine}{lacking}; run in {folder.path}"
    console.print(about, soft_wrap=True)
    if setup.rate != setup.wanted_rate:
        real = ", ".join([*setup.physical, *setup.tracked])
        console.print(f"rate {setup.rate:g}, not {setup.wanted_rate:g}: {real} cannot be hurried")
    played = play(launch, folder, server)
    if not played.over or played.state is None:
        raise typer.Exit(130 if played.interrupted else 1)
    if all(player.state == DISQUALIFIED for player in played.state.players):
        raise typer.Exit(1)
    return folder, setup


def _shown(launch: Launch, options: PlayOptions) -> Launch:
    """A match with the views that were asked for."""
    setup, console = launch.setup, launch.console
    names = [player.name for player in setup.players]
    taken = {process.name for process in planned(setup, window=launch.window, record=launch.record)}
    views: list[Process] = []
    page = None
    if options.address is not None:
        if options.drawer:
            DRAWERS.get(options.drawer)
        known = page_of(options.page) if options.page else None
        page = open_page(*options.address, names, keys=launch.keys, tls=options.tls, known=known)
        views.append(Process(name=WEB.process, kind=WEB.name))
    opened: dict[str, Opening] = {}
    for name, typed in options.views.items():
        kind = kind_shown(name, "opens")
        if kind.process in taken or kind.process in opened or not kind.process:
            other = "player" if kind.process in names else "process"
            raise ConfigError(f"--show {name}: its process has the name of the {other} {kind.process}: rename that one")
        opened[kind.process] = loaded(kind.opens, f"--show {name}")(setup, typed, secured=launch.secured)
        views.append(Process(name=kind.process, kind=kind.name, node=opened[kind.process].name))

    def ready(process: str, endpoint: str) -> None:
        if process == WEB.process and page is not None and not options.page:
            print_links(page, console, options.drawer)
        if process in opened:
            console.print(opened[process].words(endpoint), soft_wrap=True)

    return replace(launch, page=page, views=views, ready=ready)


def wants_replay(folder: RunFolder) -> bool:
    """True, once, if the user of the window wants to watch the match again."""
    wanted = folder.again.exists()
    folder.again.unlink(missing_ok=True)
    return wanted
