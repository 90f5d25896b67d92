"""What all messages have in common."""

from typing import Annotated, ClassVar

from msgspec import Meta, Struct

TEXT_LENGTH = 2000
"""Characters of the longest text in a message."""
Text = Annotated[str, Meta(max_length=TEXT_LENGTH)]
REASON_LENGTH = 300
Reason = Annotated[str, Meta(max_length=REASON_LENGTH)]
"""What a person types to explain a decision."""


class Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every message has in common."""

    version: ClassVar[int] = 1


class SensorMessage(Message, frozen=True, kw_only=True):
    """One reading of one sensor. Its stamp on the bus is the time of the measurement.

    Attributes:
        kind: the word that stands for this kind of sensor in keys and in robot models, such as `laser`.
    """

    kind: ClassVar[str]


def shortened(text: str, length: int = TEXT_LENGTH) -> str:
    """The text, or as much of its beginning as a field of `length` characters holds, with an ellipsis."""
    return text if len(text) <= length else text[: length - 1] + "…"
