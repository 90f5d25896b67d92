"""The evidence: everything by which the referee decides, in the order in which it took it in.

The journal tells what was called. The evidence tells why: it is enough to judge a match again, call by call, without a
world and without players; see `vrg.coordinator.judging`. One entry is one thing that the coordinator did to the match:
it looked at the field, applied what an official wants, halted play, or took a player out.
"""

import hashlib
import logging
import os
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

import msgspec
from msgspec import Struct

from vrg.bus.messages import Official
from vrg.coordinator.decisions import decide
from vrg.coordinator.match import Checkpoint, Match
from vrg.coordinator.outcome import Effects
from vrg.coordinator.rulebook import Call, Observation, RuleBook
from vrg.errors import JournalError

log = logging.getLogger(__name__)

FORMAT = 2
"""The version of the entries."""
_HEAD = struct.Struct("<I8s")
"""The head of each tick: the number of its bytes, and its digest."""
_START = bytes(8)
"""The digest before the first tick."""
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


class Halted(Struct, frozen=True, tag=True, array_like=True):
    """Something outside the rules halted play, such as an emergency stop."""

    reason: str


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

    calls: list[Call]


class Looked(Struct, frozen=True, tag=True, array_like=True):
    """The referee looked at the field and judged.

    Args:
        dt: the match time since it looked before, s.
        absent: the reasons outside the rules why the match cannot go on.
    """

    dt: float
    absent: list[str]


Entry = Began | Halted | Disqualified | Reinstated | Decided | Answered | Looked


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


def enact(match: Match, entry: Entry, field: Observation) -> Effects:
    """Apply an entry to a match, and return the effects. The result depends on the arguments alone.

    Args:
        field: the field at that tick.
    """
    match entry:
        case Looked(dt, absent):
            outcome = match.step(dt, field, absent)
        case Halted(reason):
            outcome = match.halt(reason)
        case Disqualified(name, why):
            outcome = match.disqualify(name, why, field)
        case Reinstated(name):
            outcome = match.reinstate(name, field)
        case Decided(official, absent, silent):
            outcome = decide(match, official, field, absent, silent)
        case Answered(calls):
            outcome = Effects(calls)
        case Began():
            outcome = Effects()
    return outcome


# What is recorded must not depend on the order in which Python happens to keep a set.
_encoder = msgspec.msgpack.Encoder(order="deterministic")
_decoder = msgspec.msgpack.Decoder(TickEvidence)


class EvidenceFile:
    """The file of the evidence of one match, which a restarted coordinator goes on writing.

    Each tick is its length, a digest and MessagePack. The digest is of the tick and of the digest before it, so no tick
    can be changed, added or left out later without a trace; and the journal has the digest of each of its records.

    What cannot be written, for example on a full disk, is logged once; after that the file stays as it is, and what
    follows in the journal has no digest. The match goes on.

    Args:
        path: the path of the file. Nothing is written before `open`.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = -1
        self._digest = _START
        self._broken = False

    def open(self) -> None:
        """Open the file, or make it, and go on after the last complete tick in it.

        Raises:
            OSError: it cannot be opened or read.
        """
        self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
        end = 0
        with self._path.open("rb") as written:
            for digest, data in _pieces(written):
                self._digest = digest
                end += _HEAD.size + len(data)
        os.ftruncate(self._file, end)
        os.lseek(self._file, end, os.SEEK_SET)

    @property
    def digest(self) -> str:
        """The digest of the newest tick, as hexadecimal digits; empty if it could not be written."""
        return "" if self._broken else self._digest.hex()

    def piece(self, tick: TickEvidence) -> bytes:
        """The bytes of the referee's inputs and effects in one tick, to be written in this order."""
        data = _encoder.encode(tick)
        self._digest = _chained(self._digest, data)
        return _HEAD.pack(len(data), self._digest) + data

    def write(self, piece: bytes) -> None:
        """Write what `piece` has returned."""
        if self._broken:
            return
        try:
            problem = "" if os.write(self._file, piece) == len(piece) else "no space left"
        except OSError as error:
            problem = error.strerror or str(error)
        if problem:
            self._broken = True
            log.error("%s: cannot be written: %s: what follows cannot be judged again", self._path, problem)

    def close(self) -> None:
        """Close the file. Idempotent."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1


@dataclass(frozen=True)
class Exhibit:
    """One tick of the evidence as it was read.

    Args:
        digest: its digest, as hexadecimal digits. genuine: whether the digest fits it and what comes before.
    """

    tick: TickEvidence
    digest: str
    genuine: bool


def read_evidence(path: Path) -> Iterator[Exhibit]:
    """Read the complete ticks, one after the other; a missing file has none.

    What a coordinator decided before it crashed, and could not write into the journal, has not happened: these ticks
    are left out.

    Raises:
        JournalError: the file cannot be read, or is damaged, or of another version.
    """
    try:
        with path.open("rb") as file:
            begun = [
                (number, tick.after)
                for number, (_, data) in enumerate(_pieces(file))
                if b"Began" in data and (tick := _decoded(path, number, data)).began
            ]
            file.seek(0)
            before = _START
            for number, (digest, data) in enumerate(_pieces(file)):
                tick = _decoded(path, number, data)
                if all(tick.after <= after for later, after in begun if later > number):
                    yield Exhibit(tick, digest.hex(), _chained(before, data) == digest)
                before = digest
    except FileNotFoundError:
        return
    except OSError as error:
        raise JournalError(f"{path}: cannot be read: {error.strerror}") from error


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
            state = match.game
            made = [outcome for entry in tick.entries if (outcome := enact(match, entry, tick.field))]
            yield exhibit, following, match, state, made
        exhibit = following


def _decoded(path: Path, number: int, data: bytes) -> TickEvidence:
    try:
        tick = _decoder.decode(data)
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise JournalError(f"{path}: expected the evidence of tick {number + 1}: {error}") from None
    if tick.began and tick.began.format != FORMAT:
        raise JournalError(
            f"{path}: expected evidence of version {FORMAT}, got {tick.began.format}: use the VRG that recorded it"
        )
    return tick


def _chained(before: bytes, data: bytes) -> bytes:
    return hashlib.blake2b(before + data, digest_size=len(_START)).digest()


def _pieces(file: BinaryIO) -> Iterator[tuple[bytes, bytes]]:
    """The digest and the data of each tick in a file; a torn last one is left out."""
    left = os.fstat(file.fileno()).st_size
    while left >= _HEAD.size:
        length, digest = _HEAD.unpack(file.read(_HEAD.size))
        left -= _HEAD.size + length
        if left >= 0:
            yield digest, file.read(length)
