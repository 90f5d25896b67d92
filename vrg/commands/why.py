"""The command `vrg run why`, which shows why the referee made a call."""

from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer
from msgspec import Struct

from vrg.commands.matches import run_of
from vrg.commands.options import JsonOption, RunArgument
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


class Explanation(Struct, frozen=True):
    """Why a call was made.

    Args:
        heading: the call. lines: what is known of it, in sentences.
        picture: the path of the file with the picture; None if there is none.
    """

    heading: str
    lines: list[str]
    picture: str | None = None


def why(
    run: RunArgument = None,
    call: Annotated[int | None, typer.Option("--call", help="Number of the call; without it, list them.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show why the referee made a call: the rule, who and where, the number that decided, and a picture to scale."""
    from vrg.coordinator.journal import read_journal

    folder, setup = run_of(run)
    _, records = read_journal(folder.journal)
    calls = {made.number: made for record in records for made in record.calls}
    if call is None:
        if as_json:
            typer.echo(msgspec.json.encode(list(calls.values())))
            return
        for made in calls.values():
            typer.echo(f"{made.number:4d}  {_clock(made)}  {made.rule}: {made.text}")
        return
    if call not in calls:
        known = f"a call from 1 to {max(calls)}" if calls else "a run with calls"
        raise LaunchError(f"{folder.path}: expected {known}, got {call}")
    found = explain(setup, folder, records, calls[call])
    if as_json:
        typer.echo(msgspec.json.encode(found))
        return
    for line in (found.heading, *found.lines):
        typer.echo(line)
    if found.picture is not None:
        typer.echo(f"Drawn in {found.picture}.")


def _clock(call: "Call") -> str:
    from vrg.ui.scene import clock_text

    return clock_text(call.clock)


def explain(setup: "MatchSetup", folder: "RunFolder", records: "list[Record]", call: "Call") -> Explanation:
    """Find out all that is known of a call, and draw it into the run folder.

    Raises:
        LaunchError: the picture cannot be written.
    """
    from vrg.config.rules import rulebook_of
    from vrg.coordinator.cases import cases_of, seconds_before
    from vrg.coordinator.evidence import read_evidence
    from vrg.ui.proof import SECONDS, draw_proof

    record = next(record for record in records if call in record.calls)
    heading = f"Call {call.number}, {call.rule}, {_clock(call)} of play, match time {record.time:.1f} s: {call.text}"
    game = game_of(setup.game)
    text = game.rule_text(call.rule)
    lines = [] if text is None else [f"Rule{f' ({text.source})' if text.source else ''}: {text.words}"]
    places = [f"{name} at ({pose.x:.2f}, {pose.y:.2f})" for name, pose in zip(call.players, call.poses, strict=False)]
    lines += [f"Where it was: {', '.join(places)}."] if places else []
    book = rulebook_of(setup)
    cases = cases_of(book, read_evidence(folder.evidence), records)
    case = next((case for case in cases if case.call == call), None)
    if case is None:
        return Explanation(
            heading, [*lines, f"There is no more to show: {folder.evidence.name} does not reach this call."]
        )
    prover = game.load_prover()
    measures = [] if prover is None else list(prover(book, case))
    lines += [f"{measure}." for measure in measures]
    if not call.poses:
        return Explanation(heading, lines)
    picture = folder.explanation(call.number)
    title = f"Call {call.number}, {_clock(call)}: {call.text}"
    fields = seconds_before(read_evidence(folder.evidence), case, SECONDS)
    try:
        draw_proof(picture, case, measures, _scenery(setup, book, case), fields, title)
    except OSError as error:
        raise LaunchError(f"{picture}: cannot be written: {error.strerror}") from error
    return Explanation(heading, lines, str(picture))


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
