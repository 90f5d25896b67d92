"""Files that a power cut, a rotten disk or a stranger has left: no command shows a traceback, waits, or eats memory.

What is whole in them is shown; that is tested where each file is read. The files: those of a run, in which anybody may
have changed everything, and those that people write or copy.
"""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.writer import Writer

os.environ["SDL_VIDEODRIVER"] = "dummy"


from vrg.config.code_files import imported
from vrg.config.loading import load_match
from vrg.config.setup import read_setup
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import read_journal
from vrg.errors import VrgError
from vrg.hal.can.calibration import load_calibration
from vrg.hal.can.workshop.odrive.listener import read_endpoints
from vrg.hal.sim.map import MAPS, load_map
from vrg.modules import classes_in
from vrg.recording.recorded import read_recorded
from vrg.runs.change import branch_of
from vrg.runs.events import read_events
from vrg.runs.result import headline
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import read_steps
from vrg.testing.command_line import invoke
from vrg.testing.damage import check_no_file, check_refused, mutants
from vrg.testing.tiny import TINY

READ_BY: dict[str, tuple[str, ...]] = {
    "journal.jsonl": ("judge", "result", "why", "why --call 2", "stops", "diff"),
    "journal.jsonl.clock": ("result",),
    "evidence.bin": ("judge", "why --call 2"),
    "recording.mcap": ("judge", "stops", "plot", "diff"),
    "setup.json": ("judge", "result", "why --call 2", "stops", "plot"),
    "result.json": ("list",),
    "steps.jsonl": ("diff",),
    "fingerprint.json": ("diff",),
    "match.toml": ("list", "diff"),
}
"""The files of a run, and the commands that read each."""


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole run."""
    folder = tmp_path_factory.mktemp("played")
    (folder / "match.toml").write_text(TINY)
    options = ["--in-process", "--headless", "--rate", "max", "--runs", str(folder / "runs")]
    done = invoke("play", str(folder / "match.toml"), *options)
    assert done.exit_code == 0, done.output
    return next((folder / "runs").iterdir())


@pytest.fixture
def run(played: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(played, tmp_path / "runs" / "run"))


def outcome(command: str, run: Path, other: Path) -> str:
    """What a command prints about a run; nothing but an error in words ends it."""
    name, *options = command.split()
    words = {"list": [str(run.parent)], "diff": [str(run), str(other)]}.get(name, [str(run), *options])
    done = invoke("run", name, *words)
    if done.exception is not None and not isinstance(done.exception, VrgError | SystemExit):
        raise done.exception
    assert "\x1b" not in done.output, "what a file says steers no terminal"
    return f"{done.output}{done.exception or ''}"


@pytest.mark.parametrize("file", READ_BY)
@pytest.mark.parametrize("count", [8, pytest.param(150, marks=pytest.mark.thorough)])
def test_no_command_fails_on_a_run_with_a_damaged_file(run: Path, played: Path, file: str, count: int) -> None:
    for what, content in mutants((played / file).read_bytes(), count):
        (run / file).write_bytes(content)
        for command in READ_BY[file]:
            try:
                outcome(command, run, played)
            except Exception as error:
                raise AssertionError(f"`vrg run {command}` with {file}, {what}") from error
        shutil.copy(played / "result.json", run / "result.json")


@pytest.mark.parametrize("change", [(b'"bob"', b'"nobody"'), (b'"players":["bob","shark"]', b'"players":["bob"]')])
def test_a_call_about_others_than_the_match_has_is_told_without_its_proof(
    run: Path, played: Path, change: tuple[bytes, bytes]
) -> None:
    journal = run / "journal.jsonl"
    assert change[0] in journal.read_bytes()
    journal.write_bytes(journal.read_bytes().replace(*change))
    told = [outcome(f"why --call {number}", run, played) for number in (1, 2, 3)]
    assert all(f"Call {number}, " in text for number, text in enumerate(told, 1))
    assert any("There is no more to show" in text for text in told)


CALIBRATION = b'robot = "ann"\ntrack = 0.4\nmotion = { delay = 0.05 }\n\n[axes.0]\ndirection = 1\nratio = 50.0\n'
ENDPOINTS = b'{"fw_version": "0.6.10", "endpoints": {"axis0.error": {"id": 3, "type": "uint32", "access": "r"}}}'
CODE = b"""import helper
from vrg.agents import Strategy

class Mine(Strategy):
    def act(self, view):
        return 1
