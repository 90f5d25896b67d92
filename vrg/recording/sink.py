"""The sinks of a recorder: a file, or viewers that look on."""

from pathlib import Path
from typing import Protocol

from msgspec import Struct


class Sink(Protocol):
    """Takes messages in. Every method but `abandon` may raise OSError, after which nothing more can be written.

    Attributes:
        path: the file that was made; None if there is none.
    """

    path: Path | None

    def write(self, topic: str, record: Struct, stamp: float, sequence: int) -> None:
        """Add a message.

        Args:
            stamp: match time, s. sequence: the publisher's.

        Raises:
            MessageError: it cannot hold this message. What was written before stays, and more can be written.
        """

    def flush(self) -> None:
        """Let what was written outlive this process, or reach those who have just come."""

    def finish(self) -> None:
        """End it in order. Nothing can be written afterwards."""

    def abandon(self) -> None:
        """End it as it is, after an error."""
