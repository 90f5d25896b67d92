"""Why calls were made: of every call of whole matches the deciding numbers hold, and they are drawn to scale."""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import pygame
import pytest
from click.testing import Result
from msgspec import structs

from tests.games.roboflag.playing import four_each, match_text
from tests.ui.test_explaining import worked_out
from vrg.bus.messages import Call
from vrg.config.loading import load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup, write_setup
from vrg.coordinator.evidence import Exhibit, read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.judging import cases_of, judge_again, refuted
from vrg.coordinator.proof import Case, Measure, Relation, with_deviation
from vrg.coordinator.rulebook import Observation
from vrg.games import game_of
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import play
from vrg.runs.explaining import explain
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.types import Pose, Uncertainty
from vrg.ui import palette
from vrg.ui.window.card import CardPainter
from vrg.ui.window.explaining import Explainer
from vrg.ui.window.text import Fonts

Runs = Mapping[str, tuple[MatchSetup, RunFolder]]
SHARKS = "sharks-and-minnows"


def played(folder: Path, setup: MatchSetup, seconds: float, *, recorded: bool = True) -> RunFolder:
    run = prepared(folder, setup)
    watchers = [recorder_node(setup, run)] if recorded else []
    with open_journal(setup, run) as journal:
        play(setup, journal, limit=seconds, watchers=watchers)
    return run


def prepared(folder: Path, setup: MatchSetup) -> RunFolder:
    run = RunFolder(folder)
    run.prepare()
    write_setup(setup, run.setup)
    return run


def judged(run: RunFolder, folder: Path, setup: MatchSetup, recording: bytes) -> Result:
    """What is said of a run with another recording."""
    mixed = prepared(folder / "mixed", setup)
    mixed.journal.write_bytes(run.journal.read_bytes())
    mixed.evidence.write_bytes(run.evidence.read_bytes())
    mixed.recording.write_bytes(recording)
    return said("judge", mixed)


def said(command: str, run: RunFolder, *options: str) -> Result:
    return invoke("run", command, str(run.path), *options)


def first_tag(run: RunFolder) -> tuple[int, Call]:
    """The number of the record of the first tag, and the tag."""
    return next((r.n, call) for r in read_journal(run.journal)[1] for call in r.calls if call.rule == "tag")


def courtyard(folder: Path, seed: int) -> MatchSetup:
    """Two passes of the match of the thesis, in which nobody needs a laser."""
    file = folder / "courtyard.toml"
    text = match_path("sharks-and-minnows").read_text().replace("[rules]", "[rules]\npasses = 2")
    file.write_text(f"lasers = false\n{text}")
    return load_match(file, engine="planar", seed=seed)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    base = tmp_path_factory.mktemp("runs")
    flags = base / "flags.toml"
    flags.write_text(match_text(four_each("aggressive", "balanced"), rules="round_time = 32.0"))
    setups = {
        "sharks-and-minnows": (courtyard(base, seed=3), 300.0),
        "pursuit-evasion": (load_match(match_path("pursuit-evasion-table-4-1"), engine="planar").at_rate(0), 20.0),
        "roboflag": (load_match(flags), 36.0),
    }
    return {
        name: (setup, played(base / name, setup, limit, recorded=name == "sharks-and-minnows"))
        for name, (setup, limit) in setups.items()
    }


GAMES = {
    "sharks-and-minnows": {"tag", "pass_over"},
    "pursuit-evasion": {"capture", "launch"},
    "roboflag": {"tag", "home", "flag"},
}


@pytest.mark.parametrize("game", GAMES)
def test_the_numbers_that_decided_every_call_of_a_match_hold(runs: Runs, game: str) -> None:
    setup, run = runs[game]
    book, prover = rulebook_of(setup), game_of(game).load_prover()
    assert prover is not None
    records = read_journal(run.journal)[1]
    cases = list(cases_of(book, read_evidence(run.evidence), records))
    assert [case.call for case in cases] == [call for record in records for call in record.calls]
    assert {case.call.rule for case in cases if prover(book, case)} >= GAMES[game]
    assert refuted(prover, book, cases) == []
    assert [case.call.rule for case in cases if game_of(game).rule_text(case.call.rule) is None] == []


