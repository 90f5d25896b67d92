"""Takes a recorded match up from one of its instants, with other strategies, rules, radio or noise.

A match in one process is the same, byte for byte, each time that it is played. So it is played again from its beginning
up to that instant, where it is made sure that the referee has seen the same, and from there on with the changes.
"""

import contextlib
import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from functools import reduce
from pathlib import Path

from msgspec import structs

from vrg.bus.messages import Stage
from vrg.bus.node import Node
from vrg.bus.stopping import StopSignal
from vrg.config.loading import check_strategies, load_match
from vrg.config.setup import CheckedMatch, MatchSetup, read_setup, write_setup
from vrg.coordinator.evidence import TINY, Exhibit, read_evidence
from vrg.errors import ConfigError, GivenUpError, LaunchError
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.launch.strategy_class import strategy_of
from vrg.playing import in_process
from vrg.playing.in_process import Ending
from vrg.playing.strategies import Strategies
from vrg.runs.change import Branch, Change, amended, branch_of, changes_in, kept, write_branch
from vrg.runs.keeping import keep, keep_layout
from vrg.runs.result import ended_of, plot, write_result
from vrg.runs.run_folder import RunFolder, delete
from vrg.runs.step_log import Ended, StepLog, read_steps


def last_instant(folder: RunFolder) -> float:
    """The match time, s, up to which a match can be taken up.

    Raises:
        LaunchError: it was played as processes, or holds no evidence.
        JournalError: the evidence is damaged.
    """
    if folder.events.exists():
        raise LaunchError(
            f"{folder.path}: expected a match that was played in steps, with `vrg play --in-process` or `--lockstep`: "
            "a match in real time does not record when each process heard what, so it cannot be repeated"
        )
    last = _last_before(folder, math.inf)
    if last is None:
        raise LaunchError(f"{folder.evidence}: expected the referee's evidence, found none")
    return last.tick.time


def check_instant(of: RunFolder, instant: float) -> list[Change]:
    """Check that a recorded match can be taken up at an instant, and return the changes that it has had before.

    Args:
        of: its run folder. instant: the match time, s.

    Raises:
        LaunchError: it cannot. JournalError: its evidence is damaged.
    """
    end, before = last_instant(of), branch_of(of)
    if not 0.0 <= instant <= end:
        raise LaunchError(f"expected an instant from 0 to {end:.1f} s of match time, got {instant:g}")
    if before is None:
        return []
    if instant < (last := before.changes[-1].time):
        text = f"expected a later instant, got {instant:g}; an earlier one is in {before.of}"
        raise LaunchError(f"{of.path} was itself continued at {last:.1f} s: {text}")
    return before.changes


def play_branch(
    of: RunFolder,
    changes: Sequence[Change],
    runs: Path,
    now: datetime,
    *,
    progress: Callable[[float], None],
    stop: StopSignal,
    apart: Strategies | None = None,
) -> RunFolder:
    """Play a recorded match again up to an instant, and on from there with changes.

    Args:
        of: its run folder. changes: all at that instant.
        runs: the folder for the new run folder. now: the local real time, for its name.
        progress: called with the match time now and then.
        stop: set it to break this off.
        apart: which strategies are imported and decide in processes of their own; None lets all do so in this process.

    Returns:
        the new run folder, with everything that any run leaves.

    Raises:
        ConfigError: a player, a strategy or a field does not exist, or cannot have this value.
        LaunchError: the match cannot be repeated, or this was broken off.
        JournalError: its evidence is damaged.
        BrokenPipeError: `progress` has raised it.
    """
    earlier = check_instant(of, changes[0].time)
    setup = _as_played(of)
    make = strategy_of if apart is None else apart.tried
    check_strategies(reduce(amended, changes, setup), make)
    folder = RunFolder.create(runs, setup.name, now)
    with _written(folder):
        keep(setup, folder)
        keep_layout(setup, folder)
        own = {
            strategy: kept(strategy, folder) for strategy in dict.fromkeys(c.strategy for c in changes if c.strategy)
        }
        changes = [*earlier, *(structs.replace(c, strategy=own.get(c.strategy, "")) for c in changes)]
        check_strategies(reduce(amended, changes, setup), make)
        write_setup(setup, folder.setup)
        write_branch(folder, Branch(str(of.path.resolve()), changes))
        watchers = [recorder_node(setup, folder)]
        ending = play_on(setup, of, folder, watchers=watchers, progress=progress, stop=stop, apart=apart)
        _conclude(setup, folder, ending, stop)
    with contextlib.suppress(ModuleNotFoundError):  # what a plot needs, `vrg run plot` says
        plot(setup, folder)
    return folder


