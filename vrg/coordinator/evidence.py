"""The evidence: everything by which the referee decides, in the order in which it took it in.

The journal tells what was called. The evidence tells why: it is enough to judge a match again, call by call, without a
world and without players; see `vrg.coordinator.judging`. One entry is one thing that the coordinator did to the match:
it looked at the field, applied what an official wants, halted play, or took a player out.
"""

import contextlib
import hashlib
import logging
import os
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

import msgspec
from msgspec import Struct, structs

from vrg.bus.messages import Call, Official
from vrg.coordinator.decisions import decide
from vrg.coordinator.match import Checkpoint, Match
from vrg.coordinator.outcome import Answer, Effects
from vrg.coordinator.rulebook import Observation, RuleBook
from vrg.errors import FileError, JournalError
from vrg.files import decoded, opened
from vrg.system import FILE_FLAGS

log = logging.getLogger(__name__)

FORMAT = 3
"""The version of the entries; from 3 on no tick follows from what never came into the journal."""
_HEAD = struct.Struct("<I8s")
"""The head of each tick: the number of its bytes, and its digest."""
_START = bytes(8)
"""The digest before the first tick."""
_TICK_SIZE = 16_000_000
"""The bytes that a tick may have."""
_DOUBTFUL = 1000
"""The ticks one after the other whose digests do not fit, at most, before the file counts as damaged from there on."""
TINY = 1e-6
"""The match time in s below which two instants are the same."""

Books = Sequence[tuple[float, RuleBook[Any]]]
"""Rule books that took the place of the one before, each with the match time in s from which it counts."""


class Began(Struct, frozen=True, kw_only=True, tag=True, array_like=True):
    """A coordinator began.

    Args:
        format: the version of the entries. standing: the standing from which it went on; None for a new match.
    """

    format: int = FORMAT
    standing: Checkpoint | None = None


class Resumed(Struct, frozen=True, tag=True, array_like=True):
    """The evidence goes on after a gap: what was decided before, since the last tick, could not be written.

    Args:
        standing: the standing before this tick. before: the field by which the next step judges, as the field before.
        place_at: the time in the stage at which players are put on their marks, s.
    """

    standing: Checkpoint
    before: Observation | None
    place_at: float


class Halted(Struct, frozen=True, tag=True, array_like=True):
    """Something outside the rules halted play, such as an emergency stop.

    Args:
        reason: in words. cause: see `vrg.bus.messages.Call`.
    """

    reason: str
    cause: str = ""


class Disqualified(Struct, frozen=True, tag=True, array_like=True):
    """A player was taken out, as it had failed."""

    name: str
    why: str


class Reinstated(Struct, frozen=True, tag=True, array_like=True):
    """A player that had failed reports again."""

    name: str


class Decided(Struct, frozen=True, tag=True, array_like=True):
    """An official decided.

    Args:
        official: the official's message.
        absent: the reasons outside the rules why play could not be resumed. silent: the players that did not report.
    """

    official: Official
    absent: list[str]
    silent: list[str]


class Answered(Struct, frozen=True, tag=True, array_like=True):
    """The world has put robots somewhere, or has refused to."""

    calls: list[Answer]


class Looked(Struct, frozen=True, tag=True, array_like=True):
    """The referee looked at the field and judged.

    Args:
        dt: the match time since it looked before, s.
        absent: the reasons outside the rules why the match cannot go on.
    """

    dt: float
    absent: list[str]


Entry = Began | Resumed | Halted | Disqualified | Reinstated | Decided | Answered | Looked


class TickEvidence(Struct, frozen=True, array_like=True):
    """The referee's inputs and effects in one tick.

    Args:
        after: the number of the last record of the journal before this tick; 0 before the first.
        time: the match time, s. field: all poses, and the players' reports to the referee.
        entries: what it did to the match, in order.
    """

    after: int
    time: float
    field: Observation
    entries: list[Entry]

    @property
    def began(self) -> Began | None:
        """The entry with which a coordinator began in this tick; None if none did."""
        first = self.entries[0] if self.entries else None
        return first if isinstance(first, Began) else None

    @property
    def resumed(self) -> Resumed | None:
        """The entry with which the evidence goes on in this tick after a gap; None if there was none."""
        first = self.entries[0] if self.entries else None
        return first if isinstance(first, Resumed) else None

    @property
    def anew(self) -> bool:
        """Whether it continues from a standing of its own: what was decided since the tick before may be missing."""
        return self.began is not None or self.resumed is not None


