"""Writes the names of the robots on the field, so that each is seen to belong to its own robot."""

import math
from collections.abc import Sequence
from typing import Final

import pygame

from vrg.colours import Rgb
from vrg.ui import palette, shapes
from vrg.ui.text import Face, Fonts
from vrg.ui.view import Pixel

_SIDES: Final = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1))
"""Where a name may stand beside its robot, in the order of preference; y is down."""
_STEPS: Final = (0.0, 1.2, 2.4)
"""How far away from its robot a name may stand, in heights of its plate. Far away a line leads to its robot."""
_CLEARLY: Final = 4.0
"""Pixels by which a name without a line must be nearer to its own robot than to any other."""
_DOUBTFUL: Final = 400.0
"""What it costs to stand beside another robot, in pixels of something covered."""

Circle = tuple[Pixel, float]
"""The centre and the radius of a robot in the window, pixels."""


class NamePainter:
    """Draws names. Each stays where it was as long as that place is free, so that names do not flicker."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._last: dict[str, int] = {}

    def draw(
        self, surface: pygame.Surface, area: pygame.Rect, robots: Sequence[tuple[str, Rgb, Circle]], ui: float
    ) -> list[pygame.Rect]:
        """Draw the name of each robot, given by name, colour and circle, inside of `area`.

        Returns:
            where the names are.
        """
        size = max(12, round(13 * ui))
        circles = [circle for _, _, circle in robots]
        bodies = [_square(circle) for circle in circles]
        plates: list[pygame.Rect] = []
        for index, (name, colour, (centre, radius)) in enumerate(robots):
            if not area.inflate(40, 40).collidepoint(centre):
                continue
            text = self._fonts.render(name, size, colour, Face.BOLD)
            plate = self._place(name, text.get_rect().inflate(10, 2), index, circles, [*bodies, *plates], area)
            plates.append(plate)
            if _gap(plate, centre) > radius + plate.height:
                end = (_clamped(centre[0], plate.left, plate.right), _clamped(centre[1], plate.top, plate.bottom))
                shapes.stroke(surface, centre, end, palette.mix(palette.FIELD, colour, 0.6), 1.0)
            shapes.pill(surface, plate, palette.BACKGROUND, 170, 6)
            surface.blit(text, text.get_rect(center=plate.center))
        return plates

    def _place(
        self,
        name: str,
        plate: pygame.Rect,
        own: int,
        circles: Sequence[Circle],
        taken: Sequence[pygame.Rect],
        area: pygame.Rect,
    ) -> pygame.Rect:
        """The best place for a plate: over nothing else, not beside another robot, near its own."""
        last = self._last.get(name, 0)
        best, best_cost = plate, math.inf
        count = len(_SIDES) * len(_STEPS)
        for index in (last, *(i for i in range(count) if i != last)):
            step, side = divmod(index, len(_SIDES))
            tried = _beside(plate, circles[own], _SIDES[side], _STEPS[step] * plate.height).clamp(area)
            cost = float(sum(_overlap(tried, taken[i]) for i in tried.collidelistall(list(taken))))
            if step == 0 and _nearest_other(tried, own, circles) < _edge(tried, circles[own]) + _CLEARLY:
                cost += _DOUBTFUL
            if cost < best_cost:
                best, best_cost = tried, cost
                self._last[name] = index
            if cost == 0:
                break
        return best


def _beside(plate: pygame.Rect, of: Circle, side: tuple[int, int], away: float) -> pygame.Rect:
    (x, y), radius = of
    tried = plate.copy()
    tried.center = (
        round(x + side[0] * (radius + 4 + plate.width / 2 + away)),
        round(y + side[1] * (radius + 4 + plate.height / 2 + away)),
    )
    return tried


def _nearest_other(plate: pygame.Rect, own: int, circles: Sequence[Circle]) -> float:
    return min((_edge(plate, circle) for i, circle in enumerate(circles) if i != own), default=math.inf)


def _edge(plate: pygame.Rect, circle: Circle) -> float:
    """The distance from a plate to the edge of a circle, pixels; negative where they overlap."""
    return _gap(plate, circle[0]) - circle[1]


def _gap(plate: pygame.Rect, point: Pixel) -> float:
    x, y = point
    return math.hypot(_clamped(x, plate.left, plate.right) - x, _clamped(y, plate.top, plate.bottom) - y)


def _clamped(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def _square(circle: Circle) -> pygame.Rect:
    (x, y), radius = circle
    reach = round(radius) + 2
    return pygame.Rect(round(x) - reach, round(y) - reach, 2 * reach, 2 * reach)


def _overlap(a: pygame.Rect, b: pygame.Rect) -> int:
    common = a.clip(b)
    return common.width * common.height
