"""The parts that windows are made of: plates with titles, buttons, chips, headings, fields, and the list of keys."""

from collections.abc import Sequence

import pygame
from pygame import Rect

from vrg.colours import Rgb
from vrg.ui import palette
from vrg.ui.palette import ink_on
from vrg.ui.window import shapes
from vrg.ui.window.text import Face, Fonts


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


def write(
    surface: pygame.Surface, text: str, place: Rect, size: int, colour: Rgb, fonts: Fonts, face: Face = Face.REGULAR
) -> None:
    """Write a line at the left of a place, in the middle of its height, as far as there is room."""
    shown = fonts.render(fonts.shorten(text, place.width, size, face), size, colour, face)
    surface.blit(shown, shown.get_rect(midleft=place.midleft))


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


def chip(surface: pygame.Surface, at: tuple[int, int], words: str, colour: Rgb, ui: float, fonts: Fonts) -> Rect:
    """Draw a word upon a round plate whose upper left corner is `at`; return where."""
    text = fonts.render(words, round(13 * ui), ink_on(colour), Face.BOLD)
    place = Rect(*at, text.get_width() + round(18 * ui), round(24 * ui))
    shapes.pill(surface, place, colour, radius=place.height // 2)
    surface.blit(text, text.get_rect(center=place.center))
    return place


def heading(surface: pygame.Surface, area: Rect, words: str, ui: float, fonts: Fonts) -> int:
    """Write a small heading at the top of an area, with a line to its right; return its height."""
    size = max(10, round(11 * ui))
    text = fonts.render(fonts.shorten(words, area.width, size, Face.BOLD), size, palette.MUTED, Face.BOLD)
    surface.blit(text, area.topleft)
    y, start = area.top + text.get_height() // 2, area.left + text.get_width() + round(8 * ui)
    pygame.draw.line(surface, palette.LINE, (start, y), (max(start, area.right), y))
    return round(19 * ui)


def plate(surface: pygame.Surface, area: Rect, ui: float) -> None:
    """Draw what stands above everything else, such as a card or the list of keys."""
    shapes.pill(surface, area, palette.PANEL, 255, round(10 * ui))
    pygame.draw.rect(surface, palette.LINE, area, 1, border_radius=round(10 * ui))


def keys(surface: pygame.Surface, area: Rect, listed: Sequence[tuple[str, str]], ui: float, fonts: Fonts) -> Rect:
    """List keys and what they do in the middle of an area; return where."""
    size, step, pad = max(12, round(14 * ui)), round(23 * ui), round(18 * ui)
    left = max(fonts.width(key, size, Face.BOLD) for key, _ in listed)
    width = left + max(fonts.width(meaning, size) for _, meaning in listed) + 3 * pad
    columns = 1 if step * len(listed) + 2 * pad <= area.height or 2 * width > area.width else 2
    rows = -(-len(listed) // columns)
    where = Rect(0, 0, width * columns, step * rows + 2 * pad)
    where.center = area.center
    plate(surface, where, ui)
    for index, (key, meaning) in enumerate(listed):
        column, line = divmod(index, rows)
        x, y = where.left + pad + column * width, where.top + pad + line * step + step // 2
        sign = fonts.render(key, size, palette.CAUTION, Face.BOLD)
        surface.blit(sign, sign.get_rect(midleft=(x, y)))
        text = fonts.render(meaning, size, palette.TEXT)
        surface.blit(text, text.get_rect(midleft=(x + left + pad, y)))
    return where


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
