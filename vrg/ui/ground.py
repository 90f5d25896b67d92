"""What stands still on the field: zones, grid, walls, a scale. Drawn once and kept."""

import math

import pygame

from vrg.bus.messages import Zone
from vrg.ui import palette, shapes
from vrg.ui.scene import Scene
from vrg.ui.text import Face, Fonts
from vrg.ui.view import View


def draw_ground(surface: pygame.Surface, scene: Scene, view: View, ui: float, fonts: Fonts) -> None:
    """Draw field, zones, walls and legend over the whole surface; `ui` scales letters."""
    surface.fill(palette.BACKGROUND)
    fields = [zone for zone in scene.zones if zone.kind == "field"]
    for zone in fields:
        left, top, width, height = view.box((zone.x_min, zone.y_min, zone.x_max, zone.y_max))
        pygame.draw.rect(surface, palette.FIELD, (round(left), round(top), round(width), round(height)))
        _grid(surface, zone, view)
    for zone in scene.zones:
        if zone.kind != "field":
            _zone(surface, zone, view, ui, fonts)
    for zone in fields:
        corners = [
            view.point(x, y)
            for x, y in (
                (zone.x_min, zone.y_min),
                (zone.x_max, zone.y_min),
                (zone.x_max, zone.y_max),
                (zone.x_min, zone.y_max),
            )
        ]
        shapes.outline(surface, corners, palette.BORDER, 2.5 * ui)
    for x1, y1, x2, y2 in scene.segments:
        shapes.line(surface, view.point(x1, y1), view.point(x2, y2), palette.WALL, max(3.0, 0.1 * view.scale))
    for x, y, radius in scene.circles:
        shapes.disc(surface, view.point(x, y), radius * view.scale, palette.WALL)
    _legend(surface, view, ui, fonts)
    if {body.physical for body in scene.bodies} == {True, False}:
        _explain_rim(surface, ui, fonts)


def _grid(surface: pygame.Surface, zone: Zone, view: View) -> None:
    for x in range(math.ceil(zone.x_min), math.floor(zone.x_max) + 1):
        pygame.draw.line(surface, palette.GRID, view.point(x, zone.y_min), view.point(x, zone.y_max))
    for y in range(math.ceil(zone.y_min), math.floor(zone.y_max) + 1):
        pygame.draw.line(surface, palette.GRID, view.point(zone.x_min, y), view.point(zone.x_max, y))


def _zone(surface: pygame.Surface, zone: Zone, view: View, ui: float, fonts: Fonts) -> None:
    left, top, width, height = (round(v) for v in view.box((zone.x_min, zone.y_min, zone.x_max, zone.y_max)))
    if width < 2 or height < 2:
        return
    safe = zone.kind == "safe"
    colour = palette.SAFE if safe else palette.MUTED
    place = pygame.Rect(left, top, width, height)
    tint = palette.mix(palette.FIELD, colour, 0.2 if safe else 0.08)
    surface.fill(tint, place)
    if safe:
        stripe = palette.mix(tint, colour, 0.22)
        surface.set_clip(place)
        for offset in range(-height, width, max(14, round(18 * ui))):
            start, end = (left + offset, top + height), (left + offset + height, top)
            pygame.draw.aaline(surface, stripe, start, end)
            pygame.draw.aaline(surface, stripe, (start[0] + 1, start[1]), (end[0] + 1, end[1]))
        surface.set_clip(None)
    edge = palette.mix(colour, palette.FIELD, 0.25)
    pygame.draw.rect(surface, edge, (left, top, width, height), 2 if safe else 1)
    words = zone.name.replace("_", " ").upper()
    if safe and "ZONE" not in words:
        words += " ZONE"
    size = round((20 if safe else 15) * ui)
    smallest = max(10, round(12 * ui))
    while size > smallest and fonts.width(words, size, Face.BOLD) > 0.85 * width:
        size -= 1
    ink = palette.mix(colour, palette.TEXT, 0.45 if safe else 0.0)
    text = fonts.render(words, max(size, smallest), ink, Face.BOLD)
    if text.get_width() > 0.85 * width and height > width:
        text = pygame.transform.rotate(text, 90)
    if text.get_width() <= width - 4 and text.get_height() <= height - 4:
        text = text.copy()
        text.set_alpha(210 if safe else 150)
        surface.blit(text, text.get_rect(center=(left + width // 2, top + height // 2)))


def _legend(surface: pygame.Surface, view: View, ui: float, fonts: Fonts) -> None:
    """A scale in metres and where x and y point."""
    metres = next((m for m in (1, 2, 5, 10, 20, 50, 100) if m * view.scale >= 60 * ui), 100)
    length = metres * view.scale
    left, bottom = 18 * ui, surface.get_height() - 16 * ui
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
    origin = (left + length + 40 * ui, bottom - (34 if view.turned else 4) * ui)
    for theta, name in ((0.0, "x"), (math.pi / 2, "y")):
        angle = view.angle(theta)
        tip = shapes.oriented(origin, angle, 20 * ui, 0.0)
        shapes.line(surface, origin, tip, palette.MUTED, 1.5 * ui)
        head = [shapes.oriented(tip, angle, a * ui, b * ui) for a, b in ((5, 0), (-3, 3.5), (-3, -3.5))]
        shapes.polygon(surface, head, palette.MUTED)
        letter = fonts.render(name, size, palette.MUTED)
        surface.blit(letter, letter.get_rect(center=shapes.oriented(origin, angle, 33 * ui, 0.0)))


def _explain_rim(surface: pygame.Surface, ui: float, fonts: Fonts) -> None:
    text = fonts.render("white rim: physical robot", max(10, round(12 * ui)), palette.MUTED)
    if surface.get_width() >= text.get_width() + 300 * ui:
        corner = (surface.get_width() - 18 * ui, surface.get_height() - 12 * ui)
        surface.blit(text, text.get_rect(bottomright=corner))
