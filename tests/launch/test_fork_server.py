"""The fork server, with processes that end at once or that leave others behind."""

import json
import os
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import psutil
import pytest

from vrg.launch.fork_server import UNKNOWN_STATUS, Child, ForkServer, fork_server
from vrg.testing.requirements import missing
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="it is started only on Linux")

PROGRAM = """
import os, subprocess, sys, time


def main(arguments):
    what = arguments[0]
    if what == "ends":
        return int(arguments[1])
    if what == "litters":
        # One in its own group, one in another session, and one whose parent has ended.
        sleep = [sys.executable, "-c", "import time; time.sleep(3600.0)"]
        started = [subprocess.Popen(sleep), subprocess.Popen(sleep, start_new_session=True)]
        if os.fork() == 0:
            os.setsid()
            lost = subprocess.Popen(sleep)
            print(lost.pid, flush=True)
            os._exit(0)
        os.wait()
        for process in started:
            print(process.pid, flush=True)
    print(os.getpid(), flush=True)
    if what != "litters" or arguments[1] == "stays":
        time.sleep(3600.0)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(autouse=True)
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "littering.py").write_text(PROGRAM, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.getcwd()}")


@pytest.fixture
def server() -> Iterator[ForkServer]:
    with fork_server(preload=["littering"]) as server:
        yield server


def run(server: ForkServer, log: Path, *arguments: str, forked: bool = True) -> Child:
    with log.open("ab") as output:
        return server.run("littering", arguments, output, forked=forked)


def status(child: Child) -> int | None:
    """That with which a process has ended."""
    assert child.wait(60.0)
    return child.poll()


def test_a_process_that_is_being_forked_is_known_although_stop_is_set(server: ForkServer, tmp_path: Path) -> None:
    server.stop = stop = threading.Event()
    run(server, tmp_path / "log", "ends", "0")
    stop.set()
    forked = run(server, tmp_path / "log", "ends", "3")
    assert server.alive
    assert status(forked) == 3


def test_processes_are_known_by_more_than_1024_files(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < 2048:
        missing("a limit of 2,048 open files")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 2048), hard))
    try:
        with ExitStack() as stack:
            for _ in range(1100):
                stack.enter_context(open(os.devnull))
            server = stack.enter_context(fork_server(preload=["littering"]))
            child = run(server, tmp_path / "log", "sleeps")
            child.kill()
            assert status(child) == -signal.SIGKILL
            assert server.alive
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_no_process_waits_for_a_server_that_still_loads_once_stop_is_set(server: ForkServer, tmp_path: Path) -> None:
    server.stop = stop = threading.Event()
    stop.set()
    spawned = run(server, tmp_path / "log", "ends", "3")
    assert not server.alive
    assert status(spawned) == 3, "it has an interpreter of its own"


def test_an_end_that_is_reported_late_keeps_its_status(server: ForkServer, tmp_path: Path) -> None:
    """A busy machine may let the server wait for its turn for a long time."""
    child = run(server, tmp_path / "log", "sleeps")
    child.send_signal(signal.SIGTERM)
    wait_until(lambda: _ended(child.pid), "the process to end")
    late, server.receive = server.receive, lambda: None  # type: ignore[method-assign]
    for _ in range(100):
        assert child.poll() is None
    server.receive = late  # type: ignore[method-assign]
    wait_until(lambda: child.poll() is not None, "the report")
    assert child.poll() == -signal.SIGTERM
    assert server.alive


def test_a_server_that_is_frozen_is_given_up(server: ForkServer, tmp_path: Path) -> None:
    child = run(server, tmp_path / "log", "sleeps")
    psutil.Process(server._pid).suspend()
    child.kill()
    wait_until(lambda: child.poll() is not None, "the end to be seen")
    assert child.poll() == UNKNOWN_STATUS
    assert not server.alive


@pytest.mark.parametrize("how", ["ends", "killed", "server killed", "interpreter of its own"])
def test_what_a_process_has_started_ends_with_it(server: ForkServer, tmp_path: Path, how: str) -> None:
    log = tmp_path / "log"
    forked = how != "interpreter of its own"
    child = run(server, log, "litters", "ends" if how == "ends" else "stays", forked=forked)
    wait_until(lambda: len(log.read_text().split()) == 4, "all to be started")
    left = {int(word) for word in log.read_text().split()} - {child.pid}
    if how == "server killed":
        process = psutil.Process(server._pid)
        process.kill()
        process.wait()
    if how != "ends":
        child.kill()
    wait_until(lambda: child.poll() is not None, "the end to be seen")
    # What has a session of its own is found only by the server.
    found = left if how in ("ends", "killed") else {pid for pid in left if _group(pid) == child.pid}
    wait_until(lambda: all(map(_ended, found)), f"{found} to be ended")
    for pid in left - found:
        os.kill(pid, signal.SIGKILL)


def test_a_helper_that_a_process_has_detached_lives_as_long_as_the_process(server: ForkServer, tmp_path: Path) -> None:
    """A driver may start a daemon; it is not ended because a window is closed."""
    log = tmp_path / "log"
    child = run(server, log, "litters", "stays")
    wait_until(lambda: len(log.read_text().split()) == 4, "all to be started")
    left = {int(word) for word in log.read_text().split()} - {child.pid}
    assert [status(run(server, tmp_path / "other", "ends", "0")) for _ in range(2)] == [0, 0]
    assert not any(map(_ended, left))
    child.kill()
    wait_until(lambda: all(map(_ended, left)), f"{left} to be ended")


def test_where_the_system_has_no_room_for_a_fork_the_server_and_its_processes_go_on(tmp_path: Path) -> None:
    code = "import os\n\nfork, count = os.fork, [0]\n\n\ndef full():\n    count[0] += 1\n"
    code += "    if count[0] == 2:\n        raise BlockingIOError(11, 'full')\n    return fork()\n\n\nos.fork = full\n"
    (tmp_path / "full.py").write_text(code)
    with fork_server(preload=["littering", "full"]) as server:
        first = run(server, tmp_path / "log", "sleeps")
        second = run(server, tmp_path / "log", "ends", "3")
        assert (status(second), first.poll(), server.alive) == (3, None, True), "it has an interpreter of its own"
        third = run(server, tmp_path / "log", "ends", "4")
        assert (status(third), server.alive) == (4, True)
        first.kill()
        assert first.wait(60.0)


def test_a_server_that_is_a_fork_ends_with_the_process_that_has_it(tmp_path: Path) -> None:
    code = (
        "import os, sys\nfrom vrg.launch.fork_server import ForkServer\n"
        "server = ForkServer()\nserver.start_as_fork()\nprint(server._pid, flush=True)\n"
        "sys.stdin.read()\nserver.close()\nprint('closed', flush=True)\n"
    )
    for kill in (True, False):
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        process = subprocess.Popen([sys.executable, "-c", code], text=True, **pipes)
        assert process.stdout is not None
        pid = int(process.stdout.readline())
        if kill:
            process.kill()
        out, _ = process.communicate()
        assert out == ("" if kill else "closed\n")
        wait_until(lambda pid=pid: _ended(pid), "the server to end")  # type: ignore[misc]


def _group(pid: int) -> int | None:
    try:
        return os.getpgid(pid)
    except ProcessLookupError:
        return None


def _ended(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def test_a_process_that_is_stuck_is_ended_although_an_answer_was_waiting(tmp_path: Path) -> None:
    """A connection that is closed with something unread is reset, which is another end than a closed one."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    log = tmp_path / "log"
    code = "from vrg.launch import forking; import socket; forking.serve_forks(socket.socket(fileno=0), patience=0.1)"
    with theirs, log.open("wb") as output, tempfile.TemporaryFile() as variables:
        variables.write(b"{}")
        variables.flush()
        server = subprocess.Popen([sys.executable, "-c", code], stdin=theirs.fileno())
        for what in (["sleeps"], ["ends", "0"]):
            stream, hold = socket.socketpair()
            descriptors = [stream.fileno(), output.fileno(), variables.fileno()]
            socket.send_fds(ours, [json.dumps(["littering", *what]).encode()], descriptors)
            stream.close()
            hold.close()
    wait_until(lambda: log.read_text().strip(), "the process to run")
    stuck = int(log.read_text())
    # The pids of both, and the status of the one that has ended, are never read.
    wait_until(lambda: len(psutil.Process(server.pid).children()) == 1, "the other one to end")
    ours.close()
    wait_until(lambda: not psutil.pid_exists(stuck), "the process to be ended")
    assert server.wait(30.0) == 0


