"""Files of strategies that are no Python: what reads them, and what is said where nothing does."""

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from vrg import registry
from vrg.agents.strategy import Strategy
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.games import STRATEGY_FILES, file_of, has_name, is_strategy_file, unreadable
from vrg.launch.strategy_class import strategy_class

WHY = r"x\.npz: expected a file that an installed package reads, got one of a kind that the package "
WHY += "virtual-robotic-games-learn adds: "
WHY += r"run `make setup` in a clone, or `pip install virtual-robotic-games-learn`"


def plug(monkeypatch: pytest.MonkeyPatch, **entries: str) -> None:
    made = {name: EntryPoint(name, value, STRATEGY_FILES.group) for name, value in entries.items()}
    monkeypatch.setattr(registry, "added", lambda: {STRATEGY_FILES.group: made})


def reader(file: Path) -> type[Strategy]:
    """The strategy of every file that ends in `.mind`."""
    assert file.suffix == ".mind"
    return strategy_class("sharks-and-minnows", file.parent)


def test_another_package_reads_the_files_that_end_as_it_says(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    plug(monkeypatch, mind=f"{__name__}:reader")
    assert file_of("old.mind") == "old.mind"
    assert unreadable("old.mind") is None
    assert strategy_class("old.mind", tmp_path).__name__ == "SharksAndMinnowsPlayer"
    assert not is_strategy_file("old.mine")
    assert has_name("old.mine")


def test_a_policy_without_its_plug_in_is_refused_with_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    plug(monkeypatch)
    assert file_of("x.npz") == "x.npz"
    assert not has_name("x.npz")
    with pytest.raises(ConfigError, match=rf"^{WHY}$"):
        strategy_class("x.npz", tmp_path)


@pytest.mark.parametrize("there", [True, False])
def test_a_match_with_a_policy_without_its_plug_in_is_refused_at_its_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, there: bool
) -> None:
    plug(monkeypatch)
    text = match_path("sharks-and-minnows").read_text(encoding="utf-8")
    file = tmp_path / "match.toml"
    file.write_text(text.replace("[[players]]", '[[players]]\nstrategy = "x.npz"', 1), encoding="utf-8")
    if there:
        (tmp_path / "x.npz").touch()
    with pytest.raises(ConfigError, match=rf"match\.toml:\d+: players\.1\.strategy: {WHY}$"):
        load_match(file)
