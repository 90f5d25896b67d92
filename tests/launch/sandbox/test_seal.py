"""What a process can still do once it has sealed itself, tried in real processes."""

import asyncio
import contextlib
import ctypes
import fcntl
import mmap
import os
import platform
import pwd
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.launch.sandbox.sealed import policy, sealed
from vrg.errors import SandboxError
from vrg.launch.sandbox import landlock, seal
from vrg.launch.sandbox.syscalls import ARCHITECTURES
from vrg.testing.requirements import missing

REASON = seal.missing()


@pytest.fixture(autouse=True)
def _can_be_sealed() -> None:
    if REASON is not None:
        missing(REASON)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "code").mkdir()
    (tmp_path / "code" / "mine.py").write_text("MINE = 1\n")
    (tmp_path / "code" / "tricks.py").touch()
    (tmp_path / "code" / "theirs.py").write_text("THEIRS = 1\n")
    (tmp_path / "secret").write_text("of others")
    return tmp_path


Inside = Callable[[Callable[[], object]], object]


@pytest.fixture
def inside(folder: Path) -> Inside:
    """What an action returns or raises in a sealed process."""
    return lambda action: sealed(policy(folder), action)


@pytest.fixture
def listening() -> socket.socket:
    server = socket.create_server(("127.0.0.1", 0))
    server.settimeout(10.0)
    return server


def call(name: str, *arguments: int) -> None:
    """Make a system call by its number."""
    library = ctypes.CDLL(None, use_errno=True)
    library.syscall.restype = ctypes.c_long
    number = ARCHITECTURES[platform.machine()].numbers[name]
    if library.syscall(ctypes.c_long(number), *map(ctypes.c_long, arguments)) < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def listen() -> None:
    socket.socket().listen()


def bind() -> None:
    socket.socket().bind(("127.0.0.1", 0))


def fast_open() -> None:
    socket.socket().sendto(b"x", socket.MSG_FASTOPEN, ("127.0.0.1", 7448))


def reserve() -> None:
    with tempfile.TemporaryFile(dir=os.environ["VRG_PLAYER_FOLDER"]) as file:
        call("fallocate", file.fileno(), 1, 0, 1 << 20)


PARENT = os.getpid()
FORBIDDEN: dict[str, Callable[[], object]] = {
    "list the processes": lambda: os.listdir("/proc"),
    "read the memory of its parent": lambda: os.open(f"/proc/{PARENT}/mem", os.O_RDONLY),
    "write the memory of its parent": lambda: os.open(f"/proc/{PARENT}/mem", os.O_RDWR),
    "read the environment of its parent": Path(f"/proc/{PARENT}/environ").read_bytes,
    "trace its parent": lambda: call("ptrace", 16, PARENT, 0, 0),
    "read a process' memory": lambda: call("process_vm_readv", PARENT, 0, 0, 0, 0, 0),
    "write a process' memory": lambda: call("process_vm_writev", PARENT, 0, 0, 0, 0, 0),
    "look for its parent": lambda: os.kill(PARENT, 0),
    "kill everybody": lambda: os.kill(-1, signal.SIGCONT),
    "kill its group": lambda: os.kill(0, signal.SIGCONT),
    "get a handle of its parent": lambda: os.pidfd_open(PARENT),
    "fork": os.fork,
    "run a program": lambda: subprocess.run(["true"], check=False),
    "spawn a program": lambda: os.posix_spawn("/bin/true", ["true"], {}),
    "become a program": lambda: os.execv(sys.executable, ["python", "-c", "pass"]),
    "write elsewhere": lambda: Path(tempfile.gettempdir(), "x").write_text("x"),
    "write to /tmp": Path("/tmp/vrg-test-of-a-sandbox").touch,
    "write shared memory": Path("/dev/shm/vrg-test-of-a-sandbox").touch,
    "read passwords": Path("/etc/shadow").read_bytes,
    "read the home folder": lambda: os.listdir(pwd.getpwuid(os.getuid()).pw_dir),
    "read its environment": Path("/proc/self/environ").read_bytes,
    "read the environment of its thread": lambda: Path(f"/proc/self/task/{os.getpid()}/environ").read_bytes(),
    "read what is mounted": Path("/proc/self/mountinfo").read_text,
    "let memory grow as a stack does": lambda: mmap.mmap(-1, 1 << 20, flags=0x122),
    "use udp": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM),
    "use a local socket": lambda: socket.socket(socket.AF_UNIX),
    "ask the kernel for the network": lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW),
    "listen": listen,
    "bind": bind,
    "connect by fast open": fast_open,
    "choose its cores": lambda: os.sched_setaffinity(0, range(os.cpu_count() or 1)),
    "choose its priority": lambda: os.setpriority(os.PRIO_PROCESS, 0, 19),
    "bound its parent": lambda: resource.prlimit(PARENT, resource.RLIMIT_NOFILE),
    "raise its memory": lambda: resource.setrlimit(resource.RLIMIT_DATA, (-1, -1)),
    "use memory that is not counted": lambda: os.memfd_create("x"),
    "share memory with nobody": lambda: mmap.mmap(-1, 1 << 20),
    "share it by another name": lambda: mmap.mmap(-1, 1 << 20, flags=3 | mmap.MAP_ANONYMOUS),
    "map zeros": lambda: os.open("/dev/zero", os.O_RDWR),
    "reserve room on the disk": reserve,
    "wait for the disk": lambda: call("sync"),
    "watch files": lambda: call("inotify_init1", 0),
    "make others wait for a file": lambda: fcntl.fcntl(0, fcntl.F_SETLEASE, fcntl.F_RDLCK),
    "make a namespace": lambda: call("unshare", 0x10000000),
    "mount": lambda: call("mount", 0, 0, 0, 0, 0),
    "load a filter into the kernel": lambda: call("bpf", 0, 0, 0),
    "use io_uring": lambda: call("io_uring_setup", 8, 0),
    "keep keys in the kernel": lambda: call("keyctl", 0, 0, 0),
}


