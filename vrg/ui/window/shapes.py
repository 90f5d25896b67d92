"""Draws smooth shapes that pygame.draw does not have. Points are pixels."""

import math
from collections.abc import Sequence

import pygame
from pygame import gfxdraw

from vrg.colours import Rgb
from vrg.ui.view import Pixel

FAR = 16000
"""gfxdraw keeps coordinates in 16 bits."""


def polygon(surface: pygame.Surface, points: Sequence[Pixel], colour: Rgb) -> None:
    """Fill a polygon with smooth edges."""
    if any(abs(x) > FAR or abs(y) > FAR for x, y in points):
        return
    gfxdraw.filled_polygon(surface, points, colour)
    gfxdraw.aapolygon(surface, points, colour)


def outline(surface: pygame.Surface, points: Sequence[Pixel], colour: Rgb, width: float = 1.0) -> None:
    """Draw a closed smooth line."""
    for start, end in zip(points, [*points[1:], points[0]], strict=True):
        stroke(surface, start, end, colour, width)


def line(surface: pygame.Surface, start: Pixel, end: Pixel, colour: Rgb, width: float = 1.0) -> None:
    """Draw a line of any width, its corners at whole pixels."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    if length < 0.1:
        return
    nx, ny = -dy / length * width / 2, dx / length * width / 2
    corners = [
        (start[0] + nx, start[1] + ny),
        (end[0] + nx, end[1] + ny),
        (end[0] - nx, end[1] - ny),
        (start[0] - nx, start[1] - ny),
    ]
    polygon(surface, corners, colour)


def stroke(surface: pygame.Surface, start: Pixel, end: Pixel, colour: Rgb, width: float) -> None:
    """Draw a smooth thin line between fractions of pixels: as many hair lines beside each other as it takes."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    if length < 0.1:
        return
    hairs = max(1, round(width))
    for hair in range(hairs):
        away = (hair - (hairs - 1) / 2) / length
        shift = (-dy * away, dx * away)
        pygame.draw.aaline(
            surface, colour, (start[0] + shift[0], start[1] + shift[1]), (end[0] + shift[0], end[1] + shift[1])
        )


def disc(surface: pygame.Surface, centre: Pixel, radius: float, colour: Rgb) -> None:
    """Fill a circle."""
    if max(abs(centre[0]), abs(centre[1]), radius) > FAR:
        return
    x, y, r = round(centre[0]), round(centre[1]), max(1, round(radius))
    gfxdraw.filled_circle(surface, x, y, r, colour)
    gfxdraw.aacircle(surface, x, y, r, colour)


def ring(surface: pygame.Surface, centre: Pixel, radius: float, colour: Rgb, width: float = 2.0) -> None:
    """Draw a smooth circle line."""
    steps = max(24, int(radius))
    points = [
        (
            centre[0] + radius * math.cos(2 * math.pi * i / steps),
            centre[1] + radius * math.sin(2 * math.pi * i / steps),
        )
        for i in range(steps)
    ]
    outline(surface, points, colour, width)


def oriented(centre: Pixel, angle: float, ahead: float, aside: float) -> Pixel:
    """The pixel `ahead` and `aside` (to the left) of the centre of something turned by `angle`, pi/2 is up."""
    c, s = math.cos(angle), math.sin(angle)
    return centre[0] + ahead * c - aside * s, centre[1] - ahead * s - aside * c


def pill(surface: pygame.Surface, area: pygame.Rect, colour: Rgb, alpha: int = 255, radius: int = 8) -> None:
    """Fill a rectangle with round corners; `alpha` 0 is transparent and 255 opaque."""
    if area.width <= 0 or area.height <= 0:
        return
    if alpha == 255:
        pygame.draw.rect(surface, colour, area, border_radius=radius)
        return
    layer = pygame.Surface(area.size, pygame.SRCALPHA)
    pygame.draw.rect(layer, (*colour, alpha), layer.get_rect(), border_radius=radius)
    surface.blit(layer, area)
