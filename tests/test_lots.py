"""scripts/lots runs every test, says at the end what failed, and runs the other lots all the same."""

import importlib.machinery
import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def lots(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    """The script as a module; what lots print goes to a folder of the test's."""
    loader = importlib.machinery.SourceFileLoader("lots", str(ROOT / "scripts" / "lots"))
    spec = importlib.util.spec_from_loader("lots", loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "lots", module)  # dataclasses look their module up
    loader.exec_module(module)
    monkeypatch.setattr(module, "HERE", tmp_path)
    monkeypatch.setattr(module, "LOGS", tmp_path)
    return module


def paths(lots: ModuleType, marks: str) -> list[Path]:
    """The files and folders of all lots whose tests have these marks."""
    commands = [command for lot in lots.all_lots(thorough=True) for command in lot.commands if "pytest" in command]
    return [
        ROOT / path
        for command in commands
        if marks in command
        for path in command
        if path.startswith(("tests/", "plugins/"))
    ]


def test_every_file_with_tests_is_in_a_lot(lots: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lots, "HERE", ROOT)
    marked = {
        marks: rf"(?m)^\s*(@|pytestmark = .*)pytest\.mark\.{name}\b"
        for marks, name in ((lots.SYSTEM, "system"), (lots.VCAN, "vcan"))
    }
    here = Path(__file__)
    files = [*(ROOT / "tests").rglob("test_*.py"), *ROOT.glob("plugins/*/tests/**/test_*.py")]
    files.remove(here)
    missing = [
        f"{path.relative_to(ROOT)} in {marks!r}"
        for marks, pattern in (*marked.items(), (lots.FAST, r"def test_|Contract\)"))
        for path in files
        if re.search(pattern, path.read_text()) and not (marks == lots.FAST and "tests/system/" in str(path))
        if not any(path.is_relative_to(given) for given in paths(lots, marks))
    ]
    assert not missing, "\n".join(missing)
    for marks in (lots.SYSTEM, lots.FAST, lots.VCAN):
        named = paths(lots, marks)
        assert len(set(named)) == len(named), f"a file is in two lots of {marks!r}"
        assert all(path.exists() for path in named), named


def test_all_lots_run_and_the_end_says_how_to_repeat_what_failed(
    lots: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def says(*lines: str, status: int = 0) -> tuple[str, ...]:
        return (sys.executable, "-c", f"print({chr(10).join(lines)!r}); raise SystemExit({status})")

    failed = "FAILED tests/test_a.py::test_b[x - y] - AssertionError: no"
    broken = (*says("....", failed, "1 failed, 3 passed in 1.00s", status=1), *lots.PYTEST, "-m", "not system")
    slow = ("2.25s call     tests/test_a.py::test_slow[x y]", "0.50s setup    tests/test_a.py::test_slow[x y]")
    monkeypatch.setattr(
        lots,
        "all_lots",
        lambda thorough: [
            lots.Lot("first", (says("one"), says(*slow, "2 passed in 0.10s"))),
            lots.Lot("broken", (broken,)),
            lots.Lot("checks", (says("found 3 errors", status=2), says("never said"))),
            lots.Lot("nothing", (("/nowhere/command",),)),
            lots.Lot("last", (says("5 passed, 1 skipped in 9.00s"),)),
        ],
    )
    monkeypatch.setattr(sys, "argv", ["lots"])
    assert lots.main() == 1
    printed = capsys.readouterr().out
    for line in (r"first    green  0:0\d +\d s  2 passed", r"broken   RED    0:0\d +\d s  1 failed, 3 passed",
                 r"checks   RED    0:0\d +\d s  found 3 errors", r"last     green  0:0\d +\d s  5 passed, 1 skipped",
                 r" 2\.8 s  tests/test_a\.py::test_slow\[x y\]"):  # fmt: skip
        assert re.search(line, printed), f"{line}\n{printed}"
    assert re.search(r"nothing +RED .*No such file", printed)
    assert "3 of 5 lots are red" in printed
    assert "-m 'not system' 'tests/test_a.py::test_b[x - y]'" in printed
    assert "scripts/lots checks" in printed
    assert "never said" not in (tmp_path / "checks.log").read_text().split("\n", 1)[1]
    monkeypatch.setattr(sys, "argv", ["lots", "first", "last"])
    assert lots.main() == 0
    assert "all 2 lots are green" in capsys.readouterr().out


def test_a_name_that_no_lot_has_is_told() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "scripts" / "lots", "none"], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 2
    assert "expected beginnings of lint, system-match, system-machines" in done.stderr


def test_what_failed_is_run_once_more_alone_and_named(
    lots: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    ended = tmp_path / "ended"

    def command(code: str) -> tuple[str, ...]:
        return (sys.executable, "-c", f"import pathlib, time; ended = pathlib.Path({str(ended)!r}); {code}")

    def first(*failed: str) -> object:
        lines = "\n".join(f"FAILED tests/test_a.py::{test} - no" for test in failed)
        return lots.Lot("first", (command(f"print({lines!r}); raise SystemExit(1)"),))

    def beside() -> object:
        return lots.Lot("beside", (command("time.sleep(0.5); ended.touch(); print('1 passed')"),))

    fails = {True: "raise SystemExit('no')", False: "print('yes'); raise SystemExit(not ended.exists())"}
    monkeypatch.setattr(lots.Lot, "alone", lambda lot, test: command(fails[test.endswith("always")]))
    monkeypatch.setattr(sys, "argv", ["lots"])
    many = [f"seldom{number}" for number in range(lots.AGAIN + 1)]
    for failed, status, told in (
        (["seldom"], 0, r"green after 0:\d\d, but these passed only alone.*\n    tests/test_a.py::seldom\n$"),
        (["seldom", "always"], 1, "1 of 2 lots are red"),
        (many, 1, "1 of 2 lots are red"),
    ):
        ended.unlink(missing_ok=True)
        monkeypatch.setattr(lots, "all_lots", lambda thorough, failed=failed: [first(*failed), beside()])
        assert lots.main() == status
        printed = capsys.readouterr().out
        assert re.search(told, printed), printed
        assert ("first-again-1" in printed) == (failed != many)


def test_one_lot_more_runs_than_there_are_processors_and_one_of_them_in_real_time(
    lots: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Each lot writes its priority and which lots run, itself included; the first waits until two others do."""
    running = tmp_path / "running"
    running.mkdir()

    def lot(name: str, *, real_time: bool) -> object:
        code = (
            "import os, pathlib, sys, time\n"
            "folder, name = pathlib.Path(sys.argv[1]), sys.argv[2]\n"
            "(folder / name).touch()\n"
            "while len(os.listdir(folder)) < 3 if name == 'real0' else not (folder.parent / 'real0').exists():\n"
            "    time.sleep(0.05)\n"
            "(folder.parent / name).write_text(' '.join([str(os.nice(0)), *os.listdir(folder)]))\n"
            "(folder / name).unlink()\n"
            "print('1 passed')\n"
        )
        return lots.Lot(name, (("timeout", "300", sys.executable, "-c", code, str(running), name),), real_time)

    made = [lot(f"real{number}", real_time=True) for number in range(2)]
    made += [lot(f"unit{number}", real_time=False) for number in range(4)]
    monkeypatch.setattr(lots, "all_lots", lambda thorough: made)
    monkeypatch.setattr(sys, "argv", ["lots", "--jobs", "3"])
    assert lots.main() == 0
    written = {path.name: path.read_text().split() for path in tmp_path.glob("*[0-9]")}
    assert len(written) == 6
    niceness = {name: int(words[0]) for name, words in written.items()}
    for name, (_, *beside) in written.items():
        assert len(beside) <= 3
        assert sum(other.startswith("real") for other in beside) <= 1
        assert (niceness[name] > niceness["real0"]) == name.startswith("unit")
    assert len(written["real0"]) == 1 + 3, "something computes beside it"
