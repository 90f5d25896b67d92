"""The commands `vrg run diff`, which finds where two runs of one match parted, and `vrg run repeat`."""

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrg.commands.matches import ended_run
from vrg.commands.options import RunArgument, RunsOption, SealedOption, echo
from vrg.errors import LaunchError
from vrg.files import read_bytes

if TYPE_CHECKING:
    from vrg.runs.run_folder import RunFolder


def diff(
    there: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
    here: Annotated[Path, typer.Argument(metavar="RUN", help="Another one, of the same match.")],
) -> None:
    """Find where two runs of one match parted: the first step, which node published something else in it, and what.

    The exit status is 1 if they differ. Matches in one process and in lockstep have digests for this once a second;
    recordings tell the rest.
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
    """Play a match again that was played in one process or in lockstep, and find out whether it is the same.

    What players missed then, as they did not answer in time or were killed, they miss again. The exit status is 1 if
    the two runs differ.
    """
    from vrg.bus.stopping import stop_on_signals
    from vrg.launch.playing import strangers
    from vrg.runs.branch import repeat_match

    folder, _ = ended_run(run)

    def announce(text: str) -> None:
        echo(text, err=True)

    with strangers(folder, sandbox=sandbox, lockstep=lockstep, announce=announce) as apart, stop_on_signals() as stop:
        again = repeat_match(folder, runs, datetime.now(), apart, stop)
    echo(f"Played again in {again.path}.")
    if not _compare(folder, again):
        raise typer.Exit(1)


def _compare(there: "RunFolder", here: "RunFolder") -> bool:
    """Print whether two runs are the same, or where they parted; whether they are the same.

    Raises:
        LaunchError: a file cannot be read. JournalError: a journal is damaged.
    """
    from vrg.recording.difference import first_difference
    from vrg.runs.step_log import parted, read_steps

    found = False
    for file in (there.match_file, here.match_file, there.journal, here.journal):
        if not file.is_file():
            raise LaunchError(f"{file}: no such file: expected a run folder with all its files")
    if _content(there.match_file) != _content(here.match_file):
        echo(f"The match files differ: {there.match_file}, {here.match_file}")
        found = True
    step = parted(read_steps(there.steps), read_steps(here.steps))
    if step is not None:
        echo(f"Digests: the first that differ are those of {step[0]:.2f} s, of {', '.join(step[1])}.")
        found = True
    line = _journal_line(there.journal, here.journal)
    if line is not None:
        echo(f"Journals: the first lines that differ are {line[0]}, at {line[1]:.2f} s.")
        found = True
    if there.recordings() and here.recordings():
        torn: list[Path] = []
        try:
            difference = first_difference(there.recordings(), here.recordings(), torn)
        except OSError as error:
            raise LaunchError(f"a recording cannot be read: {error}") from None
        for part in torn:
            echo(f"{part} ends in the middle, or is damaged: it was compared as far as it goes.")
        if difference is not None:
            echo(f"Recordings: {difference}.")
            found = True
    if not found:
        echo("The same: journals and all else that was compared do not differ.")
    return not found


def _journal_line(there: Path, here: Path) -> tuple[int, float] | None:
    """The number of the first line in which two journals differ, and its match time in s; None if there is none."""
    from vrg.coordinator.journal import read_journal

    if _content(there) == _content(here):
        return None
    (header, one), (other_header, other) = read_journal(there), read_journal(here)
    if header != other_header:
        return 1, 0.0
    for number, (a, b) in enumerate(zip(one, other, strict=False), 2):
        if a != b:
            return number, min(a.time, b.time)
    longer = max(one, other, key=len)
    least = min(len(one), len(other))
    return least + 2, longer[least].time if least < len(longer) else 0.0


def _content(file: Path) -> bytes:
    """The content of a file of a run.

    Raises:
        LaunchError: it cannot be read.
    """
    try:
        return read_bytes(file)
    except OSError as error:
        raise LaunchError(f"{file}: cannot be read: {error.strerror}") from None
