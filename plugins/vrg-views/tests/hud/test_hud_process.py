"""A head-up display in a process of its own, on a screen that goes away while it drives, in a match with seats."""

from collections.abc import Callable
from pathlib import Path

import pytest

from vrg.testing.processes.match import MINNOWS, LiveMatch, long_match
from vrg.testing.processes.programs import helper, screen
from vrg.testing.waiting import wait_until
from vrg.ui.window.window import GONE

pytestmark = pytest.mark.system


def test_a_display_drives_by_its_seat_and_the_match_goes_on_without_its_screen(
    start: Callable[..., LiveMatch], tmp_path: Path
) -> None:
    match = start(long_match("seen"), seats=True)
    observer, log = match.observer, tmp_path / "hud.log"
    program = Path(__file__).with_name("window_process.py")
    where = ("hud", match.endpoint, str(match.run.path), "ann", str(match.seats))

    def drive_and_lose_the_screen() -> None:
        with screen() as (display, server), helper(program, *where, log=log, display=display) as hud:
            pulses = observer.heard.pulses
            heard = pulses["hud/ann"]
            observer.wait_until(lambda: pulses["hud/ann"] > heard + 2, "the window")
            observer.time_passes(2.0, "ann to be away from where she began")
            hud.do("home")
            observer.wait_until(lambda: observer.mode("ann") == "Manual", "ann to be driven back")
            observer.wait_moving("ann")
            server.kill()
            wait_until(lambda: hud.process.poll() is not None, "the display to end")
            assert hud.process.returncode == 1
            assert GONE in hud.said()
        observer.wait_until(lambda: observer.mode("ann").startswith("Minnows"), "ann to play by herself again")
        observer.wait_moving(*MINNOWS)

    observer.undisturbed(drive_and_lose_the_screen)
