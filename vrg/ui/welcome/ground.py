"""A draft as a scene for the painter of the field, and which robot or ring of it is at a pixel. No window is needed."""

import math
from collections.abc import Sequence
from typing import Final

from vrg.hal.models import MODELS
from vrg.types import Pose
from vrg.ui.scene import Scene, SceneBody
from vrg.ui.view import Pixel, View
from vrg.ui.welcome.checking import Verdict
from vrg.ui.welcome.draft import DEFAULTS, Draft

UNKNOWN_SIZE: Final = (0.5, 0.5)
"""The length and width in m of a robot whose model is not known."""
SMALLEST: Final = 12.0
"""The distance in pixels from a robot's centre within which it can be taken hold of, at least."""
ARM: Final = 34.0
"""The distance in pixels from a robot's centre to the ring that turns it, at least."""
RING: Final = 7.0
"""The radius in pixels of that ring."""


def scene_of(
    draft: Draft,
    verdict: Verdict | None,
    poses: Sequence[Pose | None] | None = None,
    physical: frozenset[str] = frozenset(),
) -> Scene:
    """The scene of a draft.

    Args:
        verdict: the newest one, which knows the ground; None before the first.
        poses: where robots are shown, if not at their starts. physical: the backends of physical robots.
    """
    seen = verdict or Verdict()
    starts = [entry.pose for entry in draft.players]
    bodies = [
        SceneBody(
            name=entry.name or str(number + 1),
            pose=pose,
            length=_size(entry.model)[0],
            width=_size(entry.model)[1],
            role=entry.role,
            state="",
            physical=entry.backend in physical,
            trail=(),
        )
        for number, (entry, pose) in enumerate(zip(draft.players, poses or starts, strict=True))
        if pose is not None and _on_map(pose, seen)
    ]
    return Scene(
        live=True,
        game=draft.game,
        bodies=tuple(bodies),
        zones=seen.zones,
        obstacles=seen.obstacles,
        starts=tuple((pose.x, pose.y) for pose in starts if pose is not None and _on_map(pose, seen)),
    )


def _on_map(pose: Pose, verdict: Verdict) -> bool:
    """Whether a robot can be shown: one far outside would make everything else small."""
    if verdict.bounds is None:
        return abs(pose.x) < 1e3 and abs(pose.y) < 1e3
    x_min, y_min, x_max, y_max = verdict.bounds.bounds
    return x_min - 3 <= pose.x <= x_max + 3 and y_min - 3 <= pose.y <= y_max + 3


def _size(model: str) -> tuple[float, float]:
    found = MODELS.find(model or DEFAULTS["model"])
    return UNKNOWN_SIZE if found is None else found.size


def ring_of(pose: Pose, model: str, view: View, ui: float) -> Pixel:
    """The middle of the ring before a robot, by which it is turned."""
    x, y = view.point(pose.x, pose.y)
    angle, arm = view.angle(pose.theta), max(ARM * ui, 0.9 * _size(model)[0] * view.scale + RING * ui)
    return x + arm * math.cos(angle), y - arm * math.sin(angle)


def grip_at(
    place: Pixel, draft: Draft, poses: Sequence[Pose | None], selected: int | None, view: View, ui: float
) -> tuple[int, bool] | None:
    """The player whose robot is at a pixel, and whether it is the ring that turns it; None if there is none.

    Args:
        selected: the player with the ring. What it has comes before what others have.
    """
    if selected is not None and selected < len(poses) and (own := poses[selected]) is not None:
        ring = ring_of(own, draft.players[selected].model, view, ui)
        if math.dist(place, ring) <= (RING + 4) * ui:
            return selected, True
    near = [
        (math.dist(place, view.point(pose.x, pose.y)), number) for number, pose in enumerate(poses) if pose is not None
    ]
    if not near:
        return None
    away, number = min(near)
    length, width = _size(draft.players[number].model)
    return (number, False) if away <= max(SMALLEST * ui, math.hypot(length, width) / 2 * view.scale) else None
