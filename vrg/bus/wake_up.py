"""The event by which zenoh's threads wake the thread of a node."""

from queue import Empty, SimpleQueue


class AutoResetEvent:
    """Wakes one waiting thread, and is reset by waking it. Any thread may set it, at any time.

    It wakes in half the time that a `threading.Condition` takes, because a `SimpleQueue` is written in C. Whatever a
    thread has done before `set` is seen by the thread whose `wait` returns after it.
    """

    def __init__(self) -> None:
        self._set: SimpleQueue[None] = SimpleQueue()

    def set(self) -> None:
        """Wake the thread that waits, or else let its next wait return at once."""
        if self._set.empty():
            self._set.put(None)

    def wait(self, timeout: float) -> bool:
        """Wait until the event is set, for at most `timeout` s, and reset it; return whether it was set."""
        try:
            self._set.get(timeout=timeout)
        except Empty:
            return False
        while not self._set.empty():
            self._set.get_nowait()
        return True
