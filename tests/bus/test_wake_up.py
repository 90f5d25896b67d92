"""The event that wakes a node's thread."""

import threading

import pytest

from vrg.bus.process import AutoResetEvent


@pytest.mark.parametrize("times", [1, 5])
def test_a_wait_after_one_set_or_several_returns_at_once_and_resets(times: int) -> None:
    event = AutoResetEvent()
    for _ in range(times):
        event.set()
    assert event.wait(10.0)
    assert not event.wait(0.0)


def test_nothing_that_was_done_before_a_set_is_missed() -> None:
    """Four threads append and set; the waiting thread sees every item, though several sets may become one."""
    event, items, count = AutoResetEvent(), list[int](), 2000
    threads = [
        threading.Thread(target=lambda: [(items.append(n), event.set()) for n in range(count)]) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    while len(items) < 4 * count:
        assert event.wait(10.0), f"{len(items)} items came, and then no wake-up"
    for thread in threads:
        thread.join()
