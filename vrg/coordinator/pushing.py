"""Players that opponents push: who they are, and where they are judged meanwhile. Pure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from vrg.bus.messages import Body
from vrg.coordinator.rulebook import Contestant, Observation, away
from vrg.geometry import outline_distance
from vrg.types import Pose

PUSH = 0.005
"""The distance in m between two looks beyond which a robot has moved whose wheels stand."""
TOUCH = 0.05
"""The distance in m between the outlines of two robots at which one may push the other."""
PUSH_GRACE = 5.0
"""The time of play in s after a push in which a player is not called for being where it was pushed to."""

Pushed = Mapping[str, tuple[Pose, float]]
"""The players that were pushed away, each with where it stood and the time of play up to which it is judged there."""


def moved(bodies: Mapping[str, Body], before: Observation) -> list[str]:
    """The players that have moved since the look before, although their wheels have stood since then."""
    return [
        name
        for name, body in bodies.items()
        if body.stands is not None
        and body.stands <= before.time
        and name in before.poses
        and away(before.poses[name], body.pose) > PUSH
    ]


def touched(name: str, opponents: Sequence[str], now: Observation, contestants: Mapping[str, Contestant]) -> bool:
    """True if an opponent touches a player's robot."""
    pose, size = now.poses[name], contestants[name].size
    return any(outline_distance(pose, now.poses[n], size, contestants[n].size) <= TOUCH for n in opponents)


def judged_at(
    pushed: Pushed,
    put: Sequence[str],
    before: Observation,
    now: Observation,
    clock: float,
    called: Callable[[str, tuple[Observation, Observation]], bool],
) -> tuple[dict[str, tuple[Pose, float]], tuple[Observation, Observation]]:
    """The players that are judged where they stood when they were pushed, and the two observations by which play is
    judged.

    This ends as soon as no opponent pushes it and the rules allow its place, or after PUSH_GRACE.

    Args:
        put: the players that were put where they are now. before, now: the fields at the look before, and now.
        clock: the time of play, s.
        called: whether the rules make a call about a player by two fields.
    """
    kept = {**pushed, **{n: (pushed[n][0] if n in pushed else before.poses[n], clock + PUSH_GRACE) for n in now.pushed}}
    here = list(put)
    for name in sorted(kept.keys() - now.pushed):
        others = {n: stood for n, stood in kept.items() if n != name}
        if kept[name][1] > clock and called(name, _stood(others, before, now, [*here, name])):
            continue
        kept = others
        here.append(name)
    return kept, _stood(kept, before, now, here)


def _stood(
    pushed: Pushed, before: Observation, now: Observation, here: Sequence[str]
) -> tuple[Observation, Observation]:
    """The two fields with the pushed where they stood, and others where they are now in both."""
    stood = {name: pose for name, (pose, _) in pushed.items() if name in now.poses}
    arrived = {name: now.poses[name] for name in here if name in now.poses}
    if not (stood or arrived):
        return before, now
    return replace(before, poses={**before.poses, **arrived, **stood}), replace(now, poses={**now.poses, **stood})
