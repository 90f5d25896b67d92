"""The units of systemd in deploy/, and what those of a plug-in are tested by."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command_line import Vrg, command_line

DEPLOY = Path(__file__).parents[1] / "deploy"


@pytest.mark.parametrize("unit", sorted(DEPLOY.glob("*.service")), ids=lambda unit: unit.name)
def test_its_command_exists_with_these_options(
    unit: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    check_command(unit, command_line(monkeypatch, capsys))


def test_systemd_accepts_them(tmp_path: Path) -> None:
    check_units(DEPLOY, tmp_path)


def check_command(unit: Path, vrg: Vrg) -> None:
    """The command of a service exists with its options."""
    found = re.search(r"^ExecStart=\S+/vrg (.+)$", unit.read_text(encoding="utf-8"), re.MULTILINE)
    assert found is not None
    words = found[1].split()
    command = words[:1] if words[0] == "play" else words[:2]
    told = vrg(*command, "--help")
    assert told.status == 0
    assert all(word in told.out for word in words if word.startswith("--"))


def check_units(folder: Path, place: Path) -> None:
    """Systemd accepts the units in a folder, by copies of them in another place that is empty."""
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd is not installed")
    units = sorted([*folder.glob("*.service"), *folder.glob("*.timer")])
    for unit in units:
        text = unit.read_text(encoding="utf-8").replace("/opt/vrg/.venv/bin/vrg", sys.executable)
        (place / unit.name).write_text(text, encoding="utf-8")
    command = ["systemd-analyze", "verify", "--man=no", *(str(place / unit.name) for unit in units)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
