"""Draws the quadrants of what the robot senses: location, laser, sonar and camera."""

import io
import math
from itertools import pairwise
from typing import Protocol

import pygame

from vrg.colours import Rgb
from vrg.games.hud.helm import Goal
from vrg.ui import palette, shapes
from vrg.ui.field import FieldPainter
from vrg.ui.hud import words
from vrg.ui.hud.dashboard import Dashboard, place
from vrg.ui.hud.polar import (
    RINGS,
    Fan,
    cone,
    echoes,
    fan,
    nearest_of_ring,
    nearest_of_scan,
    reach_for,
    told,
)
from vrg.ui.text import Fonts
from vrg.ui.view import View
from vrg.ui.widgets import blank, frame


class Quadrant(Protocol):
    """A part of the display that changes only with a reading."""

    def shows(self, board: Dashboard) -> object:
        """What its picture depends on, besides its place. While this stays equal, so does the picture."""

    def draw(self, surface: pygame.Surface, area: pygame.Rect, board: Dashboard, ui: float) -> None:
        """Draw it into an area; `ui` scales letters."""


class LocationPainter:
    """Draws the map with the robot, its trail, its goal and its way."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._field = FieldPainter(fonts)

    def draw(self, surface: pygame.Surface, area: pygame.Rect, board: Dashboard, ui: float) -> View:
        """Draw it, and return how the field's coordinates became pixels."""
        inner = frame(surface, area, words.LOCATION, place(board), ui, self._fonts)
        inner.inflate_ip(-4, -4)
        here = (inner.left, inner.top, inner.width, inner.height)

        def below(view: View) -> None:
            _plan(surface, view, board, ui)

        return self._field.draw(surface, here, board.scene, ui, board.player, whole=here, below=below)


def _plan(surface: pygame.Surface, view: View, board: Dashboard, ui: float) -> None:
    """Draw where the robot began, its goal, and the way there."""
    if board.home is not None:
        home = view.point(board.home.x, board.home.y)
        shapes.outline(surface, shapes.rectangle(home, 0.0, -5 * ui, 5 * ui, 5 * ui), palette.MUTED, 2)
    pose = board.seen.pose
    if pose is not None and board.way:
        points = [view.point(pose.x, pose.y), *(view.point(*point) for point in board.way)]
        for start, end in pairwise(points):
            _dashes(surface, start, end, palette.CAUTION, ui)
    if board.goal is not None:
        _cross(surface, view, board.goal, ui)


def _dashes(
    surface: pygame.Surface, start: tuple[float, float], end: tuple[float, float], colour: Rgb, ui: float
) -> None:
    length, step = math.dist(start, end), 12 * ui
    for index in range(math.ceil(length / step)):
        a, b = (min(1.0, (index + part) * step / length) for part in (0.0, 0.6))
        points = [(start[0] + (end[0] - start[0]) * s, start[1] + (end[1] - start[1]) * s) for s in (a, b)]
        shapes.stroke(surface, points[0], points[1], colour, 2 * ui)


def _cross(surface: pygame.Surface, view: View, goal: Goal, ui: float) -> None:
    """Draw the goal as a ring with a cross, and an arrow where a heading is wanted."""
    centre, radius = view.point(goal.x, goal.y), 9 * ui
    shapes.ring(surface, centre, radius, palette.CAUTION, 2.5 * ui)
    for dx, dy in ((radius, 0.0), (0.0, radius)):
        ends = ((centre[0] - dx, centre[1] - dy), (centre[0] + dx, centre[1] + dy))
        shapes.line(surface, *ends, palette.CAUTION, 2 * ui)
    if goal.heading is not None:
        angle = view.angle(goal.heading)
        tip = shapes.oriented(centre, angle, 2.6 * radius, 0.0)
        shapes.line(surface, shapes.oriented(centre, angle, radius, 0.0), tip, palette.CAUTION, 2.5 * ui)
        head = [shapes.oriented(tip, angle, a * ui, b * ui) for a, b in ((6, 0), (-4, 5), (-4, -5))]
        shapes.polygon(surface, head, palette.CAUTION)


