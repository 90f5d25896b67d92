"""The HTML over the picture: score, clock, banners and the last call. Names in it may come from anybody."""

from html import escape
from typing import Final

from vrg.colours import Rgb, hexadecimal, mix
from vrg.games import game_of
from vrg.games.game import capitalised
from vrg.ui import palette
from vrg.ui.banner import banners
from vrg.ui.headline import headline
from vrg.ui.pages import rendered
from vrg.ui.scene import Scene


def board(scene: Scene) -> str:
    """The score and the clock in the middle above, below them what the match is about or must not be overlooked."""
    head = headline(scene)
    teams = [
        {"points": team.points, "team": team.team, "words": team.words, "colour": _tint(team.colour)}
        for team in head.teams
    ]
    half = (len(teams) + 1) // 2
    told = [
        {"heading": b.heading, "text": b.text, "colour": hexadecimal(b.colour), "ink": _ink(b.colour)}
        for b in banners(scene)
    ]
    text = rendered(
        "board.html",
        package=__package__,
        head=head,
        left=teams[:half],
        right=teams[half:],
        started=scene.stage is not None,
        banners=told,
    )
    return str(text)


def _tint(colour: Rgb) -> str:
    return hexadecimal(mix(colour, palette.TEXT, 0.15))


def _ink(colour: Rgb) -> str:
    return hexadecimal(palette.ink_on(colour))


def last_call(scene: Scene) -> str:
    """The last call of the referee. The browser lets it fade, and shows it again if it is another text."""
    if not scene.calls:
        return ""
    call = scene.calls[-1]
    marked = " marked" if call.rule in game_of(scene.game).marked else ""
    return f'<div class="vrg-call{marked}">{escape(capitalised(call.text))}</div>'


_COLOURS = ("panel", "line", "text", "muted", "caution")
STYLE: Final = str(
    rendered(
        "board_style.html",
        package=__package__,
        colours={name: hexadecimal(getattr(palette, name.upper())) for name in _COLOURS},
    )
)
"""The style of all that, for the head of the page."""
