"""Runs something in a process that has sealed itself."""

import os
import pickle
import signal
import traceback
from collections.abc import Callable
from pathlib import Path

from vrg.launch.sandbox.player_policy import entries_of, libraries
from vrg.launch.sandbox.policy import SealPolicy, files
from vrg.launch.sandbox.seal import seal

PATIENCE = 180
"""s of real time that a sealed process may take."""


def policy(folder: Path, *, port: int = 7447, core: int = 0) -> SealPolicy:
    """One by which `folder/code/mine.py` and `tricks.py` can be read, and `folder/own` be written."""
    code = [folder / "code" / "mine.py", folder / "code" / "tricks.py"]
    places = {"own": code, "folder": folder / "own"}
    allowed = files(libraries=libraries(), hidden=(), entries=entries_of, **places)  # type: ignore[arg-type]
    return SealPolicy(files=allowed, ports=(port,), folder=folder / "own", memory=400 + _used(), core=core)


def _used() -> int:
    """The memory in MB that a fork of this process, which may have run many tests, begins with."""
    pages = int(Path("/proc/self/statm").read_text().split()[5])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1_000_000


def sealed(wanted: SealPolicy, action: Callable[[], object]) -> object:
    """What an action returns or raises in a sealed process. `ChildProcessError` if the process did not survive it."""
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(PATIENCE)
        result: object
        try:
            seal(wanted)
            result = action()
        except BaseException as error:
            result = error if isinstance(error, OSError | RuntimeError | MemoryError | ValueError) else repr(error)
            traceback.print_exc()
        try:
            os.write(writer, pickle.dumps(result))
        finally:
            os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as answer:
        data = answer.read()
    _, status = os.waitpid(pid, 0)
    if not data:
        return ChildProcessError(status)
    found: object = pickle.loads(data)
    return found
