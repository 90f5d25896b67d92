"""Why a child has ended, as it tells its supervisor over its leash. Its log has it for people."""

import contextlib
import os
import socket
import traceback
from typing import IO

import msgspec
from msgspec import Struct

from vrg.errors import LaunchError, RobotError
from vrg.types import printable

LEASH = 0
"""The descriptor of a child's standard input, which its supervisor holds as a leash."""
_SIZE = 4000
"""The bytes of the longest ending."""


class Ending(Struct, frozen=True):
    """Why a child has ended.

    Args:
        why: in words, in one line, without the name of the player. error: the type of the error and its place in the
            code, by which the same one is known again, whatever its words.
    """

    why: str
    error: str


def tell(error: BaseException, why: str, *, name: str) -> None:
    """Tell the supervisor why this process ends. Without one, or on Windows, nothing is told.

    Args:
        why: in words. name: of the player, which the supervisor puts before them.
    """
    if isinstance(error, RobotError | LaunchError) and error.name == name:
        why = error.text
    frame = traceback.extract_tb(error.__traceback__)[-1]
    ending = Ending(
        "; ".join(why.splitlines())[: _SIZE // 4], f"{type(error).__name__}, {frame.filename}:{frame.lineno}"
    )
    with contextlib.suppress(OSError), socket.socket(fileno=os.dup(LEASH)) as leash:
        leash.send(msgspec.json.encode(ending), socket.MSG_DONTWAIT)


def told(stream: socket.socket | IO[bytes]) -> Ending | None:
    """What a child that has ended has reported over its leash; None if it has told nothing that makes sense."""
    if not isinstance(stream, socket.socket):
        return None
    try:
        ending = msgspec.json.decode(stream.recv(_SIZE, socket.MSG_DONTWAIT), type=Ending)
    except (OSError, ValueError):
        return None
    return Ending(printable(ending.why), ending.error)
