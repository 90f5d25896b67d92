"""The developers' view on a match of real processes: an official's keys work in it."""

from pathlib import Path

import pytest

from tests.system.harness import Match, helper

pytestmark = [pytest.mark.system, pytest.mark.thorough]


def test_it_halts_and_continues_the_match(match: Match, display: str, tmp_path: Path) -> None:
    observer, pulses = match.observer, match.observer.heard.pulses
    where = ("developer", match.endpoint, str(match.run.path), "developer")
    with helper("window_process", *where, log=tmp_path / "view.log", display=display) as view:
        observer.wait_until(lambda: pulses["spectator/developer"] > 6, "the window to have drawn for a while")
        view.do("h")
        observer.wait_until(lambda: observer.state.halted is not None, "the halt")
        view.do("c")
        observer.wait_until(lambda: observer.playing, "play to go on by its key")
