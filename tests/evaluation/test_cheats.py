"""Strategies that cheat change no result of a comparison: see `tests/evaluation/cheats.py` for what they try."""

from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from tests.evaluation.cheats import CHEATS
from vrg.config.loading import load_match
from vrg.evaluation.contenders import with_strategies
from vrg.evaluation.game_process import GameProcess, server_for
from vrg.evaluation.games import OVER, Played


def game(match: Path, minnows: str, *, sealed: bool = True) -> Played:
    """A game of honest sharks."""
    file = match.with_name("cheats.py")
    file.write_text(CHEATS, encoding="utf-8")
    setup = with_strategies(load_match(match), {"sharks": f"{file}:Honest", "minnows": f"{file}:{minnows}"})
    setup = structs.replace(setup, wanted_sandbox=None if sealed else False)
    return GameProcess(server_for(setup), setup, 0, match.with_name(f"{minnows} {sealed}"), 600.0).result()


def outcome(played: Played) -> list[Any]:
    return [played.ended, played.winner, played.score, played.play_time, played.calls, played.failures]


@pytest.mark.parametrize("cheat", ["Everything", "Kills"])
def test_a_strategy_that_is_sealed_reaches_nothing_that_decides(match: Path, cheat: str) -> None:
    honest = game(match, "Honest")
    assert honest.ended == OVER
    assert outcome(game(match, cheat)) == outcome(honest)


@pytest.mark.parametrize("cheat", ["Exits", "Forges"])
def test_who_breaks_the_line_to_the_referee_is_named_and_loses(match: Path, cheat: str) -> None:
    found = game(match, cheat)
    assert (found.ended, found.winner) == (OVER, "sharks")
    assert set(found.disqualified) == {"ann", "bob"}
    assert all("the process of the strategy is gone" in failure for failure in found.failures)


@pytest.mark.parametrize("cheat", ["Zones", "Score"])
def test_without_a_seal_they_would_change_the_result(match: Path, cheat: str) -> None:
    """The cheats work where nothing keeps them from it, so the tests above can fail."""
    assert outcome(game(match, cheat, sealed=False)) != outcome(game(match, "Honest", sealed=False))
