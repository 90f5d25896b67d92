"""The commands `vrg run list`, `result`, `plot` and `judge`, on matches that were recorded."""

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vrg.bus.messages import Stage
from vrg.commands.matches import ended_run, is_running, need_recording, played_at, run_folders
from vrg.commands.options import JsonOption, RunArgument, echo, make_console, print_table
from vrg.config.rules import rulebook_of
from vrg.coordinator.journal import read_standing
from vrg.coordinator.match import state_after
from vrg.errors import LaunchError
from vrg.files import read_text, toml_of, write_json
from vrg.runs import result as results
from vrg.runs.run_folder import RunFolder

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Listed:
    """A run in a list.

    Args:
        run: the name of its folder. game: empty if it cannot be read.
        began: when, in local time with its offset from UTC, as ISO 8601.
        ended: how the match ended, in a few words. duration: of play, s of match time; None if that is not known.
    """

    run: str
    game: str
    began: str
    ended: str
    duration: float | None


def list_runs(
    runs: Annotated[Path, typer.Argument(metavar="[FOLDER]", help="Folder of the run folders.")] = Path("runs"),
    as_json: JsonOption = False,
) -> None:
    """List the runs in a folder, the newest first: game, when, how the match ended, and how long play took."""
    found = list(listed(runs))
    if as_json:
        typer.echo(json.dumps([asdict(run) for run in found], indent=2))
        return
    if not found:
        echo(f"{runs}: no runs; `vrg play` makes one")
        return
    rows = [
        (run.run, run.game, run.began.replace("T", " ")[:16], run.ended, "" if run.duration is None else _clock(run))
        for run in found
    ]
    print_table(make_console(), ("run", "game", "began", "ended", "play"), rows, right=(4,))


def _clock(run: Listed) -> str:
    minutes, seconds = divmod(round(run.duration or 0.0), 60)
    return f"{minutes}:{seconds:02d}"


def listed(runs: Path) -> Iterator[Listed]:
    """The runs in a folder. One that disappears or is torn while it is read is passed by, or listed in part."""
    for path in run_folders(runs):
        with suppress(OSError):
            yield _listed(RunFolder(path))


def _listed(folder: RunFolder) -> Listed:
    began = datetime.fromtimestamp(played_at(folder.path)).astimezone().isoformat(timespec="seconds")
    table: dict[str, Any] = {}
    with suppress(OSError, ValueError):
        table = toml_of(read_text(folder.match_file))
    game = str(table.get("game", ""))
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError):
        result = results.read_result(folder)
        played = result["play_time"]
        seconds = float(played) if played is not None else None
        return Listed(folder.path.name, str(result["game"]), began, results.headline(result), seconds)
    ended = "result.json is damaged" if folder.result.exists() else "never ended"
    ended = "still running" if is_running(folder.path) else f"{ended}: `vrg run result` makes its result"
    return Listed(folder.path.name, game, began, ended, None)


def result(run: RunArgument = None) -> None:
    """Make result.json from the journal of a run, and print how the match ended."""
    folder, setup = ended_run(run)
    standing = read_standing(folder.journal)
    if standing is None:
        raise LaunchError(f"{folder.journal}: nothing was decided in this match")
    state = state_after(rulebook_of(setup), standing)
    over = state.stage is Stage.GAME_OVER
    ended = results.ended_of(state) if over else "broken off: `vrg play` ended before the match, or did not start it"
    with suppress(OSError, ValueError, KeyError):
        ended = ended if over else str(results.read_result(folder)["ended"])  # the journal does not tell why
    if not over and ended == "game over":
        what = f"{folder.result} records the end of the match, which {folder.journal.name} has lost: it is kept"
        raise LaunchError(f"{what}. To make a result from what is left, remove it first")
    found = results.result_of(setup, folder, state, ended)
    try:
        write_json(folder.result, found)
    except OSError as error:
        raise LaunchError(f"{folder.result}: cannot be written: {error.strerror}") from None
    echo(f"{results.conclusion(found)}{results.summary(found)}")
    if found["stops"]["sentence"]:
        echo(found["stops"]["sentence"])
    echo(f"Written to {folder.result}.")


def plot(run: RunArgument = None) -> None:
    """Draw the trajectories of a run from its recording."""
    folder, setup = ended_run(run)
    need_recording(folder)
    try:
        torn = results.plot(setup, folder)
    except (OSError, ValueError) as error:
        raise LaunchError(f"{folder.path}: cannot be plotted: {error}") from None
    for part in torn:
        echo(f"{part.name} ends in the middle, or is damaged: what it lacks is not drawn.")
    echo(f"Written to {folder.plot}.")


def judge(run: RunArgument = None) -> None:
    """Let the rule book judge a run again, and print where the referee's calls or the recording disagree with it.

    The exit status is 1 if there is a disagreement.
    """
    from vrg.runs.judged import judge_folder

    found = judge_folder(*ended_run(run))
    for line in (*found.notes, *map(str, found.disagreements), found.sentence):
        echo(line)
    if found.disagreements:
        raise typer.Exit(1)
