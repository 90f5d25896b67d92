"""Searches the memory of sealed processes for an environment variable of who has started them."""

import contextlib
import os
import re
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

import psutil

from vrg.launch.sandbox.seal import missing
from vrg.testing.requirements import missing as lacking

STUCK = """
import time

from vrg.agents import Strategy


class Own(Strategy):
    def act(self, view):
        time.sleep(900)
"""
"""The code of a strategy that does not come to an end."""
SECRET = f"planted-{os.getpid()}-" + "0123456789" * 10
_PATIENCE = 120.0
"""The real time in s within which the code runs."""


def check_unknown(command: Sequence[str], place: Path, title: str) -> None:
    """Check that no sealed process of a command has the variable in its memory.

    Args:
        command: which runs `stuck.py`, or another program that lasts. place: the folder in which it runs.
        title: what the command line of a sealed process has, when it runs strangers' code.
    """
    (place / "stuck.py").write_text(STUCK)
    if (why := missing()) is not None:
        lacking(why)
    environment = os.environ | {"CI_SECRET_TOKEN": SECRET}
    with (place / "said").open("wb") as said, subprocess.Popen(
        command, cwd=place, env=environment, stdin=subprocess.PIPE, stdout=said, stderr=said
    ) as process:  # fmt: skip
        try:
            deadline, found = time.monotonic() + _PATIENCE, dict[int, int]()
            while process.poll() is None and not found:
                assert time.monotonic() < deadline, (place / "said").read_text()
                time.sleep(0.05)
                for pid in _sealed(process.pid, title):
                    with contextlib.suppress(ProcessLookupError, FileNotFoundError):  # it has ended meanwhile
                        found[pid] = _memory(pid).count(SECRET.encode())
            assert process.poll() is None, (place / "said").read_text()
            assert set(found.values()) == {0}, found
        finally:
            with contextlib.suppress(psutil.NoSuchProcess):
                for one in [*psutil.Process(process.pid).children(recursive=True), process]:
                    one.kill()


def _sealed(pid: int, title: str) -> list[int]:
    """The processes that have more filters of system calls than this one, of a process and those that it started."""
    found = [pid, *(child.pid for child in psutil.Process(pid).children(recursive=True))]
    return [one for one in found if _filters(one) > _filters(os.getpid()) and title in _command(one)]


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")
    except OSError:
        return ""


def _filters(pid: int) -> int:
    try:
        found = re.search(r"^Seccomp_filters:\s*(\d+)$", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    except OSError:
        return 0
    return 0 if found is None else int(found[1])


def _memory(pid: int) -> bytes:
    """All that a process can write, and what it was started with."""
    parts = []
    with open(f"/proc/{pid}/mem", "rb", buffering=0) as memory:
        for line in Path(f"/proc/{pid}/maps").read_text().splitlines():
            begin, end = (int(place, 16) for place in line.split()[0].split("-"))
            if line.split()[1].startswith("rw"):
                memory.seek(begin)
                try:
                    parts.append(memory.read(end - begin))
                except OSError:
                    continue  # a mapping of a device
    return b"".join(parts)
