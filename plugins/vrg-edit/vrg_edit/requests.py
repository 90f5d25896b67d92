"""The requests of the configurator's page. They come from outside, so each field has bounds."""

from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from vrg.types import Metres, Radians

_Text = Annotated[str, Meta(max_length=2000)]
_Number = Annotated[int, Meta(ge=0, le=1000)]


class _Request(Struct, frozen=True, tag_field="do", tag=str.lower, forbid_unknown_fields=True, kw_only=True):
    """The base class of all requests; the field `do` tells which one it is."""


class _Edit(_Request, frozen=True, kw_only=True):
    """A change of the match.

    Args:
        seen: the number of the state that the page showed. A change of another one is not made.
    """

    seen: int


class Look(_Request, frozen=True):
    """Tell what there is, also what can be opened."""


class Check(_Request, frozen=True):
    """Check the match as it is now."""


class Open(_Request, frozen=True, kw_only=True):
    """Take up another match.

    Args:
        game: its default match is taken up. map: on which it is played; empty for the game's own. match: a recent
            match file, in place of a game. sure: True gives up what is not saved; this holds for all requests.
    """

    game: _Text = ""
    map: _Text = ""
    match: _Text = ""
    sure: bool = False


class Set(_Edit, frozen=True, kw_only=True):
    """Take in what was typed in a field.

    Args:
        key: the parts of the path of the field with dots between them, such as `players.2.x`.
    """

    key: _Text
    typed: _Text


class Place(_Edit, frozen=True, kw_only=True):
    """Put a player's robot at a pose."""

    player: _Number
    x: Metres
    y: Metres
    heading: Radians


class Count(_Edit, frozen=True, kw_only=True):
    """Have this many players."""

    players: _Number


class Remove(_Edit, frozen=True, kw_only=True):
    """Take players out."""

    players: Annotated[list[_Number], Meta(max_length=1000)]


class Undo(_Edit, frozen=True, kw_only=True):
    """Go back to before the last change."""


class Redo(_Edit, frozen=True, kw_only=True):
    """Make the change again that was taken back last."""


class Save(_Edit, frozen=True, kw_only=True):
    """Write the match file.

    Args:
        name: a new name of the match and its file; empty for the file that it has. replace: True replaces another file.
        play: play it then, if it is good.
    """

    name: _Text = ""
    replace: bool = False
    play: bool = False


class Watch(_Request, frozen=True, kw_only=True):
    """Watch the run of a recent match file again."""

    match: _Text
    sure: bool = False


class Leave(_Request, frozen=True, kw_only=True):
    """Close the configurator."""

    sure: bool = False


Request = Look | Check | Open | Set | Place | Count | Remove | Undo | Redo | Save | Watch | Leave
_DECODER = msgspec.json.Decoder(Request)


def read_request(text: bytes) -> Request:
    """Decode a request.

    Raises:
        ValueError: it is not one. The message tells what was expected.
    """
    try:
        found: Request = _DECODER.decode(text)
    except msgspec.MsgspecError as error:
        raise ValueError(f"expected a request of the configurator's page, got something else: {error}") from None
    return found
