"""The command `vrg why`, which shows why the referee made a call."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from vrg.commands.after import RunArgument, ended_run
from vrg.errors import LaunchError
from vrg.games import game_of

if TYPE_CHECKING:
    from vrg.bus.messages import Call
    from vrg.config.setup import MatchSetup
    from vrg.coordinator.journal import Record
    from vrg.coordinator.proof import Case
    from vrg.coordinator.rulebook import RuleBook
    from vrg.launch.run_folder import RunFolder
    from vrg.ui.proof import Scenery


def why(
    run: RunArgument,
    call: Annotated[
        int | None, typer.Argument(metavar="CALL", help="Number of the call; without it, list them.")
    ] = None,
) -> None:
    """Show why the referee made a call: the rule, who and where, the number that decided, and a picture to scale."""
    from vrg.coordinator.journal import read_journal

    folder, setup = ended_run(run)
    _, records = read_journal(folder.journal)
    calls = {made.number: made for record in records for made in record.calls}
    if call is None:
        for made in calls.values():
            typer.echo(f"{made.number:4d}  {_clock(made)}  {made.rule}: {made.text}")
        return
    if call not in calls:
        known = f"a call from 1 to {max(calls)}" if calls else "a run with calls"
        raise LaunchError(f"{run}: expected {known}, got {call}")
    _tell(setup, folder, records, calls[call])


def _clock(call: "Call") -> str:
    from vrg.ui.scene import clock_text

    return clock_text(call.clock)


def _tell(setup: "MatchSetup", folder: "RunFolder", records: "list[Record]", call: "Call") -> None:
    """Print all that is known of a call, and draw it."""
    from vrg.config.rules import rulebook_of
    from vrg.coordinator.cases import cases_of, seconds_before
    from vrg.coordinator.evidence import read_evidence
    from vrg.ui.proof import SECONDS, draw_proof

    record = next(record for record in records if call in record.calls)
    typer.echo(f"Call {call.number}, {call.rule}, {_clock(call)} of play, match time {record.time:.1f} s: {call.text}")
    game = game_of(setup.game)
    text = game.rule_text(call.rule)
    if text is not None:
        typer.echo(f"Rule{f' ({text.source})' if text.source else ''}: {text.words}")
    for name, pose in zip(call.players, call.poses, strict=False):
        typer.echo(f"{name} was at ({pose.x:.2f}, {pose.y:.2f}).")
    book = rulebook_of(setup)
    exhibits = read_evidence(folder.evidence) if folder.evidence.is_file() else []
    case = next((case for case in cases_of(book, exhibits, records) if case.call == call), None)
    if case is None:
        typer.echo(f"There is no more to show: {folder.evidence.name} does not reach this call.")
        return
    prover = game.load_prover()
    measures = [] if prover is None else list(prover(book, case))
    for measure in measures:
        typer.echo(f"  {measure}")
    if not call.poses:
        return
    picture = folder.path / f"why-{call.number}.png"
    title = f"Call {call.number}, {_clock(call)}: {call.text}"
    try:
        draw_proof(picture, case, measures, _scenery(setup, book, case), seconds_before(exhibits, case, SECONDS), title)
    except OSError as error:
        raise LaunchError(f"{picture}: cannot be written: {error.strerror}") from error
    typer.echo(f"Drawn in {picture}.")


def _scenery(setup: "MatchSetup", book: "RuleBook[Any]", case: "Case") -> "Scenery":
    """What the picture is drawn on: the field as it was at the call."""
    from vrg.bus.messages import Stage
    from vrg.ui.proof import Scenery

    return Scenery(
        game_of(setup.game),
        book.statuses(case.state, Stage.PLAY_ROUND, case.now),
        {player.name: player.robot.size for player in setup.players},
        book.zones(case.state),
        setup.obstacles,
    )
