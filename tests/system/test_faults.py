"""One student's failing code does not end the match of the others, and the student can mend it meanwhile."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.playing.test_stepped import BROKEN
from vrg.bus.messages import DISQUALIFIED
from vrg.testing.processes.match import LiveMatch, long_match

pytestmark = [pytest.mark.system, pytest.mark.thorough]

CULPRITS = {
    "raiser": ("Raises", "it fails too often: ZeroDivisionError: float division by zero (broken.py, line 10, in act)"),
    "looper": ("Loops", "it hangs again: Loops.act: a decision may take 5 s (it was at broken.py, line 1"),
    "printer": ("Prints", "OutputFloodError: it has printed more than 2 MB within 10 s (broken.py, line 22, in act)"),
    "eater": ("Eats", "MemoryError (broken.py, line 29, in act)"),
    "nan": ("Nan", "it fails too often: Nan.act: expected finite numbers of m/s and rad/s, got Twist(v=nan, w=0.0)"),
    "absent": ("Missing", "/"),
}
"""The players that are broken: the class of each, and what the referee says of it."""
MENDED = """
from vrg.agents import Strategy, Twist


class Mended(Strategy):
    mode = "mended"

    def act(self, view):
        return Twist(v=0.2, w=0.0)
"""


def match_text(folder: Path) -> str:
    """The long match of three minnows, and a row of broken ones."""
    text = long_match("faults").replace("seed = 5", "seed = 5\nmemory = 300\nsandbox = false")
    for number, (name, (kind, _)) in enumerate(CULPRITS.items()):
        text += (
            f'\n[[players]]\nname = "{name}"\nrole = "minnow"\nx = {-20 + 3 * number}\ny = 92.0\nheading = -90.0\n'
            f'strategy = "{folder}/broken.py:{kind}"\n'
        )
    return text


def test_broken_players_are_named_and_out_and_can_be_replaced(start: Callable[..., LiveMatch], tmp_path: Path) -> None:
    broken, mended = tmp_path / "broken.py", tmp_path / "mended.py"
    broken.write_text(BROKEN)
    mended.write_text(MENDED)
    match = start(match_text(tmp_path))
    observer = match.observer

    def out(name: str) -> bool:
        player = observer.state.player(name)
        return player is not None and player.state == DISQUALIFIED

    observer.wait_until(lambda: all(map(out, CULPRITS)), "all broken players to be out", patience=120.0)
    assert observer.playing or observer.stalled, "nobody else was halted"
    observer.wait_moving("ann", "cid")
    journal = match.run.journal.read_text(encoding="utf-8")
    for name, (_, why) in CULPRITS.items():
        assert f"{name} is disqualified: {why}" in journal
    assert "expected the name of a class in" in match.said(), "a class that is not there keeps nobody from playing"

    # A player that works is replaced at once; a typing error is told before anything is stopped.
    old = match.child("ann")
    refused = match.vrg("official", "substitute", "ann", f"{mended}:Mendd", "faults")
    assert refused.returncode == 1
    assert "expected the name of a class" in refused.stderr
    assert "ann plays by" in match.command("official", "substitute", "ann", f"{mended}:Mended", "faults")
    match.wait_replaced("ann", old)
    observer.wait_until(lambda: observer.mode("ann") == "mended", "the other strategy")
    nobody = match.vrg("official", "substitute", "nemo", f"{mended}:Mended", "faults")
    assert "PLAYER: expected one of shark, ann" in nobody.stderr

    # One that is out is back from the next pass.
    match.command("official", "substitute", "raiser", f"{mended}:Mended", "faults")
    observer.wait_until(lambda: observer.called("raiser plays again from the next pass"), "it to be back")
    observer.wait_moving("cid")
