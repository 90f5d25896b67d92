"""The strategies that are compared: what a folder of them holds."""

from pathlib import Path

import pytest

from vrg import registry
from vrg.errors import ConfigError
from vrg.launch.strategy_class import strategy_class
from vrg_league.contenders import entered


def test_a_policy_in_a_folder_is_not_left_out_in_silence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(registry, "added", dict)
    (tmp_path / "x.npz").touch()
    found, _ = entered([str(tmp_path)], folders=True)
    assert [one.target for one in found] == [str(tmp_path / "x.npz")]
    with pytest.raises(ConfigError, match="the package virtual-robotic-games-learn adds: run `make setup`"):
        strategy_class(found[0].target, tmp_path)
