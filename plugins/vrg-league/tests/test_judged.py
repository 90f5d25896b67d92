"""Each game of a comparison is judged again: honest ones agree, and one whose record was altered is not valid."""

import shutil
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from experiments import match_in
from msgspec import structs

from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.games import game_of
from vrg.runs.fingerprint import fingerprint
from vrg.runs.run_folder import RunFolder
from vrg_league.games import BROKEN_OFF, INVALID, OVER, GameRecord, Pairing, Played, ScheduledGame
from vrg_league.playing import judged, played
from vrg_league.report import computed, irregular


@pytest.mark.parametrize("game", ["roboflag", "pursuit-evasion"])
def test_honest_games_agree_with_the_rule_book(tmp_path: Path, game: str) -> None:
    """As one of Sharks and Minnows does, which the tests after this one alter."""
    setup, folder = load_match(game_of(game).default_match(), engine="planar", lasers=False), RunFolder(tmp_path)
    found = judged(setup, folder, played(setup, folder, 12.0))
    assert (found.ended, found.problem) == (BROKEN_OFF, "it reached the limit of match time")
    assert found.calls["begin"] == {"": 1}
    assert found.play_time is not None
    assert found.play_time > 0.0
    assert found.score


Game = tuple[MatchSetup, RunFolder, Played]


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Game:
    """A game whose record is as it was written."""
    place = tmp_path_factory.mktemp("honest")
    setup, folder = load_match(match_in(place)), RunFolder(place / "game")
    told = played(setup, folder, 600.0)
    found = judged(setup, folder, told)
    assert (found.ended, found.problem, found.calls["begin"]) == (OVER, "", {"": 1})
    assert found.fingerprint == fingerprint(setup.engine)
    return setup, folder, told


@pytest.fixture
def tiny(honest: Game, tmp_path: Path) -> Game:
    """A copy of it."""
    setup, folder, told = honest
    shutil.copytree(folder.path, tmp_path / "game")
    return setup, RunFolder(tmp_path / "game"), told


def another_pose(folder: RunFolder) -> None:
    content = bytearray(folder.evidence.read_bytes())
    content[len(content) // 2] ^= 1
    folder.evidence.write_bytes(content)


def another_winner(folder: RunFolder) -> None:
    text = folder.journal.read_text()
    assert '"winner":"minnows"' in text
    folder.journal.write_text(text.replace('"winner":"minnows"', '"winner":"sharks"'))


def another_call(folder: RunFolder) -> None:
    lines = folder.journal.read_text().splitlines(keepends=True)
    folder.journal.write_text("".join(line for line in lines if '"tag"' not in line))


@pytest.mark.parametrize(
    ("alter", "words"),
    [
        (another_pose, ""),
        (another_winner, "winner"),
        (another_call, ""),
        (lambda folder: folder.evidence.unlink(), "its journal or its evidence ends early"),
        (lambda folder: folder.journal.write_text(""), "expected a journal, got an empty file"),
    ],
)
def test_a_game_whose_record_was_altered_is_not_valid(
    tiny: Game, alter: Callable[[RunFolder], None], words: str
) -> None:
    setup, folder, told = tiny
    alter(folder)
    found = judged(setup, folder, told)
    assert found.ended == INVALID
    assert words in found.problem != ""


def test_a_game_with_a_damaged_fingerprint_counts(tiny: Game) -> None:
    setup, folder, told = tiny
    folder.fingerprint.write_text("{}")
    found = judged(setup, folder, told)
    assert (found.ended, found.fingerprint) == (OVER, None)


def test_the_report_names_games_that_are_not_valid_and_who_has_lost_them() -> None:
    game = ScheduledGame(pairing=Pairing("Ann", "Bob"), number=0, seed=7, first_team="sharks", second_team="minnows")
    lost = GameRecord(game=game, played=Played(ended=INVALID, problem="12.0 s: so", winner="minnows"), teams={})
    assert (lost.points, lost.winner) == (0.0, "Bob")
    unknown = structs.replace(lost, played=structs.replace(lost.played, winner=None))
    assert unknown.points == 0.5
    [draw, loss] = irregular([lost, unknown])
    assert "counts as a draw: seed 7 (Ann as sharks, Bob as minnows) (such as 12.0 s: so)" in draw
    assert "the record of 1 game is not what the rule book says" in loss
    assert "won by Bob" in loss


def test_the_report_names_what_differs_between_the_computers_that_have_played(honest: Game) -> None:
    setup, folder, told = honest
    here = judged(setup, folder, told)
    assert here.fingerprint is not None
    there = structs.replace(here, fingerprint=structs.replace(here.fingerprint, libc="musl 1.2.5"))
    unknown = structs.replace(here, fingerprint=None)
    game = ScheduledGame(pairing=Pairing("Ann", "Bob"), number=0, seed=7, first_team="sharks", second_team="minnows")
    rows = [GameRecord(game=game, played=each, teams={}) for each in (here, unknown, there, here)]
    assert computed(rows[:2]) == []
    [words] = computed(rows)
    assert words.endswith(f"computed with different C libraries: {here.fingerprint.libc} and musl 1.2.5")
    assert words in irregular(rows)
    again = msgspec.json.decode(msgspec.json.encode(rows), type=list[GameRecord])
    assert computed(again) == [words]