def apply(match: Match, entry: Entry, field: Observation) -> Effects:
    """Apply an entry to a match, and return the effects. The result depends on the arguments alone.

    Args:
        field: the field at that tick.
    """
    match entry:
        case Looked(dt, absent):
            outcome = match.step(dt, field, absent)
        case Halted(reason, cause):
            outcome = match.halt(reason, cause)
        case Disqualified(name, why):
            outcome = match.disqualify(name, why, field)
        case Reinstated(name):
            outcome = match.reinstate(name, field)
        case Decided(official, absent, silent):
            outcome = decide(match, official, field, absent, silent)
        case Answered(calls):
            outcome = Effects([Call(**structs.asdict(answer)) for answer in calls])
        case Began() | Resumed():
            outcome = Effects()
    return outcome


# What is recorded must not depend on the order in which Python happens to keep a set.
_encoder = msgspec.msgpack.Encoder(order="deterministic")
_decoder = msgspec.msgpack.Decoder(TickEvidence)


class EvidenceFile:
    """The file of the evidence of one match, which a restarted coordinator goes on writing.

    Each tick is its length, a digest and MessagePack. The digest is of the tick and of the digest before it, so no tick
    can be changed, added or left out later without a trace; and the journal has the digest of each of its records.

    What cannot be written, for example on a full disk, is logged and left out. The match goes on; as soon as `resume`
    has been called the file goes on, too, if there is room again.

    The next record begins with what was decided in the ticks before a gap. So a coordinator whose first tick cannot be
    written cuts off those of another one since the last record: its own record does not follow from them.

    Args:
        path: the path of the file. Nothing is written before `open`. put: writes as `vrg.system.write_at` does.

    Attributes:
        gap: True while what the referee decides by is not written.
        broken: True once a tick could not be written, until `resume`.
    """

    def __init__(self, path: Path, put: Callable[[int, bytes, int], int]) -> None:
        self._path, self._put = path, put
        self._file = -1
        self._digest = self._written = _START
        self._end = 0
        self._recorded: tuple[bytes, int] | None = None
        self._chain = 0
        self.gap = self.broken = False

    def open(self, last: int) -> None:
        """Open the file, or make it, and go on after the last whole tick in it. What follows that is cut off.

        What a coordinator decided before it crashed, and could not write into the journal, has not happened: ticks
        that follow it are cut off, too.

        Args:
            last: the number of the last record of the journal; 0 if it has none.

        Raises:
            OSError: it cannot be opened or read.
            JournalError: it is of another version.
        """
        self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | FILE_FLAGS, 0o644)
        self._recorded = _START, 0
        with opened(self._path) as written:
            for number, piece in enumerate(_pieces(written)):
                if (tick := _decoded(self._path, number, piece)) is not None and tick.after > last:
                    break
                if piece.genuine:
                    self._digest, self._end = piece.digest, piece.end
                    if tick is not None and tick.after < last:
                        self._recorded = self._digest, self._end
        self._written = self._digest
        if (further := os.fstat(self._file).st_size - self._end) > 0:
            log.warning("%s: dropped %d bytes behind the last whole tick of the journal", self._path, further)
        os.ftruncate(self._file, self._end)

    @property
    def digest(self) -> str:
        """The digest of the newest tick, as hexadecimal digits; empty if it could not be written."""
        return "" if self.gap else self._digest.hex()

    def resume(self) -> None:
        """Go on behind the last tick that is in the file. The next tick begins with the entry `Resumed`."""
        self._digest = self._written
        self._chain += 1
        self.broken = False

    def piece(self, tick: TickEvidence) -> Callable[[], None]:
        """The job that writes the referee's inputs and effects in one tick. Jobs must be done in this order."""
        data = _encoder.encode(tick)
        self._digest = digest = _chained(self._digest, data)
        chain = self._chain
        return lambda: self._write(chain, digest, data)

    def _write(self, chain: int, digest: bytes, data: bytes) -> None:
        if self.broken or chain != self._chain:
            return  # one before it is missing
        piece = _HEAD.pack(len(data), digest) + data
        try:
            problem = "" if self._put(self._file, piece, self._end) == len(piece) else "no space left"
        except OSError as error:
            problem = error.strerror or str(error)
        if not problem:
            self._end += len(piece)
            self._written = digest
            self._recorded = None
            if self.gap:
                log.warning("%s: can be written again: decisions made meanwhile cannot be judged again", self._path)
            self.gap = False
            return
        if self._recorded is not None:
            self._written, self._end = self._recorded
        with contextlib.suppress(OSError):
            os.ftruncate(self._file, self._end)
        if not self.gap:
            log.error("%s: cannot be written: %s: what follows cannot be judged again", self._path, problem)
        self.gap = self.broken = True

    def close(self) -> None:
        """Close the file. Idempotent."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1


@dataclass(frozen=True)
class Exhibit:
    """One tick of the evidence as it was read.

    Args:
        digest: its digest, as hexadecimal digits. genuine: whether the digest fits this tick and all before it.
    """

    tick: TickEvidence
    digest: str
    genuine: bool


def read_evidence(path: Path, damage: list[str] | None = None) -> Iterator[Exhibit]:
    """Read the whole ticks, one after the other; a missing file has none.

    Args:
        damage: where to note, in words, that the file does not end with a whole tick.

    Raises:
        JournalError: the file cannot be read, or is of another version.
    """
    try:
        with opened(path) as file:
            end = 0
            for number, piece in enumerate(_pieces(file)):
                if (tick := _decoded(path, number, piece)) is None:
                    continue
                end = piece.end
                yield Exhibit(tick, piece.digest.hex(), piece.genuine)
            if damage is not None and (further := os.fstat(file.fileno()).st_size - end) > 0:
                damage.append(f"{path}: its last {further} bytes are torn or damaged, and were left out")
    except FileNotFoundError:
        return
    except OSError as error:
        raise JournalError(f"{path}: cannot be read: {error.strerror}") from error


def resumed(match: Match) -> Resumed:
    """The entry with which the evidence of a match goes on. The match continues from it, too, as a judged one does.

    So a difference that a file makes, such as the order of names, is one for both.
    """
    data = _encoder.encode(Resumed(match.standing(), match.before, match.place_at))
    entry = msgspec.msgpack.decode(data, type=Resumed)
    match.restore(entry.standing, entry.before, entry.place_at)
    return entry


def book_at(time: float, book: RuleBook[Any], later: Books) -> RuleBook[Any]:
    """The rule book that counts at a match time, s."""
    return next((other for since, other in reversed(later) if since <= time + TINY), book)


def replayed(
    book: RuleBook[Any], exhibits: Iterable[Exhibit], later: Books = ()
) -> Iterator[tuple[Exhibit, Exhibit | None, Match, Any, list[Effects]]]:
    """Do again what the referee did, tick by tick.

    Args:
        book: the rule book of the match. later: those that took its place in the course of it.

    Returns:
        for each tick: it and the one that follows it, the match after it, which may be corrected before the next, the
        state of the game before it, and what followed from it.
    """
    match, exhibit = Match(book), None
    for following in chain(exhibits, [None]):
        if exhibit is not None:
            tick = exhibit.tick
            now = book_at(tick.time, book, later)
            if tick.began is not None:
                match = Match(now, tick.began.standing)
            match.judge_by(now)
            if tick.resumed is not None:
                match.restore(tick.resumed.standing, tick.resumed.before, tick.resumed.place_at)
            state = match.game
            made = [outcome for entry in tick.entries if (outcome := apply(match, entry, tick.field))]
            yield exhibit, following, match, state, made
        exhibit = following


def _decoded(path: Path, number: int, piece: "_Piece") -> TickEvidence | None:
    """The tick in a piece; None if the piece was changed so that it holds none."""
    try:
        tick = decoded(_decoder, piece.data)
    except FileError as error:
        if not piece.genuine:
            return None
        raise JournalError(f"{path}: expected the evidence of tick {number + 1}: {error}") from None
    if tick.began and tick.began.format != FORMAT:
        raise JournalError(
            f"{path}: expected evidence of version {FORMAT}, got {tick.began.format}: use the VRG that recorded it"
        )
    return tick


def _chained(before: bytes, data: bytes) -> bytes:
    return hashlib.blake2b(before + data, digest_size=len(_START)).digest()


@dataclass(frozen=True)
class _Piece:
    """One tick as it is in the file.

    Args:
        digest: its digest. data: its bytes. genuine: whether the digest fits them and the digest before.
        end: the number of bytes of the file up to its end.
    """

    digest: bytes
    data: bytes
    genuine: bool
    end: int


def _pieces(file: BinaryIO) -> Iterator[_Piece]:
    """The ticks in a file, up to the first that is torn or damaged.

    Those whose digests do not fit count if a later one continues from them, or if they are whole up to the end of the
    file: somebody has changed them later.
    """
    before, end = _START, 0
    doubtful: list[_Piece] = []
    while len(head := file.read(_HEAD.size)) == _HEAD.size and len(doubtful) < _DOUBTFUL:
        length, digest = _HEAD.unpack(head)
        # Behind what a power cut has left the file may be full of zeros, or of what was on the disk before.
        if not 0 < length <= _TICK_SIZE or len(data := file.read(length)) < length:
            return
        end += len(head) + length
        piece = _Piece(digest, data, _chained(before, data) == digest, end)
        before = digest
        doubtful.append(piece)
        if piece.genuine:
            yield from doubtful
            doubtful.clear()
    if not head:
        yield from doubtful
