"""Finds the place in a student's code at which something has gone wrong, in words."""

import socket
import sys
import traceback
from pathlib import Path
from types import TracebackType

from vrg.errors import StrategyError
from vrg.types import printable

_OWN = str(Path(__file__).parent)
_LIBRARIES = (sys.prefix, sys.base_prefix)


class OutputFloodError(Exception):
    """A strategy prints more than it may."""


class DecisionTimeoutError(BaseException):
    """A strategy takes too long to decide. A student's `except Exception` does not catch it."""


class DeferredError(BaseException):
    """What another node has deferred cannot be made. A student's `except Exception` does not catch it.

    Attributes:
        sender: the node. error: what it raises.
    """

    def __init__(self, sender: str, error: Exception) -> None:
        super().__init__(f"{sender}: {error}")
        self.sender, self.error = sender, error


FINAL = (MemoryError, OutputFloodError)
"""Failures after which a strategy is not tried again."""

_REFUSED: list[str] = []
"""The advice on a PermissionError in this process, once it is sealed."""


def tell_of_refusals(remark: str) -> None:
    """Add a remark to each failure by a PermissionError, or by a name that the network does not resolve, from now on.

    The reason is that this process has given up rights.
    """
    _REFUSED[:] = [remark]


def failure_of(error: BaseException) -> StrategyError:
    """The exception of a strategy in one line, with the innermost place in the student's own code."""
    try:
        # The text of a SyntaxError ends with its place, which follows anyway.
        words = error.msg if isinstance(error, SyntaxError) and error.filename else str(error)
        text = printable(" ".join(words.split()))
    except BaseException:  # its own `__str__` is a student's code, too
        text = ""
    words = f"{type(error).__name__}: {text}" if text else type(error).__name__
    if isinstance(error, PermissionError | socket.gaierror) and _REFUSED:
        words = f"{words}; {_REFUSED[0]}"
    if isinstance(error, SyntaxError) and error.filename:
        where = f"{Path(error.filename).name}, line {error.lineno}"
    else:
        # A strategy that decides elsewhere was only waited for here.
        where = place_of(error.__traceback__, ours=not isinstance(error, DecisionTimeoutError))
    failure = StrategyError(f"{words} ({where})" if where else words, final=isinstance(error, FINAL))
    failure.__cause__ = error
    return failure


def place_of(trace: TracebackType | None, *, ours: bool = True) -> str:
    """The innermost place of a traceback that is neither in VRG nor in a library, such as `ann.py, line 7, in act`.

    If there is none, it is the innermost place of all, or empty if `ours` is False; empty without a traceback.
    """
    frames = [frame for frame in traceback.extract_tb(trace) if ours or is_students(frame.filename)]
    if not frames:
        return ""
    foreign = [frame for frame in frames if is_students(frame.filename)]
    frame = (foreign or frames)[-1]
    return place_text(frame.filename, frame.lineno, frame.name)


def place_of_method(owner: object, name: str) -> str:
    """The place of a method of an object, such as `ann.py, line 7, in act`; empty if it is not known."""
    code = getattr(getattr(owner, name, None), "__code__", None)
    return "" if code is None else place_text(code.co_filename, code.co_firstlineno, name)


def place_text(file: str, line: object, name: str) -> str:
    """A place in a program, in words such as `ann.py, line 7, in act`."""
    return printable(f"{Path(file).name}, line {line}, in {name}")


def is_students(file: str) -> bool:
    """True if a file of Python code is neither VRG's own nor a library's."""
    return not file.startswith("<frozen") and not any(Path(file).is_relative_to(own) for own in (_OWN, *_LIBRARIES))
