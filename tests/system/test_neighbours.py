"""Several matches on one machine, of people who know nothing of each other."""

from pathlib import Path

import pytest

from vrg.testing.processes.arena import Arena
from vrg.testing.processes.match import LiveMatch, long_match

pytestmark = [pytest.mark.system, pytest.mark.thorough]


def test_two_matches_that_start_at_once_are_both_played(arena: Arena, tmp_path: Path) -> None:
    arena.clear()
    for name in ("left", "right"):
        (tmp_path / name).mkdir()
    matches = [LiveMatch(tmp_path / name, long_match("same")) for name in ("left", "right")]
    with matches[0] as left, matches[1] as right:
        assert left.endpoint != right.endpoint
        left.command("official", "halt")
        left.observer.wait_until(lambda: left.observer.state.halted, "the halt of one")
        clock = right.observer.state.clock
        right.observer.wait_until(lambda: right.observer.state.clock > clock, "the other to go on")
        right.observer.wait_moving()
        for match in matches:
            assert "started again" not in match.said()
