"""Runs an event: lets its time pass, has its matches played, and writes down what changes."""

import asyncio
import logging
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgspec
from aiohttp import ClientSession

from vrg.bus.mailbox import is_power_of_ten
from vrg.files import write_whole
from vrg.system import boot_time
from vrg_class.event.course import Event
from vrg_class.event.field import Field
from vrg_class.event.plan import Fixture
from vrg_class.event.results import as_csv, as_json

log = logging.getLogger(__name__)

KEPT: Final = "event.json"
"""The file of what survives a restart."""
_STEP: Final = 0.1
"""The real time in s between two looks at the clock."""
_ENDING: Final = 60.0
"""The real time in s that the match on the field has to end when the event ends."""


class EventClock:
    """Tells the wall time at the start of the event and the seconds since: nobody sets it while the event runs.

    Args:
        wall: tells the wall time, s. It is asked once. since: tells seconds that go on evenly.
    """

    def __init__(self, wall: Callable[[], float] = time.time, since: Callable[[], float] = boot_time) -> None:
        self._since = since
        self._offset = wall() - since()

    def now(self) -> float:
        """The time of the event, s since 1970."""
        return self._offset + self._since()


class Running:
    """Runs an event until it is over. All but `said`, `is_over` and `close` is for the loop of the server.

    Args:
        event: the event. field: plays its matches. clock: its clock. folder: for what is written.

    Attributes:
        said: what is to be printed, in lines. files: the results by the name of the file, as they were written last.
    """

    def __init__(self, event: Event, field: Field, clock: EventClock, folder: Path) -> None:
        self.event, self.field, self._clock, self._folder = event, field, clock, folder
        self.said: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._written = -1
        self.files: dict[str, bytes] = {}
        self._failures = 0
        self._writing = asyncio.Lock()
        self._closed = False
        self._idle = threading.Event()
        self._idle.set()

    def now(self) -> float:
        """The time of the event, s."""
        return self._clock.now()

    @property
    def is_over(self) -> bool:
        """True if all is played, confirmed and written."""
        event = self.event
        return self._idle.is_set() and event.on is None and event.next is None and self._written == event.version

    def close(self) -> None:
        """Break the match on the field off, and begin no other one. It waits for its end."""
        self._closed = True
        self._idle.wait(_ENDING)

    async def go(self, session: ClientSession) -> None:
        """Run the event until this is cancelled. Nothing ends it, whatever happens."""
        matches = set[asyncio.Task[None]]()
        while True:
            await asyncio.sleep(_STEP)  # first, too: nothing begins where the pages cannot be served
            try:
                fixture = None if self._closed else self.event.step(self.now())
                if fixture is not None:
                    self._idle.clear()
                    task = asyncio.create_task(self._play(fixture, session))
                    matches.add(task)
                    task.add_done_callback(matches.discard)
                await self.keep()
            except Exception as error:
                self._failures += 1
                if is_power_of_ten(self._failures):
                    log.exception("the event is held (number %d)", self._failures)
                words = f"{type(error).__name__}: {error}"
                if self._idle.is_set():
                    self.event.fail(self.now(), words)
                else:
                    self.event.hold(self.now(), "failed", words=words)

    async def _play(self, fixture: Fixture, session: ClientSession) -> None:
        event = self.event
        try:
            title = event.title(fixture)
            self.said.put(f"{fixture.of.number}. {title}")
            report = await self.field.play(fixture.of, session, event.hear, lambda: self._closed or event.stopping)
            if not (self._closed and (report.why or report.winner is None)):  # else it is played again
                event.ended(report, self.now())
                self.said.put(f"{title}: {report.words or report.why}")
                await self.keep()
        except Exception as error:
            log.exception("a match has failed")
            event.fail(self.now(), f"{type(error).__name__}: {error}")
        finally:
            self._idle.set()

    async def keep(self) -> bool:
        """Write down what has changed: whether it is. Where that fails, the event is held, and it is tried again."""
        async with self._writing:
            event, version = self.event, self.event.version
            if version == self._written:
                return True
            self.files = {"results.json": as_json(event), "results.csv": as_csv(event)}
            files = {KEPT: msgspec.json.encode(event.kept), **self.files}
            try:
                for name, content in files.items():
                    await asyncio.to_thread(write_whole, self._folder / name, content, synced=True)
            except OSError as error:
                event.hold(self.now(), "disk", words=error.strerror or str(error))
                return False
            self._written = version
            return True
