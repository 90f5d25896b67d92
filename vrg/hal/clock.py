"""Time as drivers and devices get it: that of this computer, or simulated time, in which nothing really waits."""

import queue
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, Final, Protocol, TypeVar

from vrg.system import boot_time

T = TypeVar("T")


class Task(Protocol):
    """Work that goes on beside its caller, as a `threading.Thread` does."""

    def is_alive(self) -> bool:
        """Return whether it has not ended."""

    def join(self, timeout: float | None = None) -> None:
        """Wait until it has ended, for `timeout` seconds at most."""


class MonotonicClock(ABC):
    """Monotonic time, and everything that waits for it.

    Attributes:
        pause: s between looks at a condition that is waited for.
    """

    pause: ClassVar[float] = 0.005

    @abstractmethod
    def now(self) -> float:
        """Monotonic time, s."""

    @abstractmethod
    def sleep(self, seconds: float) -> None:
        """Return when this time has passed."""

    @abstractmethod
    def spawn(self, work: Callable[[], None], name: str) -> Task:
        """Let work go on beside the caller."""

    def take(self, items: "queue.Queue[T]", patience: float) -> T:
        """Return the next item of a queue, and wait for it for `patience` seconds.

        Raises:
            queue.Empty: none came.
        """
        self.wait(lambda: not items.empty(), patience)
        return items.get_nowait()

    def wait(self, condition: Callable[[], object], patience: float) -> bool:
        """Wait until the condition holds; return False if it does not within `patience` seconds."""
        deadline = self.now() + patience
        while not condition():
            left = deadline - self.now()
            if left <= 0:
                return False
            self.sleep(min(self.pause, left))
        return True


class RealClock(MonotonicClock):
    """The time of this computer, and its threads."""

    def now(self) -> float:
        """Return `boot_time()`."""
        return boot_time()

    def sleep(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def take(self, items: "queue.Queue[T]", patience: float) -> T:
        """Block until an item is there."""
        return items.get(timeout=patience)

    def spawn(self, work: Callable[[], None], name: str) -> Task:
        """Start a thread that the process does not wait for."""
        thread = threading.Thread(target=work, name=name, daemon=True)
        thread.start()
        return thread


REAL_CLOCK: Final = RealClock()
"""The time of this computer."""
