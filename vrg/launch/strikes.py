"""Counts the failures of a player until it is given up, in its own process or in a match in one process."""

from collections import deque

FAILURES = 5
"""The number of failures within STRIKE_WINDOW after which a player, or a process, is still started again."""
HANGS = 1
"""The number of times within STRIKE_WINDOW that a player may hang and still be started again."""
STRIKE_WINDOW = 60.0
"""The time in s in which failures are counted."""


class Strikes:
    """Counts the failures of one player or process."""

    def __init__(self) -> None:
        self._failures: deque[float] = deque()
        self._hangs: deque[float] = deque()

    def failure(self, now: float) -> bool:
        """It has failed at time `now`, s; whether it may be started again."""
        return _within_window(self._failures, now) <= FAILURES

    def hang(self, now: float) -> bool:
        """It has hung at time `now`, s; whether it may be started again."""
        return _within_window(self._hangs, now) <= HANGS


def _within_window(times: deque[float], now: float) -> int:
    """Add a time, forget those of before the window, and count the rest."""
    times.append(now)
    while now - times[0] > STRIKE_WINDOW:
        times.popleft()
    return len(times)
