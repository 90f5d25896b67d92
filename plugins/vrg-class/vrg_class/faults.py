"""What went wrong in a student's code: its line, and words for a beginner."""

import re
from typing import Final

from msgspec import Struct

_AT: Final = re.compile(r" \(at (\d+(?:\.\d+)?) s\)$")
_HINTS: Final = {
    "NameError": "Python does not know this name. Is it spelled as where it was made? Is something missing above?",
    "AttributeError": "This thing has nothing of this name after the dot. The list of what a view has shows the names.",
    "SyntaxError": "Python cannot read this line. Look for a missing colon, bracket or quote, here or one line above.",
    "IndentationError": "The spaces at the beginning of this line do not fit those of the lines around it.",
    "TabError": "Some lines begin with tabs, others with spaces. Use four spaces for each step.",
    "TypeError": "A function got something that it cannot use: look at what stands in its brackets.",
    "ZeroDivisionError": "Something is divided by 0 here.",
    "IndexError": "The list has fewer things than that.",
    "KeyError": "The table has no entry of this name.",
    "ValueError": "The value has the right kind, but cannot be used here.",
    "RecursionError": "A function calls itself without end.",
    "ImportError": "This cannot be imported here.",
    "ModuleNotFoundError": "This module is not installed here.",
    "PermissionError": "The code may not do this: it can only play.",
    "MemoryError": "The code needs too much memory. Does a list grow without end?",
    "it does not come to an end": "The code was here for two seconds. Does a loop ever stop?",
    "OutputFloodError": "The code prints too much.",
}
"""What may help, by the kind of the error."""
_NO_MOTION: Final = re.compile(r"the process of the strategy is gone: .*\$\.twist")
"""What VRG tells of a motion that cannot be sent."""
_ANSWER: Final = "act must return how to drive, such as `return Twist(0.5, 0.0)`: metres a second, and a turn."


class Fault(Struct, frozen=True, kw_only=True):
    """A failure of a student's code.

    Args:
        text: what went wrong, as Python has it. line: in the student's code, from 1; None if that is not known.
        time: the match time, s; None if it was before the match. hint: what may help, for a beginner.
    """

    text: str
    line: int | None = None
    time: float | None = None
    hint: str = ""


def fault_of(text: str, code: str, line: int | None = None) -> Fault:
    """The failure that a sentence of VRG's tells.

    Args:
        text: such as `NameError: name 'x' is not defined (code.py, line 7, in act) (at 3.1 s)`.
        code: the file name of the student's code. line: if it is known already.
    """
    at = _AT.search(text)
    text = _AT.sub("", text)
    if _NO_MOTION.search(text):
        text = "act returned a motion that no robot can drive: its numbers must be finite, and not too large"
    if line is None:
        found = re.search(rf"{re.escape(code)}(?:, line |:)(\d+)", text)
        line = None if found is None else int(found[1])
    text = re.sub(rf" \([^()]*{re.escape(code)}, line \d+[^()]*\)$", "", text)
    # The folder is nobody's business, nor is what Python has of its own in between.
    text = re.sub(rf"\S*{re.escape(code)}: cannot be (?:read as Python|imported): ", "", text)
    text = re.sub(rf"\S*/(?={re.escape(code)})| \(<frozen [^)]*\)", "", text)
    hint = next((words for kind, words in _HINTS.items() if re.search(rf"\b{kind}\b", text)), "")
    if not hint and ".act: " in text:
        hint = _ANSWER
    return Fault(text=text[:500], line=line, time=None if at is None else float(at[1]), hint=hint)
