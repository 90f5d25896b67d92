"""Plays a match to its end, in this process or as processes, and writes what it leaves: see `play`."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from itertools import accumulate
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from vrg.bus.messages import RefereeState
from vrg.bus.stopping import StopSignal, stop_on_signals
from vrg.config.loading import check_strategies, load_match
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError
from vrg.hal.sim.engines import BULLET, check_installed, installed
from vrg.kinds import every_kind
from vrg.launch.fork_server import ForkServer, fork_server
from vrg.launch.process_main import is_sealed
from vrg.launch.sandbox.seal import check_able, missing
from vrg.launch.strategy_class import strategy_of
from vrg.packages import lacking
from vrg.playing import over_processes, strategy_process
from vrg.playing.launch import How, Launch, Played, Way
from vrg.playing.strategies import Strategies
from vrg.playing.trial import once_each, trial
from vrg.registry import plugins
from vrg.runs.change import Change, amended, changes_in
from vrg.runs.keeping import keep, keep_layout
from vrg.runs.result import conclusion, ended_of, plot, summary, write_result
from vrg.runs.run_folder import RunFolder


def prepare(launch: Launch, server: ForkServer) -> Launch:
    """A match with the set-up with which it is played in its way.

    Args:
        server: forks the processes of strategies. It is started if a match in this process needs one.

    Raises:
        ConfigError: it cannot be: a package is missing, a strategy cannot be made, or real motors would be hurried.
        SandboxError: a strategy is to be sealed, and this machine cannot do it.
    """
    setup = launch.setup
    if "world" not in setup.place:
        check_installed(setup.engine)
        if not installed(BULLET) and any(player.camera for player in setup.players):
            raise ConfigError(["camera = true: PyBullet, which draws the pictures, is not installed: remove this line"])
    if launch.steps:
        # Emulated motor controllers can be hurried, and real ones are refused.
        setup = setup.at_rate(setup.wanted_rate)
    elif lacks := [
        text
        for _, table, robots in setup.backend_settings()
        if (emulation := table.emulation) is not None
        for text in emulation.only_in_process(robots)
    ]:
        raise ConfigError(lacks)
    if launch.steps and any(is_sealed(setup, player.name, seats=False) for player in setup.players):
        check_able()
    strategies = launch.strategies(server)
    if launch.steps and not setup.hosts and any(strategies.is_apart(setup, p.name) for p in setup.players):
        if not server.alive:
            server.start([strategy_process.__name__])
        with trial(server) as tried:
            check_strategies(setup, once_each(tried.make))
    elif launch.how is How.IN_PROCESS:
        check_strategies(setup, strategy_of)
    return replace(launch, setup=setup)


def new_run(launch: Launch, runs: Path) -> RunFolder:
    """Make the folder of a run, with the files that its match names.

    Raises:
        LaunchError: it cannot be made.
    """
    folder = RunFolder.create(runs, launch.setup.name, datetime.now())
    try:
        keep(launch.setup, folder)
    except OSError as error:
        launch.announce(f"the files that the match names cannot be kept with the run: {error}")
    try:
        if launch.record:
            keep_layout(launch.setup, folder)
    except OSError as error:
        launch.announce(f"the layout for Foxglove cannot be written: {error}")
    return folder


def play(launch: Launch, folder: RunFolder, server: ForkServer, also: StopSignal | None = None) -> Played:
    """Play a match to its end, and write its result and its plot. SIGINT and SIGTERM break it off.

    Args:
        launch: as `prepare` returns it. folder: see `new_run`. server: starts its processes.
        also: what breaks it off besides signals, which only the main thread hears.

    Raises:
        ConfigError: the keys that were given are not good for this match.
        LaunchError: a process does not start, or dies too often; the result is written anyway.
    """
    shown = False

    def over(state: RefereeState | None) -> None:
        nonlocal shown
        shown = True
        _conclude(launch, folder, Played(state))

    if launch.steps and not launch.paced:
        launch = replace(launch, setup=launch.setup.at_rate(0.0))
    with stop_on_signals(also) as stop:
        server.stop = stop
        played = _way(launch)(launch, folder, server, stop, over)._replace(interrupted=stop.is_set())
        # After a window, the result is written silently once more, with the processes' counts and the recording's end.
        # A second Ctrl-C does not keep the result from being written.
        last = replace(launch, console=Console(quiet=True)) if shown else launch
        _conclude(last, folder, played)
    if played.failure is not None:
        raise played.failure
    return played


def undriven(setup: MatchSetup, served: Collection[str] = ()) -> list[str]:
    """The views without which players stand, in words.

    Args:
        served: the processes of the views that are open.
    """
    if not {player.strategy for player in setup.players} & plugins("vrg.strategies").keys():
        return []  # the views of other packages are not asked for nothing
    return [
        f"{', '.join(players)}: driven only by `vrg show {kind.shown}`: run that, or play with --show {kind.shown}"
        for kind in every_kind()
        if kind.drives and kind.process not in served and (players := setup.played_by(kind.drives))
    ]


def sealing(setup: MatchSetup, *, seats: bool) -> list[str]:
    """The players whose code is sealed, and those whose code can do all that the user can, in sentences.

    Args:
        seats: True if the match is played with seats.
    """
    files = [player.name for player in setup.players if setup.strategy_file(player.name) is not None]
    names = [name for name in files if not is_sealed(setup, name, seats=seats)]
    sealed = [name for name in files if name not in names]
    found = [_sealed(sealed)] if sealed else []
    if names:
        found.append(f"{_unsealed(names)}; {missing() or '--sandbox would change that'}")
    return found


@contextmanager
def strangers(
    run: RunFolder,
    changes: Sequence[Change] = (),
    *,
    sandbox: bool,
    lockstep: bool = False,
    announce: Callable[[str], None] = lambda _: None,
) -> Iterator[Strategies | None]:
    """Where the strategies of a recorded match decide that is played again: by default those of files are sealed.

    Args:
        run: its folder. changes: with which it is taken up, besides those with which it was taken up before.
        sandbox: False lets them do all that the user can. lockstep: all decide in processes of their own.
        announce: called with a sentence on what is sealed.

    Raises:
        ConfigError: the match, or a change, cannot be played. LaunchError: this machine cannot seal the strategies.
    """
    setups = list(accumulate([*changes_in(run), *changes], amended, initial=load_match(run.match_file)))
    files = {p.name: None for setup in setups for p in setup.players if setup.strategy_file(p.name) is not None}
    sealed = sandbox and bool(files)
    if sealed and (lacking := missing()) is not None:
        raise LaunchError(f"{lacking}; with --no-sandbox the code in the run can do all that you can")
    if files:
        announce((_sealed if sealed else _unsealed)(list(files)))
    with fork_server(wanted=sealed or lockstep) as server:
        yield Strategies(server, every=lockstep, strangers=sealed) if sealed or lockstep else None


def _sealed(names: Sequence[str]) -> str:
    return f"sandboxed: the code of {_listed(names)} can only play"


def _unsealed(names: Sequence[str]) -> str:
    return f"not sandboxed: the code of {_listed(names)} can read and change all that you can"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) < 5 else f"{len(names)} players"


def _way(launch: Launch) -> Way:
    """How a match is played."""
    if not launch.steps:
        return over_processes.play
    from vrg.playing.in_steps import play  # noqa: PLC0415 - it loads all nodes, which other processes do otherwise

    return play


def _conclude(launch: Launch, folder: RunFolder, played: Played) -> None:
    """Write the result and print how the match ended."""
    setup, state, failure = launch.setup, played.state, played.failure
    if failure is not None:
        lines = str(failure).splitlines()
        ended = f"given up: {lines[0].rstrip(':')}" + (f": {lines[-1]}" if len(lines) > 1 else "")
    elif played.over:
        ended = ended_of(state) if state else ""
    else:
        stands = "" if state is None else state.halted or "; ".join(state.waiting)
        why = f"play stood still, and here nobody can resume it: {stands}" if stands else "it took too long"
        ended = "interrupted" if played.interrupted else f"broken off: {why}"
    result = write_result(setup, folder, state, ended)
    if launch.record and folder.recordings():
        try:
            plot(setup, folder)
        except (ModuleNotFoundError, OSError, ValueError) as error:
            launch.announce(f"no plot of the trajectories: {lacking('matplotlib') or error}")
    # The reason of a failure is the last that the command prints.
    words = "Given up" if failure is not None else conclusion(result)
    launch.console.print(f"[bold]{escape(words)}[/bold]{summary(result)}", soft_wrap=True)
    if result["stops"]["sentence"]:
        launch.console.print(escape(result["stops"]["sentence"]), soft_wrap=True)
    kept = (folder.result, folder.journal, *folder.recordings(), folder.plot, folder.heights)
    launch.console.print(f"Recorded in {folder.path}: {', '.join(p.name for p in kept if p.exists())}", soft_wrap=True)
