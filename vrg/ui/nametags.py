"""Writes the names of the robots on the field, so that each is seen to belong to its own robot."""

import math
from collections.abc import Sequence
from typing import Final

import pygame

from vrg.colours import Rgb
from vrg.segments import nearest_on_segment
from vrg.ui import palette, shapes
from vrg.ui.text import Face, Fonts
from vrg.ui.view import Pixel

_SIDES: Final = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1))
"""The sides of a robot on which a name may stand, in the order of preference; y is down."""
_STEPS: Final = (0.0, 1.2, 2.4, 3.6)
"""The distances of a name from its robot, in heights of its plate. Far away a line leads to its robot."""
_CLEARLY: Final = 4.0
"""Pixels by which a name without a line must be nearer to its own robot than to any other."""
_COVERED: Final = 600.0
"""The cost of covering something, besides the pixels that are covered."""
_DOUBTFUL: Final = 400.0
"""The cost of being taken for another robot's name."""
_CROWD: Final = 8
"""From how many robots on their names may be shortened."""
_LONG: Final = 40.0
"""The cost of standing a step further away."""
_LOYAL: Final = 35.0
"""The worth of staying in the same place: less than a step, so that names come back to their robots."""
_PATIENT: Final = 390.0
"""By how much a place that is not good must be worse than another before it is left; less than what is doubtful."""

Circle = tuple[Pixel, float]
"""The centre and the radius of a robot in the window, pixels."""


class NamePainter:
    """Draws names. Each stays on its side as long as that place is free, so that names do not flicker."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._last: dict[str, int] = {}
        self._crowded = False

    def draw(
        self,
        surface: pygame.Surface,
        area: pygame.Rect,
        robots: Sequence[tuple[str, Rgb, Circle]],
        ui: float,
        covered: Sequence[pygame.Rect] = (),
        remarks: Sequence[str] = (),
    ) -> list[pygame.Rect]:
        """Draw the name of each robot, given by name, colour and circle, inside of `area` and not below `covered`.

        Args:
            remarks: what stands behind the name of each robot; none if it is empty.

        Returns:
            where the names are.
        """
        size = max(12, round(13 * ui))
        circles = [circle for _, _, circle in robots]
        words = self._words([name for name, _, _ in robots], circles, size)
        taken = [*(_square(circle) for circle in circles), *covered]
        placed: list[tuple[pygame.Surface, pygame.Rect]] = []
        for index, (name, colour, (centre, radius)) in enumerate(robots):
            if not area.inflate(40, 40).collidepoint(centre):
                continue
            remark = f" {remarks[index]}" if remarks and remarks[index] else ""
            text = self._fonts.render(words[index] + remark, size, colour, Face.BOLD)
            plate = self._place(name, text.get_rect().inflate(10, 2), index, circles, taken, area)
            taken.append(plate)
            placed.append((text, plate))
            if _gap(plate, centre) > radius + plate.height:
                end = _nearest(plate, centre)
                share = radius / math.dist(centre, end)
                edge = (centre[0] + (end[0] - centre[0]) * share, centre[1] + (end[1] - centre[1]) * share)
                shapes.stroke(surface, edge, end, palette.mix(palette.FIELD, colour, 0.8), 1.0)
        # Above all lines, so that none runs through a name.
        for text, plate in placed:
            shapes.pill(surface, plate, palette.BACKGROUND, 170, 6)
            surface.blit(text, text.get_rect(center=plate.center))
        return [plate for _, plate in placed]

    def _words(self, names: Sequence[str], circles: Sequence[Circle], size: int) -> Sequence[str]:
        """The names, or in a crowd what tells them apart: 7 and 12 for player7 and player12."""
        short = numbers(names)
        if short is None or len(names) < _CROWD:
            return names
        gaps = sorted(min(math.dist(a, b) for b, _ in circles if b is not a) for a, _ in circles)
        widest = max(self._fonts.width(name, size, Face.BOLD) for name in names)
        # It takes more room to go back to whole names, so that they do not flicker.
        self._crowded = gaps[len(gaps) // 2] < widest * (1.5 if self._crowded else 1.0)
        return short if self._crowded else names

    def _place(
        self,
        name: str,
        plate: pygame.Rect,
        own: int,
        circles: Sequence[Circle],
        taken: list[pygame.Rect],
        area: pygame.Rect,
    ) -> pygame.Rect:
        """The best place for a plate: over nothing else, not beside another robot, and as near its own as can be."""
        last = self._last.get(name)
        best, best_place, best_cost = plate, 0, math.inf
        # The last place is tried first: most often it is still free, and then nothing else has to be looked at.
        for index in sorted(range(len(_STEPS) * len(_SIDES)), key=lambda place: place != last):
            step, side = divmod(index, len(_SIDES))
            stays = index == last
            cost = _LONG * step - _LOYAL * stays
            if cost >= best_cost:
                continue
            tried = _beside(plate, circles[own], _SIDES[side], _STEPS[step] * plate.height).clamp(area)
            harm = sum(_COVERED + _overlap(tried, taken[i]) for i in tried.collidelistall(taken))
            if cost + harm - _PATIENT * stays < best_cost:
                harm += _DOUBTFUL * _doubts(tried, own, circles, led=step > 0)
            cost += max(0.0, harm - _PATIENT * stays)
            if cost < best_cost:
                best, best_place, best_cost = tried, index, cost
        self._last[name] = best_place
        return best


def numbers(names: Sequence[str]) -> list[str] | None:
    """The numbers at the ends of names that are otherwise the same, or None where they are not."""
    stems = {name.rstrip("0123456789") for name in names}
    [stem] = stems if len(stems) == 1 else [""]
    found = [name.removeprefix(stem) for name in names]
    return found if stem and all(found) else None


def _doubts(plate: pygame.Rect, own: int, circles: Sequence[Circle], *, led: bool) -> int:
    """The number of other robots that the plate may be taken for, or that its line crosses."""
    others = (circle for index, circle in enumerate(circles) if index != own)
    if not led:
        clear = _edge(plate, circles[own]) + _CLEARLY
        return sum(_edge(plate, other) < clear for other in others)
    start, end = circles[own][0], _nearest(plate, circles[own][0])
    return sum(math.dist(centre, nearest_on_segment(centre, start, end)) < radius for centre, radius in others)


def _beside(plate: pygame.Rect, of: Circle, side: tuple[int, int], away: float) -> pygame.Rect:
    (x, y), radius = of
    tried = plate.copy()
    tried.center = (
        round(x + side[0] * (radius + 4 + plate.width / 2 + away)),
        round(y + side[1] * (radius + 4 + plate.height / 2 + away)),
    )
    return tried


def _edge(plate: pygame.Rect, circle: Circle) -> float:
    """The distance from a plate to the edge of a circle, pixels; negative where they overlap."""
    return _gap(plate, circle[0]) - circle[1]


def _gap(plate: pygame.Rect, point: Pixel) -> float:
    return math.dist(_nearest(plate, point), point)


def _nearest(plate: pygame.Rect, point: Pixel) -> Pixel:
    """The point of a plate that is nearest to a point."""
    return min(max(point[0], plate.left), plate.right), min(max(point[1], plate.top), plate.bottom)


def _square(circle: Circle) -> pygame.Rect:
    (x, y), radius = circle
    reach = round(radius) + 2
    return pygame.Rect(round(x) - reach, round(y) - reach, 2 * reach, 2 * reach)


def _overlap(a: pygame.Rect, b: pygame.Rect) -> int:
    common = a.clip(b)
    return common.width * common.height
