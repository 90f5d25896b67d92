"""The rate of the messages on each key. More events than anything in a match publishes are a flood."""

import threading
from typing import Final

MAX_MESSAGE_RATE: Final = 2_000
"""The messages on one key in a second above which it is flooded. A player publishes 10 messages on a key in a second of
match time, and a match runs at most 100 times as fast as real time."""
RATE_WINDOW: Final = 1.0
"""The real time in s in which messages are counted."""


class FlowMeter:
    """Counts messages. A flooded key stays so until fewer than MAX_MESSAGE_RATE have come in a whole window.

    Any thread may call it: zenoh has one for each subscription.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._since = 0.0
        self._counts: dict[str, int] = {}
        self._before: frozenset[str] = frozenset()

    def admits(self, key: str, now: float) -> bool:
        """Count a message, and return whether it is no part of a flood.

        Args:
            now: real time of some clock, s.
        """
        with self._lock:
            if now - self._since >= RATE_WINDOW:
                self._before = self._over(now)
                self._since, self._counts = now, {}
            count = self._counts[key] = self._counts.get(key, 0) + 1
            return count <= MAX_MESSAGE_RATE and key not in self._before

    def flooded(self, now: float) -> frozenset[str]:
        """The keys that are flooded now."""
        with self._lock:
            return self._over(now)

    def _over(self, now: float) -> frozenset[str]:
        passed = now - self._since
        over = frozenset(key for key, count in self._counts.items() if count > MAX_MESSAGE_RATE)
        return over | self._before if passed < RATE_WINDOW else over if passed < 2 * RATE_WINDOW else frozenset()
