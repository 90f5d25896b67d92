"""The units of systemd in deploy/."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command_line import command_line

DEPLOY = Path(__file__).parents[1] / "deploy"
UNITS = sorted([*DEPLOY.glob("*.service"), *DEPLOY.glob("*.timer")])


@pytest.mark.parametrize("unit", [unit for unit in UNITS if unit.suffix == ".service"], ids=lambda unit: unit.name)
def test_its_command_exists_with_these_options(
    unit: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = re.search(r"^ExecStart=\S+/vrg (.+)$", unit.read_text(encoding="utf-8"), re.MULTILINE)
    assert found is not None
    words = found[1].split()
    command = words[:1] if words[0] == "play" else words[:2]
    told = command_line(monkeypatch, capsys)(*command, "--help")
    assert told.status == 0
    assert all(word in told.out for word in words if word.startswith("--"))


def test_systemd_accepts_them(tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd is not installed")
    for unit in UNITS:
        text = unit.read_text(encoding="utf-8").replace("/opt/vrg/.venv/bin/vrg", sys.executable)
        (tmp_path / unit.name).write_text(text, encoding="utf-8")
    command = ["systemd-analyze", "verify", "--man=no", *(str(tmp_path / unit.name) for unit in UNITS)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
