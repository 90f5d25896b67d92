"""The requests of browsers to the page's server, and the commands and decisions that follow from them.

Requests come from outside, so each field has bounds. A request that breaks them gets an error in words.
"""

import enum
from dataclasses import dataclass
from typing import Annotated, Final

import msgspec
from msgspec import Meta, Struct

from vrg.types import Signed
from vrg.ui.web.admission import VisitorKind, VisitorRole

REQUEST_LIMIT: Final = 2048
"""The number of bytes in a request."""
_NAME = Annotated[str, Meta(max_length=64)]


class PageButton(enum.StrEnum):
    """The act of a button of the page."""

    HALT = "halt"
    RESUME = "resume"
    RECOVER = "recover"
    END = "end"
    ESTOP = "estop"
    RELEASE = "release"
    DISQUALIFY = "disqualify"
    REINSTATE = "reinstate"


class _Request(Struct, frozen=True, tag_field="t", forbid_unknown_fields=True, kw_only=True):
    """The base class of all requests; the field `t` tells which one it is."""


class Hello(_Request, frozen=True, tag="hello", kw_only=True):
    """The first request.

    Args:
        token: admits to a role; without one the browser watches. tab: a random word that the page has made for itself.
        takeover: True takes a seat that another page has.
    """

    token: Annotated[str, Meta(max_length=64)] = ""
    tab: _NAME = ""
    takeover: bool = False


class Ack(_Request, frozen=True, tag="ack", kw_only=True):
    """The page has shown this many batches since it was admitted."""

    count: Annotated[int, Meta(ge=0)]


class DriveRequest(_Request, frozen=True, tag="drive", kw_only=True):
    """A driving command, which the page repeats as long as it holds.

    Args:
        forward, turn: from -1 to 1, ahead and to the left, as fractions of what the robot can do.
    """

    forward: Signed
    turn: Signed


class GiveBack(_Request, frozen=True, tag="give_back", kw_only=True):
    """The player plays by itself again."""


class Pressed(_Request, frozen=True, tag="act", kw_only=True):
    """A button was pressed; `player` is whom it is about, empty for none."""

    what: PageButton
    player: _NAME = ""


class Inspect(_Request, frozen=True, tag="inspect", kw_only=True):
    """A drawer was opened, or another player was selected in it.

    Args:
        drawer: its name; empty closes it. player: empty for none.
    """

    drawer: _NAME = ""
    player: _NAME = ""

    @property
    def part(self) -> str:
        """The name of the part with what it shows, behind `vrg.ui.web.gallery.PRIVATE`."""
        return f"{self.drawer}/{self.player}"


Request = Hello | Ack | DriveRequest | GiveBack | Pressed | Inspect
_DECODER: Final = msgspec.json.Decoder(Request)


def read_request(text: str) -> Request:
    """Decode a request.

    Raises:
        ValueError: it is not one; the message gives the reason, and repeats nothing of it.
    """
    try:
        request: Request = _DECODER.decode(text)
    except msgspec.ValidationError as error:
        raise ValueError(f"this request is not understood: {error}") from None
    except msgspec.DecodeError:
        raise ValueError("expected a request in JSON, got something else") from None
    return request


def refusal(role: VisitorRole, request: Request) -> str:
    """Why a role may not ask for this, in words; empty if it may."""
    match request:
        case DriveRequest() | GiveBack() if role.kind is not VisitorKind.SEAT:
            return "driving needs the link of a player's seat, with its token"
        case Pressed(what=PageButton.ESTOP) if role.kind is VisitorKind.VIEWER:
            return "the emergency stop needs the link of an official or of a player's seat, with its token"
        case Pressed(what=what) if what is not PageButton.ESTOP and role.kind is not VisitorKind.OFFICIAL:
            return "deciding needs the official's link, with its token"
        case Inspect() if role.kind is not VisitorKind.OFFICIAL:
            return "a drawer needs the official's link, with its token"
        case _:
            return ""


@dataclass(frozen=True)
class PageDrive:
    """A person at a page, the guest of this number, drives a player; `forward` and `turn` are as in `DriveRequest`."""

    guest: int
    player: str
    forward: float
    turn: float


@dataclass(frozen=True)
class ButtonPress:
    """A person at a page has pressed a button.

    Args:
        guest: the number of its connection, which gets the answer. by: who that is, in words.
        player: whom it is about; empty for none.
    """

    guest: int
    by: str
    what: PageButton
    player: str = ""


@dataclass(frozen=True)
class Wishes:
    """The requests of people at pages since the last look.

    Args:
        commands: the newest command for each player. given_back: players that were given back, before that command.
        decisions: in their order.
    """

    commands: tuple[PageDrive, ...] = ()
    given_back: tuple[str, ...] = ()
    decisions: tuple[ButtonPress, ...] = ()
