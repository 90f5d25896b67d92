"""Draws the field of a scene with pygame. What stands still is drawn once and kept."""

from collections.abc import Sequence

import pygame

from vrg.figures import Figure
from vrg.regions import Bounds
from vrg.ui import palette, picture
from vrg.ui.scene import Scene
from vrg.ui.view import Area, Projection, extent, fit
from vrg.ui.window.easel import FigurePainter
from vrg.ui.window.ground import draw_strip, strip_height
from vrg.ui.window.text import Fonts


class FieldPainter:
    """Draws the field with all that is on it into an area of a surface."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._figures = FigurePainter(fonts)
        self._ground: pygame.Surface | None = None
        self._ground_of: tuple[object, ...] = ()
        self._painted: list[pygame.Rect] = []

    def draw(
        self,
        surface: pygame.Surface,
        area: pygame.Rect | Area,
        scene: Scene,
        ui: float,
        driving: str | None,
        *,
        below: Sequence[Figure] = (),
        above: Sequence[Figure] = (),
        names: bool = True,
        box: Bounds | None = None,
        turned: bool | None = None,
        strip: bool = True,
    ) -> Projection:
        """Draw the scene and return where things are.

        Args:
            ui: scales letters. driving: the player with a ring.
            below, above: figures that are drawn below the robots, and above everything.
            names: whether words are written beside what moves. box: the part that is shown, m; None shows all.
            turned: whether it is shown a quarter turn clockwise; None chooses what shows all of it larger.
            strip: whether there is a strip with scale and legend below the field.
        """
        low = strip_height(ui) if strip else 0
        rect = pygame.Rect(area)
        view = fit(box or extent(scene), (rect.left, rect.top, rect.width, max(1, rect.height - low)), turned)
        surface.blit(self._ground_for(rect, scene, view, ui, strip=strip), rect)
        rect.height = max(1, rect.height - low)
        before = surface.get_clip()
        surface.set_clip(rect.clip(before))
        figures = picture.moving(scene, driving, below, above)
        self._figures.draw(surface, figures, view, ui)
        if names:
            self._figures.label(surface, rect, figures[::-1], view, ui, self._painted)
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
            self._ground.fill(palette.APRON)
            here = Projection(view.x, view.y, view.left - rect.left, view.top - rect.top, view.scale, view.turned)
            painted = self._figures.draw(self._ground, picture.ground(scene), here, ui)
            self._painted = [words.move(rect.topleft) for words in painted]
            if strip:
                draw_strip(self._ground, scene, here, ui, self._fonts)
        return self._ground
