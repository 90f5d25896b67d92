"""What pages of a class may ask for, with the bounds of each."""

from typing import Annotated, TypeVar

import msgspec
from msgspec import Meta, Struct

from vrg_class.folder import CODE_SIZE

Name = Annotated[str, Meta(max_length=80)]
Code = Annotated[str, Meta(max_length=CODE_SIZE)]
T = TypeVar("T", bound=Struct)


class Join(Struct, frozen=True, forbid_unknown_fields=True):
    """A student joins; `word` is that of the roster, if there is one."""

    name: Name
    word: Name = ""


class Nothing(Struct, frozen=True):
    """A request for which it is enough who asks."""


class Save(Struct, frozen=True, forbid_unknown_fields=True):
    """The code as it is now, which is saved, or handed in: then it takes part in the league from now on."""

    code: Code


class Try(Struct, frozen=True, forbid_unknown_fields=True):
    """The code is tried.

    Args:
        step: the name of the step of the lesson; empty plays the match of the league.
        against: empty for the other team of the step or of the match; the number of a former version of the own code.
    """

    code: Code
    step: Name = ""
    against: Annotated[int, Meta(ge=0, le=1_000_000)] = 0


class Start(Struct, frozen=True, forbid_unknown_fields=True):
    """How a step begins is to be shown; the empty name is the match of the league."""

    step: Name = ""


class Decide(Struct, frozen=True, forbid_unknown_fields=True):
    """The teacher halts or goes on, or has a message for everybody; None leaves either as it is."""

    halted: bool | None = None
    message: Annotated[str, Meta(max_length=300)] | None = None


def read(text: bytes, kind: type[T]) -> T:
    """A request as it was sent.

    Raises:
        ValueError: it is none.
    """
    try:
        return msgspec.json.decode(text, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"expected {kind.__name__}: {error}") from None
