"""One agent at a time supervises the processes of a run on one machine; what nobody has fetched is deleted later."""

import contextlib
import fcntl
import logging
import os
import shutil
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from vrg.errors import LaunchError

log = logging.getLogger(__name__)

NAME = ".agent"
"""The name of the lock in the run folder."""
_KEYS = "-keys"
"""What the name of the folder of a run's keys ends in."""
PATIENCE = 5.0
"""The real time in s that a killed agent may take to be gone."""


@contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Be the only agent of a run folder. An agent that is there already is killed: its launcher has lost it.

    The processes of the killed agent notice its end, and end by themselves.

    Raises:
        LaunchError: the agent that is there does not end.
    """
    path = folder / NAME
    with path.open("a+", encoding="ascii") as lock:
        deadline = time.monotonic() + PATIENCE
        while not _locked(lock):
            lock.seek(0)
            before = lock.read().strip()
            if time.monotonic() > deadline:
                raise LaunchError(f"{path}: expected the agent {before} to end within {PATIENCE:g} s")
            if before.isdigit() and int(before) != os.getpid():
                log.info("the agent %s, which has lost its launcher, is killed", before)
                with contextlib.suppress(ProcessLookupError):
                    os.kill(int(before), signal.SIGKILL)
            time.sleep(0.05)
        lock.truncate(0)
        lock.write(str(os.getpid()))
        lock.flush()
        try:
            yield
        finally:
            # A number that was left here might be another process' by then.
            lock.truncate(0)


def keys_folder(run: Path) -> Path:
    """The folder of the keys of a run's seats, beside the run folder, whose files travel back."""
    return run.with_name(f"{run.name}{_KEYS}")


def sweep_keys(home: Path) -> None:
    """Delete the keys of runs that no agent supervises, which agents that were killed have left.

    Args:
        home: the folder of the folders of runs.
    """
    for folder in list(home.glob(f"*{_KEYS}")):
        run = home / folder.name.removesuffix(_KEYS)
        with contextlib.suppress(OSError), contextlib.ExitStack() as stack:
            if folder.is_symlink() or not folder.is_dir():
                continue
            # Without a run folder there is no agent. While its lock is held here, none can begin.
            if run.is_dir() and not _locked(stack.enter_context((run / NAME).open("a+", encoding="ascii"))):
                continue
            log.info("deleting %s, which an agent has left", folder)
            shutil.rmtree(folder, ignore_errors=True)


def sweep(home: Path, older_than: float) -> None:
    """Delete folders of runs that nobody has fetched, and that no agent uses. Their keys are for `sweep_keys`.

    Args:
        home: the folder of these folders. older_than: the wall time before which they were written last, s.
    """
    for folder in home.iterdir() if home.is_dir() else ():
        try:
            if folder.name.endswith(_KEYS) or folder.is_symlink() or not folder.is_dir():
                continue
            if folder.stat().st_mtime > older_than:
                continue
            with (folder / NAME).open("a+", encoding="ascii") as lock:
                if not _locked(lock):
                    continue
                log.info("deleting %s, which nobody has fetched", folder)
                shutil.rmtree(folder, ignore_errors=True)
        except OSError as error:
            log.debug("%s: %s", folder, error)


def _locked(lock: TextIO) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
