"""Finds out why the referee made a call, from what a run has left: the journal and the evidence."""

from pathlib import Path
from typing import Any, Final

from vrg.bus.messages import Call, Stage
from vrg.config.setup import MatchSetup, read_setup
from vrg.coordinator.evidence import book_at, read_evidence
from vrg.coordinator.journal import Record, read_journal
from vrg.coordinator.judging import cases_of, seconds_before
from vrg.coordinator.proof import Case
from vrg.coordinator.rulebook import Observation, RuleBook
from vrg.errors import LaunchError
from vrg.games import game_of
from vrg.runs.change import books_of
from vrg.runs.reasons import measures_of
from vrg.runs.run_folder import RunFolder
from vrg.types import Pose
from vrg.ui.plots.proof import SECONDS, STRIP, Proof, box_around
from vrg.ui.scene import Scene, SceneBody, clock_text, objects_of

_NEAR: Final = 0.25
"""The difference between the match time of a picture and the wanted one that is allowed, s."""


def explain(run: Path, number: int) -> Proof:
    """Everything that is known of a call.

    Args:
        run: the run folder. number: of the call.

    Raises:
        LaunchError: there is no such run, or no such call. VrgError: its files cannot be read.
    """
    folder = RunFolder(run)
    if not folder.setup.is_file():
        raise LaunchError(f"{run}: expected a run folder with a {folder.setup.name}, found none")
    setup = read_setup(folder.setup)
    _, records = read_journal(folder.journal)
    known = [(record, call) for record in records for call in record.calls]
    record, call = next(((r, c) for r, c in known if c.number == number), (None, None))
    if record is None or call is None:
        wanted = f"a call from 1 to {known[-1][1].number}" if known else "a run with calls"
        raise LaunchError(f"{run}: expected {wanted}, got {number}")
    game = game_of(setup.game)
    heading = (
        f"Call {number}, {call.rule}, {clock_text(call.clock)} of play, match time {record.time:.1f} s: {call.text}"
    )
    text = game.rule_text(call.rule)
    lines = [] if text is None else [f"Rule{f' ({text.source})' if text.source else ''}: {text.words}"]
    places = [f"{name} at ({pose.x:.2f}, {pose.y:.2f})" for name, pose in zip(call.players, call.poses, strict=False)]
    lines += [f"Where {'they were' if places[1:] else 'it was'}: {', '.join(places)}."] if places else []
    try:
        return _proof(setup, folder, records, call, heading, lines)
    except Exception as error:  # the rules of any game, on numbers and names that anybody may have changed
        why = f"the rules cannot continue from the evidence: {type(error).__name__}: {error}"
        return Proof(heading, (*lines, f"There is no more to show: {why}."))


def _proof(
    setup: MatchSetup, folder: RunFolder, records: list[Record], call: Call, heading: str, lines: list[str]
) -> Proof:
    """What the evidence shows of a call; of a run that somebody has changed this may raise anything."""
    book, later = books_of(setup, folder)
    cases = cases_of(book, read_evidence(folder.evidence), records, later)
    case = next((c for c in cases if c.call == call), None)
    if case is None:
        return Proof(heading, (*lines, f"There is no more to show: {folder.evidence.name} does not reach this call."))
    book = book_at(case.now.time, book, later)
    measures = measures_of(setup, book, case)
    lines = [*lines, *(f"{measure}." for measure in measures)]
    if not call.poses:
        return Proof(heading, tuple(lines))
    looks = seconds_before(read_evidence(folder.evidence), case, SECONDS)
    named = call.players[: len(call.poses)]
    points = [(pose.x, pose.y) for pose in call.poses]
    points += [(f.poses[name].x, f.poses[name].y) for f in looks for name in named if name in f.poses]
    return Proof(
        heading=heading,
        lines=tuple(lines),
        now=_scene(setup, book, case, case.now, looks, dict(zip(named, call.poses, strict=False))),
        box=box_around(points, measures),
        measures=measures,
        earlier=tuple((before, _earlier(setup, book, case, looks, before)) for before in STRIP),
    )


def _earlier(
    setup: MatchSetup, book: RuleBook[Any], case: Case, looks: list[Observation], before: float
) -> Scene | None:
    wanted = case.now.time - before
    then = min(looks, key=lambda field: abs(field.time - wanted), default=None)
    if then is None or abs(then.time - wanted) > _NEAR:
        return None
    return _scene(setup, book, case, then, [], {})


def _scene(
    setup: MatchSetup,
    book: RuleBook[Any],
    case: Case,
    field: Observation,
    before: list[Observation],
    called: dict[str, Pose],
) -> Scene:
    """The field at an instant about a call; the players of the call stand where they were called."""
    statuses = {status.name: status for status in book.statuses(case.state, Stage.PLAY_ROUND, field)}
    game, bodies = game_of(setup.game), []
    for player in setup.players:
        pose = called.get(player.name) or field.poses.get(player.name)
        if pose is None:
            continue
        status, (length, width) = statuses[player.name], player.robot.size
        trail = tuple((f.poses[player.name].x, f.poses[player.name].y) for f in before if player.name in f.poses)
        bodies.append(
            SceneBody(
                name=player.name,
                pose=pose,
                length=length,
                width=width,
                role=status.role,
                state=status.state,
                physical=player.name in setup.physical,
                trail=trail,
                out_of_play=game.is_out(status.state),
            )
        )
    return Scene(
        live=True, time=field.time, game=setup.game, bodies=tuple(bodies), zones=tuple(book.zones(case.state)),
        obstacles=tuple(setup.obstacles), objects=objects_of(book.objects(case.state, field), field.poses, {}),
    )  # fmt: skip
