"""The course of `vrg play`: it plays a match in this process or as processes, shows it, records and concludes it."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from itertools import accumulate
from pathlib import Path

import typer
from rich.console import Console
from rich.markup import escape

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import DISQUALIFIED, RefereeState, Stage
from vrg.bus.node import Node
from vrg.bus.stopping import Stop, stop_on_signals
from vrg.commands.groups import PlayOptions
from vrg.commands.launching import Launch, Show
from vrg.commands.options import echo, has_display
from vrg.commands.page import live_address, open_page
from vrg.commands.plan import print_plan
from vrg.commands.ros import ros_address, typed_domain, undriven
from vrg.commands.three import three_address
from vrg.config.loading import check_strategies, load_match, match_path
from vrg.config.setup import MatchSetup, write_setup
from vrg.errors import ConfigError, LaunchError
from vrg.hal.sim.engines import BULLET, check_installed, default_engine, installed
from vrg.kinds import FOXGLOVE, HUD, ROS, SPECTATOR, THREE
from vrg.launch import in_process
from vrg.launch.fork_server import ForkServer, fork_server
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.launch.nodes.strategy import strategy_of
from vrg.launch.serving import is_sealed
from vrg.launch.specs import window_of
from vrg.launch.stepping import DEADLINE, Apart
from vrg.runs.change import Change, amended, changes_in
from vrg.runs.keeping import keep, keep_layout
from vrg.runs.result import conclusion, ended_of, plot, summary, write_result
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import StepLog
from vrg.ui.banner import Help
from vrg.ui.table import TerminalTable


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
    _check_packages(setup)
    if options.developer:
        setup = _for_developers(setup)
    console = Console(highlight=False, emoji=False)
    address = options.address
    window = not options.headless and (SPECTATOR.process in setup.place or has_display())
    if options.dry_run:
        print_plan(setup, console, window=window, record=options.record, web=address is not None)
        return None
    keys = None if options.seats is False else options.keys
    names = [player.name for player in setup.players]
    page = None if address is None else open_page(*address, names, keys=keys, tls=options.tls)
    secured = not options.steps and (keys is not None or (setup.has_seats if options.seats is None else options.seats))
    served = {FOXGLOVE.process: live_address(None)} if options.foxglove else {}
    served |= {THREE.process: three_address(None)} if options.three else {}
    served |= {ROS.process: ros_address(typed_domain(), None, secured=secured)} if options.ros else {}
    show = Show(console, window=window, record=options.record, page=page, served=served)
    show.announce(*sealing(setup, seats=secured, in_process=options.in_process))
    if not options.ros:
        show.announce(*undriven(setup))
    if not options.steps:
        lacks = [text for _, table, robots in setup.backend_settings() for text in table.only_in_process(robots)]
        if lacks:
            raise ConfigError(lacks)
    if options.steps:
        # Emulated motor controllers can be hurried, and real ones are refused.
        setup = setup.at_rate(setup.wanted_rate)
    if options.in_process:
        check_strategies(setup, strategy_of)
    folder = RunFolder.create(options.runs, setup.name, datetime.now(), setup.text)
    try:
        keep(setup, folder)
    except OSError as error:
        show.announce(f"the files that the match names cannot be kept with the run: {error}")
    try:
        if options.record:
            keep_layout(setup, folder)
    except OSError as error:
        show.announce(f"the layout for Foxglove cannot be written: {error}")
    lacking = " (PyBullet is not installed)" if setup.engine == default_engine() != BULLET else ""
    about = f"{setup.name}: {setup.game}, seed {setup.seed}, {setup.engine}{lacking}; run in {folder.path}"
    console.print(about, soft_wrap=True)
    if setup.rate != setup.wanted_rate:
        console.print(f"rate {setup.rate:g}, not {setup.wanted_rate:g}: {', '.join(setup.physical)} cannot be hurried")
    _play(Launch(setup, folder, show, server, secured, keys), options)
    return folder, setup


def _check_packages(setup: MatchSetup) -> None:
    """Check that what simulates the match is installed, if that is done on this machine.

    Raises:
        ConfigError: it is not.
    """
    if "world" not in setup.place:
        check_installed(setup.engine)
        if not installed(BULLET) and any(player.camera for player in setup.players):
            raise ConfigError(["camera = true: PyBullet, which draws the pictures, is not installed: leave it out"])


def wants_again(folder: RunFolder) -> bool:
    """True, once, if the user of the window wants to watch the match again."""
    wanted = folder.again.exists()
    folder.again.unlink(missing_ok=True)
    return wanted


def _play(launch: Launch, options: PlayOptions) -> None:
    """Play the match, and conclude it; for what is raised see `play_match`."""
    setup, folder, show = launch.setup, launch.folder, launch.show
    shown = False

    def over(state: RefereeState | None) -> None:
        nonlocal shown
        shown = True
        _conclude(setup, folder, show, state, failure=None)

    state: RefereeState | None
    with stop_on_signals() as stop:
        launch.server.stop = stop
        if options.steps:
            paced = options.speed is not None
            setup = setup if paced else setup.at_rate(0.0)
            apart = (
                Apart(launch.server, every=True, deadline=options.deadline or DEADLINE) if options.lockstep else None
            )
            state, failure = _play_in_steps(setup, folder, show, stop, apart, paced=paced)
        else:
            state, failure = launch.play(stop, over)
    # After a window, once more with what the processes have counted and the end of the recording, and without a word.
    last = replace(show, console=Console(quiet=True)) if shown else show
    _conclude(setup, folder, last, state, interrupted=stop.is_set(), failure=failure)
    if failure is not None:
        raise failure
    if state is None or state.stage is not Stage.GAME_OVER:
        raise typer.Exit(130 if stop.is_set() else 1)
    if all(player.state == DISQUALIFIED for player in state.players):
        raise typer.Exit(1)


def sealing(setup: MatchSetup, *, seats: bool, in_process: bool) -> list[str]:
    """The players whose code is sealed, and those whose code can do all that the user can, in sentences.

    Args:
        seats: True if the match is played with seats. in_process: True if it is played in one process.
    """
    files = [player.name for player in setup.players if setup.strategy_file(player.name) is not None]
    names = [name for name in files if in_process or not is_sealed(setup, name, seats=seats)]
    sealed = [name for name in files if name not in names]
    found = [_sealed(sealed)] if sealed else []
    if names:
        from vrg.launch.sandbox.seal import missing

        able = "code is sealed only in processes of its own" if in_process else "--sandbox seals it"
        lacking = missing()
        found.append(f"{_unsealed(names)}; {able if lacking is None else lacking.partition(': ')[0]}")
    return found


@contextmanager
def strangers(
    run: RunFolder, changes: Sequence[Change] = (), *, sandbox: bool, lockstep: bool = False, silent: bool = False
) -> Iterator[Apart | None]:
    """Where the strategies of a recorded match decide that is played again: by default those of files are sealed.

    Args:
        run: its folder. changes: with which it is taken up, besides those with which it was taken up before.
        sandbox: False lets them do all that the user can. lockstep: all decide in processes of their own.
        silent: nothing is printed.

    Raises:
        ConfigError: the match, or a change, cannot be played. LaunchError: this machine cannot seal the strategies.
    """
    from vrg.launch.sandbox.seal import missing

    setups = list(accumulate([*changes_in(run), *changes], amended, initial=load_match(run.match_file)))
    files = {p.name: None for setup in setups for p in setup.players if setup.strategy_file(p.name) is not None}
    sealed = sandbox and bool(files)
    if sealed and (lacking := missing()) is not None:
        why = lacking.partition(": ")[0]
        raise LaunchError(f"{why}; with --no-sandbox the code in the run can do all that you can")
    if files and not silent:
        echo((_sealed if sealed else _unsealed)(list(files)), err=True)
    with fork_server(wanted=sealed or lockstep) as server:
        yield Apart(server, every=lockstep, strangers=sealed) if sealed or lockstep else None


def _sealed(names: Sequence[str]) -> str:
    return f"sealed: the code of {_listed(names)} can only play"


def _unsealed(names: Sequence[str]) -> str:
    return f"not sealed: the code of {_listed(names)} can read and change all that you can"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) < 5 else f"{len(names)} players"


def _for_developers(setup: MatchSetup) -> MatchSetup:
    """The same match with the developers' view as its window.

    Raises:
        ConfigError: its window is on another machine.
    """
    if SPECTATOR.process in setup.place:
        where = setup.place[SPECTATOR.process]
        raise ConfigError(f"--developer: the window is on {where}: `vrg show developer` opens one there")
    return setup.for_developers()


def _play_in_steps(
    setup: MatchSetup, folder: RunFolder, show: Show, stop: Stop, apart: Apart | None, *, paced: bool
) -> tuple[RefereeState | None, LaunchError | None]:
    """Play the match in lockstep. Return the last state of the referee, and the error if the match was given up.

    Args:
        apart: which strategies decide in processes of their own.
    """
    resumable = show.window and paced
    means = Help.KEYS if resumable else Help.NONE  # no command reaches a match in one process
    watchers: list[Node] = [TerminalTable("terminal", Mailbox(), setup.keys, console=show.console, means=means)]
    if show.record:
        watchers.append(recorder_node(setup, folder))
    if resumable:
        from vrg.launch.nodes.windows import hud_node, spectator_node  # only a window needs pygame

        kind, name = window_of(setup)
        display = kind is HUD
        watchers.append(hud_node(setup, name) if display else spectator_node(setup, name, folder.path))
    pace = _pace(stop, setup.rate)
    write_setup(setup, folder.setup)
    with open_journal(setup, folder) as journal, StepLog(folder.steps) as steps:
        try:
            ending = in_process.play(
                setup,
                journal,
                watchers=watchers,
                pace=pace,
                resumable=resumable,
                stop=stop,
                logs=folder.logs,
                apart=apart,
                steps=steps,
            )
        except LaunchError as failure:
            return None, failure
    return ending.state, None


def _pace(stop: Stop, rate: float) -> Callable[[float], bool]:
    """Return a function that waits for real time between ticks. At rate 0 it only checks whether to stop."""
    began = time.monotonic()

    def wait(match_time: float) -> bool:
        pause = began + match_time / rate - time.monotonic() if rate else 0.0
        return not (stop.wait(pause) if pause > 0 else stop.is_set())

    return wait


def _conclude(
    setup: MatchSetup,
    folder: RunFolder,
    show: Show,
    state: RefereeState | None,
    *,
    failure: LaunchError | None,
    interrupted: bool = False,
) -> None:
    """Write the result and print how the match ended."""
    over = state is not None and state.stage is Stage.GAME_OVER
    if failure is not None:
        lines = str(failure).splitlines()
        ended = f"given up: {lines[0].rstrip(':')}" + (f": {lines[-1]}" if len(lines) > 1 else "")
    elif over:
        ended = ended_of(state) if state else ""
    else:
        stands = "" if state is None else state.halted or "; ".join(state.waiting)
        why = f"play stood still, and here nobody can resume it: {stands}" if stands else "it took too long"
        ended = "interrupted" if interrupted else f"broken off: {why}"
    result = write_result(setup, folder, state, ended)
    if show.record and folder.recordings():
        try:
            plot(setup, folder)
        except (OSError, ValueError) as error:
            show.announce(f"no plot of the trajectories: {error}")
    # The reason of a failure is the last that the command prints.
    words = "Given up" if failure is not None else conclusion(result)
    show.console.print(f"[bold]{escape(words)}[/bold]{summary(result)}", soft_wrap=True)
    if result["stops"]["sentence"]:
        show.console.print(escape(result["stops"]["sentence"]), soft_wrap=True)
    kept = (folder.result, folder.journal, *folder.recordings(), folder.plot)
    show.console.print(f"Recorded in {folder.path}: {', '.join(p.name for p in kept if p.exists())}", soft_wrap=True)
