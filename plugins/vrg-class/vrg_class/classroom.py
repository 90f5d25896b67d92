"""What is known of a class while it is served: who listens, what was tried last, and one thread for the disk."""

import asyncio
from collections import defaultdict
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar

from vrg.errors import ConfigError
from vrg.ui.web.parts import encode
from vrg_class.folder import NAME_SIZE, ClassFolder, Student, checked_name
from vrg_class.page import Page
from vrg_class.roster import read_roster
from vrg_class.site import RefusalError
from vrg_class.tries import Try

UNKNOWN: Final = 4001
"""The code with which a connection is closed whose token is not known."""
CHANGED: Final = 4002
"""The code with which a connection is closed whose page must ask again who it is."""
ASKED_AT_ONCE: Final = 4
"""The requests of a student that are answered or wait."""
T = TypeVar("T")


@dataclass
class Desk:
    """What is known of a student while the server runs.

    Args:
        step: the step of the last try, by its name. tried: the last try. pages: those that listen.
        language: of the lesson, as the browser of the last request prefers it.
        problem: why what was handed in last does not play, in words of VRG; empty if it does.
        last: when the last request came that costs something, s of the monotonic clock.
        asking: how many requests are answered or wait. turn: whose holder is answered.
    """

    step: str = ""
    language: str = ""
    problem: str = ""
    tried: Try | None = None
    pages: list[Page] = field(default_factory=list)
    last: float = 0.0
    asking: int = 0
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)

    async def answered(self, answer: Callable[[], Awaitable[T]]) -> T:
        """Answer a request in its turn, so that nobody who asks without end keeps the disk from others.

        Raises:
            RefusalError: too many requests of this student wait.
        """
        self.asking += 1
        try:
            if self.asking > ASKED_AT_ONCE:
                raise RefusalError("haste")
            async with self.turn:
                return await answer()
        finally:
            self.asking -= 1

    def show(self, text: str) -> None:
        """Send a message to all pages, a text of JSON."""
        for page in self.pages:
            page.send(text)


class Classroom:
    """What is known of a class while it is served. All is for the server's loop, but for what says that it is for the
    thread of the folder.

    Args:
        folder: of the class.

    Attributes:
        desks: by the folder of the student. message, halted: what the teacher has to say to all.
        closed: nobody may join any more. roster_problem: why a changed roster is not used, in words; empty for none.
    """

    def __init__(self, folder: ClassFolder) -> None:
        self.folder = folder
        self.desks: defaultdict[str, Desk] = defaultdict(Desk)
        self.message, self.halted, self.closed, self.roster_problem = "", False, False, ""
        # All that is written goes through one thread: in the order of the requests, and nobody waits for a slow disk.
        self.disk = ThreadPoolExecutor(1, "class folder")
        self._roster_time = 0

    async def write(self, act: Callable[..., T], *arguments: Any, **named: Any) -> T:
        """Do something with the folder of the class, on the thread for it."""
        return await asyncio.get_running_loop().run_in_executor(self.disk, lambda: act(*arguments, **named))

    @property
    def news(self) -> str:
        """What the teacher has to say, as a message to pages."""
        return encode({"t": "news", "message": self.message, "halted": self.halted})

    def joined(self, name: str, device: str = "") -> Student:
        """A new student; on the thread of the folder. A student who has saved and tried nothing yet may join again from
        the same device.

        Args:
            device: what tells the device from others; empty if that is not known.

        Raises:
            RefusalError: the name is taken, or the class is full. OSError: it cannot be written.
        """
        if (known := self.folder.named(name)) is not None:
            # The answer of the first time may have been lost on its way.
            if device and device == known.device and not (known.versions or known.tries or known.done):
                return known
            raise RefusalError("taken", name=name)
        try:
            return self.folder.join(name, device)
        except OSError:  # it is known, and written as soon as there is room
            if (student := self.folder.named(name)) is None:
                raise
            return student
        except OverflowError:
            raise RefusalError("full", count=len(self.folder.students)) from None

    def look_at_disk(self) -> None:
        """Take in a roster that was changed, and write what could not be written; on the thread of the folder.

        Raises:
            OSError: it still cannot be written.
        """
        changed = self._time_of_roster()
        if changed != self._roster_time:
            try:
                roster = read_roster(Path(self.folder.about.roster_file))
                self.roster_problem = ""
                if roster != self.folder.about.roster:
                    self.folder.keep_about(roster=roster)
            except ConfigError as error:  # the one before stays
                self.roster_problem = str(error)
            self._roster_time = changed
        self.folder.settle()

    def _time_of_roster(self) -> int:
        """When the roster was changed; 0 if it has no file."""
        try:
            return Path(self.folder.about.roster_file).stat().st_mtime_ns if self.folder.about.roster_file else 0
        except OSError:
            return 0


def name_of(typed: str) -> str:
    """A name as it is kept.

    Raises:
        RefusalError: it cannot be the name of a student.
    """
    try:
        return checked_name(typed)
    except ValueError:
        raise RefusalError("name", most=NAME_SIZE) from None
