"""The relation of a process' own clock to the match clock, or to that of a robot. This module reads no clock.

Nobody's wall clock matters to a match: every stamp is match time, and every time-out a difference of one process'
monotonic time. So machines need not agree on the time of day, and a wall clock that is an hour off, or is set during
the match, changes nothing. What can differ between processes is how late they hear the match clock, and how fast their
own clocks run. Both follow from the times at which clock messages arrive: the least delayed messages form the lower
envelope of the arrival times, as in the filter of NTP (RFC 5905, section 10). Its slope is the drift.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

CLOCK_WINDOW: Final = 10.0
"""The time in s for which a clock message counts: clocks drift, and a world may fall behind."""
STOPPED: Final = 0.1
"""By how much every message of a second is later, s, if the match clock has stood still for a while and goes on."""
_RECENT: Final = 1.0
INTERVAL = 2.0
"""The length in s of the intervals of which the least delayed message counts for the drift."""
DRIFT_SAMPLES = 15
"""The number of intervals that the drift is estimated from."""
MIN_INTERVALS = 4
"""The number of intervals before there is a drift."""


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

    @property
    def quickest(self) -> tuple[float, float] | None:
        """The arrival of the least delayed message, and its match time minus that, s; None without a message."""
        return self._best[0] if self._best else None

    def match_time(self, monotonic: float) -> float | None:
        """The match time at a monotonic time, s; None without a clock message."""
        return monotonic + self._best[0][1] if self._best else None


@dataclass(frozen=True)
class ClockEstimate:
    """A process' view of the match clock.

    Args:
        late: how much later clock messages have arrived since the last estimate than the least delayed one of the last
            INTERVAL s, on average, s.
        drift: how much faster the process' clock runs than the match clock, s per s; None as long as it is not known.
            A world that cannot keep its pace counts here, too.
    """

    late: float
    drift: float | None


class ClockTracker:
    """Takes in the arrivals of clock messages, and estimates how late they come and how fast the own clock runs."""

    def __init__(self) -> None:
        self._rate = 0.0
        self._forget()

    def _forget(self) -> None:
        self._offset = ClockOffset(INTERVAL, math.inf)
        self._floors: deque[tuple[float, float]] = deque(maxlen=DRIFT_SAMPLES)
        """The arrival of the least delayed message of each past interval, and its offset, s."""
        self._began = -math.inf
        self._sum, self._count = 0.0, 0
        self._match_time = 0.0

    def heard(self, match_time: float, rate: float, now: float) -> None:
        """Take in a clock message.

        Args:
            match_time: the time in the message, s. rate: match seconds per real second; 0 if there is no such pace.
            now: the process' monotonic time at which it has arrived, s.
        """
        if rate != self._rate or match_time < self._match_time:
            # Another pace, or a world that went back in time: what was learnt no longer holds.
            self._forget()
        self._rate, self._match_time = rate, match_time
        if rate <= 0.0:
            return
        if now - self._began >= INTERVAL:
            if (floor := self._offset.quickest) is not None:
                self._floors.append(floor)
            self._began = now
        self._offset.heard(match_time / rate, now)
        self._sum += match_time / rate - now
        self._count += 1

    def estimate(self) -> ClockEstimate | None:
        """The present estimate; None without a message since the last one, or without a pace."""
        quickest = self._offset.quickest
        if quickest is None or self._count == 0:
            return None
        late = max(0.0, quickest[1] - self._sum / self._count)
        self._sum, self._count = 0.0, 0
        return ClockEstimate(late=late, drift=self._drift())

    def _drift(self) -> float | None:
        """The slope of the least squares line through the floors, downwards, s per s."""
        count = len(self._floors)
        if count < MIN_INTERVALS:
            return None
        mean_time = sum(time for time, _ in self._floors) / count
        mean = sum(offset for _, offset in self._floors) / count
        spread = sum((time - mean_time) ** 2 for time, _ in self._floors)
        return sum((time - mean_time) * (mean - offset) for time, offset in self._floors) / spread
