"""The command `vrg judge`, which lets the rule book judge a run again."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from vrg.commands.after import RunArgument, ended_run
from vrg.errors import LaunchError

if TYPE_CHECKING:
    from vrg.coordinator.judging import Disagreement, Judgement
    from vrg.launch.run_folder import RunFolder


def judge(run: RunArgument) -> None:
    """Let the rule book judge a run again, and say where the referee's calls or the recording disagree with it.

    The exit status is 1 if there is a disagreement.
    """
    from vrg.launch.judged import judge_run

    folder, setup = ended_run(run)
    if not folder.evidence.is_file():
        raise LaunchError(f"{run}: expected {folder.evidence.name}, found none: an earlier VRG has played this match")
    judgement, wrong = judge_run(setup, folder)
    seen, compared = _recorded(folder)
    found = sorted([*wrong, *seen], key=lambda d: d.time)
    for disagreement in found:
        typer.echo(str(disagreement))
    typer.echo(_sentence(judgement, len(found), compared))
    if found:
        raise typer.Exit(1)


def _recorded(folder: "RunFolder") -> "tuple[list[Disagreement], int]":
    """Where the recording, if there is one, shows something else than the referee saw; and how much was compared."""
    from vrg.coordinator.evidence import read_evidence
    from vrg.launch.crosscheck import cross_check
    from vrg.recording.reader import read_tracks

    parts = folder.recordings()
    if not parts:
        return [], 0
    torn: list[Path] = []
    try:
        found = cross_check(list(read_tracks(parts, torn).values()), read_evidence(folder.evidence))
    except OSError as error:
        raise LaunchError(f"{folder.path}: its recording cannot be read: {error}") from None
    for part in torn:
        typer.echo(f"{part.name} ends in the middle: what it lacks was not compared.")
    return found


def _sentence(judgement: "Judgement", wrong: int, compared: int) -> str:
    """What came of it, in a sentence or two.

    Args:
        wrong: the number of disagreements. compared: the number of poses of the recording that were compared.
    """
    text = (
        f"{judgement.calls} calls were judged again, by {judgement.ticks} looks at the field; "
        f"{compared} recorded poses were compared: "
    )
    text += "no disagreement." if not wrong else f"{wrong} disagreement{'s' if wrong > 1 else ''}."
    if judgement.unjudged:
        text += f" The evidence ends early: {judgement.unjudged} further calls could not be judged."
    return text
