"""The same as in test_leases, with robots on a CAN interface of the kernel."""

import signal
from pathlib import Path

import pytest

from tests.system.harness import Match
from tests.system.test_leases import STILL, check_leases, lease_match
from tests.vcan import IN_REAL_TIME, VCAN

NAMES = ("red1", "red2")


@IN_REAL_TIME
@pytest.mark.system
@pytest.mark.thorough
@pytest.mark.vcan
@pytest.mark.parametrize("fault", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
def test_led_robots_on_can_stop_when_the_referee_falls_silent(tmp_path: Path, fault: signal.Signals) -> None:
    (tmp_path / "still.py").write_text(STILL, encoding="utf-8")
    with Match(tmp_path, lease_match(NAMES, VCAN), movers=()) as match:
        check_leases(match, NAMES, fault)
