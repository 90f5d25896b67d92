"""Draws on the field what robots sense and players see: scans, sonars, sightings, and where robots were measured."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt
import pygame

from vrg.colours import Rgb
from vrg.games import game_of
from vrg.geometry import circumradius, compose, ellipse
from vrg.hal.models import RobotModel
from vrg.hal.sensors.depiction import Cones, Depiction, Rays, Ticks
from vrg.types import Pose, Uncertainty
from vrg.ui import palette, shapes
from vrg.ui.developer.choices import Layer
from vrg.ui.developer.insight import SEEN, Insight, Reading, Seen
from vrg.ui.view import Pixel, Projection

_ARC: Final = 5
"""The number of points on the arc of a sonar's cone."""

Points = npt.NDArray[np.float64]
"""Shape (n, 2): x and y in the map's frame, m."""


DRAWN: Final[Mapping[Layer, Sequence[type[Depiction]]]] = {Layer.SCANS: (Rays,), Layer.SENSORS: (Cones, Ticks)}
"""The depictions that are drawn on the field, by the switch of each."""


def beam_ends(rays: Rays, pose: Pose) -> tuple[Points, npt.NDArray[np.bool_]]:
    """The ends of beams, and a mask of those that have met something.

    Args:
        pose: of the robot.
    """
    eye, ranges = compose(pose, rays.mount), np.array(rays.ranges, dtype=np.float64)
    angles = rays.bearings + pose.theta
    x, y = eye.x + ranges * np.cos(angles), eye.y + ranges * np.sin(angles)
    return np.stack((x, y), axis=1), (ranges > 0.0) & (ranges < rays.range_max)


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
        view: Projection,
        insight: Insight,
        shown: set[Layer],
        selected: str | None,
        ui: float,
    ) -> None:
        """Draw what is switched on. Of the player that is selected the free ground of its scan is drawn too."""
        colours = self._colours(insight)
        for reading in insight.readings:
            colour, chosen = colours.get(reading.robot, palette.ECHO), reading.robot == selected
            match reading.depiction:
                case Rays() as rays:
                    self._rays(surface, view, rays, reading.pose, colour, ui, free=chosen)
                case Cones() as cones:
                    self._cones(surface, view, cones, reading.pose, colour, sides=chosen)
                case Ticks() as ticks:
                    self._ticks(surface, view, ticks, reading, ui)
        if Layer.SIGHTINGS in shown:
            for seen in insight.sightings:
                self._sighting(surface, view, seen, colours.get(seen.player, palette.ECHO), insight.now, ui)
        if Layer.MEASURED in shown:
            self._measured(surface, view, insight, ui)

    @staticmethod
    def _colours(insight: Insight) -> dict[str, Rgb]:
        game = game_of(insight.scene.game)
        return {body.name: game.style(body.role, body.state).colour for body in insight.scene.bodies}

    def _rays(
        self, surface: pygame.Surface, view: Projection, rays: Rays, pose: Pose, colour: Rgb, ui: float, *, free: bool
    ) -> None:
        """Draw a dot where a beam has met something; `free` fills the ground that the beams find free."""
        ends, met = beam_ends(rays, pose)
        if free and len(ends) > 1:
            eye = compose(pose, rays.mount)
            corners = [(float(x), float(y)) for x, y in pixels(view, ends)]
            pygame.draw.polygon(surface, palette.SCAN, [view.point(eye.x, eye.y), *corners])
        self._dots(surface, pixels(view, ends[met]), colour, max(2, round(2 * ui)))

    @staticmethod
    def _cones(
        surface: pygame.Surface, view: Projection, cones: Cones, pose: Pose, colour: Rgb, *, sides: bool
    ) -> None:
        """Draw an arc in each cone where something is; `sides` draws the sides of the cone too."""
        for number, distance in enumerate(cones.ranges):
            if distance < cones.range_max:
                places = [compose(pose, Pose(x, y, 0.0)) for x, y in cones.outline(number, _ARC)]
                apex, *arc = [view.point(place.x, place.y) for place in places]
                pygame.draw.aalines(surface, colour, False, [apex, *arc, apex] if sides else arc)

    def _ticks(self, surface: pygame.Surface, view: Projection, ticks: Ticks, reading: Reading, ui: float) -> None:
        """Draw a stroke at each mark that is set, on the circle around the body."""
        robot, centre = self._robots[reading.robot], view.point(reading.pose.x, reading.pose.y)
        radius = max(17.0 * ui, 1.2 * view.scale * circumradius(robot.size))
        for number, on in enumerate(ticks.on):
            if on:
                bearing = view.angle(reading.pose.theta + math.tau * number / len(ticks.on))
                half = 0.35 * math.tau / len(ticks.on)
                start, end = (shapes.oriented(centre, bearing + turn, radius, 0.0) for turn in (-half, half))
                shapes.line(surface, start, end, palette.CAUTION, 3 * ui)

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
    def _sighting(surface: pygame.Surface, view: Projection, seen: Seen, colour: Rgb, now: float, ui: float) -> None:
        share = min(1.0, max(0.0, (now - seen.sighting.time) / SEEN))
        faded = palette.mix(colour, palette.FIELD, 0.85 * share)
        s = seen.sighting
        corners = ellipse(s.x, s.y, Uncertainty(s.xx, s.xy, s.yy, 0.0))
        shapes.outline(surface, [view.point(*corner) for corner in corners], faded, 1.0)
        shapes.disc(surface, view.point(seen.sighting.x, seen.sighting.y), 2.0 * ui, faded)

    @staticmethod
    def _measured(surface: pygame.Surface, view: Projection, insight: Insight, ui: float) -> None:
        """Outline robots where they were measured, with lines to where they are and ellipses where they may be."""
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
            if measured.body.uncertainty is not None:
                known = ellipse(pose.x, pose.y, measured.body.uncertainty)
                shapes.outline(surface, [view.point(*corner) for corner in known], palette.CAUTION, 1.5 * ui)


def pixels(view: Projection, points: Points) -> Points:
    """Points of the field, m, as pixels of the window, shape (n, 2): `Projection.point` for many at once."""
    dx, dy = (points[:, 0] - view.x) * view.scale, (points[:, 1] - view.y) * view.scale
    right, down = (dy, dx) if view.turned else (dx, -dy)
    return np.stack((view.left + right, view.top + down), axis=1)
