"""The commands `vrg run diff`, which finds where two runs of one match parted, and `vrg run repeat`."""

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrg.commands.matches import ended_run
from vrg.commands.options import RunArgument, RunsOption, SealedOption, echo

if TYPE_CHECKING:
    from vrg.runs.run_folder import RunFolder


def diff(
    there: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
    here: Annotated[Path, typer.Argument(metavar="RUN", help="A second run of the same match.")],
) -> None:
    """Find where two runs of one match diverge: the first step, which node published something else in it, and what.

    The exit status is 1 if they differ. Matches in one process and in lockstep store digests for this once a second;
    recordings show the rest. Differences between the computers that played them are printed first.
    """
    if not _compare(ended_run(there)[0], ended_run(here)[0]):
        raise typer.Exit(1)


def repeat(
    run: RunArgument = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Let each strategy decide in a process of its own.")
    ] = False,
    runs: RunsOption = Path("runs"),
    sandbox: SealedOption = True,
) -> None:
    """Play a match again that was played in one process or in lockstep, and check whether it is the same.

    Players miss again what they missed then because they did not answer in time or were killed. The exit status is 1
    if the two runs differ.
    """
    from vrg.bus.stopping import stop_on_signals
    from vrg.playing.branch import repeat_match
    from vrg.playing.match import strangers

    folder, _ = ended_run(run, runs)

    def announce(text: str) -> None:
        echo(text, err=True)

    with strangers(folder, sandbox=sandbox, lockstep=lockstep, announce=announce) as apart, stop_on_signals() as stop:
        again = repeat_match(folder, runs, datetime.now(), apart, stop)
    echo(f"Played again in {again.path}.")
    if not _compare(folder, again):
        raise typer.Exit(1)


def _compare(there: "RunFolder", here: "RunFolder") -> bool:
    """Print what computed two runs where that differs, and whether they are the same, or where they parted.

    Returns:
        whether they are the same.

    Raises:
        LaunchError: a file cannot be read. JournalError: a journal is damaged.
    """
    from vrg.runs.differences import differences

    same, start = True, "The same"
    for found in differences(there, here):
        echo(found.text)
        same &= not found.differs
        start = "Nevertheless the same" if found.explains else start
    if same:
        echo(f"{start}: the journals and everything else that was compared do not differ.")
    return same
