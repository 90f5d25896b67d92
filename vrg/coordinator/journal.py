"""The referee's journal: append-only, on disk before anything is announced, and readable after any crash.

Each line is a JSON object. The first line tells which match it is. Each later line holds what was called and the whole
standing after it, so a restarted coordinator needs only the last complete line. Nothing in the journal depends on real
time or names the computer, so two runs of one match with one seed write the same bytes; `fingerprint.json` in the run
folder tells what computed them. Beside the journal, `<journal>.clock` holds the play clock of the newest tick. It is
overwritten in place, so that the clock of a crashed match is right to a tick without a line in the journal for each
tick. `evidence.bin` beside it holds what the referee decided by; see `vrg.coordinator.evidence`.

In a match of processes a thread of its own writes all this, in order, so that a disk that stalls does not hold up the
referee's tick. What was not announced before such a stall is announced when it is on disk.
"""

import contextlib
import logging
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Self

import msgspec
from msgspec import Struct

from vrg.bus.messages import Call, Stage
from vrg.coordinator.evidence import Entry, EvidenceFile, TickEvidence
from vrg.coordinator.match import Checkpoint
from vrg.coordinator.rulebook import Observation
from vrg.errors import FileError, JournalError
from vrg.files import RECORDS_LIMIT, Records, decoded, opened, read_bytes, records_of
from vrg.system import FILE_FLAGS, lock, write_at

log = logging.getLogger(__name__)

FORMAT = 3
"""The version of the records; from 3 on no stage is called `foul`."""
EVIDENCE_FILE = "evidence.bin"
"""The name of the file with what the referee decided by, beside the journal."""


class JournalHeader(Struct, frozen=True, kw_only=True):
    """The first line of a journal, which identifies its match.

    Args:
        journal: the version of the format. match: the name of the match. game: the game. seed: the match's seed.
    """

    journal: int = FORMAT
    match: str
    game: str
    seed: int


class Record(Struct, frozen=True, kw_only=True):
    """One line after the first: one change of the match.

    Args:
        n: counts the records from 1.
        time: the match time, s.
        stages: the stages that were entered, in order. calls: the calls that were announced, in order.
        standing: the standing of the match after the change.
        evidence: the digest of the evidence by which this was decided; empty where that could not be written.
    """

    n: int
    time: float
    stages: list[Stage]
    calls: list[Call]
    standing: Checkpoint
    evidence: str = ""


class ClockMark(Struct, frozen=True, kw_only=True):
    """The play clock at a tick after record number `n`. The times are those of `Checkpoint`, s."""

    n: int
    clock: float
    total: float
    in_stage: float


_json = msgspec.json.Encoder()
_header = msgspec.json.Decoder[JournalHeader | Record](JournalHeader)
_record = msgspec.json.Decoder[JournalHeader | Record](Record)
_mark = msgspec.json.Decoder(ClockMark)
CLOCK_WIDTH = 120


