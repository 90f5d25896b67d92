"""The parts that several windows are made of: plates with titles, buttons, fields to type into, and rows of places."""

import pygame
from pygame import Rect

from vrg.colours import Rgb
from vrg.ui import palette, shapes
from vrg.ui.palette import ink_on
from vrg.ui.text import Face, Fonts


def title_height(ui: float) -> int:
    """The height of the title of a plate, pixels."""
    return round(26 * ui)


def row(area: Rect, shares: tuple[float, ...], gap: int) -> list[Rect]:
    """Places beside each other with widths in these proportions."""
    room, left, found = area.width - gap * (len(shares) - 1), float(area.left), []
    for share in shares:
        width = room * share / sum(shares)
        found.append(Rect(round(left), area.top, max(1, round(width)), area.height))
        left += width + gap
    return found


def frame(surface: pygame.Surface, area: Rect, name: str, says: str, ui: float, fonts: Fonts) -> Rect:
    """Draw a plate with its name and what it says; return the area that is left."""
    shapes.pill(surface, area, palette.PANEL, radius=round(8 * ui))
    bar, pad, size = title_height(ui), round(10 * ui), max(12, round(14 * ui))
    label = fonts.render(name, size, palette.MUTED, Face.BOLD)
    surface.blit(label, label.get_rect(midleft=(area.left + pad, area.top + bar // 2)))
    room = area.width - label.get_width() - 3 * pad
    text = fonts.render(fonts.shorten(says, room, size), size, palette.TEXT)
    surface.blit(text, text.get_rect(midright=(area.right - pad, area.top + bar // 2)))
    return Rect(area.left, area.top + bar, area.width, max(1, area.height - bar))


def blank(surface: pygame.Surface, area: Rect, says: str, ui: float, fonts: Fonts) -> None:
    """Write in the middle of a plate why it shows nothing."""
    size = max(13, round(16 * ui))
    text = fonts.render(fonts.shorten(says, area.width - 20, size), size, palette.MUTED)
    surface.blit(text, text.get_rect(center=area.center))


def write(
    surface: pygame.Surface, text: str, place: Rect, size: int, colour: Rgb, fonts: Fonts, face: Face = Face.REGULAR
) -> None:
    """Write a line at the left of a place, in the middle of its height, as far as there is room."""
    shown = fonts.render(fonts.shorten(text, place.width, size, face), size, colour, face)
    surface.blit(shown, shown.get_rect(midleft=place.midleft))


def button(surface: pygame.Surface, place: Rect, name: str, key: str, colour: Rgb, ui: float, fonts: Fonts) -> None:
    """Draw a button with its name and its key."""
    shapes.pill(surface, place, colour, radius=round(7 * ui))
    ink, size, small = ink_on(colour), round(15 * ui), max(10, round(11 * ui))
    both = fonts.width(name, size, Face.BOLD) + fonts.width(key, small) + round(8 * ui)
    if not key or both > place.width - round(8 * ui):
        shown = fonts.shorten(name, place.width - round(6 * ui), size, Face.BOLD)
        text = fonts.render(shown, size, ink, Face.BOLD)
        surface.blit(text, text.get_rect(center=place.center))
        return
    text, sign = fonts.render(name, size, ink, Face.BOLD), fonts.render(key, small, ink)
    left = place.centerx - both // 2
    surface.blit(text, text.get_rect(midleft=(left, place.centery)))
    surface.blit(sign, sign.get_rect(midright=(left + both, place.centery)))


def field(
    surface: pygame.Surface,
    place: Rect,
    name: str,
    text: str,
    ui: float,
    fonts: Fonts,
    *,
    focused: bool,
    edge: Rgb = palette.LINE,
) -> None:
    """Draw a field with its name at the left and its text at the right.

    Args:
        edge: the colour of its edge while it is not focused.
    """
    round_by = round(5 * ui)
    shapes.pill(surface, place, palette.BACKGROUND, radius=round_by)
    colour = palette.CAUTION if focused else edge
    pygame.draw.rect(surface, colour, place, max(1, round(2 * ui)), border_radius=round_by)
    inside, size = place.inflate(round(-16 * ui), 0), round(15 * ui)
    write(surface, name, inside, round(13 * ui), palette.MUTED, fonts)
    shown = fonts.render(text, size, palette.TEXT, Face.MONO)
    surface.blit(shown, shown.get_rect(midright=inside.midright))
