"""A head-up display in a process of its own, on a screen that goes away while it drives, in a match with seats."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.requirements import missing
from tests.system.conftest import Arena
from tests.system.harness import MINNOWS, Match, long_match, wait_until
from vrg.ui.window import GONE

pytestmark = pytest.mark.system


@contextmanager
def screen() -> Iterator[tuple[str, "subprocess.Popen[bytes]"]]:
    """A virtual screen that the test may take away: its display and its process."""
    if shutil.which("Xvfb") is None:
        missing("Xvfb is not installed: no screen for the display")
    out, into = os.pipe()
    command = ["Xvfb", "-displayfd", str(into), "-screen", "0", "1280x720x24", "-nolisten", "tcp"]
    process = subprocess.Popen(command, pass_fds=[into], stderr=subprocess.DEVNULL)
    os.close(into)
    try:
        with os.fdopen(out) as answer:
            yield f":{answer.readline().strip()}", process
    finally:
        process.kill()
        process.wait()


@contextmanager
def opened(match: Match, player: str, display: str, log: Path) -> Iterator["subprocess.Popen[str]"]:
    """The display of a player."""
    root = Path(__file__).parents[2]
    paths = [str(root), *filter(None, [os.environ.get("PYTHONPATH")])]
    gone = ("WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_AUDIODRIVER")
    inherited = {name: value for name, value in os.environ.items() if name not in gone}
    where = [match.endpoint, str(match.run.path), player, str(match.seats)]
    with log.open("wb") as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.system.hud_process", *where],
            stdin=subprocess.PIPE,
            stdout=said,
            stderr=subprocess.STDOUT,
            cwd=root,
            env={**inherited, "DISPLAY": display, "PYTHONPATH": os.pathsep.join(paths)},
            text=True,
        )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_a_display_drives_by_its_seat_and_the_match_goes_on_without_its_screen(arena: Arena, tmp_path: Path) -> None:
    match = arena.start(long_match("seen"), seats=True)
    try:
        observer, log = match.observer, tmp_path / "hud.log"

        def drive_and_lose_the_screen() -> None:
            with screen() as (display, server), opened(match, "ann", display, log) as hud:
                assert hud.stdin is not None
                pulses = observer.heard.pulses
                heard = pulses["hud/ann"]
                observer.wait_until(lambda: pulses["hud/ann"] > heard + 2, "the window")
                observer.time_passes(2.0, "ann to be away from where she began")
                print("home", file=hud.stdin, flush=True)
                observer.wait_until(lambda: observer.mode("ann") == "Manual", "ann to be driven back")
                observer.wait_moving("ann")
                server.kill()
                wait_until(lambda: hud.poll() is not None, "the display to end")
                assert hud.returncode == 1
                assert GONE in log.read_text()
            observer.wait_until(lambda: observer.mode("ann").startswith("Minnows"), "ann to play by herself again")
            observer.wait_moving(*MINNOWS)

        observer.undisturbed(drive_and_lose_the_screen)
    finally:
        match.close()
