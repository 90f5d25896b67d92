"""Simulated time: a wait runs everything that is due until its end, and returns at once.

Everything runs on one thread at a time, in an order that depends on nothing but simulated time and the order of the
calls, so that the same calls have the same outcome on every machine, however busy.
"""

import heapq
import itertools
import math
import threading
from collections.abc import Callable

from vrg.hal.clock import MonotonicClock


class SimulatedClock(MonotonicClock):
    """A clock of simulated time, which begins at 0 s."""

    pause = 1e-3

    def __init__(self) -> None:
        self._now = 0.0
        self._events: list[tuple[float, int, Callable[[], object]]] = []
        self._numbers = itertools.count()
        self._running: SimulatedTask | None = None
        self._parked: dict[SimulatedTask, None] = {}

    def now(self) -> float:
        """Simulated time, s."""
        return self._now

    def at(self, time: float, action: Callable[[], object]) -> None:
        """Let something happen at a time, in s, or at once where that has passed; of two at a time, in their order."""
        heapq.heappush(self._events, (time, next(self._numbers), action))

    def sleep(self, seconds: float) -> None:
        """Let everything happen that is due within this time."""
        if self._running is not None:
            self._running.wait(seconds)
            return
        until = self._now + seconds
        while self._events and self._events[0][0] <= until:
            self._step()
        self._now = max(self._now, until)

    def wait(self, condition: Callable[[], object], patience: float) -> bool:
        """Let time pass until the condition holds; return False if it does not within `patience` seconds. It is looked
        at now, after everything that happens, and at the end; spawned work looks every `pause` seconds.

        Raises:
            RuntimeError: it is waited for without end, and nothing can happen any more.
        """
        if self._running is not None:
            return super().wait(condition, patience)
        deadline = self._now + patience
        while not condition():
            if not self._events or self._events[0][0] > deadline:
                if deadline == math.inf:
                    raise RuntimeError("expected something that ends this wait, but nothing is left to happen")
                self._now = max(self._now, deadline)
                return bool(condition())
            self._step()
        return True

    def spawn(self, work: Callable[[], None], name: str) -> "SimulatedTask":
        """Let work go on beside the caller: it begins when the caller next waits."""
        task = SimulatedTask(self, work, name)
        self.at(self._now, task.resume)
        return task

    def close(self) -> None:
        """End all work that has not ended, where it waits.

        Raises:
            BaseException: the first that work has raised while it was ended.
        """
        errors: list[BaseException] = []
        for task in list(self._parked):
            try:
                task.end()
            except BaseException as error:
                errors.append(error)
        if errors:
            raise errors[0]

    def _step(self) -> None:
        time, _, action = heapq.heappop(self._events)
        self._now = max(self._now, time)
        action()


class _Ended(BaseException):
    """The simulation has ended while work was waiting."""


class SimulatedTask:
    """Work on its own thread, which runs only while the thread of the simulation waits for it.

    Args:
        clock: the time by which it waits. work: what is done. name: of the thread.
    """

    def __init__(self, clock: SimulatedClock, work: Callable[[], None], name: str) -> None:
        self._clock = clock
        self._work = work
        self._mine, self._theirs = threading.Semaphore(0), threading.Semaphore(0)
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._alive = True
        self._ending = False
        self._error: BaseException | None = None
        clock._parked[self] = None

    def is_alive(self) -> bool:
        """Return whether it has not ended."""
        return self._alive

    def join(self, timeout: float | None = None) -> None:
        """Let simulated time pass until it has ended."""
        self._clock.wait(lambda: not self._alive, math.inf if timeout is None else timeout)

    def resume(self) -> None:
        """Let it run until it next waits, or ends.

        Raises:
            BaseException: what it has raised.
        """
        if not self._alive:
            return
        self._clock._running = self
        try:
            if self._thread.ident is None:
                self._thread.start()
            else:
                self._mine.release()
            try:
                self._theirs.acquire()
            except KeyboardInterrupt:
                self._theirs.acquire()  # it still runs: two never do
                raise
        finally:
            self._clock._running = None
        error, self._error = self._error, None
        if error is not None:
            raise error

    def wait(self, seconds: float) -> None:
        """Wait. The work itself calls this."""
        if self._ending:
            raise _Ended
        self._clock.at(self._clock.now() + seconds, self.resume)
        self._theirs.release()
        self._mine.acquire()
        if self._ending:
            raise _Ended

    def end(self) -> None:
        """End it where it waits."""
        self._ending = True
        if self._thread.ident is None:
            self._alive = False
            self._clock._parked.pop(self, None)
        else:
            self.resume()

    def _run(self) -> None:
        try:
            self._work()
        except _Ended:
            pass
        except BaseException as error:  # it is raised where the work was resumed
            self._error = error
        finally:
            self._alive = False
            self._clock._parked.pop(self, None)
            self._theirs.release()
