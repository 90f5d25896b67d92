"""A match in steps whose players are broken in all kinds of ways is played to its end by the others."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from vrg.bus.messages import DISQUALIFIED, Call, Stage
from vrg.config.loading import load_match
from vrg.errors import LaunchError
from vrg.launch.fork_server import ForkServer, fork_server
from vrg.playing import apart, strategy_process
from vrg.playing.in_process import Ending
from vrg.playing.strategies import Strategies
from vrg.testing import matches
from vrg.testing.command_line import invoke
from vrg.testing.matches import calls_of
from vrg.testing.processes.match import short_match
from vrg.testing.waiting import wait_until

BROKEN = """
import sys

from vrg.agents import Strategy, Twist
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Raises(Strategy):
    def act(self, view):
        return Twist(v=1.0 / 0, w=0.0)


class Loops(Strategy):
    def act(self, view):
        while True:
            pass


class Prints(Strategy):
    def act(self, view):
        while True:
            print("here I am " * 100)


class Eats(Strategy):
    hoard = []

    def act(self, view):
        self.hoard.append(bytearray(50_000_000))
        return Twist(v=0.0, w=0.0)


class Nan(Strategy):
    def act(self, view):
        return Twist(v=float("nan"), w=0.0)


class Leaves(Strategy):
    def act(self, view):
        sys.exit()


class Silly(Strategy):
    def act(self, view):
        return "left"


class Once(SharksAndMinnowsPlayer):
    def act(self, view):
        if int(10 * view.referee.clock) == 20:
            raise RuntimeError("only once")
        return super().act(view)
"""

SLOW_EATER = """

class Nibbles(Strategy):
    hoard = []

    def act(self, view):
        while True:
            self.hoard.append([0] * 500)


class Odd(Strategy):
    def act(self, view):
        return Twist(v=10**400, w=0.0)


class Interrupts(Strategy):
    def act(self, view):
        raise KeyboardInterrupt("two\\nlines \\udcff")
