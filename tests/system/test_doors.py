"""Matches over processes on systems without what Linux alone has; see tests/test_doors.py."""

from pathlib import Path

import pytest

from tests.doors import play_and_judge

pytestmark = pytest.mark.system


@pytest.mark.parametrize("system", [pytest.param("darwin", marks=pytest.mark.thorough), "win32"])
def test_a_match_over_processes_is_played_and_judged(system: str, tmp_path: Path) -> None:
    play_and_judge(system, tmp_path, "--rate", "4")
    (run,) = (tmp_path / "runs").iterdir()
    for log in (run / "logs").glob("*.log"):
        assert "stopped by" in log.read_text() or "stopping: " in log.read_text(), log.read_text()
