"""Draws what stands still on the field: zones, grid, walls, a scale and a legend. It is drawn once and kept."""

import math

import pygame

from vrg.bus.messages import Zone
from vrg.colours import Rgb
from vrg.games import game_of
from vrg.games.game import Style
from vrg.regions import Region
from vrg.types import Vector
from vrg.ui import palette, shapes
from vrg.ui.headline import WALL, legend
from vrg.ui.scene import Scene
from vrg.ui.text import Face, Fonts
from vrg.ui.view import Pixel, Projection
from vrg.ui.zones import ZoneLook, room, zone_look


def draw_ground(
    surface: pygame.Surface, scene: Scene, view: Projection, ui: float, fonts: Fonts, *, strip: bool = True
) -> None:
    """Draw field, zones, walls, scale and legend over the whole surface; `ui` scales letters.

    Args:
        strip: False leaves scale and legend out.
    """
    surface.fill(palette.APRON)
    fields = [zone.region for zone in scene.zones if zone.kind == "field"]
    for region in fields:
        shapes.polygon(surface, _outline(region, view), palette.FIELD)
        _grid(surface, region, view)
    game = game_of(scene.game)
    for zone in scene.zones:
        if zone.kind != "field":
            _zone(surface, zone, zone_look(zone, game), view, ui, fonts)
    for region in fields:
        shapes.outline(surface, _outline(region, view), palette.BORDER, 2.5 * ui)
    for obstacle in scene.obstacles:
        corners = _outline(obstacle, view)
        shapes.polygon(surface, corners, palette.WALL)
        # A thin wall may be less than a pixel wide.
        shapes.outline(surface, corners, palette.WALL_EDGE, max(1.0, 1.5 * ui))
    if not strip:
        return
    below = pygame.Rect(0, surface.get_height() - strip_height(ui), surface.get_width(), strip_height(ui))
    surface.fill(palette.BACKGROUND, below)
    _scale(surface, view, ui, fonts)
    _signs(surface, scene, ui, fonts)


def strip_height(ui: float) -> int:
    """The height in pixels of the strip below the field, in which the scale is."""
    return round(42 * ui)


def legend_left(scene: Scene, width: int, ui: float, fonts: Fonts) -> int:
    """The pixel at which the legend begins in a strip of so many pixels."""
    return _legend(scene, width, ui, fonts)[0]


def _legend(scene: Scene, width: int, ui: float, fonts: Fonts) -> tuple[int, list[tuple[str, Style | None, int]]]:
    """The left end of the legend, and its signs, as many as there is room for, with their words and widths."""
    size, side, gap = max(11, round(13 * ui)), round(16 * ui), round(18 * ui)
    right = width - round(14 * ui)
    signs = [(words, style, fonts.width(words, size) + side + round(6 * ui)) for words, style in legend(scene)]
    while signs and sum(each for *_, each in signs) + gap * (len(signs) - 1) > right - 230 * ui:
        signs.pop()
    return right - sum(each for *_, each in signs) - gap * max(0, len(signs) - 1), signs


def _outline(region: Region, view: Projection) -> list[Pixel]:
    return [view.point(x, y) for x, y in region.outline()]


def _grid(surface: pygame.Surface, region: Region, view: Projection) -> None:
    """Draw a line at each whole metre, as far as it is inside the region."""
    x_min, y_min, x_max, y_max = region.bounds
    ways: list[tuple[Vector, Vector]] = [
        ((x, y_min), (x, y_max)) for x in range(math.ceil(x_min), math.floor(x_max) + 1)
    ]
    ways += [((x_min, y), (x_max, y)) for y in range(math.ceil(y_min), math.floor(y_max) + 1)]
    for start, end in ways:
        stretch = region.inside(start, end)
        if stretch is not None:
            a, b = (view.point(*_between(start, end, share)) for share in stretch)
            pygame.draw.line(surface, palette.GRID, a, b)


def _zone(surface: pygame.Surface, zone: Zone, look: ZoneLook, view: Projection, ui: float, fonts: Fonts) -> None:
    _, _, width, height = view.box(zone.region.bounds)
    if width < 2 or height < 2:
        return
    outline = _outline(zone.region, view)
    shapes.polygon(surface, outline, look.tint)
    if look.safe:
        _stripes(surface, zone.region, view, look.stripe, max(14, round(18 * ui)))
    shapes.outline(surface, outline, look.edge, 2 if look.safe else 1)
    if look.words:
        _name(surface, zone.region, look, view, ui, fonts)


def _stripes(surface: pygame.Surface, region: Region, view: Projection, colour: Rgb, step: int) -> None:
    """Draw lines that rise to the right in the window, `step` pixels apart, as far as they are inside the region."""
    left, top, width, height = view.box(region.bounds)
    for offset in range(-math.ceil(height), math.ceil(width), step):
        start, end = (left + offset, top + height), (left + offset + height, top)
        stretch = region.inside(view.place(*start), view.place(*end))
        if stretch is not None:
            a, b = (_between(start, end, share) for share in stretch)
            pygame.draw.aaline(surface, colour, a, b)
            pygame.draw.aaline(surface, colour, (a[0] + 1, a[1]), (b[0] + 1, b[1]))