@pytest.mark.parametrize("game", GAMES)
def test_each_number_can_prove_a_call_wrong(runs: Runs, game: str) -> None:
    """A call with a pose or a clock that is not the true one fails by the very number that it changes."""
    setup, run = runs[game]
    book, prover = rulebook_of(setup), game_of(game).load_prover()
    assert prover is not None
    cases = list(cases_of(book, read_evidence(run.evidence), read_journal(run.journal)[1]))
    cases.sort(key=lambda case: len(case.call.poses))
    proved = {case.call.rule: case for case in cases if prover(book, case)}
    for rule, case in proved.items():
        for measure in prover(book, case):
            told = {disagreement.what for one in changed(case) for disagreement in refuted(prover, book, [one])}
            assert any(f"but {measure.what}: " in what for what in told), f"{rule}: {measure} holds whatever happened"


def changed(case: Case) -> list[Case]:
    """The same call at another time, or with one of its players elsewhere."""
    found = [replace(case, call=structs.replace(case.call, clock=clock)) for clock in (-1.0, 0.0)]
    for at, name in enumerate(case.call.players[: len(case.call.poses)]):
        for dx, dy in AROUND:
            here, there = case.call.poses[at], case.now.poses[name]
            poses = list(case.call.poses)
            poses[at] = Pose(here.x + dx, here.y + dy, here.theta)
            moved = replace(case.now, poses={**case.now.poses, name: Pose(there.x + dx, there.y + dy, there.theta)})
            found.append(replace(case, call=structs.replace(case.call, poses=poses), now=moved))
    return found


AROUND = [
    (way * math.cos(bearing), way * math.sin(bearing))
    for way in (0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 16.0, 20.0)
    for bearing in (math.tau * part / 24 for part in range(24))
]


@pytest.mark.parametrize("game", GAMES)
def test_a_whole_match_is_judged_again_without_a_disagreement(runs: Runs, game: str) -> None:
    setup, run = runs[game]
    records = read_journal(run.journal)[1]
    judgement = judge_again(rulebook_of(setup), read_evidence(run.evidence), records)
    assert judgement.disagreements == []
    assert judgement.calls == sum(len(record.calls) for record in records)
    result = said("judge", run)
    assert result.exit_code == 0, result.output
    assert "no disagreement" in result.output


def test_a_shark_that_was_moved_away_is_found_by_the_rules_alone(runs: Runs) -> None:
    """Even where somebody has made the file of the evidence anew: what was called does not follow from it."""
    setup, run = runs[SHARKS]
    number, tag = first_tag(run)

    def moved(exhibit: Exhibit) -> Exhibit:
        field, name = exhibit.tick.field, tag.players[1]
        poses = {**field.poses, name: Pose(field.poses[name].x + 3.0, field.poses[name].y, 0.0)}
        tick = structs.replace(exhibit.tick, field=type(field)(poses, time=field.time))
        return Exhibit(tick, exhibit.digest, genuine=True)

    exhibits = [moved(e) if e.tick.after == number - 1 else e for e in read_evidence(run.evidence)]
    found = judge_again(rulebook_of(setup), exhibits, read_journal(run.journal)[1]).disagreements
    assert any(f"call {tag.number}, tag" in one.what for one in found)


def test_a_recording_that_shows_a_robot_elsewhere_is_found(runs: Runs, tmp_path: Path) -> None:
    """Its evidence and its journal agree, but what people watch is of another match."""
    setup, run = runs[SHARKS]
    other = played(tmp_path / "other", courtyard(tmp_path, seed=4), 20.0)
    result = judged(run, tmp_path, setup, other.recording.read_bytes())
    assert result.exit_code == 1
    assert "from where the referee saw it" in result.output


