"""The signals that stop a process."""

import os
import pty
import signal
import sys
from pathlib import Path

from tests.system.harness import wait_until

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
