"""The match time of what a process has noted by its own clock. This module reads no clock.

A clock message is some time on its way, and that time differs. The one that was least on its way tells best what match
time it was when; see also `vrg.bus.clock_tracker`.
"""

from collections import deque
from typing import Final

CLOCK_WINDOW: Final = 10.0
"""The time in s for which a clock message counts: clocks drift, and a world may fall behind."""
STOPPED: Final = 0.1
"""By how much every message of a second is later, s, if the match clock has stood still for a while and goes on."""
_RECENT: Final = 1.0


class ClockOffset:
    """Takes in the arrivals of clock messages, and converts times.

    Its result is late by what the least delayed message was on its way, which on one machine is about a millisecond.

    Args:
        kept: the time in s for which a message counts. stopped: by how much every message of a second is later, s, if
            the clock has stood still for a while and goes on; infinite for a clock that never does, so that whatever
            comes late counts as late.
    """

    def __init__(self, kept: float = CLOCK_WINDOW, stopped: float = STOPPED) -> None:
        self._kept, self._stopped = kept, stopped
        self._best: deque[tuple[float, float]] = deque()
        """Arrivals and match time minus arrival, s: each is better than all that came after it."""
        self._newest: tuple[float, float] | None = None

    def heard(self, match_time: float, now: float) -> None:
        """Take in a clock message.

        Args:
            match_time: in the message, s. now: the monotonic time of this process at which it arrived, s.
        """
        if self._newest is not None and (match_time < self._newest[0] or now < self._newest[1]):
            # The world went back to a snapshot: what was learnt no longer holds.
            self._best.clear()
        self._newest = match_time, now
        offset = match_time - now
        while self._best and self._best[-1][1] <= offset:
            self._best.pop()
        self._best.append((now, offset))
        recent = next(offset for arrival, offset in self._best if arrival >= now - _RECENT)
        while self._best[0][0] < now - self._kept or self._best[0][1] > recent + self._stopped:
            self._best.popleft()

    def match_time(self, monotonic: float) -> float | None:
        """The match time at a monotonic time, s; None without a clock message."""
        return monotonic + self._best[0][1] if self._best else None
