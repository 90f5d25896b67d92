"""The base classes of all messages, and the bounds of texts in them."""

from collections.abc import Mapping
from typing import Annotated, ClassVar

from msgspec import Meta, Struct, to_builtins
from msgspec.structs import force_setattr

from vrg.types import CONTROL, FrozenDict, printable

TEXT_LENGTH = 2000
"""The length of the longest text in a message, in characters."""
PLAIN = rf"^[^{CONTROL}]*\Z"
Text = Annotated[str, Meta(max_length=TEXT_LENGTH, pattern=PLAIN)]
"""A text without signs that change a terminal. A line break is one."""
REASON_LENGTH = 300
Reason = Annotated[str, Meta(max_length=REASON_LENGTH, pattern=PLAIN)]
"""The text that a person types to explain a decision."""


def freeze(struct: Struct, *names: str) -> None:
    """Make the tables in these fields unchangeable. For `__post_init__`, which msgspec calls after decoding, too."""
    for name in names:
        table = getattr(struct, name)
        if type(table) is not FrozenDict:
            force_setattr(struct, name, FrozenDict(table))


class Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, gc=False):
    """The base class of all messages.

    A message is immutable, so it is never part of a cycle, and the garbage collector need not look at it: thousands of
    them are made a second.

    Attributes:
        version: the version of the message's fields, which travels with it.
    """

    version: ClassVar[int] = 1


class SensorMessage(Message, frozen=True, kw_only=True):
    """One reading of one sensor. Its stamp on the bus is the time of the measurement.

    Attributes:
        kind: the word that stands for this kind of sensor in keys and in robot models, such as `laser`.
    """

    kind: ClassVar[str]

    @property
    def words(self) -> str:
        """The reading in one line, for people. A kind of sensor may say it better than by the names of its fields."""
        return _listed(to_builtins(self, builtin_types=(bytes,)))


def _listed(value: object) -> str:
    """Plain data without its brackets; numbers are rounded to a thousandth, angles stay in rad."""
    match value:
        case Mapping():
            return ", ".join(f"{name} {_listed(item)}" for name, item in value.items())
        case list() | tuple():
            return "(" + " ".join(_listed(item) for item in value) + ")"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{round(value, 3) + 0.0:g}"
        case bytes():
            return f"{len(value)} bytes"
        case _:
            return str(value)


def shortened(text: str, length: int = TEXT_LENGTH) -> str:
    """The text as a message may carry it: printable, and cut and ended by an ellipsis if it is longer than `length`."""
    text = printable(text)
    return text if len(text) <= length else text[: length - 1] + "…"
