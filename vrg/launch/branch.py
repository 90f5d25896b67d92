"""Takes a recorded match up from one of its instants, with another strategy for one player.

A match in one process is the same, byte for byte, each time that it is played. So it is played again from its beginning
up to that instant, where it is made sure that the referee has seen the same, and from there on with the change.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
from msgspec import Struct

from vrg.bus.messages import RefereeState, Stage
from vrg.bus.stopping import StopSignal
from vrg.config.loading import check_strategies, load_match
from vrg.config.setup import MatchSetup, read_setup, write_setup
from vrg.coordinator.evidence import Exhibit, read_evidence
from vrg.errors import ConfigError, LaunchError
from vrg.games import file_of
from vrg.launch import in_process, nodes
from vrg.launch.in_process import Change
from vrg.launch.keeping import copy_into, files_of_strategy, keep, keep_layout
from vrg.launch.result import ended_of, plot, write_result
from vrg.launch.run_folder import RunFolder, delete, write_whole
from vrg.launch.step_log import Ended, StepLog, read_steps

if TYPE_CHECKING:
    from vrg.launch.stepping import Apart

_TINY = 1e-6
"""The match time in s below which two instants are the same."""


class Branch(Struct, frozen=True):
    """The origin of a match that was taken up from another one, as its run folder has it.

    Args:
        of: the path of the run folder with the recorded match.
        changes: what was changed, in the order of time.
    """

    of: str
    changes: list[Change]

    def __str__(self) -> str:
        parts = [f"from {change.time:.1f} s on {change.player} plays {change.name}" for change in self.changes]
        return ", ".join(parts)


def branch_of(folder: RunFolder) -> Branch | None:
    """The changes to the match of a run folder; None if it was played as its match file has it.

    Raises:
        LaunchError: the file that tells it is damaged.
    """
    try:
        return msgspec.json.decode(folder.branch.read_bytes(), type=Branch)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.MsgspecError) as error:
        raise LaunchError(f"{folder.branch}: cannot be read: {error}") from error


def last_instant(folder: RunFolder) -> float:
    """The match time, s, up to which a match can be taken up.

    Raises:
        LaunchError: it was played as processes, or holds no evidence.
        JournalError: the evidence is damaged.
    """
    if folder.events.exists():
        raise LaunchError(
            f"{folder.path}: expected a match that was played in one process, with `vrg play --in-process`: in one of "
            "several processes it is not known at which instant each of them heard what, so it cannot be repeated"
        )
    last = _last_before(folder, math.inf)
    if last is None:
        raise LaunchError(f"{folder.evidence}: expected what the referee decided by, found nothing")
    return last.tick.time


def play_branch(
    of: RunFolder,
    change: Change,
    runs: Path,
    now: datetime,
    *,
    progress: Callable[[float], None],
    stop: StopSignal,
) -> RunFolder:
    """Play a recorded match again up to an instant, and on from there with a change.

    Args:
        of: its run folder. runs: the folder for the new run folder. now: the local real time, for its name.
        progress: called with the match time now and then.
        stop: set it to break this off.

    Returns:
        the new run folder, with everything that any run leaves.

    Raises:
        ConfigError: the player or the strategy does not exist.
        LaunchError: the match cannot be repeated, or this was broken off.
        JournalError: its evidence is damaged.
        BrokenPipeError: `progress` has raised it.
    """
    end = last_instant(of)
    if not 0.0 <= change.time <= end:
        raise LaunchError(f"expected an instant from 0 to {end:.1f} s of match time, got {change.time:g}")
    before = branch_of(of)
    earlier = before.changes if before is not None else []
    if before is not None and change.time < earlier[-1].time:
        raise LaunchError(
            f"{of.path} was itself taken up at {earlier[-1].time:.1f} s: expected a later instant, got "
            f"{change.time:g}; an earlier one is in {before.of}"
        )
    setup = load_match(of.match_file).at_rate(0.0)
    check_strategies(setup.substituted(change.player, change.strategy), nodes.strategy_of)
    folder = RunFolder.create(runs, setup.name, now, setup.text)
    try:
        keep(setup, folder)
        keep_layout(setup, folder)
        change = _kept(change, folder)
        changes = [*earlier, change]
        check_strategies(setup.substituted(change.player, change.strategy), nodes.strategy_of)
        write_setup(setup, folder.setup)
        write_whole(folder.branch, msgspec.json.encode(Branch(str(of.path.resolve()), changes)))
        state = _play(setup, of, folder, changes, progress, stop)
    except (ConfigError, LaunchError, BrokenPipeError):  # `progress` may write for a reader that has gone
        delete(folder.path)
        raise
    except OSError as error:
        raise LaunchError(f"{folder.path}: cannot be written: {error.strerror}") from error
    write_result(setup, folder, state, ended_of(state) if state.stage is Stage.GAME_OVER else "interrupted")
    plot(setup, folder)
    return folder


def repeat_match(of: RunFolder, runs: Path, now: datetime, apart: "Apart | None", stop: StopSignal) -> RunFolder:
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
    # The clock tells the rate, at which nothing is paced here.
    setup = load_match(of.match_file).at_rate(read_setup(of.setup).rate)
    folder = RunFolder.create(runs, setup.name, now, setup.text)
    try:
        _repeat(of, setup, folder, before, apart, stop)
    except (ConfigError, LaunchError):
        delete(folder.path)
        raise
    except OSError as error:
        raise LaunchError(f"{folder.path}: cannot be written: {error.strerror}") from error
    return folder


def _repeat(
    of: RunFolder, setup: MatchSetup, folder: RunFolder, before: Branch | None, apart: "Apart | None", stop: StopSignal
) -> None:
    """Play a match again in a run folder of its own; see `repeat_match`."""
    keep(setup, folder)
    write_setup(setup, folder.setup)
    steps = read_steps(of.steps)
    ended = next((line.time for line in reversed(steps) if isinstance(line, Ended)), None)
    if before is not None:
        write_whole(folder.branch, msgspec.json.encode(before))

    def pace(time: float) -> bool:
        return not stop.is_set() and (ended is None or time < ended - _TINY)

    with nodes.open_journal(setup, folder) as journal, StepLog(folder.steps) as log:
        ending = in_process.play(
            setup, journal, watchers=[nodes.recorder_node(setup, folder)] if of.recordings() else [], pace=pace,
            stop=stop, logs=folder.logs, changes=before.changes if before is not None else [], apart=apart,
            steps=log, past=steps,
        )  # fmt: skip
    if stop.is_set():
        raise LaunchError("broken off")
    state = ending.state
    write_result(setup, folder, state, ended_of(state) if state.stage is Stage.GAME_OVER else "interrupted")


def _play(
    setup: MatchSetup,
    of: RunFolder,
    folder: RunFolder,
    changes: Sequence[Change],
    progress: Callable[[float], None],
    stop: StopSignal,
) -> RefereeState:
    instant = changes[-1].time
    known = _digest_before(of, instant)
    repeated = False

    def pace(time: float) -> bool:
        nonlocal repeated
        if not repeated and time >= instant - _TINY:
            repeated = True
            if _digest_before(folder, instant) != known:
                raise LaunchError(
                    f"{of.path} cannot be repeated: up to {instant:.1f} s the referee saw something else this time. "
                    "Was a strategy or VRG changed since, or did somebody halt it or drive by hand?"
                )
        progress(time)
        return not stop.is_set()

    with nodes.open_journal(setup, folder) as journal, StepLog(folder.steps) as steps:
        recorder = nodes.recorder_node(setup, folder)
        ending = in_process.play(
            setup, journal, watchers=[recorder], pace=pace, stop=stop, logs=folder.logs, changes=changes,
            steps=steps, past=[line for line in read_steps(of.steps) if line.time < instant - _TINY],
        )  # fmt: skip
    if stop.is_set():
        raise LaunchError("broken off")
    return ending.state


def _last_before(folder: RunFolder, time: float) -> Exhibit | None:
    """The last of what the referee has seen and done before a match time, s."""
    last = deque((e for e in read_evidence(folder.evidence) if e.tick.time < time - _TINY), maxlen=1)
    return last[0] if last else None


def _digest_before(folder: RunFolder, time: float) -> str:
    """The digest of all that the referee has seen and done before a match time, s."""
    last = _last_before(folder, time)
    return last.digest if last else ""


def _kept(change: Change, folder: RunFolder) -> Change:
    """The change, with a strategy that is a file as a copy of it in the run folder."""
    target, copies = files_of_strategy(change.strategy, Path("substitute"))
    copy_into(folder, copies)
    if copies and (file := file_of(target)) is not None:
        target = f"{(folder.path / file).resolve()}{target.removeprefix(file)}"
    return Change(change.time, change.player, target)
