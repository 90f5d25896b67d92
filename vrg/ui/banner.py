"""What must not be overlooked: emergency stop, halt, the end, a silent world, and what a stage waits for."""

from dataclasses import dataclass
from typing import Final

import pygame

from vrg.bus.foxglove_scene import Rgb
from vrg.bus.messages import Stage
from vrg.ui import palette, shapes
from vrg.ui.palette import ink_on
from vrg.ui.scene import Scene, title
from vrg.ui.text import Face, Fonts

MAX_LINES: Final = 5


@dataclass(frozen=True)
class Banner:
    """A heading and what is to be said about it."""

    heading: str
    lines: tuple[str, ...]
    colour: Rgb


def banners(scene: Scene) -> list[Banner]:
    """The banners of a scene, the gravest first."""
    found = []
    if scene.estop:
        lines = (scene.estop_reason,) if scene.estop_reason else ()
        found.append(Banner("EMERGENCY STOP", (*lines, "U releases it; robots stay still until armed."), palette.ALARM))
    if not scene.live:
        found.append(Banner("NO CLOCK", ("No clock from the world: what you see is old, robots stop.",), palette.LOST))
    if scene.stage is Stage.GAME_OVER:
        found.append(Banner("GAME OVER", _result(scene), palette.GOOD))
    elif scene.halted is not None:
        found.append(Banner("HALT", (scene.halted,), palette.CAUTION))
    elif scene.waiting:
        found.append(Banner("Waiting for", tuple(f"• {reason}" for reason in scene.waiting), palette.CALM))
    return found


def _result(scene: Scene) -> tuple[str, ...]:
    score = " · ".join(f"{title(team)} {points}" for team, points in scene.score)
    if scene.winner is None:
        result = "No winner"
    else:
        result = "A draw" if scene.winner == "draw" else f"Winner: {title(scene.winner)}"
    return (result, score) if score else (result,)


def draw_banners(
    surface: pygame.Surface, area: pygame.Rect, scene: Scene, fonts: Fonts, ui: float
) -> list[pygame.Rect]:
    """Draw them below each other at the top of the area. Returns where they are."""
    gap = round(10 * ui)
    width = min(area.width - 2 * gap, round(760 * ui))
    y = area.top + gap
    places: list[pygame.Rect] = []
    if width < 40:
        return places
    for banner in banners(scene):
        place = _draw(surface, pygame.Rect(area.centerx - width // 2, y, width, 0), banner, fonts, ui)
        places.append(place)
        y = place.bottom + gap
    return places


def _draw(surface: pygame.Surface, place: pygame.Rect, banner: Banner, fonts: Fonts, ui: float) -> pygame.Rect:
    pad = round(14 * ui)
    size, step = round(15 * ui), round(21 * ui)
    wrapped = [line for text in banner.lines for line in fonts.wrap(text, place.width - 2 * pad, size, lines=2)]
    if len(wrapped) > MAX_LINES:
        rest = len(wrapped) - MAX_LINES + 1
        wrapped = [*wrapped[: MAX_LINES - 1], f"… and {rest} more"]
    ink = ink_on(banner.colour)
    heading = fonts.render(banner.heading, round(26 * ui), ink, Face.BOLD)
    place.height = heading.get_height() + step * len(wrapped) + 2 * pad - round(4 * ui)
    shapes.pill(surface, place.move(0, round(3 * ui)), (0, 0, 0), 90, 10)
    shapes.pill(surface, place, banner.colour, radius=10)
    surface.blit(heading, heading.get_rect(midtop=(place.centerx, place.top + pad - round(4 * ui))))
    y = place.top + pad + heading.get_height()
    for line in wrapped:
        text = fonts.render(line, size, ink)
        surface.blit(text, text.get_rect(midtop=(place.centerx, y)))
        y += step
    return place