class ScanPainter:
    """Draws the newest scan of the laser."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._reach: float | None = None

    def shows(self, board: Dashboard) -> object:
        """The time of the scan."""
        return None if board.seen.laser is None else board.seen.laser.stamp

    def draw(self, surface: pygame.Surface, area: pygame.Rect, board: Dashboard, ui: float) -> None:
        """Draw the quadrant."""
        scan = None if board.seen.laser is None else board.seen.laser.body
        if scan is None:
            inner = frame(surface, area, words.LASER, "", ui, self._fonts)
            blank(surface, inner, words.NO_SCAN if board.laser else words.NOT_FITTED, ui, self._fonts)
            return
        nearest = nearest_of_scan(scan)
        inner = frame(surface, area, words.LASER, told(nearest, scan.range_max), ui, self._fonts)
        ranges, bearings = echoes(scan)
        farthest = float(ranges.max()) if len(ranges) else scan.range_max
        self._reach = reach_for(farthest, self._reach)
        first, last = float(scan.angles[0]), float(scan.angles[-1])
        inner.inflate_ip(round(-30 * ui), round(-24 * ui))
        plot = fan((inner.left, inner.top, inner.width, inner.height), first, last, self._reach)
        whole = last - first > 2 * math.pi - 2 * scan.angle_step
        corners = [
            plot.polar(min(float(r), plot.reach), float(b)) for r, b in zip(scan.ranges, scan.angles, strict=True)
        ]
        shapes.polygon(surface, corners if whole else [plot.origin, *corners], palette.SCAN)
        _rings(surface, plot, first, last)
        size = max(2, round(2 * ui))
        for r, b in zip(ranges, bearings, strict=True):
            x, y = plot.polar(float(r), float(b))
            surface.fill(palette.ECHO, (round(x) - size // 2, round(y) - size // 2, size, size))
        if nearest is not None:
            shapes.ring(surface, plot.polar(*nearest), 6 * ui, palette.CAUTION, 2 * ui)
        _scale(surface, plot, ui, self._fonts)
        _robot(surface, plot, board, ui)


class RingPainter:
    """Draws the newest ranges of the ring of sonars."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts

    def shows(self, board: Dashboard) -> object:
        """The time of the ranges."""
        return None if board.seen.sonar is None else board.seen.sonar.stamp

    def draw(self, surface: pygame.Surface, area: pygame.Rect, board: Dashboard, ui: float) -> None:
        """Draw the quadrant."""
        spec, ring = board.sonar, None if board.seen.sonar is None else board.seen.sonar.body
        if spec is None or ring is None:
            inner = frame(surface, area, words.SONAR, "", ui, self._fonts)
            blank(surface, inner, words.NOT_FITTED if spec is None else words.NO_ECHO, ui, self._fonts)
            return
        nearest = nearest_of_ring(ring, spec)
        inner = frame(surface, area, words.SONAR, told(nearest, ring.range_max), ui, self._fonts)
        inner.inflate_ip(round(-20 * ui), round(-20 * ui))
        place = (inner.left, inner.top, inner.width, inner.height)
        plot = fan(place, -math.pi, math.pi, reach_for(ring.range_max, None))
        _rings(surface, plot, -math.pi, math.pi)
        for index, distance in enumerate(ring.ranges[: len(spec.places)]):
            corners = cone(plot, spec, index, distance)
            if distance < ring.range_max:
                near = nearest is not None and distance == nearest[0]
                shapes.polygon(surface, corners, palette.CAUTION if near else palette.ECHO)
            else:
                shapes.outline(surface, corners, palette.LINE)
        _scale(surface, plot, ui, self._fonts)
        _robot(surface, plot, board, ui)


def _rings(surface: pygame.Surface, plot: Fan, first: float, last: float) -> None:
    """Draw a ring at each round distance."""
    sides = round(24 * (last - first)) + 2
    for distance in _distances(plot):
        points = [plot.polar(distance, first + (last - first) * k / sides) for k in range(sides + 1)]
        for start, end in pairwise(points):
            pygame.draw.aaline(surface, palette.LINE, start, end)


def _distances(plot: Fan) -> list[float]:
    """The distances of the rings, m."""
    step = RINGS[plot.reach]
    return [number * step for number in range(1, round(plot.reach / step) + 1)]


def _scale(surface: pygame.Surface, plot: Fan, ui: float, fonts: Fonts) -> None:
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


def _robot(surface: pygame.Surface, plot: Fan, board: Dashboard, ui: float) -> None:
    """Draw the robot's body at its size, or as large as can be seen."""
    own = next((body for body in board.scene.bodies if body.name == board.player), None)
    length, width = (0.5, 0.4) if own is None else (own.length, own.width)
    grow = max(1.0, 9 * ui / max(0.01, width * plot.scale))
    half, side = length * plot.scale * grow / 2, width * plot.scale * grow / 2
    shapes.polygon(surface, shapes.rectangle(plot.origin, math.pi / 2, -half, half, side), palette.TEXT)
    tip = [
        shapes.oriented(plot.origin, math.pi / 2, a, b)
        for a, b in ((half, 0), (-half * 0.4, side), (-half * 0.4, -side))
    ]
    shapes.polygon(surface, tip, palette.CALM)


class PicturePainter:
    """Draws the newest picture of the camera. It is unpacked once."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._of: float | None = None
        self._picture: pygame.Surface | None = None

    def shows(self, board: Dashboard) -> object:
        """The time of the picture, and its age in words."""
        return None if board.seen.camera is None else board.seen.camera.stamp, self._age(board)

    @staticmethod
    def _age(board: Dashboard) -> str:
        age = board.seen.age(board.seen.camera)
        return "" if age is None else f"{age:.1f} s"

    def draw(self, surface: pygame.Surface, area: pygame.Rect, board: Dashboard, ui: float) -> None:
        """Draw the place beside the sonar."""
        taken, says = board.seen.camera, self._age(board)
        inner = frame(surface, area, words.CAMERA, says, ui, self._fonts)
        if taken is None:
            blank(surface, inner, words.NO_PICTURE, ui, self._fonts)
            return
        if taken.stamp != self._of:
            self._of = taken.stamp
            try:
                self._picture = pygame.image.load(io.BytesIO(taken.body.data), "picture.png")
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
