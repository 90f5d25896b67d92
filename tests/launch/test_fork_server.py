"""The fork server, with nodes that end at once."""

import json
import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import psutil
import pytest

from tests.system.harness import wait_until
from vrg.launch.fork_server import fork_server

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="it is started only on Linux")

NONSENSE = ("router", "not an endpoint")


def test_a_node_that_is_being_forked_is_known_although_somebody_says_stop(tmp_path: Path) -> None:
    stop = threading.Event()
    with fork_server() as server, (tmp_path / "log").open("wb") as log:
        server.stop = stop
        assert server.fork(NONSENSE, log) is not None
        stop.set()
        forked = server.fork(NONSENSE, log)
        assert forked is not None
        assert forked.wait(60.0) == 1


def test_nobody_waits_for_a_server_that_still_loads_once_somebody_says_stop(tmp_path: Path) -> None:
    stop = threading.Event()
    stop.set()
    with fork_server() as server, (tmp_path / "log").open("wb") as log:
        server.stop = stop
        assert server.fork(NONSENSE, log) is None
        assert not server.alive


STUCK = """
import os, signal, sys, time
from vrg.launch import fork_server

fork_server.ORPHANED = 0.1
fork_server._preload = lambda: None


def main(arguments):
    if arguments[0] == "ends":
        return 0
    print(os.getpid(), flush=True)
    time.sleep(3600.0)


fork_server.child.main = main
fork_server.main()
"""


def test_a_node_that_is_stuck_is_ended_although_an_answer_was_waiting_for_the_launcher(tmp_path: Path) -> None:
    """A connection that is closed with something unread is reset, which is another end than a closed one."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    log = tmp_path / "log"
    with theirs, log.open("wb") as output:
        server = subprocess.Popen([sys.executable, "-c", STUCK], stdin=theirs.fileno())
        for what in ("sleeps", "ends"):
            leash, hold = os.pipe()
            socket.send_fds(ours, [json.dumps([what]).encode()], [leash, output.fileno()])
            os.close(leash)
            os.close(hold)
    wait_until(lambda: log.read_text().strip(), "the node to run")
    node = int(log.read_text())
    # The pids of both, and the status of the one that has ended, are never read.
    wait_until(lambda: len(psutil.Process(server.pid).children()) == 1, "the other one to end")
    ours.close()
    wait_until(lambda: not psutil.pid_exists(node), "the node to be ended")
    assert server.wait(30.0) == 0
