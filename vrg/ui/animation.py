"""A game as a picture that moves, for a page without a program: where the players were, some times as fast."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Final

from vrg.types import Vector

SPEED: Final = 5.0
"""The ratio of its speed to that of the match."""
_MARGIN: Final = 1.0
"""The ground that is shown around all that the players have covered, m."""
_BODY: Final = 0.4
"""The radius of a player, m; robots are smaller, too small to be seen."""


def animated(times: Sequence[float], tracks: Mapping[str, Sequence[Vector | None]], first: Sequence[str]) -> str:
    """The game as SVG; empty if nothing is known of it.

    Args:
        times: the match times of the positions, s, at even distances. tracks: x and y of each player at these times, m;
            None where it is not known.
        first: the players of the first team, which have another colour.
    """
    known = [place for track in tracks.values() for place in track if place is not None]
    if len(times) < 2 or not known:
        return ""
    x_min, x_max = min(x for x, _ in known) - _MARGIN, max(x for x, _ in known) + _MARGIN
    y_min, y_max = min(y for _, y in known) - _MARGIN, max(y for _, y in known) + _MARGIN
    seconds = f"{(times[-1] - times[0]) / SPEED:.1f}s"
    parts = []
    for name, track in tracks.items():
        places = _filled(track)
        if not places:
            continue
        # Pictures count y downwards.
        xs, ys = [f"{x - x_min:.2f}" for x, _ in places], [f"{y_max - y:.2f}" for _, y in places]
        moves = (
            f'<animate attributeName="{axis}" values="{";".join(values)}" dur="{seconds}" repeatCount="indefinite"/>'
            for axis, values in (("cx", xs), ("cy", ys))
        )
        line = " ".join(f"{x},{y}" for x, y in zip(xs, ys, strict=True))
        parts.append(f'<g class="{"one" if name in first else "two"}"><polyline points="{line}"/>')
        parts.append(f'<circle cx="{xs[0]}" cy="{ys[0]}" r="{_BODY}"><title>{escape(name)}</title>{"".join(moves)}')
        parts.append("</circle></g>")
    box = f"0 0 {x_max - x_min:.2f} {y_max - y_min:.2f}"
    return f'<svg viewBox="{box}" role="img" aria-label="where the players were">{"".join(parts)}</svg>'


def _filled(track: Sequence[Vector | None]) -> list[Vector]:
    """A track in which a player whose place is not known stays where it was; empty if no place is known."""
    known = next((place for place in track if place is not None), None)
    filled = []
    for place in track:
        known = place or known
        if known is not None:
            filled.append(known)
    return filled
