"""Draws on the field what robots sense and players see: scans, sonars, sightings, and where robots were measured."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
import numpy.typing as npt
import pygame

from vrg.colours import Rgb
from vrg.games import game_of
from vrg.hal.models import RobotModel
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.sonar import Sonar, SonarSpec
from vrg.types import Pose
from vrg.ui import palette, shapes
from vrg.ui.developer.choices import Overlay
from vrg.ui.developer.insight import SEEN, Insight, Seen
from vrg.ui.view import Pixel, View

SIGMAS: Final = 2.0
"""How many standard deviations of a sighting its ellipse shows."""
_ARC: Final = 5
"""The number of points on the arc of a sonar's cone, and four times as many on an ellipse."""

Points = npt.NDArray[np.float64]
"""Shape (n, 2): x and y in the map's frame, m."""


def beam_ends(scan: Laser, pose: Pose, mount: float) -> tuple[Points, npt.NDArray[np.bool_]]:
    """Where the beams of a scan end, and which of them have met something.

    Args:
        pose: of the robot. mount: the distance of the laser ahead of the robot's centre, m.
    """
    ranges = scan.ranges.astype(np.float64)
    angles = scan.angles + pose.theta
    x = pose.x + mount * math.cos(pose.theta) + ranges * np.cos(angles)
    y = pose.y + mount * math.sin(pose.theta) + ranges * np.sin(angles)
    return np.stack((x, y), axis=1), ranges < scan.range_max


def echoes(ring: Sonar, spec: SonarSpec, pose: Pose) -> list[list[tuple[float, float]]]:
    """For each transducer that hears an echo the arc on which that is, with the transducer first and last; m."""
    found = []
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    for distance, place in zip(ring.ranges, spec.places, strict=False):
        if distance < ring.range_max:
            own = (pose.x + c * place.x - s * place.y, pose.y + s * place.x + c * place.y)
            bearings = [pose.theta + place.theta + spec.cone * (i / (_ARC - 1) - 0.5) for i in range(_ARC)]
            arc = [(own[0] + distance * math.cos(b), own[1] + distance * math.sin(b)) for b in bearings]
            found.append([own, *arc, own])
    return found


def ellipse(seen: Seen) -> list[tuple[float, float]]:
    """The corners of the ellipse about a sighting within SIGMAS standard deviations, m."""
    s = seen.sighting
    values, axes = np.linalg.eigh(np.array([[s.xx, s.xy], [s.xy, s.yy]]))
    turns = np.linspace(0.0, math.tau, 4 * _ARC, endpoint=False)
    circle = np.stack((np.cos(turns), np.sin(turns))) * SIGMAS * np.sqrt(values)[:, None]
    return [(s.x + float(dx), s.y + float(dy)) for dx, dy in (axes @ circle).T]


class SensingPainter:
    """Draws the overlays that lie below the robots.

    Args:
        robots: the models of the players' robots, by name.
    """

    def __init__(self, robots: Mapping[str, RobotModel]) -> None:
        self._robots = robots

    def draw(
        self,
        surface: pygame.Surface,
        view: View,
        insight: Insight,
        shown: set[Overlay],
        selected: str | None,
        ui: float,
    ) -> None:
        """Draw what is switched on. Of the player that is selected the free ground of its scan is drawn too."""
        colours = self._colours(insight)
        for reading in insight.readings:
            colour, model = colours.get(reading.robot, palette.ECHO), self._robots.get(reading.robot)
            if isinstance(reading.body, Laser):
                mount = 0.0 if model is None or model.laser is None else model.laser.x
                ends, met = beam_ends(reading.body, reading.pose, mount)
                if reading.robot == selected and len(ends) > 1:
                    self._free(surface, view, reading.pose, mount, ends)
                self._dots(surface, pixels(view, ends[met]), colour, max(2, round(2 * ui)))
                continue
            spec = None if model is None else model.sensor(SonarSpec)
            for cone in [] if spec is None else echoes(reading.body, spec, reading.pose):
                points = [view.point(*point) for point in cone]
                lines = points if reading.robot == selected else points[1:-1]
                pygame.draw.aalines(surface, colour, False, lines)
        if Overlay.SIGHTINGS in shown:
            for seen in insight.sightings:
                self._sighting(surface, view, seen, colours.get(seen.player, palette.ECHO), insight.now, ui)
        if Overlay.MEASURED in shown:
            self._measured(surface, view, insight, ui)

    @staticmethod
    def _colours(insight: Insight) -> dict[str, Rgb]:
        game = game_of(insight.scene.game)
        return {body.name: game.style(body.role, body.state).colour for body in insight.scene.bodies}

    @staticmethod
    def _free(surface: pygame.Surface, view: View, pose: Pose, mount: float, ends: Points) -> None:
        own = view.point(pose.x + mount * math.cos(pose.theta), pose.y + mount * math.sin(pose.theta))
        corners = [own, *((float(x), float(y)) for x, y in pixels(view, ends))]
        pygame.draw.polygon(surface, palette.SCAN, corners)

    @staticmethod
    def _dots(surface: pygame.Surface, places: Points, colour: Rgb, size: int) -> None:
        """Draw a square at each pixel; all at once, because there are thousands."""
        clip = surface.get_clip()
        at = np.round(places).astype(np.int64) - size // 2
        inside = (
            (at[:, 0] >= clip.left) & (at[:, 0] < clip.right - size)
            & (at[:, 1] >= clip.top) & (at[:, 1] < clip.bottom - size)
        )  # fmt: skip
        at = at[inside]
        seen = pygame.surfarray.pixels3d(surface)
        for dx in range(size):
            for dy in range(size):
                seen[at[:, 0] + dx, at[:, 1] + dy] = colour

    @staticmethod
    def _sighting(surface: pygame.Surface, view: View, seen: Seen, colour: Rgb, now: float, ui: float) -> None:
        share = min(1.0, max(0.0, (now - seen.sighting.time) / SEEN))
        faded = palette.mix(colour, palette.FIELD, 0.85 * share)
        shapes.outline(surface, [view.point(*corner) for corner in ellipse(seen)], faded, 1.0)
        shapes.disc(surface, view.point(seen.sighting.x, seen.sighting.y), 2.0 * ui, faded)

    @staticmethod
    def _measured(surface: pygame.Surface, view: View, insight: Insight, ui: float) -> None:
        """Outline each physical robot where it was measured, with a line to where it is."""
        for body in insight.scene.bodies:
            measured = insight.measured.get(body.name)
            if measured is None:
                continue
            pose = measured.body.pose
            centre: Pixel = view.point(pose.x, pose.y)
            half = max(9.0, body.length * view.scale / 2)
            aside = half * body.width / body.length
            corners = shapes.rectangle(centre, view.angle(pose.theta), -half, half, aside)
            shapes.outline(surface, corners, palette.CAUTION, max(2.0, 2 * ui))
            shapes.line(surface, centre, view.point(body.pose.x, body.pose.y), palette.CAUTION, 2 * ui)


def pixels(view: View, points: Points) -> Points:
    """Points of the field, m, as pixels of the window, shape (n, 2): `View.point` for many at once."""
    dx, dy = (points[:, 0] - view.x) * view.scale, (points[:, 1] - view.y) * view.scale
    right, down = (dy, dx) if view.turned else (dx, -dy)
    return np.stack((view.left + right, view.top + down), axis=1)
