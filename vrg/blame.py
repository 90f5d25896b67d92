"""Where in a student's code something has gone wrong, in words."""

import sys
import traceback
from pathlib import Path
from types import TracebackType

from vrg.errors import StrategyError

_OWN = str(Path(__file__).parent)
_LIBRARIES = (sys.prefix, sys.base_prefix)


class OutputFloodError(Exception):
    """A strategy prints more than it may."""


class DecisionTimeoutError(BaseException):
    """A strategy takes too long to decide. No `except Exception` of a student's can catch it."""


FINAL = (MemoryError, OutputFloodError)
"""Failures after which a strategy is not tried again."""


def failure_of(error: BaseException) -> StrategyError:
    """What a strategy has raised, in one line: the exception, and the innermost place in the student's own code."""
    last = traceback.format_exception_only(error)[-1].strip()
    words = last.removeprefix(f"{__name__}.")
    if isinstance(error, SyntaxError) and error.filename:
        where = f"{Path(error.filename).name}, line {error.lineno}"
    else:
        where = place_of(error.__traceback__)
    failure = StrategyError(f"{words} ({where})" if where else words, final=isinstance(error, FINAL))
    failure.__cause__ = error
    return failure


def place_of(trace: TracebackType | None) -> str:
    """The innermost place of a traceback that is neither in VRG nor in a library, such as `ann.py, line 7, in act`.

    If there is none, it is the innermost place of all; empty without a traceback.
    """
    frames = traceback.extract_tb(trace)
    if not frames:
        return ""
    foreign = [frame for frame in frames if is_students(frame.filename)]
    frame = (foreign or frames)[-1]
    return f"{Path(frame.filename).name}, line {frame.lineno}, in {frame.name}"


def place_of_method(owner: object, name: str) -> str:
    """Where a method of an object is written, such as `ann.py, line 7, in act`; empty if nobody can tell."""
    code = getattr(getattr(owner, name, None), "__code__", None)
    return "" if code is None else f"{Path(code.co_filename).name}, line {code.co_firstlineno}, in {name}"


def is_students(file: str) -> bool:
    """Whether a file of Python code is neither VRG's own nor a library's."""
    return not file.startswith((_OWN, *_LIBRARIES, "<frozen"))
