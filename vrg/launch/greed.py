"""Players that use too much memory or write too much, where the bounds within their processes have failed."""

import contextlib
import queue
import re
import threading
from collections.abc import Collection, Iterator, Sequence

import psutil

from vrg.launch.managed import ManagedProcess
from vrg.launch.process_log import FLOOD_SIZE, FLOOD_WINDOW
from vrg.launch.sandbox.excess import proc_text

CHECK_PERIOD = 1.0
"""The real time in s between two looks at what the processes use."""
_PAGE_TABLES = re.compile(r"^VmPTE:\s+(\d+) kB", re.MULTILINE)
_SLACK, _OWN = 1.25, 500
"""A process may use this many times the memory that its strategy may use, and this many MB more."""


class Greed:
    """Looks regularly at what processes use, in its own thread: a folder may take long to look through.

    Args:
        memory: the most memory that a player's strategy may use, MB.
    """

    def __init__(self, memory: int) -> None:
        self._memory = memory
        self._looked = 0.0
        self._looking: threading.Thread | None = None
        self._found: queue.SimpleQueue[tuple[ManagedProcess, int, str]] = queue.SimpleQueue()

    def look(self, processes: Sequence[ManagedProcess], now: float) -> Iterator[tuple[ManagedProcess, str]]:
        """The players that have been found to use too much since the last call, each with the reason.

        Args:
            processes: the processes of this machine, whose logs are bounded besides. now: the monotonic time, s.
        """
        while not self._found.empty():
            process, pid, why = self._found.get()
            if process.pid == pid:
                yield process, why
        if now - self._looked >= CHECK_PERIOD and (self._looking is None or not self._looking.is_alive()):
            self._looked = now
            watched = [(p, running) for p in processes if p.ready and (running := p.pid) is not None]
            self._looking = threading.Thread(target=self._look, args=(watched, now), daemon=True)
            self._looking.start()

    def _look(self, watched: Sequence[tuple[ManagedProcess, int]], now: float) -> None:
        used = _memory([pid for process, pid in watched if process.spec.plays])
        for process, pid in watched:
            written = process.log.grow(now)
            if not process.spec.plays:
                continue
            if used[pid] > 1_000_000 * (_SLACK * self._memory + _OWN):
                why = f"it uses more than {self._memory} MB of memory"
            elif process.log.emptied:
                why = "it has emptied its log"
            elif written > FLOOD_SIZE:
                why = f"it has written {written // 1_000_000} MB to its log within {FLOOD_WINDOW:g} s"
            else:
                continue
            self._found.put((process, pid, why))


def _memory(pids: Collection[int]) -> dict[int, int]:
    """The memory in bytes of processes together with those that they have started; 0 for those that have ended."""
    used = dict.fromkeys(pids, 0)
    if not used:
        return used
    parents: dict[int, int] = {}
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            parents[process.pid] = process.ppid() or 0
    # Some systems list process 0 as its own parent, and a number may be another process' by now.
    for pid in parents:
        owner, seen = pid, set[int]()
        while owner in parents and owner not in used and owner not in seen:
            seen.add(owner)
            owner = parents[owner]
        if owner in used:
            with contextlib.suppress(psutil.Error):
                used[owner] += psutil.Process(pid).memory_info().rss + _page_tables(pid)
    return used


def _page_tables(pid: int) -> int:
    """The memory in bytes that the kernel needs to know where a process' memory is; 0 where it does not tell."""
    found = _PAGE_TABLES.search(proc_text(pid, "status"))
    return 1024 * int(found[1]) if found else 0
