"""Strategies that cheat change no result of a comparison: see `cheats.py` for what they try."""

from pathlib import Path
from typing import Any

import pytest
from cheats import CHEATS
from experiments import match_in
from msgspec import structs

from vrg.config.loading import load_match
from vrg_league import workers
from vrg_league.contenders import with_strategies
from vrg_league.game_process import GameProcess, ended
from vrg_league.games import INVALID, OVER, Played


def game(match: Path, minnows: str, *, sealed: bool = True, sharks: str = "Honest") -> Played:
    """A game of honest sharks."""
    file = match.with_name("cheats.py")
    file.write_text(CHEATS, encoding="utf-8")
    targets = {"sharks": f"{file}:Honest" if sharks == "Honest" else sharks, "minnows": f"{file}:{minnows}"}
    setup = with_strategies(load_match(match), targets)
    setup = structs.replace(setup, sandbox=None if sealed else False)
    server = workers.server_for(setup.game, setup.engine)
    playing = GameProcess(server, setup, 0, match.with_name(f"{minnows} {sealed}"), 600.0)
    while not (found := ended([playing], 600.0)):
        pass
    return found[0][1]


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Played:
    """A game in which nobody cheats."""
    return game(match_in(tmp_path_factory.mktemp("honest")), "Honest")


def outcome(played: Played) -> list[Any]:
    return [played.ended, played.winner, played.score, played.play_time, played.calls, played.failures]


@pytest.mark.parametrize("cheat", ["Everything", pytest.param("Kills", marks=pytest.mark.thorough)])
def test_a_strategy_that_is_sealed_reaches_nothing_that_decides(match: Path, honest: Played, cheat: str) -> None:
    assert honest.ended == OVER
    assert outcome(game(match, cheat)) == outcome(honest)


@pytest.mark.parametrize("cheat", ["Exits", pytest.param("Forges", marks=pytest.mark.thorough)])
def test_who_breaks_the_line_to_the_referee_is_named_and_loses(match: Path, cheat: str) -> None:
    found = game(match, cheat)
    assert (found.ended, found.winner) == (OVER, "sharks")
    assert set(found.disqualified) == {"ann", "bob"}
    assert all("the process of the strategy is gone" in failure for failure in found.failures)


def test_without_a_seal_an_honest_game_is_valid(match: Path) -> None:
    assert game(match, "Honest", sealed=False, sharks="sharks-and-minnows").ended == OVER


@pytest.mark.parametrize(
    ("cheat", "words"),
    [
        ("Book_Zones", "pass 1 of 1 is over, 2 minnows left: by the rules there is no such call"),
        ("Stops", "nobody may halt it: emergency stop by x"),
        pytest.param("Points", "points is {'sharks': 0, 'minnows': 99} in the journal", marks=pytest.mark.thorough),
        pytest.param("Winner", "its journal or its evidence ends early", marks=pytest.mark.thorough),
        pytest.param("Code", "the journal lacks: ann is tagged", marks=pytest.mark.thorough),
        pytest.param("Score", "an official has decided, but there is none: set-score", marks=pytest.mark.thorough),
        pytest.param("Accuse", "an official has decided, but there is none: disqualify", marks=pytest.mark.thorough),
    ],
)
def test_without_a_seal_who_changes_the_referee_is_named_and_loses(match: Path, cheat: str, words: str) -> None:
    found = game(match, cheat, sealed=False, sharks="sharks-and-minnows")
    assert (found.ended, found.winner) == (INVALID, "sharks")
    assert words in found.problem


def test_where_the_code_of_both_could_have_changed_the_referee_nobody_wins(match: Path) -> None:
    found = game(match, "Book_Zones", sealed=False)
    assert (found.ended, found.winner) == (INVALID, None)
