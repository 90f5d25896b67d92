"""A player whose own code hangs: its process is alive in every other respect."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.system.harness import STUCK_ONCE, Match, long_match, patient

pytestmark = [pytest.mark.system, pytest.mark.thorough]


def test_a_player_in_an_endless_loop_is_stopped_and_started_again(start: Callable[..., Match], tmp_path: Path) -> None:
    (tmp_path / "stuck.py").write_text(STUCK_ONCE)
    text = "sandbox = false\n" + patient(long_match("stuck")).replace(
        'name = "bob"', f'name = "bob"\nstrategy = "{tmp_path}/stuck.py:Stuck"'
    )
    match = start(text)
    observer = match.observer
    old = match.child("bob")
    (tmp_path / "hang").touch()
    observer.wait_until((tmp_path / "was_stuck").exists, "bob to be stuck")
    match.wait_replaced("bob", old)
    assert re.search(r"bob hangs \(stuck\.py, line 1[34], in act\): killed", match.said())
    assert observer.halts_nobody_else("bob"), observer.state.halted
    match.go_on()