@pytest.mark.parametrize("action", FORBIDDEN.values(), ids=FORBIDDEN)
def test_it_cannot(folder: Path, inside: Inside, action: Callable[[], object]) -> None:
    def elsewhere() -> object:
        tempfile.tempdir = str(folder)
        return action()

    result = inside(elsewhere)
    raised = "not allowed to raise maximum limit" in str(result)
    assert isinstance(result, PermissionError) or raised, result


def test_it_reads_its_own_code_and_not_that_of_others(folder: Path, inside: Inside) -> None:
    code, own = folder / "code", folder / "own"

    def follow() -> str:
        (own / "link").symlink_to(folder / "secret")
        return (own / "link").read_text()

    assert inside((code / "mine.py").read_text) == "MINE = 1\n"
    assert isinstance(inside(lambda: os.link(code / "theirs.py", own / "x")), OSError)
    refused: list[Callable[[], object]] = [
        (code / "theirs.py").read_text,
        (folder / "secret").read_text,
        lambda: (code / "mine.py").write_text("x"),
        lambda: (code / "mine.py").chmod(0o777),
        lambda: os.symlink("/etc/shadow", code / "link"),
        follow,
    ]
    assert [type(inside(action)) for action in refused] == [PermissionError] * len(refused)


def test_it_writes_into_its_folder(folder: Path) -> None:
    def write() -> str:
        own = Path(os.environ["VRG_PLAYER_FOLDER"])
        (own / "deep").mkdir()
        (own / "deep" / "notes").write_text("hello")
        (own / "deep" / "notes").rename(own / "notes")
        with tempfile.TemporaryDirectory() as place:
            assert Path(place).is_relative_to(own)
        return (own / "notes").read_text()

    assert sealed(policy(folder), write) == "hello"
    assert (folder / "own" / "notes").read_text() == "hello"


def test_it_connects_to_a_port_of_its_policy_and_to_nothing_else(folder: Path, listening: socket.socket) -> None:
    port = listening.getsockname()[1]

    def connect() -> bytes:
        with socket.create_connection(("127.0.0.1", port), 10.0) as connection:
            return connection.recv(5)

    answers = threading.Thread(target=lambda: listening.accept()[0].sendall(b"hello"))
    answers.start()
    assert sealed(policy(folder, port=port), connect) == b"hello"
    answers.join()
    assert isinstance(sealed(policy(folder, port=port + 1), connect), PermissionError)
    listening.close()


def test_its_threads_are_sealed_too(folder: Path, inside: Inside) -> None:
    def read() -> object:
        with ThreadPoolExecutor(1) as pool:
            return type(pool.submit((folder / "secret").read_text).exception()).__name__

    assert inside(read) == "PermissionError"


