"""What there is to see in a picture, pixel by pixel, and the axes of plots."""

import contextlib
from collections.abc import Iterator
from typing import Any

import pygame
import pytest
from matplotlib.axes import Axes

from vrg.colours import Rgb
from vrg.ui.plots import plot
from vrg.ui.scene import Scene
from vrg.ui.view import Projection
from vrg.ui.window.draw import Painter


def colours_near(surface: pygame.Surface, point: tuple[float, float], radius: int = 14) -> dict[Rgb, int]:
    """How many pixels of each colour there are around a point."""
    found: dict[Rgb, int] = {}
    for dx in range(-radius, radius + 1):
        for dy in range(-radius, radius + 1):
            place = (round(point[0]) + dx, round(point[1]) + dy)
            if surface.get_rect().collidepoint(place):
                red, green, blue, _ = surface.get_at(place)
                found[red, green, blue] = found.get((red, green, blue), 0) + 1
    return found


def close_to(colours: dict[Rgb, int], wanted: Rgb, tolerance: int = 6) -> int:
    """How many of the pixels have about this colour."""
    return sum(n for c, n in colours.items() if max(abs(a - b) for a, b in zip(c, wanted, strict=True)) <= tolerance)


def where(scene: Scene, view: Projection, name: str) -> tuple[float, float]:
    """The pixel at which a body is."""
    pose = next(body.pose for body in scene.bodies if body.name == name)
    return view.point(pose.x, pose.y)


def painted(scene: Scene, size: tuple[int, int] = (1280, 800), **options: Any) -> tuple[pygame.Surface, Projection]:
    """The picture of a scene, and where things are in it."""
    surface = pygame.Surface(size)
    return surface, Painter().draw(surface, scene, **options)


def content(surface: pygame.Surface | None = None) -> bytes:
    """All pixels of a picture, or of the window."""
    shown = surface or pygame.display.get_surface()
    assert shown is not None
    return pygame.image.tobytes(shown, "RGB")


@contextlib.contextmanager
def kept_axes() -> Iterator[list[Axes]]:
    """The axes of each plot that is made meanwhile."""
    kept: list[Axes] = []
    made = plot._figure

    def keep(*args: Any) -> Any:
        figure, panels, metre = made(*args)
        kept.extend(panels)
        return figure, panels, metre

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plot, "_figure", keep)
        yield kept
