"""Comparisons as a function: `vrg_league.compare` and what it returns."""

import signal
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from experiments import MATCH

import vrg
import vrg_league
from vrg.errors import ConfigError
from vrg.testing.tiny import work_in
from vrg_league.games import GameRecord
from vrg_league.running import Experiment


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a match and a strategy that stands, which is the working folder."""
    return work_in(tmp_path, monkeypatch)


def test_a_comparison_tells_which_strategy_is_better(here: Path) -> None:
    (here / "quick.toml").write_text(MATCH, encoding="utf-8")
    found = vrg_league.compare(
        "still.py", "sharks-and-minnows", match="quick.toml", games=20, jobs=2, confidence=0.5, sandbox=False
    )
    assert (found.first, found.second, found.result) == ("still", "sharks-and-minnows", "worse")
    assert found.rate == 0.0
    assert found.interval[1] < 0.5
    assert found.confidence == 0.5
    assert found.sentence in repr(found)
    assert found.path.parent == Path("runs")
    table = found.to_arrow()
    assert table.num_rows == len(found.rows) == 8
    assert set(table["winner"].to_pylist()) == {"sharks-and-minnows"}
    assert found.plot()._repr_png_().startswith(b"\x89PNG")
    shown = found._repr_html_()
    assert "<td>sharks-and-minnows wins</td>" in shown
    assert "data:image/png;base64," in shown


def test_a_comparison_in_any_thread_is_broken_off_by_an_event(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count, wanted = Experiment.count, Event()

    def setting(self: Experiment, row: GameRecord) -> None:
        count(self, row)
        wanted.set()

    (here / "quick.toml").write_text(MATCH, encoding="utf-8")
    options: dict[str, Any] = {"match": "quick.toml", "games": 4, "jobs": 1, "sandbox": False, "output": "out"}
    monkeypatch.setattr(Experiment, "count", setting)
    with ThreadPoolExecutor(1) as other:
        found = other.submit(vrg_league.compare, "still.py", "sharks-and-minnows", stop=wanted, **options).result()
    assert len((found.path / "games.jsonl").read_text().splitlines()) == 1
    assert found.result == "undecided"


def test_an_interrupted_comparison_goes_on_with_its_games(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count = Experiment.count

    def pressing(self: Experiment, row: GameRecord) -> None:
        count(self, row)
        if len(self.folder.rows) == 1:
            signal.raise_signal(signal.SIGINT)

    (here / "quick.toml").write_text(MATCH, encoding="utf-8")
    options: dict[str, Any] = {"match": "quick.toml", "games": 4, "jobs": 1, "sandbox": False, "output": "out"}
    with monkeypatch.context() as patch:
        patch.setattr(Experiment, "count", pressing)
        with pytest.raises(KeyboardInterrupt, match="the games are kept in out"):
            vrg_league.compare("still.py", "sharks-and-minnows", **options)
    record = here / "out" / "games.jsonl"
    before = record.read_bytes()
    assert before.count(b"\n") == 1
    found = vrg_league.compare("still.py", "sharks-and-minnows", **options)
    assert [row.game.number for row in found.rows] == [0, 1, 2, 3]
    assert record.read_bytes().startswith(before)
    with pytest.raises(ConfigError, match="the seed is 1 now and was 0"):
        vrg_league.compare("still.py", "sharks-and-minnows", seed=1, **options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"first": "none.py"}, "none.py: no such file"),
        ({"first": vrg.Run}, "expected one of"),
        ({"match": "practice"}, "expected a match of two teams"),
        ({"engine": "warp"}, "engine: expected one of"),
        ({"games": 0}, "games: expected a whole number of at least 1, got 0"),
        ({"seed": "3"}, "seed: expected a whole number of at least 0, got '3'"),
        ({"jobs": 0}, "jobs: expected a whole number of at least 1, got 0"),
        ({"confidence": 1.0}, "confidence: expected a number from 0.5 to 0.9999, got 1.0"),
    ],
)
def test_what_cannot_be_compared_is_an_error_in_words(here: Path, options: dict[str, Any], words: str) -> None:
    usual = {"first": "still.py", "second": "sharks-and-minnows", "match": "tiny.toml"}
    with pytest.raises(ConfigError, match=words):
        vrg_league.compare(**{**usual, **options})
    assert not (here / "runs").exists()
