"""What went wrong in a student's code: its line, and words for a beginner."""

import re
from typing import Final

from msgspec import Struct

_AT: Final = re.compile(r" \(at (\d+(?:\.\d+)?) s\)$")
_KIND: Final = re.compile(r"\b[A-Z]\w*(?:Error|Exception)\b")
_FOR_OTHERS: Final = re.compile(r"(?:; the sandbox refused it[^()]*| \((?:[^()]*, line \d+[^()]*|/[^()]*)\))+$")
"""What ends a sentence of VRG's and is not for beginners: places in code, and advice for those who run VRG."""
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
    "RecursionError": "A function calls itself without end.",
    "ImportError": "The module has nothing of this name. Is it spelled right?",
    "ModuleNotFoundError": "There is no module of this name here. Is it spelled right?",
    "PermissionError": "The code may not do this: it can only play.",
    "MemoryError": "The code needs too much memory. Does a list grow without end?",
    "OutputFloodError": "The code prints too much.",
    "EOFError": "Nobody can type anything while the robots play: a robot decides by what it sees in view.",
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


def fault_of(text: str, code: str) -> Fault:
    """The failure that a sentence of VRG's tells.

    Args:
        text: such as `NameError: name 'x' is not defined (code.py, line 7, in act) (at 3.1 s)`.
        code: the file name of the student's code.
    """
    at, file = _AT.search(text), re.escape(code)
    text = _AT.sub("", text)
    if _NO_MOTION.search(text):
        text = "act returned a motion that no robot can drive: its numbers must be finite, and not too large"
    found = re.search(rf"{file}(?:, line |:)(\d+)", text)
    text = _FOR_OTHERS.sub("", text)
    kind = _KIND.search(text)
    if kind is not None:  # what VRG wanted to do when it met the error says nothing to a beginner
        text = text[kind.start() :]
    # The folder is nobody's business.
    text = re.sub(rf"^\S*{file}(?::\w+)?: |: type \S*{file}:CLASS$|\S*/(?={file})", "", text)
    hint = _HINTS.get(kind[0], "") if kind is not None else _ANSWER if ".act: " in text else ""
    line = None if found is None else int(found[1])
    return Fault(text=text[:500], line=line, time=None if at is None else float(at[1]), hint=hint)
