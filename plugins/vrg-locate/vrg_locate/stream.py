"""Streams of what comes in from the real world: a thread of its own reads, so that no node waits."""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final, Generic, TypeVar

from vrg.errors import VrgError

RETRY_PERIOD: Final = 1.0
"""The time in s between two attempts to listen to what cannot be reached, or has stopped."""
_ENDING: Final = 15.0
"""The time that the thread may take to end, s: OpenCV gives up a silent camera after 10 s."""

Item = TypeVar("Item")
_log = logging.getLogger(__name__)


class LiveStream(Generic[Item]):
    """Keeps what comes in until it is taken. One that cannot be reached, or stops, is tried again every second.

    A subclass listens, and says in words what is wrong when nothing comes.

    Args:
        name: of the thread.
        silence: the time in s without anything that counts after which that is a problem.
        length: the most items that wait to be taken; older ones are dropped.
        monotonic: the clock by which silence is measured, s.

    Attributes:
        ending: is set when nobody needs the stream any more.
    """

    def __init__(self, name: str, silence: float, length: int, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._silence, self._monotonic = silence, monotonic
        self._items: deque[Item] = deque(maxlen=length)
        self._news = threading.Condition()
        self._problem: str | None = None
        self._heard = monotonic()
        """The time at which something came last that counts, monotonic, s."""
        self.ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Begin to listen."""
        self._heard = self._monotonic()
        self._thread.start()

    def close(self) -> None:
        """End the thread. Idempotent."""
        self.ending.set()
        if self._thread.is_alive():
            self._thread.join(_ENDING)

    def take(self, patience: float = 0.0) -> list[Item]:
        """The items since the last call, the oldest first.

        Args:
            patience: how long to wait for one, s.
        """
        with self._news:
            self._news.wait_for(lambda: self._items, patience)
            items = list(self._items)
            self._items.clear()
        return items

    def problem(self) -> str | None:
        """The reason why nothing comes, in words; None if something does."""
        with self._news:
            if self._problem is not None:
                return self._problem
            silence = self._monotonic() - self._heard
        return self.silent(silence) if silence > self._silence else None

    def put(self, item: Item, *, counts: bool = True) -> None:
        """Keep what has arrived: the last problem is over.

        Args:
            counts: whether it ends the silence.
        """
        with self._news:
            self._problem = None
            self._items.append(item)
            if counts:
                self._heard = self._monotonic()
            self._news.notify_all()

    def report(self, problem: str) -> None:
        """Keep the reason, in words, why nothing comes for now."""
        with self._news:
            self._problem = problem

    def listen(self) -> str:
        """Put what comes in, until that ends or `ending` is set. Return in words why it has ended.

        Raises:
            VrgError: there is nothing to listen to, with the reason in words.
        """
        raise NotImplementedError

    def silent(self, silence: float) -> str:
        """Says that nothing has arrived for this many seconds, and what to do."""
        raise NotImplementedError

    def _run(self) -> None:
        while not self.ending.is_set():
            try:
                problem = self.listen()
            except VrgError as error:
                problem = str(error)
            except Exception as error:  # the thread lives on: what failed once may work again
                _log.exception("%s failed", self._thread.name)
                problem = f"it failed: {error!r}"
            self.report(problem)
            self.ending.wait(RETRY_PERIOD)


class Pace:
    """Takes of what comes in at most so much in a second.

    Reports on several things are counted separately: by VRPN rigid bodies come one by one, with empty frames between
    them, so a count of frames would leave out most of what has been measured, and of two perhaps always the same one.

    Args:
        rate: the most that is taken of each thing in a second.
    """

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate
        self._due: dict[str | None, float] = {}

    def takes(self, what: str | None, now: float) -> bool:
        """True if it is taken.

        Args:
            what: the thing that it is of; None for what is of none. now: when it came, s.
        """
        due = self._due.get(what, now)
        if now < due:
            return False
        # They do not come quite evenly, so that the time between two is measured over many.
        self._due[what] = max(due, now - self._period) + self._period
        return True
