"""The time of this computer that also passes while it sleeps: motors and other computers are awake meanwhile."""

import time

_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""The system's clock for it; a system without it has one that may stand still."""


def boot_time() -> float:
    """The s since the computer was started, those for which it slept among them."""
    return time.clock_gettime(_CLOCK)