"""
BROKEN = BROKEN.replace("import Strategy, Twist", "import Action, Strategy, Twist") + SLOW_EATER

CULPRITS = {
    "Raises": "it fails too often: ZeroDivisionError: float division by zero (broken.py, line 10, in act)",
    "Loops": "it fails too often: DecisionTimeoutError: Loops.act: a decision may take 1.5 s (it was at broken.py, ",
    "Prints": "OutputFloodError: it has printed more than 2 MB within 10 s (broken.py, line 22, in act)",
    "Eats": "MemoryError (broken.py, line 29, in act)",
    "Nan": "it fails too often: Nan.act: expected finite numbers of m/s and rad/s, got Twist(v=nan, w=0.0)",
    "Leaves": "it fails too often: SystemExit (broken.py, line 40, in act)",
    "Nibbles": "MemoryError (broken.py, line 60, in act)",
    "Odd": "it fails too often: Odd.act: expected a Twist of numbers, got Twist(v=1000000",
    "Interrupts": "it fails too often: KeyboardInterrupt: two lines \\udcff (broken.py, line 70, in act)",
    "Silly": "it fails too often: Silly.act: expected a Twist(v, w) or an Action, got 'left' (broken.py, line 44,",
}


def match_with(folder: Path, *kinds: str, code: str = BROKEN, more: str = "") -> Path:
    """A short match in which bob, and then cid, play by classes of this code."""
    (folder / "broken.py").write_text(code)
    text = short_match("broken")
    for name, kind in zip(("bob", "cid"), kinds, strict=False):
        text = text.replace(f'name = "{name}"', f'name = "{name}"\nstrategy = "broken.py:{kind}"')
    (folder / "match.toml").write_text(text.replace("seed = 5", f"seed = 5\nmemory = 300\n{more}"))
    return folder / "match.toml"


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    with fork_server(preload=[strategy_process.__name__]) as started:
        yield started


def played(
    server: ForkServer | None, folder: Path, *kinds: str, code: str = BROKEN, more: str = "", recorded: bool = False
) -> tuple[Ending, list[Call]]:
    """How such a match ended, and who was disqualified."""
    setup = load_match(match_with(folder, *kinds, code=code, more=more))
    ending, run = matches.played(setup, folder, limit=300.0, strict=True, recorded=recorded, apart=Strategies(server))
    return ending, calls_of(run, "disqualified")


# Those that flood, or fill the memory, are alone in their process.
TOGETHER = [("Raises", "Nan"), ("Leaves", "Odd"), ("Interrupts", "Silly")]
ALONE = [(kind,) for kind in CULPRITS if not any(kind in kinds for kinds in TOGETHER)]


@pytest.mark.parametrize(
    "kinds",
    [
        *TOGETHER[:1],
        *ALONE,
        *(pytest.param(kinds, marks=pytest.mark.thorough) for kinds in TOGETHER[1:]),
    ],
)
def test_the_culprits_are_named_and_the_others_play_on(
    server: ForkServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kinds: tuple[str, ...]
) -> None:
    # In real time: a slow machine takes long to fill the memory.
    # It bounds how long a strategy is made, too, for which a busy one needs more than a moment.
    monkeypatch.setattr(apart, "BUDGET", 1.5 if "Loops" in kinds else 60.0)
    ending, calls = played(server, tmp_path, *kinds)
    assert ending.state.stage is Stage.GAME_OVER
    out = {call.players[0]: call.text for call in calls}
    assert len(out) == len(kinds)
    for name, kind in zip(("bob", "cid"), kinds, strict=False):
        assert out[name].startswith(f"{name} is disqualified: {CULPRITS[kind]}")
        assert "broken.py, line " in out[name] or len(out[name]) > 300, "a long answer is cut"
        player = ending.state.player(name)
        assert player is not None
        assert (player.state, player.may_move) == (DISQUALIFIED, False)
        assert "broken.py" in (tmp_path / "logs" / f"{name}.log").read_text()


ODD = """
from vrg.agents import STILL, Action, Strategy, Twist


class Leaves:
    def __len__(self):
        raise SystemExit

    def __iter__(self):
        raise SystemExit

    def __float__(self):
        raise SystemExit


class Bids(Strategy):
    def act(self, view):
        return Action(STILL, bids={"\\ud800": 1.0})


class Mode(Strategy):
    mode = "\\ud800 \\x1b[2J"

    def act(self, view):
        return STILL


class Floats(Strategy):
    def act(self, view):
        return Twist(v=Leaves(), w=0.0)


class Sees(Strategy):
    def act(self, view):
        return Action(STILL, sightings=Leaves())


class Unspeakable(Exception):
    def __str__(self):
        raise KeyboardInterrupt


class Raises(Strategy):
    def act(self, view):
        raise Unspeakable
"""


@pytest.mark.parametrize(
    "kinds", [("Bids", "Mode"), pytest.param(("Floats", "Sees"), marks=pytest.mark.thorough), ("Raises",)]
)
def test_no_object_of_a_strategy_ends_the_match(server: ForkServer, tmp_path: Path, kinds: tuple[str, ...]) -> None:
    ending, _ = played(server, tmp_path, *kinds, code=ODD, recorded=True)
    assert ending.state.stage is Stage.GAME_OVER


CHATTY = """
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Chatty(SharksAndMinnowsPlayer):
    def act(self, view):
        print("x" * 15_000)
        return super().act(view)
