"""The common part of sources of fixes that see the real world."""

import logging
import math
import time
from abc import abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any, ClassVar, Final, Generic

from pydantic import Field

from vrg.bus.clock_tracker import ClockOffset
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.node import CLOCK_SKEW, Tick
from vrg.bus.topics import Keys
from vrg.localisation.source import Source, SourceContext
from vrg.tables import Table
from vrg.types import Pose
from vrg_locate.stream import Item, LiveStream

log = logging.getLogger(__name__)

_OLD: Final = 1.0
"""The age in s from which on what was captured says nothing any more, as when the match clock has stood still."""


class PoseTable(Table):
    """A pose as people write it.

    Args:
        x, y: the position, m. heading: degrees, counter-clockwise from the x axis.
    """

    x: float = Field(0.0, ge=-1e5, le=1e5)
    y: float = Field(0.0, ge=-1e5, le=1e5)
    heading: float = Field(0.0, ge=-360.0, le=360.0)

    @property
    def pose(self) -> Pose:
        """The same in m and rad."""
        return Pose(self.x, self.y, math.radians(self.heading))


class RealSource(Source, Generic[Item]):
    """A source that sees the real world: what it captures is stamped by this process's monotonic clock.

    Args:
        context, mailbox, keys: as for `Source`.
        stream: of what comes in.
        marks: the names of robots and things by what is seen of each, such as the number of its tag, as the settings
            name them; also those of what is not located here.
        monotonic: that clock, s. Nodes read no clock, so it is given from outside.

    Attributes:
        mark: what is seen of a robot, in words. items: the things that it captures, in words.
    """

    mark: ClassVar[str]
    items: ClassVar[str]

    def __init__(
        self,
        context: SourceContext,
        mailbox: Mailbox,
        keys: Keys,
        stream: LiveStream[Any],
        marks: Mapping[Any, str],
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(context, mailbox, keys)
        self._stream, self._monotonic = stream, monotonic
        located = context.robots.keys() | context.things.keys()
        self._robots = {mark: name for mark, name in marks.items() if name in located}
        self._absent = marks.keys() - self._robots.keys()
        named = set(marks.values())
        self._without = sorted(located - named)
        self._strangers = sorted(named - located)
        self._clock = mailbox.subscribe(keys.clock)
        self._offset = ClockOffset()
        self._rate = 1.0
        self._warned: set[object] = set()
        self._problem: str | None = None
        self._used = 0
        self._fixes: Counter[str] = Counter()
        self._unknown: Counter[Any] = Counter()
        self._ignored: Counter[str] = Counter()

    def start(self) -> None:
        """Begin to capture."""
        if self._without:
            self.warn("without", f"no {self.mark} is named for %s: nothing locates it here", ", ".join(self._without))
        if self._strangers:
            self.warn("strangers", "nothing that is located here has the name %s", ", ".join(self._strangers))
        self._stream.start()

    def stop(self) -> None:
        """Capture no more."""
        self._stream.close()

    def tick(self, tick: Tick) -> None:
        """Hear the match clock, and publish what has been seen since the last tick."""
        now = self._monotonic()
        for clock in self._clock.take():
            self._rate = clock.body.rate
            if self._rate != 1.0:
                self.warn("rate", "it sees robots as fast as they are: the match needs `rate = 1`, and no --in-process")
            self._offset.heard(clock.body.time, now)
        super().tick(tick)

    def seen(self, tick: Tick) -> Iterable[tuple[float, tuple[Fix, ...]]]:
        """The robots and things in what was captured since the last tick."""
        self.tell(self._stream.problem())
        now = self._monotonic()
        for captured, item in self.captured():
            if captured > now + CLOCK_SKEW:
                self.ignore("early", None, "%.1f s in the future: its clock jumps, and that is ignored", captured - now)
                continue
            stamp = self.match_time(captured)
            if stamp is not None and now - captured <= _OLD:
                self._used += 1
                if fixes := tuple(self.fixes_of(item)):
                    self._fixes.update(fix.robot for fix in fixes)
                    yield stamp, fixes

    @abstractmethod
    def captured(self) -> Iterable[tuple[float, Item]]:
        """What was captured since the last call, and when, monotonic, s."""

    @abstractmethod
    def fixes_of(self, item: Item) -> Iterable[Fix]:
        """The robots and things in what was captured."""

    def counted(self) -> dict[str, Any]:
        """What was used, the fixes of each robot, the marks that no robot has, and what was ignored for each reason."""
        return {
            self.items: self._used,
            "fixes": dict(self._fixes),
            "unknown": {str(mark): count for mark, count in sorted(self._unknown.items())},
            "ignored": {str(what): count for what, count in self._ignored.items()},
        }

    def match_time(self, monotonic: float) -> float | None:
        """The match time at a time of the monotonic clock, s; None where it is not known, or before the match."""
        stamp = self._offset.match_time(monotonic) if self._rate == 1.0 else None
        return stamp if stamp is not None and stamp >= 0.0 else None

    def warn(self, what: object, text: str, *values: object) -> None:
        """Log a warning, once for each `what`."""
        if what not in self._warned:
            self._warned.add(what)
            log.warning(f"%s: {text}", self.name, *values)

    def count_unknown(self, mark: object) -> None:
        """Count a mark that no robot has, and log it the first time; not one of a robot that is not located here."""
        if mark not in self._absent:
            self._unknown[mark] += 1
            known = ", ".join(map(str, sorted(self._robots)))
            text = f"{self.mark} %s is seen, which no robot has; robots have %s"
            self.warn(("unknown", mark), text, "without a name" if mark == "" else mark, known)

    def ignore(self, what: str, of: object, text: str | None, *values: object) -> None:
        """Count what is ignored.

        Args:
            what: the reason. of: what it is about; for each reason and each of these a warning is logged once.
            text, values: of the warning; None for none.
        """
        self._ignored[what] += 1
        if text is not None:
            self.warn((what, of), text, *values)

    def tell(self, problem: str | None) -> None:
        """Log why it sees nothing, in words, when that begins, and that it sees again when that is over.

        Args:
            problem: as it is now; None if there is none.
        """
        # It may hold a number of seconds, which goes on.
        if problem is not None and self._problem is None:
            log.error("%s: %s", self.name, problem)
        elif problem is None and self._problem is not None:
            log.warning("%s sees again", self.name)
        self._problem = problem
