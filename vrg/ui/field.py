"""Draws the field. What stands still is drawn once and kept; what moves is drawn upon it in each frame."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Final

import pygame

from vrg.bus.messages import Stage
from vrg.colours import Rgb
from vrg.games import UNKNOWN_GAME, game_of
from vrg.games.game import Marker, Style
from vrg.geometry import ellipse
from vrg.regions import Bounds
from vrg.types import Pose
from vrg.ui import palette, shapes
from vrg.ui.ground import draw_ground, strip_height
from vrg.ui.nametags import Circle, NamePainter
from vrg.ui.scene import Flash, Scene, SceneBody, SceneObject, SceneStroke
from vrg.ui.shapes import flag
from vrg.ui.sprites import FINENESS, NOSE, robot_sprite
from vrg.ui.text import Face, Fonts
from vrg.ui.view import Area, Pixel, Projection, extent, fit

SMALLEST: Final = 18.0
"""Pixels; a body is never drawn shorter than this."""


class FieldPainter:
    """Draws the field with all that is on it into an area of a surface."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._game = UNKNOWN_GAME
        self._ground: pygame.Surface | None = None
        self._ground_of: tuple[object, ...] = ()
        self._names = NamePainter(fonts)
        self._sprites: dict[tuple[Style, bool, int, int], pygame.Surface] = {}

    def draw(
        self,
        surface: pygame.Surface,
        area: pygame.Rect | Area,
        scene: Scene,
        ui: float,
        driving: str | None,
        *,
        below: Callable[[Projection], None] = lambda _view: None,
        names: bool = True,
        box: Bounds | None = None,
        turned: bool | None = None,
        strip: bool = True,
    ) -> Projection:
        """Draw the scene and return where things are.

        Args:
            ui: scales letters. driving: the player with a ring.
            below: draws what more there is below the robots and their names.
            names: whether names are written. box: the part that is shown, m; None shows all.
            turned: whether it is shown a quarter turn clockwise; None chooses what shows all of it larger.
            strip: whether there is a strip with scale and legend below the field.
        """
        self._game = game_of(scene.game)
        low = strip_height(ui) if strip else 0
        rect = pygame.Rect(area)
        view = fit(box or extent(scene), (rect.left, rect.top, rect.width, max(1, rect.height - low)), turned)
        surface.blit(self._ground_for(rect, scene, view, ui, strip=strip), rect)
        rect.height = max(1, rect.height - low)
        before = surface.get_clip()
        surface.set_clip(rect.clip(before))
        if scene.stage in (Stage.INITIALIZE, Stage.ROUND_OVER):
            self._marks(surface, scene, view)
        for body in scene.bodies:
            _trail(surface, body, view, self._game.style(body.role, body.state))
        # The name of a player stands beside the last thing that it has sketched.
        named = {stroke.player: index for index, stroke in enumerate(scene.strokes)}
        for index, stroke in enumerate(scene.strokes):
            self._stroke(surface, stroke, view, ui, stroke.player if named[stroke.player] == index else "")
        below(view)
        for body in scene.bodies:
            if body.uncertainty is not None:
                known = ellipse(body.pose.x, body.pose.y, body.uncertainty)
                shapes.outline(surface, [view.point(*corner) for corner in known], palette.CAUTION, 1.5 * ui)
        # What is out of play lies under what plays.
        for body in sorted(scene.bodies, key=lambda body: not body.out_of_play):
            self._body(surface, body, view)
            if body.name == driving:
                centre = view.point(body.pose.x, body.pose.y)
                shapes.ring(surface, centre, _radius(body, view) + 6 * ui, palette.CAUTION, 2.5 * ui)
        for thing in scene.objects:
            self._object(surface, thing, view)
        words = [self._word(rect, flash, view, ui) for flash in scene.flashes]
        if names:
            robots = [self._named(body, view, driving) for body in scene.bodies]
            remarks = [self._game.remark(body.state) for body in scene.bodies]
            self._names.draw(surface, rect, robots, ui, [plate for _, plate in words], remarks)
        for flash, word in zip(scene.flashes, words, strict=True):
            self._flash(surface, flash, word, view, ui)
        surface.set_clip(before)
        return view

    def _ground_for(
        self, rect: pygame.Rect, scene: Scene, view: Projection, ui: float, *, strip: bool
    ) -> pygame.Surface:
        physical = frozenset(body.physical for body in scene.bodies)
        key = (rect.size, rect.topleft, view, ui, physical, scene.game, scene.zones, scene.obstacles)
        if self._ground is None or key != self._ground_of:
            self._ground_of = key
            self._ground = pygame.Surface(rect.size)
            here = Projection(view.x, view.y, view.left - rect.left, view.top - rect.top, view.scale, view.turned)
            draw_ground(self._ground, scene, here, ui, self._fonts, strip=strip)
        return self._ground

    def _marks(self, surface: pygame.Surface, scene: Scene, view: Projection) -> None:
        for player in scene.players:
            if player.mark is None:
                continue
            colour = palette.mix(self._game.style(player.role, player.state).colour, palette.FIELD, 0.45)
            centre, angle = _placed(player.mark, view)
            half = max(0.25 * view.scale, SMALLEST / 2)
            shapes.outline(surface, shapes.rectangle(centre, angle, -half, half, half * 0.8), colour, 1.5)
            nose = shapes.oriented(centre, angle, half * 1.7, 0.0)
            shapes.line(surface, shapes.oriented(centre, angle, half, 0.0), nose, colour, 1.5)

    def _body(self, surface: pygame.Surface, body: SceneBody, view: Projection) -> None:
        length, width = _size(body, view)
        key = (self._game.style(body.role, body.state), body.physical, round(length), round(width))
        sprite = self._sprites.get(key)
        if sprite is None:
            sprite = self._sprites[key] = robot_sprite(*key)
        centre, angle = _placed(body.pose, view)
        turned = pygame.transform.rotozoom(sprite, math.degrees(angle), 1 / FINENESS)
        surface.blit(turned, turned.get_rect(center=(round(centre[0]), round(centre[1]))))
        style = key[0]
        if style.marker is Marker.CROSS:  # turned it could be a plus
            shapes.marker(surface, centre, 0.0, width * 0.33, palette.INK, style.marker)

    @staticmethod
    def _named(body: SceneBody, view: Projection, driving: str | None) -> tuple[str, Rgb, Circle]:
        colour, radius = palette.MUTED if body.out_of_play else palette.TEXT, _radius(body, view)
        if body.name == driving:
            colour = palette.CAUTION
        return body.name, colour, (view.point(body.pose.x, body.pose.y), radius)

    def _object(self, surface: pygame.Surface, thing: SceneObject, view: Projection) -> None:
        """Draw a flag at its place, or on the robot that carries it."""
        style = self._game.team_style(thing.team)
        flag(surface, view.point(*thing.at), max(0.5 * view.scale, SMALLEST), style.colour)

    def _stroke(self, surface: pygame.Surface, stroke: SceneStroke, view: Projection, ui: float, name: str) -> None:
        colour = palette.mix(palette.FIELD, self._game.style(stroke.role).colour, 0.75)
        points = [view.point(*point) for point in stroke.points]
        for start, end in pairwise(points):
            shapes.stroke(surface, start, end, colour, 1.5 * ui)
        shapes.disc(surface, points[-1], (2.0 if len(points) == 1 else 3.5) * ui, colour)
        label = " ".join(word for word in (name, stroke.label) if word)
        if label:
            text = self._fonts.render(label, max(10, round(12 * ui)), palette.TEXT)
            x, y = points[-1]
            surface.blit(text, text.get_rect(midleft=(round(x + 7 * ui), round(y))))

    def _word(self, rect: pygame.Rect, flash: Flash, view: Projection, ui: float) -> tuple[pygame.Surface, pygame.Rect]:
        """The word of a flash, and its plate above the ring, or below it where that has no room."""
        centre, radius = view.point(*flash.at), 1.25 * _ring(view, ui)
        text = self._fonts.render(flash.word.upper(), max(14, round(18 * ui)), palette.INK, Face.BOLD)
        plate = text.get_rect(midbottom=(round(centre[0]), round(centre[1] - radius - 4 * ui))).inflate(12, 4)
        if plate.top < rect.top:
            plate.top = round(centre[1] + radius + 4 * ui)
        plate.clamp_ip(rect)
        return text, plate

    @staticmethod
    def _flash(
        surface: pygame.Surface, flash: Flash, word: tuple[pygame.Surface, pygame.Rect], view: Projection, ui: float
    ) -> None:
        """Draw a ring that grows and fades about what was called, with a word for it."""
        centre = view.point(*flash.at)
        opacity = round(255 * (1.0 - flash.share))
        radius = _ring(view, ui) * (1.0 + flash.share)
        reach = math.ceil(radius + 4 * ui)
        layer = pygame.Surface((2 * reach, 2 * reach), pygame.SRCALPHA)
        for width, share in ((4.0, 1.0), (3.0, 0.75)):
            shapes.ring(layer, (reach, reach), radius * share, palette.CAUTION, width * ui)
        layer.set_alpha(opacity)
        surface.blit(layer, layer.get_rect(center=(round(centre[0]), round(centre[1]))))
        text, plate = word
        opacity = min(255, 3 * opacity)  # the word can be read until shortly before it is gone
        shapes.pill(surface, plate, palette.CAUTION, opacity, 6)
        text = text.copy()
        text.set_alpha(opacity)
        surface.blit(text, text.get_rect(center=plate.center))


