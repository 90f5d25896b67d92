"""The signals that stop a process."""

import os
import pty
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

from vrg.bus.stopping import stop_on_signals
from vrg.testing.waiting import wait_until

PROGRAM = """
import pathlib, sys
from vrg.bus.stopping import stop_on_signals

with stop_on_signals() as stop:
    print("ready", flush=True)
    stop.wait(60.0)
    print("this goes nowhere", flush=True)
    pathlib.Path(sys.argv[1]).write_text(str(stop.signal))
"""


def test_a_closed_terminal_stops_a_process_in_order(tmp_path: Path) -> None:
    result = tmp_path / "signal"
    pid, terminal = pty.fork()
    if pid == 0:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # also where the tests run under nohup
        os.execv(sys.executable, [sys.executable, "-c", PROGRAM, str(result)])
    assert b"ready" in os.read(terminal, 1000)
    os.close(terminal)
    wait_until(result.exists, "the process to end in order")
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
    assert result.read_text() == str(int(signal.SIGHUP))


def test_another_thread_is_stopped_by_what_it_is_given_and_hears_no_signal() -> None:
    wanted, handler = Event(), signal.getsignal(signal.SIGINT)

    def waits() -> bool:
        with stop_on_signals(wanted) as stop:
            assert signal.getsignal(signal.SIGINT) is handler
            return stop.wait() and stop.is_set() and not stop.interrupted

    with ThreadPoolExecutor(1) as other:
        waiting = other.submit(waits)
        wanted.set()
        assert waiting.result()


def test_the_main_thread_is_stopped_by_a_signal_also_where_it_is_given_something_else() -> None:
    with stop_on_signals(Event()) as stop:
        assert not stop.wait(0.0)
        signal.raise_signal(signal.SIGINT)
        assert stop.wait()
        assert stop.interrupted
