"""A match in one process whose players are broken in all kinds of ways is played to its end by the others."""

import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from vrg.bus.messages import DISQUALIFIED, Call, Stage
from vrg.config.loading import load_match
from vrg.errors import LaunchError
from vrg.launch.sandbox import bounds
from vrg.playing.in_process import Ending
from vrg.testing import matches
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
    failed = False

    def act(self, view):
        if view.referee.clock > 2.0 and not Once.failed:
            Once.failed = True
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
    "Loops": "it fails too often: DecisionTimeoutError: it was still deciding after 1.5 s (a decision may take 1.5 s)",
    "Prints": "OutputFloodError: it has printed more than 2 MB within 10 s (broken.py, line 22, in act)",
    "Eats": "MemoryError (broken.py, line 29, in act)",
    "Nan": "it fails too often: Nan.act: expected finite numbers of m/s and rad/s, got Twist(v=nan, w=0.0)",
    "Leaves": "it fails too often: SystemExit (broken.py, line 40, in act)",
    "Nibbles": "MemoryError (broken.py, line 63, in act)",
    "Odd": "it fails too often: Odd.act: expected a Twist of numbers, got Twist(v=1000000",
    "Interrupts": "it fails too often: KeyboardInterrupt: two lines \\udcff (broken.py, line 73, in act)",
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


def played(
    folder: Path, *kinds: str, code: str = BROKEN, more: str = "", recorded: bool = False
) -> tuple[Ending, list[Call]]:
    """How such a match ended, and who was disqualified."""
    setup = load_match(match_with(folder, *kinds, code=code, more=more))
    ending, run = matches.played(setup, folder, limit=300.0, strict=True, recorded=recorded)
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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kinds: tuple[str, ...]
) -> None:
    # In real time: a slow machine takes long to fill the memory.
    # It bounds how long a strategy is made, too, for which a busy one needs more than a moment.
    monkeypatch.setattr(bounds, "BUDGET", 1.5 if "Loops" in kinds else 60.0)
    ending, calls = played(tmp_path, *kinds)
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


GREEDY = """
import subprocess
import tempfile

from vrg.agents import STILL, Strategy
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Starts(Strategy):
    def act(self, view):
        self.process = subprocess.Popen(["sleep", "1000"])
        open({folder!r} + "/pid", "w").write(str(self.process.pid))
        return STILL


class Writes(Strategy):
    def act(self, view):
        with tempfile.TemporaryFile() as file:
            for _ in range(11):
                file.write(bytes(1_000_000))
        return STILL


class Notes(SharksAndMinnowsPlayer):
    def act(self, view):
        with open({folder!r} + "/notes", "w") as file:
            file.write("x" * 50_000)
        return super().act(view)
"""


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
def test_no_object_of_a_strategy_ends_the_match(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    ending, _ = played(tmp_path, *kinds, code=ODD, recorded=True)
    assert ending.state.stage is Stage.GAME_OVER


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells it")
@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("Starts", ["bob is disqualified: it has started a process: where strategies share one, none may be started"]),
        ("Writes", ["bob is disqualified: it has written more than 100 MB"]),
        ("Notes", []),
    ],
)
def test_what_a_strategy_leaves_behind_in_one_process_is_bounded(tmp_path: Path, kind: str, said: list[str]) -> None:
    ending, calls = played(tmp_path, kind, code=GREEDY.format(folder=str(tmp_path)))
    assert ending.state.stage is Stage.GAME_OVER
    assert [call.text for call in calls] == said
    if kind == "Starts":
        assert not psutil.pid_exists(int((tmp_path / "pid").read_text()))


CHATTY = """
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Chatty(SharksAndMinnowsPlayer):
    def act(self, view):
        print("x" * 15_000)
        return super().act(view)
"""


def test_what_is_printed_now_and_then_is_no_flood_however_fast_the_match_is(tmp_path: Path) -> None:
    """By match time it is 30 kB a second; all of it is printed within a second or two."""
    assert played(tmp_path, "Chatty", code=CHATTY)[1] == []


def test_who_fails_once_goes_on_with_a_fresh_strategy(tmp_path: Path) -> None:
    ending, calls = played(tmp_path, "Once")
    assert ending.state.stage is Stage.GAME_OVER
    assert calls == []
    assert "RuntimeError: only once" in (tmp_path / "logs" / "bob.log").read_text()


def test_a_match_that_is_to_halt_ends_and_says_why(tmp_path: Path) -> None:
    with pytest.raises(LaunchError, match=r"bob: it fails too often: ZeroDivisionError.*broken\.py, line 10"):
        played(tmp_path, "Raises", more='on_fault = "halt"')


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.thorough)], ids=["Ctrl-C", "SIGTERM"]
)
def test_an_endless_loop_ends_at_the_first_signal(tmp_path: Path, number: signal.Signals) -> None:
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
