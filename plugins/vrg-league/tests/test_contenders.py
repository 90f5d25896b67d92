"""The strategies that are compared: what a folder of them holds."""

from pathlib import Path

import pytest

from vrg import registry
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.launch.strategy_class import strategy_class
from vrg.runs.change import by_player
from vrg_league.contenders import entered, with_strategies
from vrg_league.experiment import written


def test_the_strategy_of_a_team_is_not_that_of_its_scout(tmp_path: Path) -> None:
    match = load_match(match_path("roboflag-scouted"))
    own = match.player("red-scout").strategy
    found = with_strategies(match, {"red": "conservative"})
    assert [player.strategy for player in found.players if player.team == "red"] == [*["conservative"] * 4, own]
    assert [p.strategy for p in found.players if p.team == "blue"] == [p.strategy for p in match.players[5:]]
    again = tmp_path / "match.toml"
    again.write_text(written(match, {"red": "conservative", "blue": "aggressive"}).text)
    assert {p.name: p.strategy for p in load_match(again).players if p.name.endswith("scout")} == {
        "red-scout": own,
        "blue-scout": own,
    }
    assert set(by_player(match, {"red": "conservative"})) == {"red1", "red2", "red3", "red4"}
    assert by_player(match, {"red-scout": "balanced"}) == {"red-scout": "balanced"}


def test_a_policy_in_a_folder_is_not_left_out_in_silence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(registry, "added", dict)
    (tmp_path / "x.npz").touch()
    found, _ = entered([str(tmp_path)], folders=True)
    assert [one.target for one in found] == [str(tmp_path / "x.npz")]
    with pytest.raises(ConfigError, match="the package virtual-robotic-games-learn adds: run `make setup`"):
        strategy_class(found[0].target, tmp_path)