"""
READERS: dict[str, tuple[str, bytes | None, Callable[[Path], object]]] = {
    "map": ("yard.toml", MAPS.get("courtyard").read_bytes(), load_map),
    "match": ("match.toml", TINY.encode(), load_match),
    "calibration": ("ann.cal.toml", CALIBRATION, lambda path: load_calibration(path, [0])),
    "endpoints of an ODrive": ("flat_endpoints.json", ENDPOINTS, read_endpoints),
    "strategy": ("mine.py", CODE, lambda path: (classes_in(path), list(imported(path)))),
    "events": ("events.jsonl", b'{"what":"began","monotonic":1.5}\n{"what":"ended","monotonic":9}\n', read_events),
    "branch": ("branch.json", b'{"of":"runs/a","changes":[{"time":3.0,"player":"ann","strategy":""}]}',
               lambda path: branch_of(RunFolder(path.parent))),
    "journal": ("journal.jsonl", None, read_journal),
    "evidence": ("evidence.bin", None, lambda path: list(read_evidence(path))),
    "recording": ("recording.mcap", None, read_recorded),
    "steps": ("steps.jsonl", None, read_steps),
    "set-up": ("setup.json", None, read_setup),
}  # fmt: skip


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.thorough)])
def test_every_reader_refuses_in_words(played: Path, tmp_path: Path, kind: str, count: int) -> None:
    name, content, read = READERS[kind]
    whole = (played / name).read_bytes() if content is None else content
    check_refused(read, tmp_path / name, whole, count)


@pytest.mark.parametrize("kind", READERS)
def test_nobody_waits_for_a_pipe_or_reads_a_device(tmp_path: Path, kind: str) -> None:
    name, _, read = READERS[kind]
    check_no_file(read, tmp_path, name)


@pytest.mark.parametrize("file", READ_BY)
def test_a_pipe_or_a_tower_of_brackets_in_a_run_ends_no_list(run: Path, played: Path, file: str) -> None:
    for make in (os.mkfifo, lambda path: path.write_bytes(b"[" * 200_000)):
        (run / file).unlink()
        make(run / file)
        assert "run" in outcome("list", run, played)
        for command in ("judge", "result", "stops", "why"):
            outcome(command, run, played)
        shutil.copy(played / "result.json", run / "result.json")


def test_a_chunk_that_unpacks_to_far_more_than_it_is_is_left_out(run: Path, played: Path) -> None:
    with (run / "recording.mcap").open("wb") as stream:
        writer = Writer(stream, chunk_size=1 << 30)
        writer.start(profile="", library="vrg")
        channel = writer.register_channel("/robot/ann/pose", "json", 0)
        writer.add_message(channel, 0, bytes(40_000_000), 0)
        writer.finish()  # type: ignore[no-untyped-call]
    assert (run / "recording.mcap").stat().st_size < 100_000
    assert "no disagreement" in outcome("judge", run, played)
    assert read_recorded(run / "recording.mcap").torn == [run / "recording.mcap"]


def test_files_that_do_not_belong_together_are_told(run: Path, played: Path) -> None:
    journal = (run / "journal.jsonl").read_text()
    (run / "journal.jsonl").write_text(journal.replace('"seed":3', '"seed":99', 1))
    assert "the journal is of tiny (sharks-and-minnows, seed 99), its set-up of tiny" in outcome("judge", run, played)


def test_a_result_that_tells_more_than_the_journal_is_kept(run: Path, played: Path) -> None:
    journal = (run / "journal.jsonl").read_text()
    (run / "journal.jsonl").write_text(journal[: len(journal) // 2])
    result = (run / "result.json").read_text()
    assert "it is kept" in outcome("result", run, played)
    assert (run / "result.json").read_text() == result
    (run / "result.json").unlink()
    assert "Written to" in outcome("result", run, played)


@pytest.mark.parametrize(
    ("command", "written"), [("plot", "trajectories.png"), ("result", "result.json"), ("why --call 2", "why-2.png")]
)
def test_what_is_written_into_a_run_follows_no_link(
    run: Path, played: Path, tmp_path: Path, command: str, written: str
) -> None:
    mine = tmp_path / "mine"
    mine.write_text("mine")
    (run / written).unlink(missing_ok=True)
    (run / written).symlink_to(mine)
    outcome(command, run, played)
    assert mine.read_text() == "mine"
    assert (run / written).is_file()
    assert not (run / written).is_symlink()


def test_what_a_run_says_is_printed_as_it_is_written_in_python(run: Path, played: Path) -> None:
    result = (run / "result.json").read_text().replace('"game over"', '"\\u001b[2Jgone"')
    (run / "result.json").write_text(result)
    assert "\\x1b[2Jgone" in outcome("list", run, played)
    assert headline({"ended": "x"}) == "X"
