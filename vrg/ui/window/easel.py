"""Draws figures with pygame."""

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Final

import pygame

from vrg.colours import mix
from vrg.figures import ORIGIN, Figure, Label, Shape, Writing
from vrg.regions import Bounds
from vrg.ui import labels, palette
from vrg.ui.labels import Placer, Wanted
from vrg.ui.view import Pixel, Projection
from vrg.ui.window import shapes
from vrg.ui.window.text import Face, Fonts

LEGIBLE: Final = 9
"""Pixels; words with smaller letters are left out."""
_FINENESS: Final = 2
"""The factor by which what turns is drawn larger than it is shown, so that it can be turned smoothly."""
_WIDE: Final = 2.0
"""Pixels; lines of this width are filled, thinner ones are smooth."""
_PLATE: Final = 215
"""The opacity of the plates behind words, 0 to 255."""


class FigurePainter:
    """Draws figures upon surfaces.

    Args:
        fonts: to write with.
    """

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._placer = Placer()

    def draw(
        self, surface: pygame.Surface, figures: Sequence[Figure], view: Projection, ui: float
    ) -> list[pygame.Rect]:
        """Draw figures, the first one lowest, and return where words are painted; `ui` scales letters and lines."""
        painted = []
        for figure in figures:
            frame = view_of(figure, view, ui)
            turns = tuple(shape for shape in figure.shapes if not shape.still) if figure.at.theta else ()
            if turns:
                self._turned(surface, turns, figure.at.theta, frame, ui)
            for shape in (shape for shape in figure.shapes if shape.still or not turns):
                draw_shape(surface, shape, frame, ui)
            if figure.writing is not None:
                painted.append(self._write(surface, figure.writing, view, ui))
        return painted

    def _turned(
        self, surface: pygame.Surface, shapes: tuple[Shape, ...], theta: float, frame: Projection, ui: float
    ) -> None:
        """Draw what turns with a figure, by a picture of it that faces right."""
        sprite = _drawn(shapes, round(_FINENESS * frame.scale, 1), _FINENESS * ui)
        turned = pygame.transform.rotozoom(sprite, math.degrees(frame.angle(theta)), 1 / _FINENESS)
        surface.blit(turned, turned.get_rect(center=(round(frame.left), round(frame.top))))

    def _write(self, surface: pygame.Surface, writing: Writing, view: Projection, ui: float) -> pygame.Rect:
        """Paint words upon the ground, upright where that has more room, or not at all where there is none."""
        across, down = (length * view.scale for length in (writing.along[::-1] if view.turned else writing.along))
        wanted = writing.size * ui
        upright = min(down, wanted) > min(across, wanted)
        size = round(min(wanted, max(across, down)))
        if size < LEGIBLE:
            return pygame.Rect(0, 0, 0, 0)
        lines = [self._fonts.render(text, size, writing.ink, Face.BOLD) for text in writing.lines]
        step = 1.25 * size
        block = pygame.Surface((max(text.get_width() for text in lines), round(step * len(lines))), pygame.SRCALPHA)
        for index, text in enumerate(lines):
            block.blit(text, text.get_rect(center=(block.get_width() / 2, (index + 0.5) * step)))
        block.set_alpha(190)
        if upright:
            block = pygame.transform.rotate(block, 90)
        x, y = view.point(*writing.middle)
        return surface.blit(block, block.get_rect(center=(round(x), round(y + writing.drop * view.scale))))

    def label(
        self,
        surface: pygame.Surface,
        area: pygame.Rect,
        figures: Sequence[Figure],
        view: Projection,
        ui: float,
        painted: Sequence[pygame.Rect] = (),
    ) -> list[pygame.Rect]:
        """Write the words beside figures inside of an area, not upon those that are painted; return where they are."""
        shown: list[tuple[str, Label, labels.Circle]] = []
        taken: list[Bounds] = [(words.left, words.top, words.right, words.bottom) for words in painted]
        for figure in figures:
            frame = view_of(figure, view, ui)
            if figure.clear:
                side = figure.clear * frame.scale
                taken.append((frame.left - 2, frame.top - side, frame.left + side, frame.top + 2))
            if figure.label is not None and area.inflate(40, 40).collidepoint(frame.left, frame.top):
                circle = (frame.left, frame.top), figure.label.reach * frame.scale
                shown.append((figure.name, figure.label, circle))
        crowded = self._crowded(shown, ui)
        texts = [self._text(label, crowded, ui) for _, label, _ in shown]
        wanted = [
            Wanted(name, (text.get_width() + 10.0, text.get_height() + 2.0), circle)
            for (name, _, circle), text in zip(shown, texts, strict=True)
        ]
        inside = (area.left, area.top, area.right, area.bottom)
        boxes = self._placer.place(wanted, inside, taken)
        for (_, label, circle), box in zip(shown, boxes, strict=True):
            led = labels.line_to(box, circle)
            if led is not None:
                shapes.stroke(surface, *led, mix(palette.FIELD, label.ink, 0.8), 1.0)
        # Above all lines, so that none runs through words.
        plates = [pygame.Rect(round(b[0]), round(b[1]), round(b[2] - b[0]), round(b[3] - b[1])) for b in boxes]
        for (_, label, _), text, plate in zip(shown, texts, plates, strict=True):
            if label.plate is not None:
                shapes.pill(surface, plate, label.plate, _PLATE, 6)
            surface.blit(text, text.get_rect(center=plate.center))
        return plates

    def _crowded(self, shown: Sequence[tuple[str, Label, labels.Circle]], ui: float) -> bool:
        """True if robots lie so close that what is short stands for their names."""
        named = [(label, circle) for _, label, circle in shown if label.short]
        widest = max((self._fonts.width(label.words, _size(label, ui), Face.BOLD) for label, _ in named), default=0)
        return self._placer.crowded([circle for _, circle in named], widest)

    def _text(self, label: Label, crowded: bool, ui: float) -> pygame.Surface:
        words = label.short if crowded and label.short else label.words
        words = f"{words} {label.remark}" if label.remark else words
        return self._fonts.render(words, _size(label, ui), label.ink, Face.BOLD if label.bold else Face.REGULAR)


