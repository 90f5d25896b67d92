"""The clocks of the machine of one simulated process."""

from collections.abc import Iterator
from contextlib import contextmanager
from random import Random
from typing import ClassVar, Final
from unittest import mock

from vrg.hal.simulated_clock import SimulatedClock

DRIFT: Final = 1e-4
"""The most by which a machine's clock is faster or slower than another's, s per s."""
UPTIME: Final = 1e6
"""The most that a monotonic clock shows when the match begins, s."""
_EPOCH: Final = 1.7e9
"""The wall time when the match begins, s since 1970."""


class Machine:
    """The clocks of the machine of one simulated process. The monotonic clocks of machines begin anywhere and drift;
    wall clocks may be set, too.

    Args:
        clock: the simulated real time. random: draws how the machine's clocks begin and drift.

    Attributes:
        set_by: the time in s by which the wall clock was set forward or back.
    """

    running: ClassVar["Machine | None"] = None
    """The machine of the process that runs now; None between two."""
    asked: ClassVar[int] = 0
    """How often the wall time was asked for."""

    def __init__(self, clock: SimulatedClock, random: Random) -> None:
        self.set_by = 0.0
        self._clock = clock
        self._began, self.pace = random.uniform(0.0, UPTIME), 1.0 + random.uniform(-DRIFT, DRIFT)

    def monotonic(self) -> float:
        """The monotonic time of this machine, s."""
        return self._began + self.pace * self._clock.now()

    def wall(self) -> float:
        """The wall time of this machine, s since 1970."""
        return _EPOCH + self.pace * self._clock.now() + self.set_by

    def set_wall(self, seconds: float) -> None:
        """Set the wall clock forward, or back if negative, s."""
        self.set_by += seconds

    @contextmanager
    def runs(self) -> "Iterator[None]":
        """Let code run on this machine."""
        before, Machine.running = Machine.running, self
        try:
            yield
        finally:
            Machine.running = before


@contextmanager
def simulated_walls() -> Iterator[None]:
    """Let `time.time` be the wall clock of the machine whose process runs, and count how often it is asked for."""
    import time  # noqa: PLC0415 - replaced below

    real = time.time
    Machine.asked = 0

    def wall() -> float:
        if Machine.running is None:
            return real()
        Machine.asked += 1
        return Machine.running.wall()

    with mock.patch("time.time", wall):
        yield