class Journal:
    """The journal of one match, locked against a second coordinator.

    Args:
        path: the path of the file. If it is missing, it is made; if it is there, the match continues from it.
        header: the first line that the journal must have.
        aside: True writes in its own thread; False writes at once, so that every run does the same.

    Raises:
        JournalError: the file is of another match, damaged, locked by another process, or cannot be opened or written.
    """

    def __init__(self, path: Path, header: JournalHeader, *, aside: bool = False) -> None:
        self.path = path
        self._thread = ThreadPoolExecutor(1, "journal") if aside else None
        self._under_way: tuple[bytes, Future[None]] | None = None
        self._evidence = EvidenceFile(path.with_name(EVIDENCE_FILE), self._put)
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | FILE_FLAGS, 0o644)
            self._clock = os.open(_clock_file(path), os.O_RDWR | os.O_CREAT | FILE_FLAGS, 0o644)
        except OSError as error:
            raise JournalError(f"{path}: cannot be opened: {error}") from error
        if not lock(self._file):
            self.close()
            raise JournalError(f"{path}: another coordinator is writing it: stop that one first")
        try:
            self._end, self.last = self._load(header)
            self._evidence.open(self.last.n if self.last else 0)
        except JournalError:
            self.close()
            raise
        except OSError as error:
            self.close()
            raise JournalError(f"{path}: cannot be read: {error.strerror}") from error

    def _load(self, header: JournalHeader) -> tuple[int, Record | None]:
        """The number of bytes up to the end of the last whole record, and that record. What follows it is cut off."""
        with opened(self.path) as written:
            content = written.read()  # however long its own match was
        found = records_of(content, _header, _record)
        if len(content) == found.torn:
            first = _json.encode(header) + b"\n"
            os.ftruncate(self._file, 0)
            self._write(0, first)
            return len(first), None
        head, records = _parts(found, self.path)
        if head != header:
            raise JournalError(
                f"{self.path}:1: expected the journal of {header}, got that of {head}: choose another run folder"
            )
        found.warn(self.path, "a record")
        if found.end < len(content):
            log.warning("%s: dropped %d bytes behind its last whole line", self.path, len(content) - found.end)
            os.ftruncate(self._file, found.end)
        return found.end, records[-1] if records else None

    @property
    def standing(self) -> Checkpoint | None:
        """The standing to continue from, with the clock of the newest tick; None in a new journal."""
        if self.last is None:
            return None
        os.lseek(self._clock, 0, os.SEEK_SET)
        return _at_mark(self.last, os.read(self._clock, CLOCK_WIDTH))

    def append(self, time: float, stages: list[Stage], calls: list[Call], standing: Checkpoint) -> None:
        """Begin to write a change; `settled` is True when it is on disk. One is written at a time.

        From now on it is the last record: what the referee decides by belongs to the next one.

        Raises:
            JournalError: the one before cannot be written.
        """
        self.settled()
        number = self.last.n + 1 if self.last else 1
        self.last = Record(
            n=number,
            time=round(time, 6),
            stages=stages,
            calls=calls,
            standing=standing,
            evidence=self._evidence.digest,
        )
        self._begin(_json.encode(self.last) + b"\n")

    def settled(self) -> bool:
        """True if all changes are on disk.

        Raises:
            JournalError: the last one cannot be written. The next call tries again.
        """
        if self._under_way is None:
            return True
        data, writing = self._under_way
        if not writing.done():
            return False
        try:
            writing.result()
        except JournalError:
            self._begin(data)
            raise
        self._end += len(data)
        self._under_way = None
        return True

    def _begin(self, data: bytes) -> None:
        self._under_way = data, self._do(lambda: self._write(self._end, data))

    def _do(self, job: Callable[[], None]) -> "Future[None]":
        """Do something in the order in which it comes."""
        if self._thread is not None:
            return self._thread.submit(job)
        done: Future[None] = Future()
        try:
            job()
            done.set_result(None)
        except JournalError as error:
            done.set_exception(error)
        return done

    def _write(self, at: int, data: bytes) -> None:
        """Write a line, and wait until it is on disk.

        Raises:
            JournalError: it cannot be written; the journal is as it was before.
        """
        try:
            written = 0
            while written < len(data):
                # If only a part fits on the disk, writing the rest raises the error with the reason.
                written += self._put(self._file, data[written:], at + written)
            self._sync()
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, at)
            raise JournalError(f"{self.path}: cannot be written: {error.strerror}: free some space") from error

    def _put(self, file: int, data: bytes, at: int) -> int:
        """Write into the file of the journal or of the evidence, as `write_at` does."""
        return write_at(file, data, at)

    def _sync(self) -> None:
        """Wait until what was written is on disk.

        Raises:
            OSError: it cannot be written.
        """
        os.fsync(self._file)

    def record_evidence(self, time: float, field: Observation, entries: list[Entry]) -> None:
        """Write what the referee decides by in this tick, before what follows from it is appended."""
        after = self.last.n if self.last else 0
        tick = TickEvidence(after=after, time=round(time, 6), field=field, entries=entries)
        self._do(self._evidence.piece(tick))

    def resume(self) -> bool:
        """Let the evidence go on after a gap, if there is one: whether the next tick must begin with `Resumed`."""
        if broken := self._evidence.broken:
            self._evidence.resume()
        return broken

    @property
    def gap(self) -> bool:
        """True while what the referee decides by is not written."""
        return self._evidence.gap

    def mark(self, clock: float, total: float, in_stage: float) -> None:
        """Write the clocks of this tick. A failure is only logged, because the last record is still good.

        Args:
            clock, total, in_stage: as in `Checkpoint`, s.
        """
        mark = ClockMark(n=self.last.n if self.last else 0, clock=clock, total=total, in_stage=in_stage)

        def write() -> None:
            try:
                write_at(self._clock, _json.encode(mark).ljust(CLOCK_WIDTH), 0)
            except OSError as error:
                log.debug("%s.clock: %s", self.path, error)

        self._do(write)

    def close(self) -> None:
        """Wait until everything is written, close the file and release its lock. Idempotent."""
        if self._thread is not None:
            self._thread.shutdown()
        self._evidence.close()
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


