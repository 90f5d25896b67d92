"""Waiting in a test for what happens in another thread or process."""

import threading
import time
from collections.abc import Callable

DEADLINE = 150.0
"""s of real time for what happens outside the bus, where nothing tells how slow the machine is."""


def wait_until(
    condition: Callable[[], object], what: str, alert: Callable[[], None] = lambda: None, patience: float = DEADLINE
) -> None:
    """Wait until a condition holds.

    Args:
        what: is waited for, in words. alert: called at each look; raises where waiting has become useless.
        patience: s of real time.

    Raises:
        AssertionError: it does not hold within `patience`.
    """
    deadline = time.monotonic() + patience
    pause = threading.Event()
    while not condition():
        alert()
        assert time.monotonic() < deadline, f"waited {patience:g} s for {what}"
        pause.wait(0.02)