def _name(surface: pygame.Surface, region: Region, look: ZoneLook, view: Projection, ui: float, fonts: Fonts) -> None:
    """Write the name of a zone about its middle, upright where that has more room, or not at all where it has none."""
    along_x, along_y = (length * view.scale for length in room(region))
    width, height = (along_y, along_x) if view.turned else (along_x, along_y)
    size = round((20 if look.safe else 15) * ui)
    smallest = max(10, round(12 * ui))
    while size > smallest and fonts.width(look.words, size, Face.BOLD) > 0.85 * width:
        size -= 1
    text = fonts.render(look.words, max(size, smallest), look.ink, Face.BOLD)
    x, y = view.point(*region.middle)
    if look.below:
        _, _, _, diameter = view.box(region.bounds)
        text = fonts.render(look.words, smallest, look.ink, Face.BOLD)
        surface.blit(text, text.get_rect(midtop=(round(x), round(y + diameter / 2 + 4 * ui))))
        return
    if text.get_width() > 0.85 * width and height > width:
        text = pygame.transform.rotate(text, 90)
    elif text.get_width() > width - 4 and look.team:
        # A corner has more room along its border than about its middle.
        lines = [fonts.render(word, smallest, look.ink, Face.BOLD) for word in look.words.split()]
        top = y - sum(line.get_height() for line in lines) / 2
        for line in lines:
            surface.blit(line, line.get_rect(midtop=(round(x), round(top))))
            top += line.get_height()
        return
    if text.get_width() <= width - 4 and text.get_height() <= height - 4:
        text = text.copy()
        text.set_alpha(210 if look.safe else 150)
        surface.blit(text, text.get_rect(center=(round(x), round(y))))


def _between(start: Pixel, end: Pixel, share: float) -> Pixel:
    return start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share


def _scale(surface: pygame.Surface, view: Projection, ui: float, fonts: Fonts) -> None:
    """Draw a scale in metres and where x and y point."""
    metres = next((m for m in (1, 2, 5, 10, 20, 50, 100) if m * view.scale >= 60 * ui), 100)
    length = metres * view.scale
    left, bottom = 18 * ui, surface.get_height() - 13 * ui
    if surface.get_width() < length + 140 * ui or surface.get_height() < 160 * ui:
        return
    size = max(10, round(12 * ui))
    for start, end in (
        ((left, bottom), (left + length, bottom)),
        ((left, bottom - 4 * ui), (left, bottom + 4 * ui)),
        ((left + length, bottom - 4 * ui), (left + length, bottom + 4 * ui)),
    ):
        shapes.line(surface, start, end, palette.MUTED, 1.5 * ui)
    text = fonts.render(f"{metres} m", size, palette.MUTED)
    surface.blit(text, text.get_rect(midbottom=(left + length / 2, bottom - 3 * ui)))
    origin = (left + length + 40 * ui, bottom - (26 if view.turned else 0) * ui)
    for theta, name in ((0.0, "x"), (math.pi / 2, "y")):
        angle = view.angle(theta)
        tip = shapes.oriented(origin, angle, 15 * ui, 0.0)
        shapes.line(surface, origin, tip, palette.MUTED, 1.5 * ui)
        head = [shapes.oriented(tip, angle, a * ui, b * ui) for a, b in ((5, 0), (-3, 3.5), (-3, -3.5))]
        shapes.polygon(surface, head, palette.MUTED)
        letter = fonts.render(name, size, palette.MUTED)
        surface.blit(letter, letter.get_rect(center=shapes.oriented(origin, angle, 26 * ui, 0.0)))


def _signs(surface: pygame.Surface, scene: Scene, ui: float, fonts: Fonts) -> None:
    """Draw a legend at the right of the strip: the signs of the roles, and what is grey, as far as there is room."""
    size, side, gap = max(11, round(13 * ui)), round(16 * ui), round(18 * ui)
    y = surface.get_height() - strip_height(ui) // 2
    left, signs = _legend(scene, surface.get_width(), ui, fonts)
    for words, style, width in signs:
        text = fonts.render(words, size, palette.TEXT)
        surface.blit(text, text.get_rect(midleft=(left + side + round(6 * ui), y)))
        sign = pygame.Rect(0, 0, side, side)
        sign.midleft = (left, y)
        if style is not None:
            shapes.pill(surface, sign, style.colour, radius=4)
            shapes.marker(surface, sign.center, math.pi / 2, side * 0.32, palette.INK, style.marker)
        elif words == WALL:
            shapes.pill(surface, sign, palette.WALL, radius=2)
            pygame.draw.rect(surface, palette.WALL_EDGE, sign, 1, border_radius=2)
        else:
            pygame.draw.rect(surface, palette.TEXT, sign, 2, border_radius=4)
        left += width + gap
