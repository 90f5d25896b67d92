"""The time without any sign of the other side of a connection. This module reads no clock."""

LAUNCHER_TIMEOUT = 10.0
"""The time in s without any sign of the launcher, over ssh or on the bus, after which an agent stops its processes and
ends. Robots do not wait for this: each stands as soon as its player, the referee or the clock is silent."""
MAX_PAUSE = 0.5
"""The longest real time in s that counts for a pause between two looks. A side that did not run for longer, because its
machine was busy or stood still, could not hear the other one."""


class Silence:
    """Counts the time in which one side has looked and heard nothing.

    Args:
        now: the monotonic time, s; so in all methods.

    Attributes:
        seconds: how long the silence lasts.
    """

    def __init__(self, now: float) -> None:
        self._looked = now
        self.seconds = 0.0

    def look(self, now: float, *, heard: bool) -> float:
        """Take in whether anything has arrived since the last look, and return how long the silence lasts, s."""
        self.seconds = 0.0 if heard else self.seconds + min(max(0.0, now - self._looked), MAX_PAUSE)
        self._looked = now
        return self.seconds