def test_a_recording_that_ends_in_the_middle_is_told_when_it_is_judged(runs: Runs, tmp_path: Path) -> None:
    setup, run = runs[SHARKS]
    content = run.recording.read_bytes()
    result = judged(run, tmp_path, setup, content[: len(content) // 2])
    assert result.exit_code == 0, result.output
    assert "recording.mcap ends in the middle: what it lacks was not compared." in result.output


def test_calls_are_listed_and_each_is_told_with_its_rule_its_number_and_a_picture(runs: Runs) -> None:
    _, run = runs[SHARKS]
    _, tag = first_tag(run)
    result = said("why", run, "--call", str(tag.number))
    assert result.exit_code == 0, result.output
    assert "Rule (thesis 4.3): A minnow whose outline" in result.output
    outlines = f"distance between the outlines of {tag.players[0]} and {tag.players[1]}"
    assert f"{outlines}: 0.30 m (at most 0.30 m)" in result.output
    assert (run.path / f"why-{tag.number}.png").read_bytes().startswith(b"\x89PNG")
    assert "begin: pass 1 of 2 begins" in said("why", run).output
    missing = said("why", run, "--call", "999")
    assert missing.exit_code == 1
    assert "expected a call from 1 to" in str(missing.exception)


def test_a_window_shows_the_same_on_a_card(runs: Runs) -> None:
    _, run = runs[SHARKS]
    _, tag = first_tag(run)
    explainer = Explainer(partial(explain, run.path))
    explainer.ask(tag, "sharks-and-minnows")
    card = worked_out(explainer)
    assert any("distance between the outlines" in line for line in card.lines)
    assert card.proof is not None
    assert card.proof.now is not None
    assert {body.name for body in card.proof.now.bodies} >= set(tag.players)
    surface = pygame.Surface((900, 700))
    CardPainter(Fonts()).draw(surface, surface.get_rect(), card, 1.0)
    shown = pygame.surfarray.array3d(surface)
    assert (shown == palette.CAUTION).all(axis=-1).sum() > 50, "what decided is marked"


@pytest.mark.parametrize(
    ("relation", "value", "holds"),
    [
        (Relation.AT_MOST, 0.3, True), (Relation.AT_MOST, 0.31, False),
        (Relation.AT_LEAST, 0.3, True), (Relation.AT_LEAST, 0.29, False),
        (Relation.MORE_THAN, 0.31, True), (Relation.MORE_THAN, 0.29, False),
    ],
)  # fmt: skip
def test_a_number_holds_as_its_relation_says(relation: Relation, value: float, holds: bool) -> None:
    assert Measure("distance", value, relation, 0.3).holds is holds


def test_a_number_nearer_to_its_limit_than_it_is_known_is_doubtful() -> None:
    """Two bodies 0.28 m apart along x, of which one is known to 2 cm along x and to 20 cm across."""
    measure = Measure("distance", 0.28, Relation.AT_MOST, 0.3, ends=((0.2, 0.0), (0.48, 0.0)))
    known, far = Uncertainty(4e-4, 0.0, 4e-2, 0.0), (Pose(9.0, 9.0, 0.0), 0.3, Uncertainty(1.0, 0.0, 1.0, 0.0))
    near = (Pose(0.0, 0.0, 0.0), 0.3, known)
    found = with_deviation(measure, [near, far])
    assert found.deviation == pytest.approx(0.02)
    assert found.doubtful
    assert str(found) == (
        "distance: 0.28 m (at most 0.30 m), known to 0.040 m, so that it may be on the other side of the limit"
    )
    both = with_deviation(measure, [near, (Pose(0.7, 0.0, 0.0), 0.3, known)])
    assert both.deviation == pytest.approx(math.hypot(0.02, 0.02))
    clear = with_deviation(replace(measure, value=0.2), [near])
    assert str(clear) == "distance: 0.20 m (at most 0.30 m), known to 0.040 m"
    touching = with_deviation(replace(measure, value=0.0, ends=((0.2, 0.0), (0.2, 0.0))), [near])
    assert touching.deviation == pytest.approx(0.2)
    assert with_deviation(measure, [far]) == measure
    assert not measure.doubtful


def test_a_call_whose_number_is_wrong_is_told() -> None:
    call = Call(number=3, rule="tag", text="ann is tagged by bob", players=(), poses=(), clock=1.0)
    wrong = Measure("distance between ann and bob", 0.35, Relation.AT_MOST, 0.3)
    case = Case(call, None, Observation({}), Observation({}, time=7.0))
    (found,) = refuted(lambda _book, _case: [wrong], None, [case])  # type: ignore[arg-type]
    assert found.time == 7.0
    assert "0.35 m (at most 0.30 m)" in found.what


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_calls_behind_the_end_of_cut_evidence_cannot_be_judged_and_are_not_blamed(runs: Runs, share: float) -> None:
    setup, run = runs[SHARKS]
    book, exhibits, records = rulebook_of(setup), list(read_evidence(run.evidence)), read_journal(run.journal)[1]
    cut = exhibits[: round(share * len(exhibits))]
    judgement = judge_again(book, cut, records)
    assert judgement.disagreements == []
    later = [call for record in records for call in record.calls if record.time > cut[-1].tick.time]
    assert later
    assert judgement.unjudged == len(later)
    assert refuted(game_of(setup.game).load_prover(), book, cases_of(book, cut, records)) == []
