"""The referee's journal: append-only, on disk before anybody is told, readable after any crash.

One JSON object a line. The first tells which match it is; each later one holds what was called and the whole standing
after it, so the last whole line is all that a restarted coordinator needs. Nothing in it depends on the real time, so
two runs of one match with one seed write the same bytes. Beside it, `<journal>.clock` holds the play clock of the
newest tick, overwritten in place: the clock of a crashed match is right to a tick, without a line for each.
"""

import contextlib
import fcntl
import logging
import os
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

import msgspec
from msgspec import Struct

from vrg.bus.messages import Call, Stage
from vrg.coordinator.match import Standing
from vrg.errors import JournalError

log = logging.getLogger(__name__)

T = TypeVar("T", bound=Struct)

FORMAT = 1


class Header(Struct, frozen=True, kw_only=True):
    """The first line."""

    journal: int = FORMAT
    match: str
    game: str
    seed: int


class Record(Struct, frozen=True, kw_only=True):
    """One change.

    Args:
        n: counts from 1.
        time: match time, s.
        stages: entered by this change, in order.
    """

    n: int
    time: float
    stages: list[Stage]
    calls: list[Call]
    standing: Standing


class ClockMark(Struct, frozen=True, kw_only=True):
    """The play clock at a tick after record number `n`."""

    n: int
    clock: float
    total: float
    in_stage: float


_json = msgspec.json.Encoder()
CLOCK_WIDTH = 120


class Journal:
    """The journal of one match, locked against a second coordinator.

    Args:
        path: of the file; made if missing, taken up if it is there.

    Raises:
        JournalError: it is of another match, damaged before its last line, locked by another process, or the
            file system refuses.
    """

    def __init__(self, path: Path, header: Header) -> None:
        self.path = path
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
            self._clock = os.open(path.with_name(path.name + ".clock"), os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise JournalError(f"{path}: cannot be opened: {error}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.close()
            raise JournalError(f"{path}: another coordinator is writing it: stop that one first") from None
        try:
            self._end, self.last = self._load(header)
        except JournalError:
            self.close()
            raise

    def _load(self, header: Header) -> tuple[int, Record | None]:
        content = self.path.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if len(whole) < len(content):
            log.warning("%s: dropped a torn last line of %d bytes", self.path, len(content) - len(whole))
            os.ftruncate(self._file, len(whole))
        lines = whole.splitlines()
        if not lines:
            return self._write(0, header), None
        found = _decode(lines[0], Header, self.path, 1)
        if found != header:
            raise JournalError(
                f"{self.path}:1: expected the journal of {header}, got that of {found}: choose another run folder"
            )
        last = _decode(lines[-1], Record, self.path, len(lines)) if len(lines) > 1 else None
        return len(whole), last

    @property
    def standing(self) -> Standing | None:
        """The standing to go on from, with the clock of the newest tick; None in a new journal."""
        if self.last is None:
            return None
        standing = self.last.standing
        try:
            mark = msgspec.json.decode(os.pread(self._clock, CLOCK_WIDTH, 0), type=ClockMark)
        except (msgspec.DecodeError, msgspec.ValidationError):
            return standing
        if mark.n != self.last.n:
            return standing
        return msgspec.structs.replace(standing, clock=mark.clock, total=mark.total, in_stage=mark.in_stage)

    def append(self, time: float, stages: list[Stage], calls: list[Call], standing: Standing) -> None:
        """Write a change and wait until it is on disk.

        Raises:
            JournalError: it could not be written; the journal is as it was before.
        """
        number = self.last.n + 1 if self.last else 1
        record = Record(n=number, time=round(time, 6), stages=stages, calls=calls, standing=standing)
        self._end = self._write(self._end, record)
        self.last = record

    def _write(self, at: int, line: Struct) -> int:
        data = _json.encode(line) + b"\n"
        try:
            written = 0
            while written < len(data):
                # Where only a part fits, writing the rest says why.
                written += os.pwrite(self._file, data[written:], at + written)
            os.fsync(self._file)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, at)
            raise JournalError(f"{self.path}: cannot be written: {error.strerror}: free some space") from error
        return at + len(data)

    def mark(self, standing: Standing) -> None:
        """Remember the play clock of this tick; a failure is not worth a halt, the last record stays good."""
        mark = ClockMark(
            n=self.last.n if self.last else 0,
            clock=standing.clock,
            total=standing.total,
            in_stage=standing.in_stage,
        )
        try:
            os.pwrite(self._clock, _json.encode(mark).ljust(CLOCK_WIDTH), 0)
        except OSError as error:
            log.debug("%s.clock: %s", self.path, error)

    def close(self) -> None:
        """Let go of the file and its lock; idempotent."""
        for descriptor in (self._file, self._clock):
            if descriptor >= 0:
                os.close(descriptor)
        self._file = self._clock = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_journal(path: Path) -> tuple[Header, list[Record]]:
    """All whole lines of a journal.

    Raises:
        JournalError: no such file, or a damaged line before the last.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise JournalError(f"{path}: cannot be read: {error.strerror}") from error
    lines = content[: content.rfind(b"\n") + 1].splitlines()
    if not lines:
        raise JournalError(f"{path}: expected a journal, got an empty file")
    records = [_decode(line, Record, path, number) for number, line in enumerate(lines[1:], 2)]
    return _decode(lines[0], Header, path, 1), records


def _decode(line: bytes, kind: type[T], path: Path, number: int) -> T:
    try:
        return msgspec.json.decode(line, type=kind)
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise JournalError(f"{path}:{number}: expected a {kind.__name__.lower()}: {error}") from None
