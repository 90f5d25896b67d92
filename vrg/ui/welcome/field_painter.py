"""Draws the field of a draft with its robots, and what a person takes hold of."""

from collections.abc import Sequence

import pygame

from vrg.types import Pose
from vrg.ui import palette, shapes
from vrg.ui.field import FieldPainter
from vrg.ui.kit import blank, frame
from vrg.ui.text import Fonts
from vrg.ui.view import View
from vrg.ui.welcome import words
from vrg.ui.welcome.checking import Verdict
from vrg.ui.welcome.draft import Draft
from vrg.ui.welcome.ground import ARM, RING, ring_of, scene_of


class DraftPainter:
    """Draws the field of drafts."""

    def __init__(self, fonts: Fonts, physical: frozenset[str]) -> None:
        self._fonts = fonts
        self._physical = physical
        self._field = FieldPainter(fonts)

    def draw(
        self,
        surface: pygame.Surface,
        area: pygame.Rect,
        draft: Draft | None,
        verdict: Verdict | None,
        ui: float,
        *,
        poses: Sequence[Pose | None] | None = None,
        selected: int | None = None,
        says: str = "",
    ) -> View | None:
        """Draw it, and return how the field's coordinates became pixels; None if there is nothing to draw.

        Args:
            poses: where robots are shown, if not at their starts. selected: the number of the player with the ring.
            says: what the plate says.
        """
        inner = frame(surface, area, words.FIELD, says, ui, self._fonts).inflate(-4, -4)
        if draft is None or not draft.data or inner.width < 20 or inner.height < 20:
            blank(surface, inner, words.NO_FIELD, ui, self._fonts)
            return None
        scene = scene_of(draft, verdict, poses, self._physical)
        chosen = draft.players[selected] if selected is not None and selected < len(draft.players) else None
        here = (inner.left, inner.top, inner.width, inner.height)
        # The ring that turns it is nearer than this, so its name is not drawn over.
        around = 0.0 if chosen is None else (ARM + RING) * ui
        view = self._field.draw(surface, here, scene, ui, chosen.name if chosen else None, around=around)
        before = surface.get_clip()
        surface.set_clip(inner.clip(before))
        shown = poses or [entry.pose for entry in draft.players]
        for number, pose in enumerate(shown):
            if pose is not None and verdict is not None and verdict.of_player(number):
                shapes.ring(surface, view.point(pose.x, pose.y), 19 * ui, palette.WARNING, 2 * ui)
        pose = shown[selected] if selected is not None and selected < len(shown) else None
        if chosen is not None and pose is not None:
            ring = ring_of(pose, chosen.model, view, ui)
            shapes.stroke(surface, view.point(pose.x, pose.y), ring, palette.CAUTION, 1.5 * ui)
            shapes.disc(surface, ring, RING * ui, palette.BACKGROUND)
            shapes.ring(surface, ring, RING * ui, palette.CAUTION, 2.5 * ui)
        surface.set_clip(before)
        return view
