"""The command `vrg run why`, which shows why the referee made a call."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from vrg.commands.matches import run_of
from vrg.commands.options import JsonOption, RunArgument, echo
from vrg.errors import LaunchError

if TYPE_CHECKING:
    from vrg.bus.messages import Call
    from vrg.ui.plots.proof import Proof


def why(
    run: RunArgument = None,
    call: Annotated[int | None, typer.Option("--call", help="Number of the call; without it, list them.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show why the referee made a call: the rule, who and where, the number that decided, and a picture to scale."""
    from vrg.coordinator.journal import read_journal

    folder, _ = run_of(run)
    _, records = read_journal(folder.journal)
    calls = {made.number: made for record in records for made in record.calls}
    if call is None:
        if as_json:
            typer.echo(msgspec.json.encode(list(calls.values())))
            return
        for made in calls.values():
            echo(f"{made.number:4d}  {_clock(made)}  {made.rule}: {made.text}")
        return
    from vrg.runs.explaining import explain

    proof = explain(folder.path, call)
    picture = None if proof.now is None else folder.explanation(call)
    if picture is not None:
        _draw(proof, picture)
    if as_json:
        known = {"heading": proof.heading, "lines": proof.lines, "picture": None if picture is None else str(picture)}
        typer.echo(msgspec.json.encode(known))
        return
    for line in (proof.heading, *proof.lines):
        echo(line)
    if picture is not None:
        echo(f"Drawn in {picture}.")


def _draw(proof: "Proof", path: Path) -> None:
    """Write the picture of a proof to a file.

    Raises:
        LaunchError: it cannot be written.
    """
    from vrg.ui.plots.proof import SIZE, ProofPainter
    from vrg.ui.window.text import Fonts
    from vrg.ui.window.window import save_png

    try:
        save_png(ProofPainter(Fonts()).picture(proof, SIZE, 1.0), path)
    except OSError as error:
        raise LaunchError(str(error)) from None


def _clock(call: "Call") -> str:
    from vrg.ui.scene import clock_text

    return clock_text(call.clock)
