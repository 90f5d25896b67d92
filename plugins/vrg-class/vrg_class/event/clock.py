"""The clock of an event, which nobody sets while it runs."""

import time
from collections.abc import Callable

from vrg.system import boot_time


class EventClock:
    """Tells the wall time at the start of the event and the seconds since.

    Args:
        wall: tells the wall time, s. It is asked once. since: tells seconds that go on evenly.
    """

    def __init__(self, wall: Callable[[], float] = time.time, since: Callable[[], float] = boot_time) -> None:
        self._since = since
        self._offset = wall() - since()

    def now(self) -> float:
        """The time of the event, s since 1970."""
        return self._offset + self._since()
