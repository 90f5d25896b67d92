"""Draws the quadrants of what the robot senses: location, laser, sonar and camera."""

import io
import math
from abc import ABC, abstractmethod
from itertools import pairwise
from typing import Any, ClassVar, Final

import pygame

from vrg.figures import Figure, Shape, dashes, line, pixels
from vrg.hal.sensors.depiction import Cones, Depiction, Image, Rays
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.view import Pixel, Projection
from vrg.ui.window import shapes
from vrg.ui.window.field import FieldPainter
from vrg.ui.window.text import Fonts
from vrg_views.hud import words
from vrg_views.hud.dashboard import Dashboard, pose_line
from vrg_views.hud.helm import Goal
from vrg_views.hud.kit import blank, titled_plate
from vrg_views.hud.polar import RINGS, PolarPlot, echoes, nearest, nearest_words, polar_plot, reach_for

_DASHES: Final = 60
"""About the most dashes of a way."""


class Quadrant(ABC):
    """A part of the display with what one sensor has measured: the first whose readings are depicted so.

    Attributes:
        depiction: the type of the depiction. nothing: what stands there before the first reading.
    """

    depiction: ClassVar[type[Depiction]]
    nothing: ClassVar[str]

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts

    def shows(self, board: Dashboard) -> object:
        """Return a key of the picture: while it stays equal, so does the picture in the same place."""
        sensed = board.seen.first(self.depiction)
        return None if sensed is None or sensed.reading is None else sensed.reading.stamp

    def draw(self, surface: pygame.Surface, area: pygame.Rect, board: Dashboard, ui: float) -> None:
        """Draw it into an area; `ui` scales letters."""
        sensed = board.seen.first(self.depiction)
        if sensed is None:
            return
        title, found = sensed.spec.kind.upper(), sensed.depiction
        inner = titled_plate(surface, area, title, "" if found is None else self.caption(found, board), ui, self._fonts)
        if found is None:
            blank(surface, inner, self.nothing, ui, self._fonts)
        else:
            self.plot(surface, inner, found, board, ui)

    def caption(self, found: Any, board: Dashboard) -> str:
        """Return the words beside the title, about a depiction."""
        return nearest_words(found)

    @abstractmethod
    def plot(self, surface: pygame.Surface, inner: pygame.Rect, found: Any, board: Dashboard, ui: float) -> None:
        """Draw a depiction into the area below the title."""


class LocationPainter:
    """Draws the map with the robot, its trail, its goal and its way."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._field = FieldPainter(fonts)

    def draw(self, surface: pygame.Surface, area: pygame.Rect, board: Dashboard, ui: float) -> Projection:
        """Draw it, and return how the field's coordinates became pixels."""
        inner = titled_plate(surface, area, words.LOCATION, pose_line(board), ui, self._fonts)
        inner.inflate_ip(-4, -4)
        here = (inner.left, inner.top, inner.width, inner.height)
        return self._field.draw(surface, here, board.scene, ui, board.player, below=_plan(board))


def _plan(board: Dashboard) -> list[Figure]:
    """Where the robot began, its goal, and the way there."""
    found, pose = [], board.seen.pose
    if board.home is not None:
        home = Shape(((5.0, 5.0), (5.0, -5.0), (-5.0, -5.0), (-5.0, 5.0)), line=palette.MUTED, width=2.0)
        found.append(pixels("home", Pose(board.home.x, board.home.y, 0.0), home))
    if pose is not None and board.way:
        way = [(pose.x, pose.y), *board.way]
        length = max(0.25, sum(math.dist(*leg) for leg in pairwise(way)) / _DASHES)
        way_line = tuple(dashes(way, palette.CAUTION, 2.0, length))
        found.append(Figure("way", way_line))
    return found if board.goal is None else [*found, *_cross(board.goal)]


