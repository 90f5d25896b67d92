"""The commands `vrg result` and `vrg plot`, which make what a launcher that was killed could not make any more."""

from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.messages import Stage
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup, read_setup
from vrg.coordinator.journal import read_standing
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Field
from vrg.errors import LaunchError
from vrg.launch import result as results
from vrg.launch import running
from vrg.launch.run_folder import RunFolder

RunArgument = Annotated[Path, typer.Argument(metavar="RUN", help="Run folder, such as runs/courtyard-20261120-234416.")]


def result(run: RunArgument) -> None:
    """Make result.json from the journal of a run, and print how the match ended."""
    folder, setup = ended_run(run)
    standing = read_standing(folder.journal)
    if standing is None:
        raise LaunchError(f"{folder.journal}: nothing was decided in this match")
    state = Match(rulebook_of(setup), standing).state(Field({}), estop=False)
    over = state.stage is Stage.GAME_OVER
    ended = results.ended_of(state) if over else "broken off: its launcher ended before the match"
    found = results.write_result(setup, folder, state, ended)
    typer.echo(f"{results.conclusion(found)}{results.summary(found)}")
    if found["stops"]["sentence"]:
        typer.echo(found["stops"]["sentence"])
    typer.echo(f"Written to {folder.result}.")


def plot(run: RunArgument) -> None:
    """Draw the trajectories of a run from its recording."""
    folder, setup = ended_run(run)
    if not folder.recordings():
        raise LaunchError(f"{folder.path}: expected a recording (recording.mcap), found none: was --no-record given?")
    try:
        results.plot(setup, folder)
    except (OSError, ValueError) as error:
        raise LaunchError(f"{folder.path}: cannot be plotted: {error}") from None
    typer.echo(f"Written to {folder.plot}.")


def ended_run(run: Path) -> tuple[RunFolder, MatchSetup]:
    """A run folder whose match does not run any more, and the set-up of the match.

    Raises:
        LaunchError: it is no run folder, or its match runs.
    """
    found = run_of(run)
    if any(Path(match.run) == run.resolve() for match in running.running()):
        raise LaunchError(f"{run}: this match still runs: ask again when it has ended")
    return found


def run_of(run: Path) -> tuple[RunFolder, MatchSetup]:
    """A run folder, and the set-up of its match, which may still run.

    Raises:
        LaunchError: it is no run folder.
    """
    folder = RunFolder(run)
    if not folder.setup.is_file():
        raise LaunchError(f"{run}: expected a run folder with a {folder.setup.name}, found none")
    return folder, read_setup(folder.setup)
