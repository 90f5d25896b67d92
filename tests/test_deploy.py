"""The units of systemd in deploy/, and in such a folder of a plug-in."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from vrg.testing.command_line import command_line

ROOT = Path(__file__).parents[1]
FOLDERS = [ROOT / "deploy", *sorted(ROOT.glob("plugins/*/deploy"))]
SERVICES = [unit for folder in FOLDERS for unit in sorted(folder.glob("*.service"))]


@pytest.mark.parametrize("unit", SERVICES, ids=lambda unit: unit.name)
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


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.parent.name)
def test_systemd_accepts_them(folder: Path, tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd is not installed")
    units = sorted([*folder.glob("*.service"), *folder.glob("*.timer")])
    for unit in units:
        text = unit.read_text(encoding="utf-8").replace("/opt/vrg/.venv/bin/vrg", sys.executable)
        (tmp_path / unit.name).write_text(text, encoding="utf-8")
    command = ["systemd-analyze", "verify", "--man=no", *(str(tmp_path / unit.name) for unit in units)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
