"""What pages of a class may ask for, with the bounds of each."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from vrg_class.folder import CODE_SIZE

Name = Annotated[str, Meta(max_length=80)]
Code = Annotated[str, Meta(max_length=5 * CODE_SIZE)]
"""More than a student may have, so that one who has more is told so."""
Number = Annotated[int, Meta(ge=1, le=1_000_000)]


class Join(Struct, frozen=True, forbid_unknown_fields=True):
    """A student joins; `word` is that of the roster, if there is one; `device` tells devices of one address apart."""

    name: Name
    word: Name = ""
    device: Name = ""


class Nothing(Struct, frozen=True):
    """A request for which it is enough who asks."""


class Save(Struct, frozen=True, forbid_unknown_fields=True):
    """The code as it is now, which is saved, or handed in: then it takes part in the league from now on.

    Args:
        base: the revision of the code from which it was made, as the server has told it.
        apart: what it replaces is to be kept as a version.
    """

    code: Code
    base: Name
    apart: bool = False


class Try(Save, frozen=True, forbid_unknown_fields=True):
    """The code is saved and tried.

    Args:
        step: the name of the step of the lesson; empty plays the match of the league.
        against: 0 for the other team of the step or of the match; the number of a former version of the own code.
    """

    step: Name = ""
    against: Annotated[int, Meta(ge=0, le=1_000_000)] = 0


class Start(Struct, frozen=True, forbid_unknown_fields=True):
    """How a step begins is to be shown; the empty name is the match of the league."""

    step: Name = ""


class OfVersion(Struct, frozen=True, forbid_unknown_fields=True):
    """A former version is to be shown."""

    number: Number


class Decide(Struct, frozen=True, forbid_unknown_fields=True):
    """The teacher halts or goes on, lets nobody join any more, or has a message for all; None leaves each as it is."""

    halted: bool | None = None
    closed: bool | None = None
    message: Annotated[str, Meta(max_length=300)] | None = None


class OfStudent(Struct, frozen=True, forbid_unknown_fields=True):
    """The teacher wants to see the code of a student."""

    student: Name


class Change(Struct, frozen=True, forbid_unknown_fields=True):
    """The teacher changes who is in the class.

    Args:
        act: `reset` starts again with the first code and no step done; `revoke` gives another link.
        student: the folder of the student; empty for `add`. name: the new one, for `add` and `rename`.
    """

    act: Literal["add", "rename", "remove", "reset", "revoke"]
    student: Name = ""
    name: Name = ""
