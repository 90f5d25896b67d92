"""Folders that belong to one process at a time: of events and classes, of runs on other machines, and of keys.

A lock is a file in the folder, which its process holds as long as it lives. So a folder that a killed process has left
can be distinguished from one that is in use.
"""

import contextlib
import logging
import os
import signal
import socket
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import psutil

from vrg import system
from vrg.errors import LaunchError
from vrg.runs.run_folder import delete

log = logging.getLogger(__name__)

NAME = ".agent"
"""The name of the lock in a run folder."""
OWNER = ".owner"
"""The name of the lock in the folder of an event or a class."""
KEYS_LOCK = ".keys"
"""The name of the lock in a folder of keys that were made or brought for one run."""
KILL_TIMEOUT = 5.0
"""The real time in s that a killed agent may take to be gone."""
ENDING_TIMEOUT = 40.0
"""The real time in s within which what a killed process has started ends."""
_BOOT = Path("/proc/sys/kernel/random/boot_id")


def this_machine() -> str:
    """The identity of this machine since it was started, among others that may share its folders."""
    try:
        boot = _BOOT.read_text(encoding="ascii").strip()
    except OSError:
        boot = "-"
    return f"{socket.gethostname()} {boot}"


@contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Be the only agent of a run folder. An agent of this machine that is there is killed: its launcher has lost it.

    The processes of the killed agent notice its end, and end by themselves.

    Raises:
        LaunchError: the agent that is there does not end, or is one of another machine.
    """
    path = folder / NAME
    with path.open("a+", encoding="utf-8") as lock:
        deadline = time.monotonic() + KILL_TIMEOUT
        while not system.lock(lock):
            lock.seek(0)
            number, _, machine = lock.read().strip().partition(" ")
            if machine and machine != this_machine():
                other = machine.split()[0]
                raise LaunchError(f"{path}: an agent of {other} uses this folder, which both machines share")
            if time.monotonic() > deadline:
                raise LaunchError(f"{path}: expected the agent {number} to end within {KILL_TIMEOUT:g} s")
            if number.isdigit() and int(number) != os.getpid():
                log.info("the agent %s, which has lost its launcher, is killed", number)
                with contextlib.suppress(ProcessLookupError):
                    os.kill(int(number), signal.SIGKILL)
            time.sleep(0.05)
        lock.truncate(0)
        lock.write(f"{os.getpid()} {this_machine()}")
        lock.flush()
        try:
            yield
        finally:
            # A number that was left here might be another process' by then.
            lock.truncate(0)


@contextmanager
def owned(folder: Path, mode: int = 0o777) -> Iterator[None]:
    """Own a folder, which is made, together with the programs that this process starts with its inheritable files.

    It waits for processes that a killed owner has started.

    Args:
        mode: of a new folder.

    Raises:
        LaunchError: another process owns it, or it cannot be written.
    """
    try:
        folder.mkdir(mode, parents=True, exist_ok=True)
        lock = (folder / OWNER).open("a+", encoding="ascii")
    except OSError as error:
        raise LaunchError(f"{folder}: cannot be used: {error.strerror}: choose another folder") from None
    with lock:
        try:
            _take(lock, folder)
        except OSError as error:
            raise LaunchError(f"{folder}: cannot be locked: {error.strerror}: choose another folder") from None
        yield


def _take(lock: IO[str], folder: Path) -> None:
    """Wait for the lock of a folder, and write there whose it is."""
    deadline = time.monotonic() + ENDING_TIMEOUT
    while not system.lock(lock):
        lock.seek(0)
        owner = lock.read().strip()
        if (owner.isdigit() and psutil.pid_exists(int(owner))) or time.monotonic() > deadline:
            who = f"process {owner}, or what it has started," if owner.isdigit() else "another process"
            raise LaunchError(f"{folder}: {who} works here already: end it first, or choose another folder")
        time.sleep(0.05)
    lock.truncate(0)
    lock.write(str(os.getpid()))
    lock.flush()
    os.set_inheritable(lock.fileno(), True)


@contextmanager
def keys_lock(folder: Path) -> Iterator[None]:
    """Own a new folder of keys, which others delete once this process is gone."""
    # The lock is held before it has its name: another launcher may look for abandoned folders just now.
    unnamed = folder / (f"{KEYS_LOCK}.new" if system.POSIX else KEYS_LOCK)  # Windows does not rename what is open
    with unnamed.open("w") as lock:
        system.lock(lock, wait=True)
        if system.POSIX:
            unnamed.rename(folder / KEYS_LOCK)
        yield


def delete_abandoned_keys(folders: Iterable[Path]) -> None:
    """Delete those of these folders that were made or brought for one run, and whose process is gone."""
    for folder in folders:
        # A folder without a lock is being made, or is no such folder; only this user's can be opened or deleted.
        with contextlib.suppress(OSError), (folder / KEYS_LOCK).open("r+") as lock:
            if not folder.is_symlink() and system.lock(lock):
                log.info("deleting %s, whose process is gone", folder)
                delete(folder)


def keys_folder(run: Path) -> Path:
    """The folder of the keys of a run's seats, beside the run folder, whose files travel back."""
    return run.with_name(f"{run.name}-keys")


def sweep(home: Path, older_than: float) -> None:
    """Delete folders of runs that were not fetched, and that no agent uses, and all abandoned keys.

    Args:
        home: the folder of these folders. older_than: the wall time before which they were written last, s.
    """
    delete_abandoned_keys(home.glob(keys_folder(home / "*").name))
    for folder in home.iterdir() if home.is_dir() else ():
        try:
            if (folder / KEYS_LOCK).exists() or folder.is_symlink() or not folder.is_dir():
                continue
            if folder.stat().st_mtime > older_than:
                continue
            with (folder / NAME).open("a+", encoding="utf-8") as lock:
                if system.lock(lock):
                    log.info("deleting %s, which was not fetched", folder)
                    delete(folder)
        except OSError as error:
            log.debug("%s: %s", folder, error)