"""


def test_what_is_printed_now_and_then_is_no_flood_however_fast_the_match_is(server: ForkServer, tmp_path: Path) -> None:
    """By match time it is 30 kB a second; all of it is printed within a second or two."""
    assert played(server, tmp_path, "Chatty", code=CHATTY)[1] == []


@pytest.mark.parametrize("apart", [True, False])
def test_who_fails_once_goes_on_with_a_fresh_strategy(server: ForkServer, tmp_path: Path, apart: bool) -> None:
    ending, calls = played(server if apart else None, tmp_path, "Once")
    assert ending.state.stage is Stage.GAME_OVER
    assert calls == []
    assert "RuntimeError: only once" in (tmp_path / "logs" / "bob.log").read_text()


@pytest.mark.parametrize("kinds", [("Raises", "Leaves"), ("Nan", "Silly")])
def test_where_it_is_trusted_exceptions_of_code_are_caught_all_the_same(tmp_path: Path, kinds: tuple[str, str]) -> None:
    ending, calls = played(None, tmp_path, *kinds)
    assert ending.state.stage is Stage.GAME_OVER
    assert {call.players[0] for call in calls} == {"bob", "cid"}


WHERE = """
import os

from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Where(SharksAndMinnowsPlayer):
    def act(self, view):
        print("in", os.getpid())
        return super().act(view)
"""


@pytest.mark.parametrize(("options", "apart"), [((), True), (("--no-sandbox",), False)])
def test_code_of_a_file_decides_in_the_process_of_the_match_by_a_word_alone(
    tmp_path: Path, options: tuple[str, ...], apart: bool
) -> None:
    match = match_with(tmp_path, "Where", code=WHERE, more="sandbox = false")
    words = ("play", str(match), "--in-process", "--headless", "--no-record", "--runs", str(tmp_path / "runs"))
    assert invoke(*words, *options).exit_code == 0
    (log,) = (tmp_path / "runs").glob("*/logs/bob.log")
    said = set(log.read_text().split())
    assert (f"{os.getpid()}" not in said) == apart
    assert "in" in said, "what it prints is in its log"


def test_trusted_code_that_prints_without_end_fills_no_disk(tmp_path: Path) -> None:
    _, calls = played(None, tmp_path, "Prints")
    assert CULPRITS["Prints"] in calls[0].text
    assert (tmp_path / "logs" / "bob.log").stat().st_size < 2_200_000


LOOPS = """        open("looping", "w").close()
        try:
            while True:
                pass
        except KeyboardInterrupt:
            open("interrupted", "w").close()
            raise
"""


def test_a_further_ctrl_c_ends_an_endless_loop_of_trusted_code_and_the_run_is_kept(tmp_path: Path) -> None:
    match = match_with(tmp_path, "Where", code=WHERE.replace("        return super().act(view)\n", LOOPS))
    command = [sys.executable, "-m", "vrg", "play", str(match), "--in-process", "--no-sandbox", "--no-record"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        wait_until((tmp_path / "looping").exists, "the loop")
        interrupted = (tmp_path / "interrupted").exists
        wait_until(lambda: interrupted() or process.send_signal(signal.SIGINT), "the end of the loop")
        output = process.communicate()[0]
    assert process.returncode == 130, output
    assert next((tmp_path / "runs").glob("*/result.json")).exists()


def test_a_match_that_is_to_halt_ends_and_says_why(server: ForkServer, tmp_path: Path) -> None:
    with pytest.raises(LaunchError, match=r"bob: it fails too often: ZeroDivisionError.*broken\.py, line 10"):
        played(server, tmp_path, "Raises", more='on_fault = "halt"')


@pytest.mark.thorough
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
def test_an_endless_loop_ends_at_the_first_signal(server: ForkServer, tmp_path: Path, number: signal.Signals) -> None:
    loop = "while True:\n            pass"
    marked = BROKEN.replace(loop, f'open("looping", "w").close()\n        {loop}')
    match = match_with(tmp_path, "Loops", code=marked)
    command = [sys.executable, "-m", "vrg", "play", str(match), "--in-process", "--no-record", "--runs", "runs"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        wait_until(lambda: (tmp_path / "looping").exists() or process.poll() is not None, "the loop")
        assert process.poll() is None
        process.send_signal(number)
        output, _ = process.communicate(timeout=60.0)
    finally:
        process.kill()
    assert process.returncode == 130, output
    assert "Interrupted" in output
    assert next((tmp_path / "runs").glob("*/result.json")).exists()
