"""The log of the steps of a match in lockstep: digests of its state, and what its seed does not tell.

Each line of `steps.jsonl` in the run folder is a JSON object. Once a second of match time there is a digest of what
each node has published in that step. Two runs of one match with one seed have the same digests, and the first one that
differs tells when and in which node they parted. Besides, each step is noted that a player has missed: see `Missed`.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Self

import msgspec
from msgspec import Struct

from vrg.blame import DecisionTimeoutError
from vrg.errors import LaunchError, StrategyError
from vrg.files import RECORDS_LIMIT, Decoder, read_bytes, records_of


class Digest(Struct, frozen=True, kw_only=True, tag="digest"):
    """The state of the match in one step.

    Args:
        time: the match time of the step, s.
        nodes: the digest of all that a node has published in it, by the node's kind and name: `player/ann`.
    """

    time: float
    nodes: Mapping[str, str]


class Missed(Struct, frozen=True, kw_only=True, tag="missed", omit_defaults=True):
    """A player that has missed a step: its process has not answered in time, or not at all.

    Args:
        time: the match time of the step, s. player: its name.
        asked: whether it was asked in this step; if not, it was still deciding in an earlier one.
        failure: why its process was given up, in words; empty if it goes on.
        final: True if it is not tried again. hung: True if it was given up because it did not answer for long.
    """

    time: float
    player: str
    asked: bool
    failure: str = ""
    final: bool = False
    hung: bool = False

    @property
    def error(self) -> StrategyError | DecisionTimeoutError:
        """The error of its failure."""
        return DecisionTimeoutError(self.failure) if self.hung else StrategyError(self.failure, final=self.final)


class Unmade(Struct, frozen=True, kw_only=True, tag="unmade"):
    """A strategy that could not be made again after a failure.

    Args:
        time: the match time of the step, s. player: its name. why: the reason, in words.
    """

    time: float
    player: str
    why: str


class Ended(Struct, frozen=True, kw_only=True, tag="ended"):
    """The end of the match.

    Args:
        time: the match time of the first step that was not played any more, s.
    """

    time: float


Line = Digest | Missed | Unmade | Ended
_decoder: Decoder[Line] = msgspec.json.Decoder(Line)


class StepLog:
    """Writes the log of a match; a context manager.

    Args:
        path: the file, which is made again.

    Raises:
        LaunchError: it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise self._unusable(error) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def write(self, line: Line) -> None:
        """Add a line.

        Raises:
            LaunchError: it cannot be written.
        """
        try:
            self._file.write(msgspec.json.encode(line) + b"\n")
        except OSError as error:
            raise self._unusable(error) from None

    def digest(self, time: float, nodes: Mapping[str, str]) -> None:
        """Add the digests of a step."""
        self.write(Digest(time=round(time, 6), nodes=nodes))

    def _unusable(self, error: OSError) -> LaunchError:
        return LaunchError(
            f"{self._path}: cannot be written: {error.strerror}: free some space, or choose another place"
        )


def read_steps(path: Path) -> list[Line]:
    """The whole lines of a log; none if there is no log. A line that is damaged is left out with a warning.

    Raises:
        LaunchError: it cannot be read.
    """
    try:
        found = records_of(read_bytes(path, RECORDS_LIMIT), _decoder)
    except FileNotFoundError:
        return []
    except OSError as error:
        raise LaunchError(f"{path}: cannot be read: {error.strerror}") from None
    found.warn(path, "one of a log of steps")
    return list(found)


def parted(one: Iterable[Line], other: Iterable[Line]) -> tuple[float, list[str]] | None:
    """The first step in which the digests of two logs differ: its match time, s, and the nodes that differ.

    None if there is none as far as both go.
    """
    digests = ([line for line in lines if isinstance(line, Digest)] for lines in (one, other))
    for a, b in zip(*digests, strict=False):
        if a != b:
            names = [name for name in sorted({*a.nodes, *b.nodes}) if a.nodes.get(name) != b.nodes.get(name)]
            return min(a.time, b.time), names
    return None
