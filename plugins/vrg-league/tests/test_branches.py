"""Games that go on from an instant of a recorded match: one team by either strategy, with the same noise."""

import json
import shlex
import shutil
from pathlib import Path

import pytest
from experiments import match_in
from pyarrow import parquet

from vrg.config.loading import load_match
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import Vrg, invoke
from vrg_league.contenders import contenders
from vrg_league.experiment import define, origin_at
from vrg_league.folder import ExperimentFolder, read_records
from vrg_league.games import GameRecord, Pairing

INSTANT = "3"
TWIN = """
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer
class Twin(SharksAndMinnowsPlayer):
    pass
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A match that was played in one process, and won by the minnows."""
    folder = tmp_path_factory.mktemp("recorded")
    command = ["play", str(match_in(folder)), "--in-process", "--seed", "1", "--no-record", "--runs", str(folder)]
    played = invoke(*command)
    assert played.exit_code == 0, played.output
    return next(folder.glob("*/journal.jsonl")).parent


@pytest.fixture
def run(recorded: Path, match: Path) -> str:
    """A copy of it beside the match file."""
    shutil.copytree(recorded, match.with_name("run"))
    return "run"


def rows(folder: Path) -> list[GameRecord]:
    return read_records(folder / "games.jsonl", GameRecord)


def test_one_team_goes_on_by_each_strategy_with_the_same_noise(vrg: Vrg, run: str, match: Path) -> None:
    for name in ("one.py", "other.py"):
        (match.parent / name).write_text(TWIN)
    command = ("compare", "one.py:Twin", "other.py:Twin", "--from", f"{run}@{INSTANT}", "--team", "minnows")
    done = vrg(*command, "--games", "4", "--output", "same", "--no-sandbox")
    assert done.status == 0, done.out + done.err
    found = rows(match.parent / "same")
    for one, other in zip(found[::2], found[1::2], strict=True):
        assert one.game.seed == other.game.seed
        assert (one.played.score, one.played.match_time) == (other.played.score, other.played.match_time)
        assert one.points == 1.0 - other.points
    assert {row.game.seed for row in found} == {0, 1}


def test_a_game_is_played_again_as_it_was_and_the_report_gives_no_strategy_the_team_that_plays_as_recorded(
    vrg: Vrg, run: str, match: Path
) -> None:
    command = ("compare", "players.py:Lazy", "sharks-and-minnows", "--from", f"{run}@{INSTANT}", "--team", "minnows")
    done = vrg(*command, "--games", "4", "--all", "--output", "two")
    assert done.status == 0, done.out + done.err
    assert {row.game.label("minnows") for row in rows(match.parent / "two")} == {"Lazy", "sharks-and-minnows"}
    watch = next(line for line in done.out.splitlines() if line.startswith("To watch a game: "))
    again = vrg(*shlex.split(watch.removeprefix("To watch a game: vrg ")), "--json")
    assert again.status == 0, again.out + again.err
    result = json.loads((Path(json.loads(again.out.splitlines()[-1])["run"]) / "result.json").read_text())
    last = max(rows(match.parent / "two"), key=lambda row: row.game.number)
    assert result["winner"] == last.played.winner
    assert result["score"] == last.played.score

    assert "as recorded" in done.out
    assert "as sharks" not in (match.parent / "two" / "report.md").read_text()
    table = parquet.read_table(match.parent / "two" / "games.parquet").to_pylist()
    for row in table:
        mine, other = ("first", "second") if row["first_team"] == "minnows" else ("second", "first")
        assert row[f"calls_tag_on_{mine}"] == row["calls_tag"], "minnows are tagged"
        assert row[f"calls_tag_on_{other}"] is None


def test_a_changed_record_and_wrong_options_are_refused(vrg: Vrg, run: str, match: Path) -> None:
    command = ("compare", "players.py:Lazy", "sharks-and-minnows", "--from")
    for options, wrong in (
        ((f"{run}@{INSTANT}",), "--from needs --team: sharks or minnows"),
        ((f"{run}@{INSTANT}", "--team", "crabs"), "expected a team, sharks or minnows, got crabs"),
        ((f"{run}@9999", "--team", "sharks"), "expected an instant from 0 to"),
        ((run, "--team", "sharks"), "expected RUN@TIME"),
        ((f"{run}@{INSTANT}", "--team", "sharks", "--match", "tiny.toml"), "and not both"),
        ((f"{run}@{INSTANT}", "--team", "sharks", "--engine", "planar"), "expected no --engine"),
        ((f"{run}@{INSTANT}", "--team", "sharks", "--limit", "2"), "expected more than the 3 s"),
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
    assert "the instant from which the games go on differs" in done.err


def test_games_go_on_in_the_engine_of_the_run_though_its_match_file_names_none(vrg: Vrg, run: str, match: Path) -> None:
    file = match.parent / run / "match.toml"
    file.write_text(file.read_text().replace('engine = "planar"\n', ""))
    command = ("compare", "players.py:Lazy", "sharks-and-minnows", "--from", f"{run}@{INSTANT}", "--team", "minnows")
    done = vrg(*command, "--games", "2", "--output", "one")
    assert done.status == 0, done.out + done.err
    assert 'engine = "planar"' in json.loads((match.parent / "one" / "experiment.json").read_text())["match"]


def test_a_file_may_be_edited_while_the_games_run(vrg: Vrg, run: str, match: Path) -> None:
    (match.parent / "mine.py").write_text(TWIN)
    origin = origin_at(RunFolder(match.parent / run), 3.0, "minnows")
    setup = load_match(match.parent / run / "match.toml")
    found = contenders([f"{match.parent}/mine.py:Twin", "sharks-and-minnows"])
    with ExperimentFolder(match.parent / "out", define(setup, found, seed=0, limit=60.0, origin=origin)) as folder:
        game = folder.definition.game_of(Pairing(found[0].label, found[1].label), 0)
        first = folder.branch(game)
        (match.parent / "mine.py").write_text("raise ValueError")
        second = folder.branch(game)
        assert first is not None
        assert first == second
        copy = Path(first.changes[-1].strategy.rpartition(":")[0])
        assert copy.read_text() == TWIN
        assert str(copy) in folder.again(game)


def test_the_command_of_a_game_gives_the_strategy_to_a_player_with_the_name_of_its_team_too(
    vrg: Vrg, run: str, match: Path
) -> None:
    file = match.parent / run / "setup.json"
    file.write_text(file.read_text().replace('"name":"ann"', '"name":"minnows"'))
    origin = origin_at(RunFolder(match.parent / run), 3.0, "minnows")
    setup = load_match(match.parent / run / "match.toml")
    found = contenders(["sharks-and-minnows", f"{match.parent}/players.py:Lazy"])
    with ExperimentFolder(match.parent / "out", define(setup, found, seed=0, limit=60.0, origin=origin)) as folder:
        game = folder.definition.game_of(Pairing(found[0].label, found[1].label), 0)
        assert "--play minnows=sharks-and-minnows --play bob=sharks-and-minnows" in folder.again(game)
