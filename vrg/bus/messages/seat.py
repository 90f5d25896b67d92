"""The messages by which a player is replaced while its match runs."""

from vrg.bus.messages.base import Message, Reason, Text
from vrg.types import Name


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