def _ring(view: Projection, ui: float) -> float:
    """The radius with which the ring of a flash begins, pixels; it doubles."""
    return min(max(0.6 * view.scale, SMALLEST), 60 * ui)


def _trail(surface: pygame.Surface, body: SceneBody, view: Projection, style: Style) -> None:
    points = [view.point(x, y) for x, y in (*body.trail, (body.pose.x, body.pose.y))]
    last = len(points) - 1
    for index in range(last):
        share = (index + 1) / last
        faded = palette.mix(palette.FIELD, style.colour, 0.2 + 0.7 * share)
        shapes.stroke(surface, points[index], points[index + 1], faded, 1.0 + 2.0 * share)


def _placed(pose: Pose, view: Projection) -> tuple[Pixel, float]:
    return view.point(pose.x, pose.y), view.angle(pose.theta)


def _size(body: SceneBody, view: Projection) -> tuple[float, float]:
    grow = max(1.0, SMALLEST / max(body.length * view.scale, 0.01))
    return body.length * view.scale * grow, body.width * view.scale * grow


def _radius(body: SceneBody, view: Projection) -> float:
    """Of the circle about a body in which its corners and its nose are."""
    length, width = _size(body, view)
    return max(math.hypot(length, width) / 2, length * (0.5 + NOSE))
