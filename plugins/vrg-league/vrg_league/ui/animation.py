"""A game as a picture that moves, for a page without a program: where the players were, some times as fast."""

from collections.abc import Mapping, Sequence
from typing import Final

from markupsafe import Markup

from vrg.types import Vector
from vrg.ui.pages import rendered

SPEED: Final = 5.0
"""The ratio of its speed to that of the match."""
_MARGIN: Final = 1.0
"""The ground that is shown around all that the players have covered, m."""
_BODY: Final = 0.4
"""The radius of a player, m; robots are smaller, too small to be seen."""


def animated(times: Sequence[float], tracks: Mapping[str, Sequence[Vector | None]], first: Sequence[str]) -> Markup:
    """The game as SVG; empty if nothing is known of it.

    Args:
        times: the match times of the positions, s, at even distances. tracks: x and y of each player at these times, m;
            None where it is not known.
        first: the players of the first team, which have another colour.
    """
    known = [place for track in tracks.values() for place in track if place is not None]
    if len(times) < 2 or not known:
        return Markup()
    x_min, x_max = min(x for x, _ in known) - _MARGIN, max(x for x, _ in known) + _MARGIN
    y_min, y_max = min(y for _, y in known) - _MARGIN, max(y for _, y in known) + _MARGIN
    ways = [
        # Pictures count y downwards.
        (name, name in first, [f"{x - x_min:.2f}" for x, _ in places], [f"{y_max - y:.2f}" for _, y in places])
        for name, track in tracks.items()
        if (places := _filled(track))
    ]
    seconds = f"{(times[-1] - times[0]) / SPEED:.1f}"
    return rendered(
        "animation.svg",
        package=__package__,
        width=x_max - x_min,
        height=y_max - y_min,
        radius=_BODY,
        seconds=seconds,
        ways=ways,
    )


def _filled(track: Sequence[Vector | None]) -> list[Vector]:
    """A track in which a player whose place is not known stays where it was; empty if no place is known."""
    known = next((place for place in track if place is not None), None)
    filled = []
    for place in track:
        known = place or known
        if known is not None:
            filled.append(known)
    return filled
