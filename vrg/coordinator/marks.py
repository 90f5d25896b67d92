"""Whether players are on the marks where they line up before a round."""

import math
from collections.abc import Mapping

from vrg.coordinator.rulebook import Field
from vrg.types import Pose

MARK_REACH = 0.4
"""The distance in m from its mark within which a player is lined up."""


def away(pose: Pose, mark: Pose) -> float:
    """The distance of a player from its mark, m."""
    return math.hypot(pose.x - mark.x, pose.y - mark.y)


def on_marks(marks: Mapping[str, Pose], now: Field) -> set[str]:
    """The players that are within MARK_REACH of their marks."""
    return {name for name, mark in marks.items() if name in now.poses and away(now.poses[name], mark) <= MARK_REACH}


def not_lined_up(marks: Mapping[str, Pose], now: Field) -> dict[str, str]:
    """The reasons why players do not yet stand still on their marks, by player."""
    reasons = {}
    for name, mark in marks.items():
        pose = now.poses.get(name)
        if pose is None:
            reasons[name] = "is not in the world"
        elif away(pose, mark) > MARK_REACH:
            reasons[name] = f"is {away(pose, mark):.1f} m from its mark"
        elif name in now.moving:
            reasons[name] = "is moving"
    return reasons
