"""What went wrong in a student's code: its line, and its kind, for which the page has words for a beginner."""

import re
from typing import Final

from msgspec import Struct

_AT: Final = re.compile(r" \(at (\d+(?:\.\d+)?) s\)$")
_KIND: Final = re.compile(r"\b[A-Z]\w*(?:Error|Exception)\b")
_FOR_OTHERS: Final = re.compile(r"(?:; the sandbox refused it[^()]*| \((?:[^()]*, line \d+[^()]*|/[^()]*)\))+$")
"""What ends a sentence of VRG's and is not for beginners: places in code, and advice for those who run VRG."""
_NO_MOTION: Final = re.compile(r"\.act: expected finite numbers")
"""VRG's words for motions that no robot can drive."""
ENDLESS, MOTION, ANSWER = "endless", "motion", "answer"
"""The kinds of faults that Python has no name for: act does not come to an end, no robot can drive so, or act has
returned something else."""


class Fault(Struct, frozen=True, kw_only=True):
    """A failure of a student's code.

    Args:
        text: what went wrong, as Python has it. line: in the student's code, from 1; None if that is not known.
        time: the match time, s; None if it was before the match.
        kind: such as `NameError`; empty if it has none. limit: what `act` has exceeded, s; None for nothing.
    """

    text: str
    line: int | None = None
    time: float | None = None
    kind: str = ""
    limit: float | None = None


def fault_of(text: str, code: str) -> Fault:
    """The failure that a sentence of VRG's tells.

    Args:
        text: such as `NameError: name 'x' is not defined (code.py, line 7, in act) (at 3.1 s)`.
        code: the file name of the student's code.
    """
    at, file = _AT.search(text), re.escape(code)
    text = _AT.sub("", text)
    kind = MOTION if _NO_MOTION.search(text) else ANSWER if ".act: " in text else ""
    found = re.search(rf"{file}(?:, line |:)(\d+)", text)
    text = _FOR_OTHERS.sub("", text)
    if kind == MOTION:
        text = "act returned a motion that no robot can drive: its numbers must be finite"
    named = _KIND.search(text)
    if named is not None:  # what VRG wanted to do when it met the error says nothing to a beginner
        text, kind = text[named.start() :], named[0]
    # The folder is nobody's business.
    text = re.sub(rf"^\S*{file}(?::\w+)?: |: type \S*{file}:CLASS$|\S*/(?={file})", "", text)
    line = None if found is None else int(found[1])
    return Fault(text=text[:500], line=line, time=None if at is None else float(at[1]), kind=kind)
