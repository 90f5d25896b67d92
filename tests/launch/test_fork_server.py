"""The fork server, with nodes that end at once."""

import sys
import threading
from pathlib import Path

import pytest

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