def test_it_computes_imports_and_waits_as_usual(folder: Path) -> None:
    def work() -> object:
        import decimal  # noqa: PLC0415
        import random  # noqa: PLC0415

        import numpy as np  # noqa: PLC0415

        async def later() -> int:
            await asyncio.sleep(0.001)
            return 1

        os.kill(os.getpid(), signal.SIGCONT)
        random.seed()
        return asyncio.run(later()) + int(np.ones(3).sum()) + int(decimal.Decimal(1)) + len(os.urandom(4))

    assert sealed(policy(folder), work) == 9


def test_a_file_that_grows_for_ever_ends_at_its_bound(folder: Path) -> None:
    def grow() -> None:
        with (folder / "own" / "big").open("wb") as file:
            file.seek(seal.FILE_SIZE - 10)
            file.write(bytes(100))

    result = sealed(policy(folder), grow)
    assert isinstance(result, OSError)
    assert "too large" in str(result)
    assert (folder / "own" / "big").stat().st_size <= seal.FILE_SIZE


def test_endless_threads_end_at_the_bound_of_memory(inside: Inside) -> None:
    def endless() -> int:
        done, count = threading.Event(), 0
        with contextlib.suppress(RuntimeError):
            while count < 10_000:
                threading.Thread(target=done.wait, daemon=True).start()
                count += 1
        done.set()
        return count

    count = inside(endless)
    assert isinstance(count, int)
    assert 10 < count < 1000


def test_its_memory_is_bounded(inside: Inside) -> None:
    assert isinstance(inside(lambda: len(bytearray(2_000_000_000))), MemoryError)
    private = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
    assert inside(lambda: len(mmap.mmap(-1, 50_000_000, flags=private))) == 50_000_000


def test_it_has_one_core_by_its_number(folder: Path) -> None:
    cores = sorted(os.sched_getaffinity(0))
    found = [sealed(policy(folder, core=number), lambda: sorted(os.sched_getaffinity(0))) for number in range(4)]
    assert found == [[cores[number % len(cores)]] for number in range(4)]


def test_it_forgets_the_environment_that_its_process_was_started_with(folder: Path) -> None:
    code = f"""
import ctypes, os, re
from pathlib import Path
from tests.launch.sandbox.sealed import policy, sealed

def look():
    places = re.findall(r"^([0-9a-f]+)-([0-9a-f]+) rw.*\\[stack\\]", Path("/proc/self/maps").read_text(), re.MULTILINE)
    begin, end = (int(place, 16) for place in places[0])
    found = ctypes.string_at(begin, end - begin).count(b"t0" + b"ken")
    return found, os.environ.get("VRG_TEST_TOKEN"), os.environ.get("PATH")

print(sealed(policy(Path({str(folder)!r})), look))
"""
    environment = {**os.environ, "VRG_TEST_TOKEN": "t0ken"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str((0, None, os.environ["PATH"]))


def test_it_has_no_capability_and_gets_none(folder: Path) -> None:
    status = sealed(policy(folder), Path("/proc/self/status").read_text)
    assert isinstance(status, str)
    lines = dict(line.split(":\t", 1) for line in status.splitlines())
    assert {int(lines[name], 16) for name in ("CapInh", "CapPrm", "CapEff", "CapAmb")} == {0}
    assert (lines["NoNewPrivs"], lines["Seccomp"]) == ("1", "2")
    if os.geteuid() == 0:
        assert int(lines["CapBnd"], 16) == 0


def test_a_process_that_has_threads_already_is_not_sealed(folder: Path) -> None:
    def twice() -> str:
        done = threading.Event()
        thread = threading.Thread(target=done.wait)
        thread.start()
        try:
            seal.seal(policy(folder))
        except SandboxError as error:
            return str(error)
        finally:
            done.set()
            thread.join()
        return ""

    assert "before it starts threads, and this one has 2" in str(sealed(policy(folder), twice))


def test_a_machine_that_cannot_is_told_what_it_lacks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(landlock, "abi", lambda: 3)
    words = r"needs Landlock with ABI 4 \(Linux 6.7 or later\), and Linux .* has less: ABI 3: `sandbox = false`"
    with pytest.raises(SandboxError, match=words):
        seal.seal(policy(tmp_path))
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    with pytest.raises(SandboxError, match="needs a processor x86_64 or aarch64, and this is riscv64"):
        seal.seal(policy(tmp_path))