def _as_played(of: RunFolder) -> CheckedMatch:
    """The match of a run, in the engine that it had: what its file leaves out may be another one on this machine."""
    recorded = read_setup(of.setup)
    # The clock tells the rate, at which nothing is paced here.
    return load_match(of.match_file, engine=recorded.engine).at_rate(recorded.rate)


def repeat_match(of: RunFolder, runs: Path, now: datetime, apart: Strategies | None, stop: StopSignal) -> RunFolder:
    """Play a recorded match again up to where it ended.

    Args:
        of: its run folder. runs: the folder for the new run folder. now: the local real time, for its name.
        apart: which strategies decide in processes of their own; None lets all decide in this process.
        stop: set it to break this off.

    Returns:
        the new run folder.

    Raises:
        ConfigError, LaunchError, JournalError: as `play_branch`.
    """
    last_instant(of)
    before = branch_of(of)
    setup = _as_played(of)
    folder = RunFolder.create(runs, setup.name, now)
    with _written(folder):
        keep(setup, folder)
        write_setup(setup, folder.setup)
        if before is not None:
            write_branch(folder, before)
        watchers = [recorder_node(setup, folder)] if of.recordings() else []
        try:
            ending = play_on(setup, of, folder, watchers=watchers, stop=stop, apart=apart, whole=True)
            _conclude(setup, folder, ending, stop)
        except GivenUpError as error:  # as the recorded match may have been
            write_result(setup, folder, None, f"given up: {error}")
    return folder


def play_on(
    setup: CheckedMatch,
    of: RunFolder,
    folder: RunFolder,
    *,
    watchers: Sequence[Node] = (),
    progress: Callable[[float], None] = lambda _: None,
    stop: StopSignal | None = None,
    apart: Strategies | None = None,
    limit: float = 3600.0,
    whole: bool = False,
) -> Ending:
    """Play a recorded match again in another run folder, with the changes that are written there.

    Up to the last change all is missed again that was missed in the recorded match, and there it is made sure that the
    referee has seen the same.

    Args:
        of: the run folder of the recorded match. watchers, stop, apart, limit: see `vrg.playing.in_process.play`.
        progress: called with the match time after each tick.
        whole: True repeats all of the recorded match, with the same changes, and ends where that has ended.

    Raises:
        ConfigError, LaunchError, JournalError: as `play_branch`.
    """
    changes, past = changes_in(folder), read_steps(of.steps)
    instant = math.inf if whole or not changes else changes[-1].time
    ended = next((line.time for line in reversed(past) if whole and isinstance(line, Ended)), math.inf)
    known, repeated = "" if instant == math.inf else _digest_before(of, instant), False

    def pace(time: float) -> bool:
        nonlocal repeated
        if not repeated and time >= instant - TINY:
            repeated = True
            if _digest_before(folder, instant) != known:
                raise LaunchError(
                    f"{of.path} cannot be repeated: up to {instant:.1f} s the referee saw something else this time. "
                    "Has a strategy or VRG changed since, or does a strategy read a clock, or draw without a seed? "
                    "`vrg run repeat` shows where"
                )
        progress(time)
        return (stop is None or not stop.is_set()) and time < ended - TINY

    with open_journal(setup, folder) as journal, StepLog(folder.steps) as steps:
        return in_process.play(
            setup, journal, watchers=watchers, limit=limit, pace=pace, stop=stop, logs=folder.logs, changes=changes,
            apart=apart, steps=steps, past=[line for line in past if line.time < instant - TINY], bank_from=instant,
        )  # fmt: skip


def _conclude(setup: MatchSetup, folder: RunFolder, ending: Ending, stop: StopSignal) -> None:
    """Write the result of a match, unless it was broken off."""
    if stop.is_set():
        raise LaunchError("broken off")
    state = ending.state
    write_result(setup, folder, state, ended_of(state) if state.stage is Stage.GAME_OVER else "interrupted")


@contextlib.contextmanager
def _written(folder: RunFolder) -> Iterator[None]:
    """Delete a run folder that cannot be made."""
    try:
        yield
    except (ConfigError, LaunchError, BrokenPipeError):  # `progress` may write for a reader that has gone
        delete(folder.path)
        raise
    except OSError as error:
        raise LaunchError(f"{folder.path}: cannot be written: {error.strerror}") from error


def _last_before(folder: RunFolder, time: float) -> Exhibit | None:
    """The last of what the referee has seen and done before a match time, s."""
    last = deque((e for e in read_evidence(folder.evidence) if e.tick.time < time - TINY), maxlen=1)
    return last[0] if last else None


def _digest_before(folder: RunFolder, time: float) -> str:
    """The digest of all that the referee has seen and done before a match time, s."""
    last = _last_before(folder, time)
    return last.digest if last else ""
