"""The relation of a process' own clock to the match clock. This module reads no clock.

Nobody's wall clock matters to a match: every stamp is match time, and every time-out a difference of one process'
monotonic time. So machines need not agree on the time of day, and a wall clock that is an hour off, or is set during
the match, changes nothing. What can differ between processes is how late they hear the match clock, and how fast their
own clocks run. Both follow from the times at which clock messages arrive: the least delayed messages of each interval
form the lower envelope of the arrival times, as in the filter of NTP (RFC 5905, section 10). Its slope is the drift.
"""

from collections import deque
from dataclasses import dataclass

INTERVAL = 2.0
"""The length in s of the intervals of which the least delayed message counts."""
DRIFT_SAMPLES = 15
"""The number of intervals that the drift is estimated from."""
MIN_INTERVALS = 4
"""The number of intervals before there is a drift."""


@dataclass(frozen=True)
class ClockEstimate:
    """A process' view of the match clock.

    Args:
        late: how much later clock messages have arrived since the last estimate than the least delayed one of the last
            interval, on average, s.
        drift: how much faster the process' clock runs than the match clock, s per s; None as long as it is not known.
            A world that cannot keep its pace counts here, too.
    """

    late: float
    drift: float | None


class ClockTracker:
    """Takes in the arrivals of clock messages."""

    def __init__(self) -> None:
        self._floors: deque[tuple[float, float]] = deque(maxlen=DRIFT_SAMPLES)
        """Of each past interval, the arrival of the least delayed message and its offset, s."""
        self._floor: tuple[float, float] | None = None
        self._began = 0.0
        self._sum = 0.0
        self._count = 0
        self._rate = 0.0
        self._match_time = 0.0

    def heard(self, match_time: float, rate: float, now: float) -> None:
        """Take in a clock message.

        Args:
            match_time: the time in the message, s. rate: match seconds per real second; 0 if there is no such pace.
            now: the process' monotonic time at which it has arrived, s.
        """
        if rate != self._rate or match_time < self._match_time:
            # Another pace, or a world that went back in time: what was learnt no longer holds.
            self._floors.clear()
            self._floor = None
            self._sum, self._count = 0.0, 0
        self._rate, self._match_time = rate, match_time
        if rate <= 0.0:
            return
        offset = now - match_time / rate
        if self._floor is None or now - self._began >= INTERVAL:
            if self._floor is not None:
                self._floors.append(self._floor)
            self._floor, self._began = (now, offset), now
        elif offset < self._floor[1]:
            self._floor = (now, offset)
        self._sum += offset
        self._count += 1

    def estimate(self) -> ClockEstimate | None:
        """The present estimate; None without a message since the last one, or without a pace."""
        if self._floor is None or self._count == 0:
            return None
        before = self._floors[-1][1] if self._floors else self._floor[1]
        late = max(0.0, self._sum / self._count - min(before, self._floor[1]))
        self._sum, self._count = 0.0, 0
        return ClockEstimate(late=late, drift=self._slope())

    def _slope(self) -> float | None:
        """The slope of the least squares line through the floors, s per s."""
        count = len(self._floors)
        if count < MIN_INTERVALS:
            return None
        mean_time = sum(time for time, _ in self._floors) / count
        mean = sum(offset for _, offset in self._floors) / count
        spread = sum((time - mean_time) ** 2 for time, _ in self._floors)
        return sum((time - mean_time) * (offset - mean) for time, offset in self._floors) / spread
