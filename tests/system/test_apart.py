"""A strategy searches its own process for what is not its own: a session, a socket, keys, a driver, a CAN channel."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from vrg.launch.sandbox.seal import missing
from vrg.testing.can.vcan import require_loopback
from vrg.testing.processes.match import LiveMatch, long_match, match_text
from vrg.testing.requirements import missing as lacking
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

SPY = """
import gc
import os
import socket
import stat
import sys

from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer

KINDS = {
    "zenoh": "Session", "vrg.bus.session": "Session", "vrg.seats.credentials": "Credentials",
    "vrg.hal.device": "Device", "vrg.hal.driver": "Driver", "can": "BusABC", "vrg.agents.player": "Player",
}


def found():
    kinds = tuple(getattr(sys.modules[module], name) for module, name in KINDS.items() if module in sys.modules)
    yield from (type(one).__name__ for one in gc.get_objects() if isinstance(one, kinds))
    for number in os.listdir("/proc/self/fd"):
        try:
            is_socket = stat.S_ISSOCK(os.fstat(int(number)).st_mode)
        except OSError:
            continue
        if is_socket:
            with socket.socket(fileno=os.dup(int(number))) as one:
                if one.family != socket.AF_UNIX:
                    yield str(one.family)
    yield from (name for name in os.environ if "KEYS" in name)


class Spy(SharksAndMinnowsPlayer):
    told = False

    def act(self, view):
        if not self.told:
            self.told = True
            print("spy:", sorted(found()), "in", os.getpid(), flush=True)
        return super().act(view)
"""


@pytest.fixture
def spy(tmp_path: Path) -> str:
    """A strategy that searches its process."""
    (tmp_path / "spy.py").write_text(SPY)
    return f"{tmp_path / 'spy.py'}:Spy"


def by(text: str, strategy: str, *players: str) -> str:
    """A match in which players play by a strategy."""
    for name in players:
        text = text.replace(f'name = "{name}"', f'name = "{name}"\nstrategy = "{strategy}"')
    return text


def found_nothing(log: Path) -> bool:
    """Whether the spy has told that it found nothing.

    Raises:
        AssertionError: it has found something.
    """
    said = [line for line in log.read_text().splitlines() if line.startswith("spy:")] if log.exists() else []
    assert all(line.startswith("spy: [] in ") for line in said), said
    return bool(said)


def test_over_processes_it_finds_nothing_beside_keys_and_the_driver_of_motors(
    start: Callable[..., LiveMatch], spy: str
) -> None:
    require_loopback()
    if (why := missing()) is not None:
        lacking(why)
    text = match_text("spied", length=190.0, width=60.0, zone=6.0, wiring={"ann": (0, 1)})
    match = start(f"seats = true\n{by(text, spy, 'ann', 'bob')}")
    for name in ("ann", "bob"):
        wait_until(lambda name=name: found_nothing(match.run.logs / f"{name}.log"), f"{name} to have searched")


def test_it_finds_nothing_where_nothing_is_sealed(start: Callable[..., LiveMatch], spy: str) -> None:
    match = start(f"sandbox = false\n{by(long_match('spied'), spy, 'ann')}")
    wait_until(lambda: found_nothing(match.run.logs / "ann.log"), "ann to have searched")


@pytest.mark.parametrize("how", ["--lockstep", "--in-process"])
def test_in_steps_it_finds_nothing_and_neither_when_that_is_repeated(tmp_path: Path, spy: str, how: str) -> None:
    wiring = {"bob": (0, 1)} if how == "--in-process" else {}
    text = match_text("spied", length=13.0, width=9.0, zone=2.5, wiring=wiring)
    (tmp_path / "match.toml").write_text(by(text, spy, "ann"))

    def ran(*words: str) -> Path:
        command = [sys.executable, "-m", "vrg", *words, "--runs", f"by-{words[0]}"]
        subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=600, check=False)
        (run,) = (tmp_path / f"by-{words[0]}").iterdir()
        return run

    run = ran("play", "match.toml", how, "--headless", "--no-record")
    assert found_nothing(run / "logs" / "ann.log")
    if missing() is None:
        assert found_nothing(ran("run", "repeat", str(run)) / "logs" / "ann.log")
