"""The log of events of the processes of a match, a file of the run folder: one JSON object a line.

The launcher writes a line for each process that is ready, dies, is killed or started again, for each machine that stops
answering or answers again, for each order of the emergency stop that it hears, and one at its own end. A launcher that
was killed leaves a file without that last line.
"""

import enum
import logging
from pathlib import Path
from typing import Protocol

import msgspec
from msgspec import Struct

from vrg.files import RECORDS_LIMIT, read_bytes, records_of

log = logging.getLogger(__name__)

REFEREE, WORLD = "referee", "world"
"""The names in events of the referee's states and of the world's clock, as links."""

_json = msgspec.json.Encoder()


class EventKind(enum.StrEnum):
    """The kind of an event."""

    BEGAN = "began"
    READY = "ready"
    DIED = "died"
    KILLED = "killed"
    VACATED = "vacated"
    STARTED = "started"
    REPLACED = "replaced"
    CLOSED = "closed"
    ESTOP = "estop"
    RELEASE = "release"
    AWAY = "away"
    BACK = "back"
    STEPPED_BACK = "stepped back"
    MEASURED = "measured"
    ENDED = "ended"


class Event(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One line of the file.

    Args:
        what: what has happened.
        process: the process, for MEASURED the robot, for AWAY and BACK the machine; None where it is about none.
        monotonic: the launcher's monotonic time at which it noticed this, s.
        time: the match time that it had heard by then, s; None before the first clock. For ESTOP it is that from which
            the world has latched the stop, if it has.
        clock: the monotonic time at which it heard the last clock, s.
        text: what happened, in words. status: the exit status of a process that has ended.
        newest: the match time of the newest message of each sender, s, by the name of the player, or `referee`, or
            `world`.
        x, y: where a physical robot was measured while match time stood, m. v, w, side: its twist then.
    """

    what: EventKind
    monotonic: float
    time: float | None = None
    clock: float = 0.0
    process: str | None = None
    text: str = ""
    status: int | None = None
    newest: dict[str, float] = {}
    x: float = 0.0
    y: float = 0.0
    v: float = 0.0
    w: float = 0.0
    side: float = 0.0


_decoder = msgspec.json.Decoder(Event)


class EventLog:
    """Appends events to a file. An event that cannot be written is logged and forgotten: the match goes on.

    Args:
        path: the file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._failed = False

    def write(self, event: Event) -> None:
        """Append an event, and hand it to the operating system."""
        try:
            with self._path.open("ab") as file:
                file.write(_json.encode(event) + b"\n")
        except OSError as error:
            if not self._failed:
                log.error("%s: cannot be written: %s", self._path, error.strerror or error)
            self._failed = True


class Notes(Protocol):
    """The log to which a supervisor writes the events of its processes."""

    def note(self, what: EventKind, process: str | None = None, text: str = "", *, status: int | None = None) -> None:
        """It happens now."""

    def note_at_next_clock(self, what: EventKind, process: str) -> None:
        """It counts as soon as the world's clock is heard again, so that its match time is known."""


class NoNotes:
    """Forgets everything."""

    def note(self, what: EventKind, process: str | None = None, text: str = "", *, status: int | None = None) -> None:
        """Forget it."""

    def note_at_next_clock(self, what: EventKind, process: str) -> None:
        """Forget it."""


def read_events(path: Path) -> list[Event]:
    """All events of a run, in order; a last line that is torn, or lines of another release, are left out.

    Raises:
        OSError: the file cannot be read.
    """
    found = records_of(read_bytes(path, RECORDS_LIMIT), _decoder)
    found.warn(path, "an event")
    return list(found)
