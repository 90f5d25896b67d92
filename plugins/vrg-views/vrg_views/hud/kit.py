"""The parts that the display is made of: plates with titles, buttons and fields."""

import pygame
from pygame import Rect

from vrg.colours import Rgb
from vrg.ui import palette
from vrg.ui.palette import ink_on
from vrg.ui.window import shapes
from vrg.ui.window.kit import write
from vrg.ui.window.text import Face, Fonts


def title_height(ui: float) -> int:
    """The height of the title of a plate, pixels."""
    return round(26 * ui)


def titled_plate(surface: pygame.Surface, area: Rect, name: str, line: str, ui: float, fonts: Fonts) -> Rect:
    """Draw a plate with its name and its text; return the area that is left."""
    shapes.pill(surface, area, palette.PANEL, radius=round(8 * ui))
    bar, pad, size = title_height(ui), round(10 * ui), max(12, round(14 * ui))
    label = fonts.render(name, size, palette.MUTED, Face.BOLD)
    surface.blit(label, label.get_rect(midleft=(area.left + pad, area.top + bar // 2)))
    room = area.width - label.get_width() - 3 * pad
    text = fonts.render(fonts.shorten(line, room, size), size, palette.TEXT)
    surface.blit(text, text.get_rect(midright=(area.right - pad, area.top + bar // 2)))
    return Rect(area.left, area.top + bar, area.width, max(1, area.height - bar))


def blank(surface: pygame.Surface, area: Rect, line: str, ui: float, fonts: Fonts) -> None:
    """Write in the middle of a plate why it shows nothing."""
    size = max(13, round(16 * ui))
    text = fonts.render(fonts.shorten(line, area.width - 20, size), size, palette.MUTED)
    surface.blit(text, text.get_rect(center=area.center))


def button(surface: pygame.Surface, place: Rect, name: str, key: str, colour: Rgb, ui: float, fonts: Fonts) -> None:
    """Draw a button with its name and its key, if that has room."""
    shapes.pill(surface, place, colour, radius=round(7 * ui))
    ink = ink_on(colour)
    large, small, gap = max(10, round(15 * ui)), max(9, round(11.25 * ui)), round(7.5 * ui)
    both = fonts.width(name, large, Face.BOLD) + fonts.width(key, small) + gap
    if not key or both > place.width - gap:
        text = fonts.render(fonts.shorten(name, place.width - gap // 2, large, Face.BOLD), large, ink, Face.BOLD)
        surface.blit(text, text.get_rect(center=place.center))
        return
    text, sign = fonts.render(name, large, ink, Face.BOLD), fonts.render(key, small, ink)
    left = place.centerx - both // 2
    surface.blit(text, text.get_rect(midleft=(left, place.centery)))
    surface.blit(sign, sign.get_rect(midright=(left + both, place.centery)))


def field(
    surface: pygame.Surface, place: Rect, name: str, text: str, ui: float, fonts: Fonts, *, focused: bool
) -> None:
    """Draw a field with its name at the left and its text at the right."""
    round_by = round(5 * ui)
    shapes.pill(surface, place, palette.BACKGROUND, radius=round_by)
    colour = palette.CAUTION if focused else palette.LINE
    pygame.draw.rect(surface, colour, place, max(1, round(2 * ui)), border_radius=round_by)
    inside, size = place.inflate(round(-16 * ui), 0), round(15 * ui)
    write(surface, name, inside, round(13 * ui), palette.MUTED, fonts)
    shown = fonts.render(text, size, palette.TEXT, Face.MONO)
    surface.blit(shown, shown.get_rect(midright=inside.midright))