def view_of(figure: Figure, view: Projection, ui: float) -> Projection:
    """Where the points of a figure's frame are, without its turn: the pixel of its place, and its scale."""
    if figure.at == ORIGIN and not figure.least:
        return view
    scale = min(max(view.scale, figure.least), figure.most * ui)
    left, top = view.point(figure.at.x, figure.at.y)
    return Projection(0.0, 0.0, left, top, scale, view.turned)


def draw_shape(surface: pygame.Surface, shape: Shape, frame: Projection, ui: float) -> None:
    """Draw one shape in a frame that is not turned."""
    points = _placed(shape, frame)
    width = max(1.0, shape.width * ui)
    if shape.radius:
        radius = shape.radius * frame.scale
        for point in points:
            if shape.fill is not None:
                shapes.disc(surface, point, radius, shape.fill)
            if shape.line is not None:
                shapes.ring(surface, point, radius, shape.line, width)
        return
    if shape.fill is not None:
        shapes.polygon(surface, points, shape.fill)
    if shape.line is None:
        return
    ends = [*points, points[0]] if shape.closed else points
    last = len(ends) - 1
    if shape.faded is not None:
        for index, (start, end) in enumerate(pairwise(ends), 1):
            share = index / last
            shapes.stroke(surface, start, end, mix(shape.faded, shape.line, share), (0.3 + 0.7 * share) * shape.width)
        return
    draw = shapes.line if shape.width >= _WIDE and not shape.closed else shapes.stroke
    for start, end in pairwise(ends):
        draw(surface, start, end, shape.line, width)


def draw_sign(surface: pygame.Surface, sign: tuple[Shape, ...], middle: Pixel, side: float, ui: float) -> None:
    """Draw shapes of about a square of side 1 about the origin upon a surface, `side` pixels large."""
    drawn = _drawn(sign, side, ui)
    surface.blit(drawn, drawn.get_rect(center=(round(middle[0]), round(middle[1]))))


@lru_cache(500)
def _drawn(shapes: tuple[Shape, ...], scale: float, ui: float) -> pygame.Surface:
    """Shapes upon a transparent surface whose middle is their origin."""
    reach = max(math.hypot(*point) + shape.radius for shape in shapes for point in shape.points)
    half = math.ceil(reach * scale + 4 * ui)
    surface = pygame.Surface((2 * half, 2 * half), pygame.SRCALPHA)
    # Without the colour of the edge around it, the smoothed edge would be mixed with black.
    edge = next((colour for shape in shapes for colour in (shape.line, shape.fill) if colour is not None), (0, 0, 0))
    surface.fill((*edge, 0))
    for shape in shapes:
        draw_shape(surface, shape, Projection(0.0, 0.0, half, half, scale, turned=False), ui)
    return surface


def _placed(shape: Shape, frame: Projection) -> list[Pixel]:
    left, top, scale = frame.left, frame.top, frame.scale
    if shape.still:
        return [(left + x * scale, top - y * scale) for x, y in shape.points]
    return [frame.point(x, y) for x, y in shape.points]


def _size(label: Label, ui: float) -> int:
    return max(11, round(label.size * ui))
