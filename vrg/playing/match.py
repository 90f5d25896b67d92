"""Plays a match to its end, in this process or as processes, and writes what it leaves: see `play`."""

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import accumulate
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.markup import escape

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState, Stage
from vrg.bus.node import Node
from vrg.bus.stopping import Stop, StopSignal, stop_on_signals
from vrg.config.loading import check_strategies, load_match
from vrg.config.setup import CheckedMatch, MatchSetup, write_setup
from vrg.errors import ConfigError, LaunchError
from vrg.hal.sim.engines import BULLET, check_installed, installed
from vrg.kinds import every_kind
from vrg.launch.context import Made, NodeContext
from vrg.launch.fork_server import ForkServer, fork_server
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.launch.nodes.strategy import strategy_of
from vrg.launch.over_processes import Launch, Show
from vrg.launch.serving import is_sealed
from vrg.launch.specs import window_of
from vrg.playing import in_process
from vrg.playing.apart import DEADLINE
from vrg.playing.strategies import Strategies
from vrg.registry import load_object, plugins
from vrg.runs.change import Change, amended, changes_in
from vrg.runs.keeping import keep, keep_layout
from vrg.runs.result import conclusion, ended_of, plot, summary, write_result
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import StepLog
from vrg.ui.banner import Help
from vrg.ui.table import TerminalTable

_LAG: Final = 0.2
"""The real time in s that a match in lockstep may make up for after it was late."""


@dataclass(frozen=True)
class Way:
    """The way in which a match is played.

    Args:
        in_process: in this process, in lockstep. lockstep: so, but each strategy decides in a process of its own.
            Without both it is played as processes.
        strangers: in lockstep: the strategies of files alone decide in processes of their own, always sealed.
        limit: the match time after which a match in steps is broken off, s.
        paced: in lockstep: at the rate of the set-up, and not as fast as possible. deadline: the real time after which
            a strategy of its own process forfeits a step, s.
        secured: True lets only processes with keys in.
        keys: the folder of the keys of the match's seats; None makes keys for this run alone.
    """

    in_process: bool = False
    lockstep: bool = False
    strangers: bool = False
    limit: float = 3600.0
    paced: bool = False
    deadline: float = DEADLINE
    secured: bool = False
    keys: Path | None = None

    @property
    def steps(self) -> bool:
        """True if the nodes of the match are in one process, in lockstep."""
        return self.in_process or self.lockstep


@dataclass(frozen=True)
class Outcome:
    """A match that was played.

    Args:
        state: the last state of the referee; None if it was not heard. interrupted: True if somebody has broken it off.
    """

    state: RefereeState | None
    interrupted: bool

    @property
    def over(self) -> bool:
        """True if the game came to its end."""
        return self.state is not None and self.state.stage is Stage.GAME_OVER


def prepare(setup: CheckedMatch, way: Way) -> CheckedMatch:
    """The set-up with which a match is played in this way.

    Raises:
        ConfigError: it cannot be: a package is missing, a strategy cannot be made, or real motors would be hurried.
    """
    if "world" not in setup.place:
        check_installed(setup.engine)
        if not installed(BULLET) and any(player.camera for player in setup.players):
            raise ConfigError(["camera = true: PyBullet, which draws the pictures, is not installed: leave it out"])
    if way.steps:
        # Emulated motor controllers can be hurried, and real ones are refused.
        setup = setup.at_rate(setup.wanted_rate)
    elif lacks := [
        text
        for _, table, robots in setup.backend_settings()
        if (emulation := table.emulation) is not None
        for text in emulation.only_in_process(robots)
    ]:
        raise ConfigError(lacks)
    if way.in_process:
        check_strategies(setup, strategy_of)
    return setup


def new_run(setup: CheckedMatch, runs: Path, show: Show) -> RunFolder:
    """Make the folder of a run, with the files that its match names.

    Raises:
        LaunchError: it cannot be made.
    """
    folder = RunFolder.create(runs, setup.name, datetime.now())
    try:
        keep(setup, folder)
    except OSError as error:
        show.announce(f"the files that the match names cannot be kept with the run: {error}")
    try:
        if show.record:
            keep_layout(setup, folder)
    except OSError as error:
        show.announce(f"the layout for Foxglove cannot be written: {error}")
    return folder


