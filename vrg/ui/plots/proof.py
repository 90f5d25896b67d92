"""Draws why a call was made: the field around it, at that instant and before, with the numbers that decided it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import pygame
from pygame import Rect

from vrg.coordinator.proof import Measure
from vrg.figures import Figure, Label, Shape, line, pixels
from vrg.regions import Bounds
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.scene import Scene
from vrg.ui.window.field import FieldPainter
from vrg.ui.window.text import Fonts

SECONDS: Final = 3.0
"""The match time in s before a call that is shown."""
STRIP: Final = (3.0, 2.0, 1.0, 0.5)
"""The times of the small pictures before the call, s."""
MARGIN: Final = 1.5
"""The width of the ground shown around the players of the call, m."""
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
        measured = [figure for measure in proof.measures for figure in _measured(measure)]
        self._fields[0].draw(surface, large, proof.now, ui, None, above=measured, box=proof.box, turned=turned)
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


def _measured(measure: Measure) -> list[Figure]:
    """A measured way with its ends and its number; nothing where it is no way."""
    if measure.ends is None:
        return []
    (ax, ay), (bx, by) = measure.ends
    name, dot = f"measure {measure.short}", Shape(((0.0, 0.0),), palette.CAUTION, radius=4.0)
    label = Label(measure.short, palette.INK, plate=palette.CAUTION, size=15.0, reach=4.0)
    return [
        Figure(name, (line(*measure.ends, colour=palette.CAUTION, width=2.5),)),
        *(pixels(name, Pose(*end, 0.0), dot) for end in measure.ends),
        pixels(name, Pose((ax + bx) / 2, (ay + by) / 2, 0.0), label=label),
    ]