OWN_FORKS = """
import os
import signal
import sys
import threading

from vrg.launch.fork_server import OwnForks

forks = OwnForks()
with open(os.devnull, "wb") as log:
    ends, killed, left = (forks.run("vrg.playing.strategy_process", (), log) for _ in range(3))
ends.stream.close()
assert ends.wait(60.0)
threads = [threading.Thread(target=killed.kill) for _ in range(8)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert killed.wait(60.0)
print(ends.poll(), killed.poll(), left.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a process does not end with who has forked it")
def test_a_fork_of_a_process_ends_by_itself_by_whoever_kills_it_and_with_that_process() -> None:
    done = subprocess.run([sys.executable, "-c", OWN_FORKS], capture_output=True, text=True, timeout=600, check=False)
    ended, killed, left = map(int, done.stdout.split())
    assert (ended, killed) == (0, -signal.SIGKILL), done.stderr
    wait_until(lambda: not psutil.pid_exists(left), "the last fork to end")


def test_an_answer_that_another_thread_has_taken_in_holds_nobody_up(monkeypatch: pytest.MonkeyPatch) -> None:
    with fork_server(preload=[]) as server:
        monkeypatch.setattr("vrg.launch.fork_server._readable", lambda *_: True)
        asking = threading.Thread(target=server.receive, daemon=True)
        asking.start()
        asking.join(60.0)
        assert not asking.is_alive()
        assert server.alive


def test_numpy_starts_no_thread_and_draws_other_numbers_in_each_process(tmp_path: Path) -> None:
    (tmp_path / "littering.py").write_text(
        "import numpy as np, os\n\ndef main(arguments):\n    threads = len(os.listdir('/proc/self/task'))\n"
        "    print(np.random.random(), threads, os.environ.get('OPENBLAS_NUM_THREADS'), flush=True)\n    return 0\n",
        encoding="utf-8",
    )
    log = tmp_path / "log"
    with fork_server(preload=["littering", "numpy"]) as server:
        assert server.alive
        for _ in range(2):
            assert run(server, log).wait(60.0)
    first, second = (line.split() for line in log.read_text().splitlines())
    assert first[1:] == second[1:] == ["1", str(os.environ.get("OPENBLAS_NUM_THREADS"))]
    assert first[0] != second[0]
