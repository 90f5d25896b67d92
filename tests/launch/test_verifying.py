"""Each second of a match is played twice, and nothing but its state decides what comes of it."""

import re
from pathlib import Path

import pytest

from tests.launch.matches import written
from tests.tiny import TINY
from vrg.config.loading import load_match, match_path
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError
from vrg.hal.sim.engines import ENGINES
from vrg.launch import bounds, in_process, nodes
from vrg.launch.run_folder import RunFolder
from vrg.launch.step_log import StepLog

FORGETFUL = """
import os
from vrg.agents import Action, Strategy, Twist
class Forgetful(Strategy):
    def act(self, view):
        return Action(Twist(0.4, SOMETHING if view.time > 4.5 else 0.0))
"""


def played(folder: Path, setup: MatchSetup, *, limit: float = 3600.0, verify: bool = True) -> RunFolder:
    run = RunFolder(folder)
    run.prepare()
    with nodes.open_journal(setup, run) as journal, StepLog(run.steps) as steps:
        recorder = nodes.recorder_node(setup, run)
        in_process.play(
            setup, journal, watchers=[recorder], limit=limit, logs=run.logs, steps=steps, verify=verify, strict=True
        )
    return run


def forgetful(folder: Path, code: str) -> MatchSetup:
    """A match in which ann plays by this code."""
    (folder / "forgetful.py").write_text(code)
    text = TINY.replace('name = "ann"', 'name = "ann"\nstrategy = "forgetful.py:Forgetful"')
    return written(folder, text).at_rate(0.0)


BRIEF = {("sharks-and-minnows", "planar")}


@pytest.mark.parametrize(
    ("game", "engine"),
    [
        pytest.param(game, engine, marks=() if (game, engine) in BRIEF else pytest.mark.thorough)
        for game in ("sharks-and-minnows", "roboflag", "pursuit-evasion")
        for engine in sorted(ENGINES.names())
    ],
)
def test_every_game_is_the_same_twice_on_every_engine(tmp_path: Path, game: str, engine: str) -> None:
    setup = load_match(match_path(game), engine=engine).at_rate(0.0)
    run = played(tmp_path / "run", setup, limit=7.5)
    assert len(run.steps.read_text().splitlines()) == 9, "eight digests and the end"


def test_the_copies_leave_nothing_in_the_run(tmp_path: Path) -> None:
    setup = written(tmp_path).at_rate(0.0)
    plain, verified = (played(tmp_path / str(verify), setup, verify=verify, limit=8.0) for verify in (False, True))
    names = sorted(path.relative_to(plain.path) for path in plain.path.rglob("*"))
    assert names == sorted(path.relative_to(verified.path) for path in verified.path.rglob("*"))
    for name in ("journal.jsonl", "evidence.bin", "steps.jsonl", "recording.mcap"):
        assert (plain.path / name).read_bytes() == (verified.path / name).read_bytes(), name


@pytest.mark.parametrize("something", ["1e-3 * (os.getpid() % 991)", "1e-3 * os.urandom(1)[0]"])
def test_what_depends_on_something_else_is_found_with_its_second_and_its_node(tmp_path: Path, something: str) -> None:
    setup = forgetful(tmp_path, FORGETFUL.replace("SOMETHING", something))
    with pytest.raises(LaunchError, match="was not the same when it was played twice") as found:
        played(tmp_path / "run", setup)
    assert re.search(r"before 5\.\d+ s.*player/ann", str(found.value))


@pytest.mark.parametrize(
    ("deed", "words"),
    [
        ("os._exit(0) if os.getpid() != STARTED else None", "the copy has ended before"),
        ("[None for _ in iter(int, 1)] if view.time < 4.65 else None", ""),
    ],
)
def test_a_copy_that_ends_is_named_and_a_decision_without_end_is_the_same_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, deed: str, words: str
) -> None:
    monkeypatch.setattr(bounds, "BUDGET", 0.5)  # the copies are forks of this process
    text = FORGETFUL.replace("SOMETHING if", "0.0 if").replace("class", "STARTED = os.getpid()\nclass")
    act = f"        if view.time > 4.5:\n            {deed}\n        return"
    setup = forgetful(tmp_path, text.replace("        return", act))
    if not words:
        run = played(tmp_path / "run", setup, limit=8.0)
        assert "still deciding after 0.5 s" in (run.logs / "ann.log").read_text()
        return
    with pytest.raises(LaunchError, match=words):
        played(tmp_path / "run", setup)
