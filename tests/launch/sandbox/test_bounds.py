"""Bounds for students' code: memory and output."""

import io
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from vrg.blame import OutputFloodError
from vrg.launch.process_log import FLOOD_WINDOW, MAX_LOG_SIZE, ProcessLog
from vrg.launch.sandbox.bounds import OUTPUT_LIMIT, OUTPUT_WINDOW, BoundedOutput, bounded_memory, printing_to
from vrg.testing.waiting import wait_until


@pytest.fixture
def log(tmp_path: Path) -> ProcessLog:
    return ProcessLog(tmp_path / "ann.log")


def grown(log: ProcessLog, now: float) -> int:
    """What was written in a while, after a hundred bytes more."""
    with log.open() as file:
        file.write(b"x" * 100)
    return log.grow(now)


class TestOutput:
    def test_what_is_printed_arrives(self) -> None:
        stream = io.StringIO()
        with printing_to(BoundedOutput(stream)):
            print("hello")
            print("oh", file=sys.stderr)
        assert stream.getvalue() == "hello\noh\n"

    def test_a_flood_is_an_exception_in_whoever_prints(self) -> None:
        stream = io.StringIO()
        with pytest.raises(OutputFloodError, match="more than 2 MB within 10 s"):
            _print_for_ever(BoundedOutput(stream))
        assert len(stream.getvalue()) <= OUTPUT_LIMIT
        with pytest.raises(OutputFloodError):
            BoundedOutput(io.StringIO()).writelines(["x" * 1000] * (OUTPUT_LIMIT // 1000 + 1))

    def test_a_little_now_and_then_is_none(self) -> None:
        now = 0.0
        stream = io.StringIO()
        output = BoundedOutput(stream, lambda: now)
        for _ in range(20):
            output.write("x" * (OUTPUT_LIMIT // 2))
            now += OUTPUT_WINDOW / 2 + 1.0
        assert len(stream.getvalue()) == 20 * (OUTPUT_LIMIT // 2)


class TestLog:
    def test_one_that_is_too_long_begins_anew_and_its_end_is_kept(self, log: ProcessLog) -> None:
        with log.open() as file:
            file.write(b"old" * MAX_LOG_SIZE + b"\nlast line\n")
            file.flush()
            log.grow(0.0)
            assert log.size == 0
            file.write(b"new line\n")
        assert log.path.read_bytes() == b"new line\n"
        kept = log.path.with_suffix(".log.1").read_bytes()
        assert kept.endswith(b"last line\n")
        assert len(kept) == MAX_LOG_SIZE

    def test_one_that_its_process_has_emptied_is_noticed(self, tmp_path: Path) -> None:
        log = ProcessLog(tmp_path / "ann.log")
        with log.open() as file:
            for _ in range(2):  # to begin it anew is no such thing
                file.write(b"x" * (MAX_LOG_SIZE + 1))
                file.flush()
                log.grow(0.0)
            file.write(b"a confession\n")
            file.flush()
            log.grow(1.0)
            assert not log.emptied
            file.truncate(0)
            log.grow(2.0)
            assert log.emptied
        log.forget()
        assert not log.emptied, "another process writes to it"

    def test_what_was_written_is_counted_over_a_while_until_another_player_comes(self, log: ProcessLog) -> None:
        assert (log.size, log.grow(0.0), log.last_words(3), log.place(0)) == (0, 0, "", ""), "it is not there yet"
        assert [grown(log, now) for now in (0.0, 30.0, 61.0, FLOOD_WINDOW * 3)] == [100, 200, 200, 100]
        log.forget()
        assert log.grow(FLOOD_WINDOW * 3 + 1.0) == 0

    def test_a_process_in_an_endless_loop_says_where_it_is(self, tmp_path: Path) -> None:
        program = tmp_path / "stuck.py"
        program.write_text(
            "from vrg.launch.sandbox.bounds import say_where_on_request\n"
            "def spin():\n    print('ready', flush=True)\n    while True:\n        pass\n"
            "say_where_on_request()\nspin()\n"
        )
        log = ProcessLog(tmp_path / "stuck.log")
        with log.open() as output:
            process = subprocess.Popen([sys.executable, str(program)], stdout=output, stderr=output)
        try:
            wait_until(lambda: "ready" in log.last_words(1), "it to be ready")
            process.send_signal(signal.SIGUSR1)
            wait_until(lambda: log.place(0), "it to say where it is")
            assert log.place(0) in {f"stuck.py, line {line}, in spin" for line in (3, 4, 5)}
            assert log.place(log.size) == "", "an old dump is no news"
        finally:
            process.kill()
            process.wait()


class TestMemory:
    def test_who_asks_for_more_than_the_bound_gets_an_error_and_the_bound_is_lifted(self) -> None:
        before = resource.getrlimit(resource.RLIMIT_DATA)
        with bounded_memory(300):
            bytearray(200_000_000)
            with pytest.raises(MemoryError):
                bytearray(400_000_000)
        assert resource.getrlimit(resource.RLIMIT_DATA) == before
        bytearray(400_000_000)


class TestStuck:
    def test_a_node_whose_threads_cannot_run_any_more_is_ended_without_a_supervisor(self) -> None:
        program = (
            "import threading\nfrom vrg.bus.stopping import Stop\nfrom vrg.launch import process_main\n"
            "process_main.STUCK = 1.0\n"
            "threading.Thread(target=process_main._hold_leash, args=(Stop(),), daemon=True).start()\n"
            "sum(iter(int, 1))\n"
        )
        with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE) as process:
            assert process.wait(60.0) == -signal.SIGVTALRM


def _print_for_ever(output: BoundedOutput) -> None:
    with printing_to(output):
        while True:
            print("x" * 1000)
