"""Matches as functions: `vrg.play` and what it returns, and the notebook of the examples."""

import json
import signal
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest

import vrg
from vrg.bus.stopping import StopSignal
from vrg.errors import ConfigError, LaunchError
from vrg.testing.tiny import STILL, work_in

NOTEBOOK = Path(__file__).parents[1] / "examples" / "notebook" / "first.ipynb"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with a match, which is the working folder."""
    return work_in(tmp_path, monkeypatch)


def test_a_run_tells_what_the_match_left(here: Path) -> None:
    run = vrg.play("tiny.toml", seed=3)
    assert run.path.parent == Path("runs")
    assert run.winner in ("sharks", "minnows")
    assert run.conclusion in repr(run)
    assert [call.number for call in run.calls] == list(range(1, len(run.calls) + 1))
    track = run.tracks["ann"]
    assert track.times.shape == track.x.shape
    assert np.all(np.diff(track.times) > 0.0)
    table = run.to_arrow()
    assert table.num_rows == sum(len(of.times) for of in run.tracks.values())
    units = {field.name: field.metadata[b"unit"] for field in table.schema if field.metadata}
    assert units == {"time": b"s", "x": b"m", "y": b"m", "z": b"m", "theta": b"rad"}
    tag = next(call for call in run.calls if call.poses)
    shown = run.why(tag.number)._repr_mimebundle_()
    assert tag.text in shown["text/plain"]
    assert shown["image/png"].startswith(b"\x89PNG")
    assert run.plot()._repr_png_().startswith(b"\x89PNG")
    assert "<iframe sandbox" in run._repr_html_()
    assert not vrg.judge(run).disagreements
    assert vrg.Run(run.path).winner == run.winner
    with pytest.raises(LaunchError, match="got 99"):
        run.why(99)


def test_a_damaged_result_is_an_error_in_words(here: Path) -> None:
    path = vrg.play("tiny.toml", record=False).path
    whole = json.loads((path / "result.json").read_text())
    changes = ({"score": 3}, {"calls": 7}, {"radio": {"lost": "x"}}, {"play_time": "1"}, {"play_time": 10**400})
    damaged = [whole | change for change in changes]
    for content in (*damaged, {}, [], 3, None):
        (path / "result.json").write_text(json.dumps(content))
        run = vrg.Run(path)
        assert run.conclusion == "it has no result"
        with pytest.raises(LaunchError, match=r"result\.json: cannot be read: .*: `vrg run result` makes it"):
            _ = run.winner


def test_another_strategy_plays_and_the_run_folder_has_it(here: Path) -> None:
    run = vrg.play("tiny.toml", {"minnows": "still.py"}, seed=3)
    assert {track.x.std() < 0.2 for name, track in run.tracks.items() if name != "shark"} == {True}
    with pytest.raises(ConfigError, match="branch: expected another strategy"):
        run.branch(2.0)
    with pytest.raises(ConfigError, match="at: expected a match time in s, got '2'"):
        run.branch("2", settings={"rules.passes": 1})  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="settings: expected a table such as"):
        run.branch(2.0, settings=["rules.passes"])  # type: ignore[arg-type]
    again = run.branch(2.0, settings={"rules.passes": 1}, sandbox=False)
    assert again.winner == run.winner
    assert np.array_equal(again.tracks["ann"].x, run.tracks["ann"].x)


MOVES = STILL.replace("from vrg", "from speed import SPEED\nfrom vrg").replace("Twist(0.0,", "Twist(SPEED,")


def test_what_was_edited_since_the_last_match_plays(here: Path) -> None:
    (here / "moves.py").write_text(MOVES, encoding="utf-8")
    moved = []
    for speed in ("0.0", "0.7", "0.0"):
        (here / "speed.py").write_text(f"SPEED = {speed}\n", encoding="utf-8")
        moved.append(bool(vrg.play("tiny.toml", {"ann": "moves.py"}, seed=3).tracks["ann"].x.std() > 0.2))
    assert moved == [False, True, False]


@pytest.mark.parametrize("how", ["in process", "lockstep"])
def test_a_match_is_played_in_any_thread(here: Path, how: Any) -> None:
    with ThreadPoolExecutor(1) as other:
        run = other.submit(vrg.play, "tiny.toml", how=how).result()
        assert run.winner in ("sharks", "minnows")
        assert not other.submit(vrg.judge, run).result().disagreements
        again = other.submit(run.branch, 2.0, settings={"rules.passes": 2}, sandbox=False).result()
    assert again.path != run.path


def test_in_lockstep_a_match_is_the_same(here: Path) -> None:
    journals = [
        (vrg.play("tiny.toml", how=how, record=False).path / "journal.jsonl").read_bytes()
        for how in ("in process", "lockstep")
    ]
    assert journals[0] == journals[1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"how": "fast"}, "how: expected one of in process, lockstep, processes, got 'fast'"),
        ({"how": "processes", "rate": "max"}, "rate: expected a number"),
        ({"players": {"green": "still.py"}}, "players: expected one of sharks, minnows, shark, ann"),
        ({"players": {"ann": "none.py"}}, "none.py: no such file"),
        ({"players": {"ann": vrg.Run}}, "players.ann: expected the name of a strategy"),
        ({"players": {"ann": "still.py:Nope"}, "how": "processes"}, "Nope"),
        ({"engine": "warp"}, "^engine: expected one of"),
        ({"players": "still.py"}, "players: expected a table such as"),
    ],
)
def test_what_cannot_be_played_is_an_error_in_words(here: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        vrg.play("tiny.toml", **options)
    assert not (here / "runs").exists()


def test_an_interrupted_match_keeps_its_run(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def pressing(stop: StopSignal, _rate: float) -> Callable[[float], bool]:
        def wait(time: float) -> bool:
            if time > 1.0 and not stop.is_set():
                signal.raise_signal(signal.SIGINT)
            return not stop.is_set()

        return wait

    monkeypatch.setattr("vrg.playing.in_steps._pace", pressing)
    with pytest.raises(KeyboardInterrupt, match="the run is kept in runs/tiny-"):
        vrg.play("tiny.toml")
    (folder,) = (here / "runs").iterdir()
    assert vrg.Run(folder).conclusion.startswith("Interrupted")


def test_a_match_in_a_thread_is_broken_off_by_an_event(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = Event()

    def setting(stop: StopSignal, _rate: float) -> Callable[[float], bool]:
        def wait(time: float) -> bool:
            if time > 1.0:
                wanted.set()
            return not stop.is_set()

        return wait

    monkeypatch.setattr("vrg.playing.in_steps._pace", setting)
    with ThreadPoolExecutor(1) as other:
        run = other.submit(vrg.play, "tiny.toml", stop=wanted).result()
        assert run.conclusion.startswith("Interrupted")
        with pytest.raises(LaunchError, match="broken off"):
            other.submit(run.branch, 0.5, settings={"rules.passes": 2}, sandbox=False, stop=wanted).result()


def test_a_folder_without_a_run_is_refused(here: Path) -> None:
    with pytest.raises(LaunchError, match="expected a run folder"):
        vrg.Run(here)
    with pytest.raises(LaunchError, match="expected the path of a run folder"):
        vrg.Run(None)  # type: ignore[arg-type]


def test_the_notebook_runs(here: Path) -> None:
    names: dict[str, Any] = {}
    for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    assert not vrg.judge(names["again"]).disagreements