def play(
    setup: CheckedMatch, folder: RunFolder, show: Show, server: ForkServer, way: Way, also: StopSignal | None = None
) -> Outcome:
    """Play a match to its end, and write its result and its plot. SIGINT and SIGTERM break it off.

    Args:
        setup: as `prepare` returns it. folder: see `new_run`. server: starts its processes.
        also: what breaks it off besides signals, which only the main thread hears.

    Raises:
        ConfigError: the keys that were given are not good for this match.
        LaunchError: a process does not start, or dies too often; the result is written all the same.
    """
    shown = False

    def over(state: RefereeState | None) -> None:
        nonlocal shown
        shown = True
        _conclude(setup, folder, show, state, failure=None)

    with stop_on_signals(also) as stop:
        server.stop = stop
        if way.steps:
            setup = setup if way.paced else setup.at_rate(0.0)
            apart = Strategies(server, not way.strangers, way.strangers, way.deadline) if way.lockstep else None
            state, failure = _play_in_steps(setup, folder, show, stop, apart, way)
        else:
            state, failure = Launch(setup, folder, show, server, way.secured, way.keys).play(stop, over)
        # After a window, once more with what the processes have counted and the end of the recording, without a word.
        # A second Ctrl-C does not keep the result from being written.
        last = replace(show, console=Console(quiet=True)) if shown else show
        _conclude(setup, folder, last, state, interrupted=stop.is_set(), failure=failure)
    if failure is not None:
        raise failure
    return Outcome(state, stop.is_set())


def undriven(setup: MatchSetup, served: Collection[str] = ()) -> list[str]:
    """The views without which players stand, in words.

    Args:
        served: the processes of the views that are open.
    """
    if not {player.strategy for player in setup.players} & plugins("vrg.strategies").keys():
        return []  # the views of other packages are not asked for nothing
    return [
        f"{', '.join(players)}: driven by `vrg show {kind.shown}` alone: run that, or play with --show {kind.shown}"
        for kind in every_kind()
        if kind.drives and kind.process not in served and (players := setup.played_by(kind.drives))
    ]


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
        from vrg.launch.sandbox.seal import missing  # noqa: PLC0415 - most matches have no sandboxes

        able = "code is sealed only in processes of its own" if in_process else "--sandbox seals it"
        lacking = missing()
        found.append(f"{_unsealed(names)}; {lacking or able}")
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
    from vrg.launch.sandbox.seal import missing  # noqa: PLC0415 - most matches have no sandboxes

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
    return f"sealed: the code of {_listed(names)} can only play"


def _unsealed(names: Sequence[str]) -> str:
    return f"not sealed: the code of {_listed(names)} can read and change all that you can"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) < 5 else f"{len(names)} players"


def _play_in_steps(
    setup: CheckedMatch, folder: RunFolder, show: Show, stop: Stop, apart: Strategies | None, way: Way
) -> tuple[RefereeState | None, LaunchError | None]:
    """Play the match in lockstep. Return the last state of the referee, and the error if the match was given up.

    Args:
        apart: which strategies decide in processes of their own.
    """
    resumable = show.window and way.paced
    means = Help.KEYS if resumable else Help.NONE  # no command reaches a match in one process
    watchers: list[Node] = [TerminalTable("terminal", Mailbox(), setup.keys, console=show.console, means=means)]
    if show.record:
        watchers.append(recorder_node(setup, folder))
    pace = _pace(stop, setup.rate)
    write_setup(setup, folder.setup)
    with ExitStack() as stack, open_journal(setup, folder) as journal, StepLog(folder.steps) as steps:
        if resumable:
            kind, name = window_of(setup)
            made: Made = load_object(kind.node)(NodeContext(
                setup=setup, name=name, folder=folder, given=True, router="", session=None, stop=stop, official=True,
                own=True, secret="", stack=stack,
            ))  # fmt: skip
            watchers.append(made.node)
        try:
            ending = in_process.play(
                setup,
                journal,
                watchers=watchers,
                limit=way.limit,
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


def _pace(stop: Stop, rate: float, clock: Callable[[], float] = time.monotonic) -> Callable[[float], bool]:
    """Return a function that waits for real time between ticks. At rate 0 it only checks whether to stop.

    After a long start, or a stall, the match goes on later. It does not hurry to catch up.

    Args:
        clock: returns the real time, s.
    """
    began: float | None = None

    def wait(match_time: float) -> bool:
        nonlocal began
        if not rate:
            return not stop.is_set()
        since = clock() - match_time / rate
        began = since if began is None else max(began, since - _LAG)
        return not (stop.wait(began - since) if began > since else stop.is_set())

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
