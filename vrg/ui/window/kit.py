"""The parts that windows are made of: plates, chips, headings, lines, and the list of keys."""

from collections.abc import Sequence

import pygame
from pygame import Rect

from vrg.colours import Rgb
from vrg.ui import palette
from vrg.ui.palette import ink_on
from vrg.ui.window import shapes
from vrg.ui.window.text import Face, Fonts


def row(area: Rect, shares: tuple[float, ...], gap: int) -> list[Rect]:
    """Places beside each other with widths in these proportions."""
    room, left, found = area.width - gap * (len(shares) - 1), float(area.left), []
    for share in shares:
        width = room * share / sum(shares)
        found.append(Rect(round(left), area.top, max(1, round(width)), area.height))
        left += width + gap
    return found


def write(
    surface: pygame.Surface, text: str, place: Rect, size: int, colour: Rgb, fonts: Fonts, face: Face = Face.REGULAR
) -> None:
    """Write a line at the left of a place, in the middle of its height, as far as there is room."""
    shown = fonts.render(fonts.shorten(text, place.width, size, face), size, colour, face)
    surface.blit(shown, shown.get_rect(midleft=place.midleft))


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