class NoJournal:
    """Stands for the journal of a match that is played for practice alone: it keeps nothing.

    Such a match cannot be continued after a crash, nor be judged again. `Journal` documents its methods.
    """

    standing: Checkpoint | None = None
    last: Record | None = None

    def append(self, time: float, stages: list[Stage], calls: list[Call], standing: Checkpoint) -> None:
        """Forget a change."""

    def settled(self) -> bool:
        """True: there is nothing to wait for."""
        return True

    def record_evidence(self, time: float, field: Observation, entries: list[Entry]) -> None:
        """Forget what the referee decides by."""

    gap = False
    """Nothing of it is ever judged again."""

    def resume(self) -> bool:
        """False: there is no evidence that goes on."""
        return False

    def mark(self, clock: float, total: float, in_stage: float) -> None:
        """Forget the clocks."""


def read_journal(path: Path, damage: list[str] | None = None) -> tuple[JournalHeader, list[Record]]:
    """Read the whole lines of a journal.

    Args:
        damage: where to note the lines that are damaged, in words; None logs them.

    Raises:
        JournalError: the file cannot be read, is empty, of another version, or does not begin as a journal does.
    """
    try:
        content = read_bytes(path, RECORDS_LIMIT)
    except OSError as error:
        raise JournalError(f"{path}: cannot be read: {error.strerror}") from error
    found = records_of(content, _header, _record)
    if len(content) == found.torn:
        raise JournalError(f"{path}: expected a journal, got {'a torn line' if content else 'an empty file'}")
    header, records = _parts(found, path)
    if header.journal != FORMAT:
        raise JournalError(
            f"{path}: expected a journal of version {FORMAT}, got {header.journal}: use the VRG that recorded it"
        )
    if damage is None:
        found.warn(path, "a record")
    else:
        damage += found.damage(path, "a record")
    return header, records


def _parts(found: Records[JournalHeader | Record], path: Path) -> tuple[JournalHeader, list[Record]]:
    """The header and the records of a journal, as far as they are whole and in their order.

    Raises:
        JournalError: it does not begin with a header.
    """
    if not found.whole or not isinstance(found.whole[0], JournalHeader):
        raise JournalError(f"{path}:1: expected the header of a journal: {found.damaged[0][1]}")
    return found.whole[0], [record for record in found if isinstance(record, Record)]


def read_standing(path: Path) -> Checkpoint | None:
    """The standing at the newest tick of a journal; None if nothing was decided yet.

    Raises:
        JournalError: as `read_journal`.
    """
    _, records = read_journal(path)
    if not records:
        return None
    try:
        mark = read_bytes(_clock_file(path))
    except OSError:
        return records[-1].standing
    return _at_mark(records[-1], mark)


def _clock_file(path: Path) -> Path:
    return path.with_name(path.name + ".clock")


def _at_mark(last: Record, mark: bytes) -> Checkpoint:
    """The standing of the last record, with the play clock of the newest tick if the mark belongs to this record."""
    try:
        found = decoded(_mark, mark[:CLOCK_WIDTH])
    except FileError:
        return last.standing
    if found.n != last.n:
        return last.standing
    return msgspec.structs.replace(last.standing, clock=found.clock, total=found.total, in_stage=found.in_stage)
