"""Players that use too much memory or write too much, where the bounds within their processes have failed."""

import time
from collections.abc import Sequence

from vrg.launch.managed import HANDOVER, ManagedProcess
from vrg.launch.process_log import FLOOD, FLOOD_WINDOW
from vrg.launch.sandbox.excess import excess

PERIOD = 1.0
"""The real time in s between two looks at what the processes use."""
_SLACK, _OWN = 1.25, 500
"""A process may use this many times the memory that its strategy may use, and so many MB more."""


class Greed:
    """Looks regularly at what processes use.

    Args:
        memory: the most memory that a player's strategy may use, MB.
    """

    def __init__(self, memory: int) -> None:
        self._memory = memory
        self._looked = 0.0

    def look(self, processes: Sequence[ManagedProcess], now: float) -> list[tuple[ManagedProcess, str]]:
        """End players that use too much, and bound the logs of all.

        Args:
            processes: the processes of this machine. now: the monotonic time, s.

        Returns:
            the processes that were ended, each with the reason.
        """
        if now - self._looked < PERIOD:
            return []
        self._looked = now
        return [(process, why) for process in processes if (why := self._end_if_greedy(process, now))]

    def _end_if_greedy(self, process: ManagedProcess, now: float) -> str | None:
        written = process.log.grow(now) if process.ready else 0
        if not process.spec.seat or process.pid is None:
            return None
        if process.memory > 1_000_000 * (_SLACK * self._memory + _OWN):
            why = f"it uses more than {self._memory} MB of memory"
        elif written > FLOOD:
            why = f"it has written {written // 1_000_000} MB to its log within {FLOOD_WINDOW:g} s"
        elif found := excess(process.log.path.parents[1], process.spec.name, process.pid):
            why = found
        else:
            return None
        where = process.where()
        # It works, so it can stop its robot.
        process.terminate()
        process.wait_stopped(time.monotonic() + HANDOVER)
        return f"{why} ({where})" if where else why