def _cross(goal: Goal) -> list[Figure]:
    """The goal as a ring with a cross, and an arrow where a heading is wanted."""
    ink, radius = palette.CAUTION, 9.0
    ring = Shape(((0.0, 0.0),), line=ink, width=2.5, radius=radius)
    bars = (((-radius, 0.0), (radius, 0.0)), ((0.0, -radius), (0.0, radius)))
    found = [pixels("goal", Pose(goal.x, goal.y, 0.0), ring, *(line(*bar, colour=ink, width=2.0) for bar in bars))]
    if goal.heading is not None:
        tip = 2.6 * radius
        arrow = (
            line((radius, 0.0), (tip, 0.0), colour=ink, width=2.5),
            Shape(((tip + 6, 0.0), (tip - 4, 5.0), (tip - 4, -5.0)), ink),
        )
        found.append(pixels("heading", Pose(goal.x, goal.y, goal.heading), *arrow))
    return found


class RaysPainter(Quadrant):
    """Draws the beams of a laser, or of another range finder with beams."""

    depiction, nothing = Rays, words.NO_SCAN

    def __init__(self, fonts: Fonts) -> None:
        super().__init__(fonts)
        self._reach: float | None = None

    def plot(self, surface: pygame.Surface, inner: pygame.Rect, found: Rays, board: Dashboard, ui: float) -> None:
        """Draw the ground that the beams find free, what they met, and what of it is nearest."""
        ranges, bearings = echoes(found)
        self._reach = reach_for(float(ranges.max()) if len(ranges) else found.range_max, self._reach)
        first = found.mount.theta + found.first
        last = first + found.step * max(0, len(found.ranges) - 1)
        inner.inflate_ip(round(-30 * ui), round(-24 * ui))
        plot = polar_plot((inner.left, inner.top, inner.width, inner.height), first, last, self._reach)
        whole = last - first > 2 * math.pi - 2 * found.step
        ends = zip(found.ranges, found.bearings.tolist(), strict=True)
        corners = [plot.polar(min(distance, plot.reach), bearing) for distance, bearing in ends]
        shapes.polygon(surface, corners if whole else [plot.origin, *corners], palette.SCAN)
        _rings(surface, plot, first, last)
        size = max(2, round(2 * ui))
        for r, b in zip(ranges, bearings, strict=True):
            x, y = plot.polar(float(r), float(b))
            surface.fill(palette.ECHO, (round(x) - size // 2, round(y) - size // 2, size, size))
        near = nearest(found)
        if near is not None:
            shapes.ring(surface, plot.polar(*near), 6 * ui, palette.CAUTION, 2 * ui)
        _scale(surface, plot, ui, self._fonts)
        _robot(surface, plot, board, ui)


class ConesPainter(Quadrant):
    """Draws the cones of a ring of sonars, or of another range finder with cones."""

    depiction, nothing = Cones, words.NO_ECHO

    def plot(self, surface: pygame.Surface, inner: pygame.Rect, found: Cones, board: Dashboard, ui: float) -> None:
        """Draw each cone up to what it heard."""
        near = nearest(found)
        inner.inflate_ip(round(-20 * ui), round(-20 * ui))
        place = (inner.left, inner.top, inner.width, inner.height)
        plot = polar_plot(place, -math.pi, math.pi, reach_for(found.range_max, None))
        _rings(surface, plot, -math.pi, math.pi)
        for number, distance in enumerate(found.ranges):
            corners = [plot.at(*point) for point in found.outline(number, 7)]
            if distance < found.range_max:
                closest = near is not None and distance == near[0]
                shapes.polygon(surface, corners, palette.CAUTION if closest else palette.ECHO)
            else:
                shapes.outline(surface, corners, palette.LINE)
        _scale(surface, plot, ui, self._fonts)
        _robot(surface, plot, board, ui)


def _rings(surface: pygame.Surface, plot: PolarPlot, first: float, last: float) -> None:
    """Draw a ring at each round distance."""
    sides = round(24 * (last - first)) + 2
    for distance in _distances(plot):
        points = [plot.polar(distance, first + (last - first) * k / sides) for k in range(sides + 1)]
        for start, end in pairwise(points):
            pygame.draw.aaline(surface, palette.LINE, start, end)


def _distances(plot: PolarPlot) -> list[float]:
    """The distances of the rings, m."""
    step = RINGS[plot.reach]
    return [number * step for number in range(1, round(plot.reach / step) + 1)]


def _scale(surface: pygame.Surface, plot: PolarPlot, ui: float, fonts: Fonts) -> None:
    """Write the distance at the outermost ring, and at further ones inwards where there is room."""
    size, last = max(11, round(12 * ui)), -math.inf
    for distance in reversed(_distances(plot)):
        x, y = plot.polar(distance, 0.0)
        if y < last + 26 * ui or y > plot.origin[1] - 30 * ui:
            continue
        last = y
        text = fonts.render(f"{distance:g} m", size, palette.TEXT)
        place = text.get_rect(midtop=(round(x), round(y) + 2))
        shapes.pill(surface, place.inflate(6, 0), palette.PANEL, 190, 4)
        surface.blit(text, place)


def _robot(surface: pygame.Surface, plot: PolarPlot, board: Dashboard, ui: float) -> None:
    """Draw the robot's body at its size, or as large as can be seen."""
    own = next((body for body in board.scene.bodies if body.name == board.player), None)
    length, width = (0.5, 0.4) if own is None else (own.length, own.width)
    grow = max(1.0, 9 * ui / max(0.01, width * plot.scale))
    half, side = length * plot.scale * grow / 2, width * plot.scale * grow / 2
    shapes.polygon(surface, _rectangle(plot.origin, math.pi / 2, -half, half, side), palette.TEXT)
    tip = [
        shapes.oriented(plot.origin, math.pi / 2, a, b)
        for a, b in ((half, 0), (-half * 0.4, side), (-half * 0.4, -side))
    ]
    shapes.polygon(surface, tip, palette.CALM)


def _rectangle(centre: Pixel, angle: float, back: float, front: float, half_width: float) -> list[Pixel]:
    """The corners of a turned rectangle from `back` to `front` along its heading, front left first."""
    return [
        shapes.oriented(centre, angle, front, half_width),
        shapes.oriented(centre, angle, front, -half_width),
        shapes.oriented(centre, angle, back, -half_width),
        shapes.oriented(centre, angle, back, half_width),
    ]


class PicturePainter(Quadrant):
    """Draws the newest picture of a camera. It is unpacked once."""

    depiction, nothing = Image, words.NO_PICTURE

    def __init__(self, fonts: Fonts) -> None:
        super().__init__(fonts)
        self._of: bytes = b""
        self._picture: pygame.Surface | None = None

    def shows(self, board: Dashboard) -> object:
        """The time of the picture, and its age in words."""
        return super().shows(board), self.caption(None, board)

    def caption(self, found: Image | None, board: Dashboard) -> str:
        """Return the age of the picture."""
        sensed = board.seen.first(self.depiction)
        age = None if sensed is None else board.seen.age(sensed.reading)
        return "" if age is None else f"{age:.1f} s"

    def plot(self, surface: pygame.Surface, inner: pygame.Rect, found: Image, board: Dashboard, ui: float) -> None:
        """Draw the picture as large as there is room."""
        if found.png is not self._of:
            self._of = found.png
            try:
                self._picture = pygame.image.load(io.BytesIO(found.png), "picture.png")
            except pygame.error:
                self._picture = None
        if self._picture is None:
            blank(surface, inner, words.BAD_PICTURE, ui, self._fonts)
            return
        inner.inflate_ip(round(-8 * ui), round(-8 * ui))
        width, height = self._picture.get_size()
        scale = min(inner.width / width, inner.height / height)
        size = max(1, round(width * scale)), max(1, round(height * scale))
        shown = pygame.transform.smoothscale(self._picture.convert(surface), size)
        surface.blit(shown, shown.get_rect(center=inner.center))
