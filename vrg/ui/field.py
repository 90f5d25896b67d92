"""Draws the field. What stands still is drawn once and kept; what moves is drawn upon it in each frame."""

import math
from typing import Final

import pygame

from vrg.bus.messages import Stage
from vrg.games import UNKNOWN, game_of
from vrg.games.game import Style
from vrg.types import Pose
from vrg.ui import palette, shapes
from vrg.ui.ground import draw_ground
from vrg.ui.scene import Scene, SceneBody
from vrg.ui.sprites import FINENESS, robot_sprite
from vrg.ui.text import Face, Fonts
from vrg.ui.view import Area, Pixel, View, extent, fit

SMALLEST: Final = 18.0
"""Pixels; a body is never drawn shorter than this."""
_PLACES: Final = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1))
"""Where a name may stand beside its body, in the order of preference; y is down."""


class FieldPainter:
    """Draws the field with all that is on it into an area of a surface."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._game = UNKNOWN
        self._ground: pygame.Surface | None = None
        self._ground_of: tuple[object, ...] = ()
        self._place: dict[str, int] = {}
        self._sprites: dict[tuple[Style, bool, int, int], pygame.Surface] = {}

    def draw(self, surface: pygame.Surface, area: Area, scene: Scene, ui: float, driving: str | None) -> View:
        """Draw the scene and return where things are; `ui` scales letters, `driving` is the player with a ring."""
        self._game = game_of(scene.game)
        view = fit(extent(scene), area)
        rect = pygame.Rect(area)
        surface.blit(self._ground_for(rect, scene, view, ui), rect)
        before = surface.get_clip()
        surface.set_clip(rect.clip(before))
        if scene.stage in (Stage.INITIALIZE, Stage.ROUND_OVER):
            self._marks(surface, scene, view)
        for body in scene.bodies:
            _trail(surface, body, view, self._game.style(body.role, body.state))
        # What is out of play lies under what plays.
        for body in sorted(scene.bodies, key=lambda body: not body.out_of_play):
            self._body(surface, body, view)
            if body.name == driving:
                centre = view.point(body.pose.x, body.pose.y)
                shapes.ring(surface, centre, _radius(body, view) + 6 * ui, palette.CAUTION, 2.5 * ui)
        self._names(surface, rect, scene, view, ui, driving)
        surface.set_clip(before)
        return view

    def _ground_for(self, rect: pygame.Rect, scene: Scene, view: View, ui: float) -> pygame.Surface:
        physical = frozenset(body.physical for body in scene.bodies)
        key = (rect.size, rect.topleft, view, ui, physical, scene.zones, scene.segments, scene.circles)
        if self._ground is None or key != self._ground_of:
            self._ground_of = key
            self._ground = pygame.Surface(rect.size)
            here = View(view.x, view.y, view.left - rect.left, view.top - rect.top, view.scale, view.turned)
            draw_ground(self._ground, scene, here, ui, self._fonts)
        return self._ground

    def _marks(self, surface: pygame.Surface, scene: Scene, view: View) -> None:
        for player in scene.players:
            if player.mark is None:
                continue
            colour = palette.mix(self._game.style(player.role, player.state).colour, palette.FIELD, 0.45)
            centre, angle = _placed(player.mark, view)
            half = max(0.25 * view.scale, SMALLEST / 2)
            shapes.outline(surface, shapes.rectangle(centre, angle, -half, half, half * 0.8), colour, 1.5)
            nose = shapes.oriented(centre, angle, half * 1.7, 0.0)
            shapes.line(surface, shapes.oriented(centre, angle, half, 0.0), nose, colour, 1.5)

    def _body(self, surface: pygame.Surface, body: SceneBody, view: View) -> None:
        length, width = _size(body, view)
        key = (self._game.style(body.role, body.state), body.physical, round(length), round(width))
        sprite = self._sprites.get(key)
        if sprite is None:
            sprite = self._sprites[key] = robot_sprite(*key)
        centre, angle = _placed(body.pose, view)
        turned = pygame.transform.rotozoom(sprite, math.degrees(angle), 1 / FINENESS)
        surface.blit(turned, turned.get_rect(center=(round(centre[0]), round(centre[1]))))

    def _names(
        self, surface: pygame.Surface, rect: pygame.Rect, scene: Scene, view: View, ui: float, driving: str | None
    ) -> None:
        size = max(10, round(13 * ui))
        taken = [_bounds(body, view) for body in scene.bodies]
        for index, body in enumerate(scene.bodies):
            colour = palette.MUTED if body.out_of_play else palette.TEXT
            if body.name == driving:
                colour = palette.CAUTION
            text = self._fonts.render(body.name, size, colour, Face.BOLD)
            centre = view.point(body.pose.x, body.pose.y)
            if not rect.inflate(40, 40).collidepoint(centre):
                continue
            plate = self._free_place(text.get_rect().inflate(10, 2), centre, index, taken, rect, body.name)
            taken.append(plate)
            shapes.pill(surface, plate, palette.BACKGROUND, 170, 6)
            surface.blit(text, text.get_rect(center=plate.center))

    def _free_place(
        self, plate: pygame.Rect, centre: Pixel, own: int, taken: list[pygame.Rect], rect: pygame.Rect, name: str
    ) -> pygame.Rect:
        reach = taken[own]
        # It stays where it was as long as that is free, so that names do not flicker.
        last = self._place.get(name, 0)
        best, best_cost = plate, math.inf
        for place in (last, *(i for i in range(len(_PLACES)) if i != last)):
            right, down = _PLACES[place]
            tried = plate.copy()
            tried.center = (
                round(centre[0] + right * (reach.width + plate.width + 4) / 2),
                round(centre[1] + down * (reach.height + plate.height + 4) / 2),
            )
            inside = tried.clamp(rect)
            cost = sum(_overlap(inside, other) for other in taken)
            if cost < best_cost:
                best, best_cost = inside, cost
                self._place[name] = place
            if cost == 0:
                break
        return best


def _trail(surface: pygame.Surface, body: SceneBody, view: View, style: Style) -> None:
    points = [view.point(x, y) for x, y in (*body.trail, (body.pose.x, body.pose.y))]
    last = len(points) - 1
    for index in range(last):
        share = (index + 1) / last
        faded = palette.mix(palette.FIELD, style.colour, 0.2 + 0.7 * share)
        shapes.stroke(surface, points[index], points[index + 1], faded, 1.0 + 2.0 * share)


def _placed(pose: Pose, view: View) -> tuple[Pixel, float]:
    return view.point(pose.x, pose.y), view.angle(pose.theta)


def _size(body: SceneBody, view: View) -> tuple[float, float]:
    grow = max(1.0, SMALLEST / max(body.length * view.scale, 0.01))
    return body.length * view.scale * grow, body.width * view.scale * grow


def _radius(body: SceneBody, view: View) -> float:
    return math.hypot(*_size(body, view)) / 2


def _bounds(body: SceneBody, view: View) -> pygame.Rect:
    radius = round(_radius(body, view)) + 2
    x, y = view.point(body.pose.x, body.pose.y)
    return pygame.Rect(round(x) - radius, round(y) - radius, 2 * radius, 2 * radius)


def _overlap(a: pygame.Rect, b: pygame.Rect) -> int:
    common = a.clip(b)
    return common.width * common.height
