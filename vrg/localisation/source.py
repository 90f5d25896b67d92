"""The contract of the sources of fixes, and their registry.

A source is a process of the match: `[localisation.NAME]` in the match file names its kind and its settings. Other
packages add a kind by an entry point of the group `vrg.localisation`.
"""

import logging
import time
from abc import abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Final, Generic

from msgspec import Struct

from vrg.bus.clock_tracker import ClockOffset
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix, Fixes
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.hal.models import RobotModel
from vrg.hal.models.drivetrain import Drivetrain
from vrg.localisation.stream import Item, LiveStream
from vrg.registry import Registry
from vrg.tables import Table
from vrg.types import Pose

log = logging.getLogger(__name__)

TRACKER = "tracker"
"""The kind of nodes that locate robots; in a match with seats they have the tracker's."""
_OLD: Final = 1.0
"""The age in s from which on what was captured says nothing any more, as when the match clock has stood still."""


class SourceContext(Struct, frozen=True, kw_only=True):
    """The things that a source is made from in a match.

    Args:
        name: of the source. settings: its table, of its own class.
        robots: the models of the robots that it is to see, by name. starts: their poses when the match begins.
        emulated: of those of them that are physical robots with emulated drives, the drivetrain whose speeds, for what
            the odometry measures, are those of the axes as wired; see `BackendSettings.as_wired`.
        seed: of all that is random in it. base: the folder that its relative paths start from.
    """

    name: str
    settings: Table
    robots: Mapping[str, RobotModel]
    starts: Mapping[str, Pose]
    emulated: Mapping[str, Drivetrain] = {}
    seed: int
    base: Path


class Source(Node):
    """The node of a source of fixes.

    Args:
        context: what it is made from. mailbox: its mailbox. keys: the keys of the match. period: between two ticks, s.

    Attributes:
        settings: the class of its table in a match file.
        sees_physical: True if it can see physical robots whose drives are real.
    """

    kind = TRACKER
    settings: ClassVar[type[Table]]
    sees_physical: ClassVar[bool] = True

    def __init__(self, context: SourceContext, mailbox: Mailbox, keys: Keys, period: float = 0.02) -> None:
        super().__init__(context.name, mailbox, period)
        self._topic = keys.fixes(self.name)

    @classmethod
    def problems(cls, settings: Table, base: Path) -> list[str]:
        """The reasons, in words, why these settings cannot be used. Relative paths in them start from `base`."""
        return []

    @classmethod
    def missing_here(cls, settings: Table, base: Path) -> list[str]:
        """The things that this source needs and this machine lacks, in words, each with what to do."""
        return []

    @classmethod
    def files(cls, settings: Table) -> list[str]:
        """The files that these settings name, as they name them; they are kept with a run."""
        return []

    def tick(self, tick: Tick) -> None:
        """Publish what has been seen since the last tick."""
        for stamp, fixes in self.seen(tick) if tick.live else ():
            self.mailbox.publish(self._topic, Fixes(fixes=fixes), stamp=stamp)

    @abstractmethod
    def seen(self, tick: Tick) -> Iterable[tuple[float, tuple[Fix, ...]]]:
        """The match times of what has been captured, s, and the robots that were seen then."""


class RealSource(Source, Generic[Item]):
    """A source that sees the real world: what it captures is stamped by this process's monotonic clock.

    Args:
        context, mailbox, keys: as for `Source`.
        stream: of what comes in.
        marks: the names of robots by what is seen of each, such as the number of its tag, as the settings name them;
            also those of robots that are not located here.
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
        self._robots = {mark: robot for mark, robot in marks.items() if robot in context.robots}
        self._absent = marks.keys() - self._robots.keys()
        named = set(marks.values())
        self._without = sorted(context.robots.keys() - named)
        self._strangers = sorted(named - context.robots.keys())
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
            self.warn("strangers", "no robot that is located here has the name %s", ", ".join(self._strangers))
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
        """The robots in what was captured since the last tick."""
        self.tell(self._stream.problem())
        now = self._monotonic()
        for captured, item in self.captured():
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
        """The robots in what was captured."""

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


def _check(found: object) -> str | None:
    good = isinstance(found, type) and issubclass(found, Source)
    return None if good else "expected a subclass of vrg.localisation.source.Source"


SOURCES: Registry[type[Source]] = Registry(
    "source of fixes",
    "vrg.localisation",
    {
        "sim": "vrg.localisation.sim:SimSource",
        "ssl": "vrg.localisation.ssl.source:SslSource",
        "camera": "vrg.localisation.camera.source:CameraSource",
        "mocap": "vrg.localisation.mocap.source:MocapSource",
    },
    _check,
)
"""The class of every kind of source, by its name."""


def read_source(table: Mapping[str, Any]) -> tuple[type[Source], Table]:
    """The class of a source and its settings, of a table `[localisation.NAME]`.

    Raises:
        ConfigError: there is no such kind of source. ValidationError: its settings are wrong.
    """
    kind = SOURCES.get(table.get("source", ""))
    return kind, kind.settings.model_validate({key: value for key, value in table.items() if key != "source"})
