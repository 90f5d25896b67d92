"""A window is nobody whom a match needs."""

import json
import signal
from collections.abc import Iterator

import pytest

from tests.system.conftest import FAULTS
from vrg.bus.messages import Stage
from vrg.launch.launched import LINGER
from vrg.testing.processes.arena import Arena
from vrg.testing.processes.match import MINNOWS, LiveMatch, long_match, short_match

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def watched(arena: Arena, display: str) -> Iterator[LiveMatch]:
    """A match with a window on it."""
    match = arena.start(long_match("watched"), environment={"DISPLAY": display}, window=True)
    match.wait_said("Play Round")  # play may begin before the window is open; one that dies by then ends the match
    yield match
    match.close()


@FAULTS
def test_a_window_that_fails_is_opened_again_and_play_goes_on(watched: LiveMatch, fault: signal.Signals) -> None:
    observer = watched.observer

    def fail() -> None:
        old = watched.child("spectator")
        old.send_signal(fault)
        watched.wait_replaced("spectator", old)
        before = observer.heard.pulses["spectator/window"]
        observer.wait_until(lambda: observer.heard.pulses["spectator/window"] > before, "the new window to be ready")
        observer.wait_moving(*MINNOWS)

    observer.undisturbed(fail)


@pytest.mark.thorough
def test_the_end_is_shown_until_the_window_is_closed(arena: Arena, display: str) -> None:
    match = arena.start(short_match("ending"), environment={"DISPLAY": display}, window=True)
    try:
        observer = match.observer

        def over() -> bool:
            if observer.stalled:
                observer.resume()
            return observer.state.stage is Stage.GAME_OVER

        observer.wait_until(over, "the end", patience=90.0)
        match.wait_said("close the window (Q) to end the match")
        ended = json.loads(match.run.result.read_text(encoding="utf-8"))
        assert (ended["ended"], match.run.plot.exists()) == ("game over", True), (
            "it is written before the window is closed"
        )
        rate = observer.heard.clocks[-1].body.rate
        observer.time_passes(2 * LINGER * rate, "longer than a match without a window goes on after its end")
        match.child("spectator").terminate()
        assert match.wait_ended() == 0
        assert match.said().count("Recorded in") == 1
        again = json.loads(match.run.result.read_text(encoding="utf-8"))
        assert (again["winner"], ended["processes"] != again["processes"]) == (ended["winner"], True)
    finally:
        match.close()
