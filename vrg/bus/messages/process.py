"""The launcher's messages about the processes of a match, and those by which a player is replaced while it runs."""

import enum

from msgspec import Struct

from vrg.bus.messages.base import Message, Reason, Text
from vrg.types import Count, Deviation, Name


class ProcessState(enum.Enum):
    """The state of a process.

    AWAY is a process of a machine that does not answer; it is not known whether it runs.
    """

    STARTING = "starting"
    RUNNING = "running"
    ENDED = "ended"
    AWAY = "away"


class ProcessStatus(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The state of one process, with what belongs to it.

    Args:
        name: its name. machine: the name of its machine in the match file; `here` is where the match is launched.
        state: whether it runs.
        node: the kind and the name of its node, such as `player/ann`; empty if it is no node of the match.
        pid: its process id on its machine; None while it does not run.
        cpu: how much of one processor core it has used lately, 1.0 means all of it.
        memory: the memory that it uses, bytes. restarts: how often it was started again.
    """

    name: Name
    machine: Name
    state: ProcessState
    node: str = ""
    pid: Count | None = None
    cpu: Deviation = 0.0
    memory: Count = 0
    restarts: Count = 0


class Processes(Message, frozen=True, kw_only=True):
    """All processes of a match that its launcher has started, twice a second.

    Args:
        processes: each of them.
    """

    processes: tuple[ProcessStatus, ...]


class SeatRequest(Message, frozen=True, kw_only=True):
    """A request to the launcher to let a player play by another strategy, in a new process.

    Args:
        player: the player's name. strategy: `module:Class`, `file.py:Class` with the whole path, or a registered name.
        by: who asks, for the launcher's terminal.
        id: the id of this request, by which its sender finds the answer.
    """

    player: Name
    strategy: Text
    by: Name
    id: Name


class SeatAnswer(Message, frozen=True, kw_only=True):
    """The launcher's answer to a `SeatRequest`.

    Args:
        id: the id of the request.
        refused: why it was not done, in words; None if it was.
    """

    id: Name
    refused: Reason | None = None
