"""Where two runs of one match parted."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from vrg.coordinator.journal import read_journal
from vrg.errors import LaunchError
from vrg.files import read_bytes
from vrg.recording.difference import first_difference
from vrg.runs.fingerprint import read_fingerprint, unlike
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import parted, read_steps


class Compared(NamedTuple):
    """A sentence about two runs.

    Args:
        differs: it tells of a difference of the matches. explains: it tells of what may be the cause of one.
    """

    text: str
    differs: bool = True
    explains: bool = False


def differences(there: RunFolder, here: RunFolder) -> Iterator[Compared]:
    """Compare fingerprints, match files, digests of steps, journals and recordings; the first difference of each.

    What computed two runs may explain why they differ, but two computers may play the same match.

    Raises:
        LaunchError: a file cannot be read. JournalError: a journal is damaged.
    """
    for file in (there.match_file, here.match_file, there.journal, here.journal):
        if not file.is_file():
            raise LaunchError(f"{file}: no such file: expected a run folder with all its files")
    yield from _computed(there, here)
    if _content(there.match_file) != _content(here.match_file):
        files = f"{there.match_file}, {here.match_file}"
        yield Compared(f"The match files differ: {files}.", differs=False, explains=True)
    step = parted(read_steps(there.steps), read_steps(here.steps))
    if step is not None:
        yield Compared(f"Digests: the first that differ are those of {step[0]:.2f} s, of {', '.join(step[1])}.")
    line = _journal_line(there.journal, here.journal)
    if line is not None:
        yield Compared(f"Journals: the first lines that differ are {line[0]}, at {line[1]:.2f} s.")
    if there.recordings() and here.recordings():
        torn: list[Path] = []
        try:
            difference = first_difference(there.recordings(), here.recordings(), torn)
        except OSError as error:
            raise LaunchError(f"a recording cannot be read: {error}") from None
        for part in torn:
            yield Compared(f"{part} ends in the middle, or is damaged: it was compared as far as it goes.", False)
        if difference is not None:
            yield Compared(f"Recordings: {difference}.")


def _computed(there: RunFolder, here: RunFolder) -> Iterator[Compared]:
    """The differences between what computed two runs, and why that is not known."""
    found = []
    for folder in (there, here):
        try:
            fingerprint = read_fingerprint(folder)
        except LaunchError as error:
            yield Compared(f"{error}.", differs=False)
            continue
        if fingerprint is None:
            yield Compared(f"{folder.path} does not tell what computed it: it has no fingerprint.", differs=False)
        else:
            found.append(fingerprint)
    for what in unlike(found):
        yield Compared(f"The runs were computed with different {what}.", differs=False, explains=True)


def _journal_line(there: Path, here: Path) -> tuple[int, float] | None:
    """The number of the first line in which two journals differ, and its match time in s; None if there is none."""
    if _content(there) == _content(here):
        return None
    (header, one), (other_header, other) = read_journal(there), read_journal(here)
    if header != other_header:
        return 1, 0.0
    for number, (a, b) in enumerate(zip(one, other, strict=False), 2):
        if a != b:
            return number, min(a.time, b.time)
    longer = max(one, other, key=len)
    least = min(len(one), len(other))
    return least + 2, longer[least].time if least < len(longer) else 0.0


def _content(file: Path) -> bytes:
    """The content of a file of a run.

    Raises:
        LaunchError: it cannot be read.
    """
    try:
        return read_bytes(file)
    except OSError as error:
        raise LaunchError(f"{file}: cannot be read: {error.strerror}") from None
