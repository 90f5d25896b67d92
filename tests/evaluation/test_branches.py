"""Games that go on from an instant of a recorded match: one team by either strategy, with the same noise."""

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from tests.evaluation.test_commands import Done, vrg
from vrg.evaluation.games import GameRecord

__all__ = ["vrg"]
INSTANT = "3"
TWIN = """
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer
class Twin(SharksAndMinnowsPlayer):
    pass
"""


@pytest.fixture
def run(vrg: Callable[..., Done], match: Path) -> str:
    """A match that was played in one process, and won by the minnows."""
    played = vrg("play", "tiny.toml", "--in-process", "--seed", "1", "--no-record")
    found = re.search(r"Recorded in (\S+):", played.out)
    assert found, played.out + played.err
    return found[1]


def rows(folder: Path) -> list[GameRecord]:
    return [msgspec.json.decode(line, type=GameRecord) for line in (folder / "games.jsonl").read_bytes().splitlines()]


def test_one_team_goes_on_by_each_strategy_with_the_same_noise(vrg: Callable[..., Done], run: str, match: Path) -> None:
    for name in ("one.py", "other.py"):
        (match.parent / name).write_text(TWIN)
    command = ("compare", "one.py:Twin", "other.py:Twin", "--from", f"{run}@{INSTANT}", "--team", "minnows")
    done = vrg(*command, "--games", "6", "--output", "same")
    assert done.status == 0, done.out + done.err
    found = rows(match.parent / "same")
    for one, other in zip(found[::2], found[1::2], strict=True):
        assert one.game.seed == other.game.seed
        assert (one.played.score, one.played.match_time) == (other.played.score, other.played.match_time)
        assert one.points == 1.0 - other.points
    assert {row.game.seed for row in found} == {0, 1, 2}


def test_a_game_is_played_again_as_it_was(vrg: Callable[..., Done], run: str, match: Path) -> None:
    command = ("compare", "players.py:Lazy", "sharks-and-minnows", "--from", f"{run}@{INSTANT}", "--team", "minnows")
    done = vrg(*command, "--games", "4", "--output", "two")
    assert done.status == 0, done.out + done.err
    assert {row.game.label("minnows") for row in rows(match.parent / "two")} == {"Lazy", "sharks-and-minnows"}
    watch = next(line for line in done.out.splitlines() if line.startswith("To watch a game: "))
    again = vrg(*shlex.split(watch.removeprefix("To watch a game: vrg ")), "--json")
    assert again.status == 0, again.out + again.err
    result = json.loads((Path(json.loads(again.out.splitlines()[-1])["run"]) / "result.json").read_text())
    last = max(rows(match.parent / "two"), key=lambda row: row.game.number)
    assert result["winner"] == last.played.winner
    assert result["score"] == last.played.score


def test_a_changed_record_and_wrong_options_are_refused(vrg: Callable[..., Done], run: str, match: Path) -> None:
    command = ("compare", "players.py:Lazy", "sharks-and-minnows", "--from")
    for options, wrong in (
        ((f"{run}@{INSTANT}",), "expected --team too: sharks or minnows"),
        ((f"{run}@{INSTANT}", "--team", "crabs"), "expected a team, sharks or minnows, got crabs"),
        ((f"{run}@9999", "--team", "sharks"), "expected an instant from 0 to"),
        ((run, "--team", "sharks"), "expected RUN@TIME"),
        ((f"{run}@{INSTANT}", "--team", "sharks", "--match", "tiny.toml"), "and not both"),
    ):
        done = vrg(*command, *options)
        assert done.status == 1
        assert wrong in done.err
    whole = (*command, f"{run}@{INSTANT}", "--team", "minnows", "--games", "2", "--output", "one")
    assert vrg(*whole).status == 0
    with (match.parent / run / "journal.jsonl").open("a") as journal:
        journal.write("\n")
    done = vrg(*whole)
    assert done.status == 1
    assert "the instant from which the games go on is another" in done.err
