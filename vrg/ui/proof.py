"""Draws why a call was made: the field around it, at that instant and before, with the numbers that decided it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import pygame
from pygame import Rect

from vrg.coordinator.proof import Measure
from vrg.regions import Bounds
from vrg.ui import palette, shapes
from vrg.ui.field import FieldPainter
from vrg.ui.scene import Scene, SceneBody
from vrg.ui.text import Face, Fonts
from vrg.ui.view import Pixel, Projection

SECONDS: Final = 3.0
"""The match time in s before a call that is shown."""
STRIP: Final = (3.0, 2.0, 1.0, 0.5)
"""The times of the small pictures before the call, s."""
MARGIN: Final = 1.5
"""The width of the ground shown around the players of the call, m."""
_SIDES: Final = ((0, -1), (0, 1), (1, 0), (-1, 0), (1, -1), (-1, -1), (1, 1), (-1, 1))
"""The sides of a measured way on which its number may stand, in the order of preference; y is down."""
SIZE: Final = (1200, 900)
"""The size of a picture in a file, pixels."""


@dataclass(frozen=True)
class Proof:
    """Why a call was made.

    Args:
        heading: the call. lines: what is known of it, in sentences.
        now: the field at the call, with trails of the seconds before; None if it is not known.
        box: the part of it that is shown, m. measures: the numbers that decided it.
        earlier: how long before, s, and the field then; None where it is not known.
    """

    heading: str
    lines: tuple[str, ...]
    now: Scene | None = None
    box: Bounds = (0.0, 0.0, 1.0, 1.0)
    measures: tuple[Measure, ...] = ()
    earlier: tuple[tuple[float, Scene | None], ...] = ()


def box_around(points: Sequence[tuple[float, float]], measures: Sequence[Measure]) -> Bounds:
    """The bounds of what is shown of a call, m: the places of its players, and what was measured near the first."""
    x, y = points[0]
    ends = [end for measure in measures for end in measure.ends or ()]
    near = [end for end in ends if abs(end[0] - x) + abs(end[1] - y) < 4 * MARGIN]
    xs, ys = zip(*points, *near, strict=True)
    return min(xs) - MARGIN, min(ys) - MARGIN, max(xs) + MARGIN, max(ys) + MARGIN


class ProofPainter:
    """Draws proofs, and keeps the picture of the last one.

    Args:
        fonts: to write with.
    """

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._fields = [FieldPainter(fonts) for _ in (*STRIP, 0.0)]
        self._kept: tuple[object, pygame.Surface] | None = None

    def picture(self, proof: Proof, size: tuple[int, int], ui: float, *, turned: bool | None = None) -> pygame.Surface:
        """The picture of a proof whose field is known, in this size.

        Args:
            ui: scales letters. turned: shown as in a window that shows the field so; None chooses by the size.
        """
        key = (proof, size, turned)
        if self._kept is None or self._kept[0] != key:
            surface = pygame.Surface(size)
            surface.fill(palette.BACKGROUND)
            self._draw(surface, proof, ui, turned)
            self._kept = key, surface
        return self._kept[1]

    def _draw(self, surface: pygame.Surface, proof: Proof, ui: float, turned: bool | None) -> None:
        assert proof.now is not None
        width, height = surface.get_size()
        gap, title = round(6 * ui), round(20 * ui)
        low = round(0.26 * height)
        large = Rect(0, 0, width, height - low - gap)
        view = self._fields[0].draw(surface, large, proof.now, ui, None, box=proof.box, turned=turned)
        before = surface.get_clip()
        surface.set_clip(large)
        taken = [_square(body, view) for body in proof.now.bodies]
        for measure in proof.measures:
            if measure.ends is not None:
                start, end = (view.point(*point) for point in measure.ends)
                shapes.line(surface, start, end, palette.CAUTION, 2.5 * ui)
                for point in (start, end):
                    shapes.disc(surface, point, 4 * ui, palette.CAUTION)
                text = self._fonts.render(measure.short, round(15 * ui), palette.INK, Face.BOLD)
                middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
                plate = place_beside(text.get_rect().inflate(10, 4), middle, taken, large, round(8 * ui))
                taken.append(plate)
                shapes.pill(surface, plate, palette.CAUTION, radius=5)
                surface.blit(text, text.get_rect(center=plate.center))
        surface.set_clip(before)
        each = (width - gap * (len(STRIP) - 1)) // len(STRIP)
        for index, (seconds, scene) in enumerate(proof.earlier):
            place = Rect(index * (each + gap), height - low + title, each, low - title)
            words = f"{seconds:g} s before" + ("" if scene is not None else ": not seen")
            text = self._fonts.render(words, round(12 * ui), palette.MUTED)
            surface.blit(text, (place.left, place.top - title + round(2 * ui)))
            if scene is not None:
                self._fields[1 + index].draw(
                    surface, place, replace(scene, calls=()), ui, None, box=proof.box, turned=turned, strip=False,
                    names=False,
                )  # fmt: skip


def _square(body: SceneBody, view: Projection) -> Rect:
    """The pixels within which a robot is, however it is turned."""
    x, y = view.point(body.pose.x, body.pose.y)
    reach = math.hypot(body.length, body.width) / 2 * view.scale
    return Rect(round(x - reach), round(y - reach), round(2 * reach), round(2 * reach))


def place_beside(plate: Rect, middle: Pixel, taken: Sequence[Rect], inside: Rect, step: int) -> Rect:
    """The place of a plate that is as near to a point as can be without hiding what is taken, or hides least of it."""
    tried = []
    for away in range(1, 24):
        for right, down in _SIDES:
            place = plate.copy()
            place.center = (
                round(middle[0] + right * (plate.width / 2 + away * step)),
                round(middle[1] + down * (plate.height / 2 + away * step)),
            )
            place.clamp_ip(inside)
            hidden = sum(common.width * common.height for common in (place.clip(other) for other in taken))
            if not hidden:
                return place
            tried.append((hidden, place))
    return min(tried, key=lambda found: found[0])[1]
