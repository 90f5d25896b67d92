"""The time of day of simulated processes, which each may have another one."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def time_of_day(now: Callable[[], float]) -> Iterator[None]:
    """Let `time.time` and `time.time_ns` return another time of day.

    Args:
        now: returns it, s.
    """
    real = time.time, time.time_ns
    time.time, time.time_ns = now, lambda: int(now() * 1e9)
    try:
        yield
    finally:
        time.time, time.time_ns = real
