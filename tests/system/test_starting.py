"""How a match starts where something is amiss, and what a stall of the machine does to it."""

import json
import os
import signal
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import psutil
import pytest

from vrg.testing.processes.match import PLAYERS, LiveMatch, long_match, patient, short_match
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

EVERYBODY = ("router", "world", "coordinator", "recorder", *PLAYERS)
STALL = 6.0
"""s of real time: more than twice as long as one process among others may be silent."""

BLOCKS = """
import time
from pathlib import Path

from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer as Player

HERE = Path(__file__)
if HERE.with_name("blocks").exists():
    HERE.with_name("blocked").touch()
    time.sleep(3600)
"""
"""A strategy whose import blocks for ever once the file `blocks` is there."""


def with_strategy(text: str, folder: Path, code: str) -> str:
    """A match in which bob plays by this code."""
    (folder / "mine.py").write_text(code)
    return "sandbox = false\n" + text.replace('name = "bob"', f'name = "bob"\nstrategy = "{folder}/mine.py:Player"')


@pytest.mark.thorough
def test_files_of_the_working_folder_are_not_taken_for_the_package_or_the_library(tmp_path: Path) -> None:
    """A student's working folder may hold a folder `vrg` and a file `random.py`."""
    (tmp_path / "vrg").mkdir()
    for name in ("vrg/__init__.py", "random.py", "json.py", "typing.py"):
        (tmp_path / name).write_text(f'raise SystemExit("the wrong {name} was imported")\n')
    with LiveMatch(tmp_path, short_match("shadowed"), here=tmp_path) as match:
        assert match.play_out() == 0, match.said()
    assert "the wrong" not in match.said()


@pytest.mark.thorough
def test_ctrl_c_during_the_start_ends_it_and_leaves_nobody(tmp_path: Path) -> None:
    (tmp_path / "blocks").touch()
    with closing(LiveMatch(tmp_path, with_strategy(long_match("interrupted"), tmp_path, BLOCKS))) as match:
        wait_until((tmp_path / "blocked").exists, "bob's import to block", match.check_launcher)
        match.launcher.send_signal(signal.SIGINT)
        assert match.wait_ended() == 130, match.said()
    assert "Interrupted" in match.said()
    assert "Traceback" not in match.said()


@pytest.mark.thorough
def test_an_import_that_blocks_harms_its_own_player_alone(start: Callable[..., LiveMatch], tmp_path: Path) -> None:
    match = start(with_strategy(long_match("blocking"), tmp_path, BLOCKS))
    observer = match.observer
    others = [name for name in EVERYBODY if name != "bob"]
    before = {name: match.child(name).pid for name in others}
    (tmp_path / "blocks").touch()
    old = match.child("bob")
    old.kill()
    observer.wait_until((tmp_path / "blocked").exists, "bob's import to block")
    observer.time_passes(2.0, "without bob")
    assert observer.playing or observer.stalled
    observer.wait_moving("ann", "cid")
    assert observer.standing("bob")
    # A player that stays away is out, and the others play on. It is back from the next pass once it is there again.
    observer.wait_until(lambda: observer.called("bob is disqualified: it has not reported for 5 s"), "bob to be out")
    observer.wait_moving("ann", "cid")
    (tmp_path / "blocks").unlink()
    match.child("bob").kill()
    observer.wait_until(lambda: observer.called("bob plays again from the next pass"), "bob to be back")
    assert {name: match.child(name).pid for name in others} == before


@pytest.mark.parametrize("with_launcher", [True, False], ids=["everything", "all-but-the-launcher-and-the-router"])
@pytest.mark.thorough
def test_a_stall_that_hits_everybody_kills_nobody(match: LiveMatch, with_launcher: bool) -> None:
    before, said = {name: match.child(name).pid for name in EVERYBODY}, match.said()
    # A router that answers nobody while the launcher asks is killed, and rightly.
    frozen = [psutil.Process(pid) for name, pid in before.items() if with_launcher or name != "router"]
    if with_launcher:
        frozen.append(psutil.Process(match.launcher.pid))
    for process in frozen:
        process.suspend()
    threading.Event().wait(STALL)
    for process in reversed(frozen):
        process.resume()
    observer = match.observer
    observer.look()
    observer.time_passes(3.0, "the match goes on")
    assert {name: match.child(name).pid for name in EVERYBODY} == before, match.said()
    assert match.said().count("killed") == said.count("killed")
    if observer.state.halted:
        # Where the referee has missed somebody it has halted the match, and says how that is left.
        assert "An official continues" in (observer.state.way_out or "")
    match.go_on()


@pytest.mark.parametrize("fault", [signal.SIGKILL, signal.SIGSTOP], ids=["dies", "freezes"])
@pytest.mark.thorough
def test_a_match_goes_on_without_its_fork_server(start: Callable[..., LiveMatch], fault: signal.Signals) -> None:
    match = start(patient(long_match("forkless")))
    observer = match.observer
    (server,) = (p for p in psutil.Process(match.launcher.pid).children() if "vrg.launch.forking" in p.cmdline())
    before = {name: match.child(name).pid for name in PLAYERS}
    server.send_signal(fault)
    os.kill(before["bob"], signal.SIGKILL)
    # Whoever was forked by a server that is dead has another parent now.
    observer.wait_until(lambda: "bob was killed" in match.said() or "bob has ended" in match.said(), "bob to be missed")
    since = len(observer.heard.drives["bob"])
    observer.wait_until(lambda: len(observer.heard.drives["bob"]) > since, "the next bob")
    # Whether the referee has missed bob, and when it says so, is a matter of speed.
    match.go_on()
    assert all(psutil.pid_exists(before[name]) for name in PLAYERS if name != "bob")
    match.launcher.send_signal(signal.SIGTERM)
    assert match.wait_ended() == 130
    assert "Interrupted" in match.said()
    result = json.loads(match.run.result.read_text())
    assert (result["ended"], result["winner"]) == ("interrupted", None)
