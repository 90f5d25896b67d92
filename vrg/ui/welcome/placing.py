"""Where a new player goes, and which player goes when there are to be fewer. Pure functions of drafts."""

import math
from collections import Counter
from collections.abc import Iterator

from vrg.games import game_of
from vrg.regions import Bounds, surrounding
from vrg.types import Pose
from vrg.ui.welcome.checking import Check, Verdict
from vrg.ui.welcome.draft import Draft, Entry

APART = 1.1
"""The distance in m between the centres of new robots and others."""
TRIES = 60
"""How many places are checked for a new player at most."""
MOST = 64
"""The number of players that can be asked for."""


def with_count(draft: Draft, count: int, check: Check) -> Draft:
    """Return the draft with so many players, at least 1: the last ones go, or new ones come."""
    count = min(max(1, count), MOST)
    while len(draft.players) > count:
        draft = fewer(draft)
    while len(draft.players) < count:
        draft = more(draft, check)
    return draft


def more(draft: Draft, check: Check) -> Draft:
    """Return the draft with one more player, in the role that is short of players, where the rules allow it.

    If no place is good, the one with the fewest problems is taken, and the problems tell what is wrong.
    """
    role = _short_of(draft)
    like = [entry for entry in draft.players if entry.role == role and entry.pose is not None]
    model = like[-1].model if like else ""
    now = check(draft)
    before = set(map(str, now.problems))
    best: tuple[int, Draft] | None = None
    for number, pose in enumerate(_places(draft, role, now)):
        found = draft.add(Entry(draft.free_name(role), role, model, "", "", pose))
        new = sum(str(problem) not in before for problem in check(found).problems)
        if best is None or new < best[0]:
            best = new, found
        if new == 0 or number + 1 >= TRIES:
            break
    return best[1] if best else draft.add(Entry(draft.free_name(role), role, model, "", "", None))


def fewer(draft: Draft) -> Draft:
    """Return the draft without the last player of the role that has the most players for its part in the game."""
    shares, counts = _shares(draft.game), Counter(entry.role for entry in draft.players)
    role = max(counts, key=lambda role: (counts[role] > 1, (counts[role] - 0.5) / max(1, shares[role])))
    return draft.remove(max(i for i, entry in enumerate(draft.players) if entry.role == role))


def _shares(game: str) -> Counter[str]:
    """How many players each role has in the default match of a game."""
    found = game_of(game)
    if not found.name:
        return Counter()
    return Counter(entry.role for entry in Draft.of_game(game, found.default_match().parent).players)


def _short_of(draft: Draft) -> str:
    """The role that has the fewest players for its part in the game, by the method of Sainte-Laguë."""
    game, shares = game_of(draft.game), _shares(draft.game)
    counts = Counter(entry.role for entry in draft.players)
    roles = game.start_roles or tuple(counts) or ("",)
    return min(roles, key=lambda role: (counts[role] + 0.5) / max(1, shares[role]))


def _places(draft: Draft, role: str, verdict: Verdict) -> Iterator[Pose]:
    """Places for a player of a role that are apart from all others: near its team mates first, then anywhere."""
    poses = [entry.pose for entry in draft.players if entry.pose is not None]
    like = [entry.pose for entry in draft.players if entry.role == role and entry.pose is not None]
    near = like or poses or [Pose(0.0, 0.0, 0.0)]
    centre = (sum(p.x for p in near) / len(near), sum(p.y for p in near) / len(near))
    ring = [
        Pose(p.x + APART * dx, p.y + APART * dy, p.theta)
        for p in near
        for dx in range(-2, 3)
        for dy in range(-2, 3)
        if dx or dy
    ]
    ring.sort(key=lambda p: math.dist((p.x, p.y), centre))
    x_min, y_min, x_max, y_max = _reach(verdict, poses)
    step = max(APART, (x_max - x_min) / 12, (y_max - y_min) / 12)
    ring += [
        Pose(x_min + step * (i + 0.5), y_min + step * (j + 0.5), near[0].theta)
        for j in range(int((y_max - y_min) / step))
        for i in range(int((x_max - x_min) / step))
    ]
    for pose in ring:
        apart = all(math.dist((pose.x, pose.y), (other.x, other.y)) >= 0.95 * APART for other in poses)
        inside = verdict.bounds is None or verdict.bounds.contains(pose.x, pose.y)
        walled = any(obstacle.contains(pose.x, pose.y) for obstacle in verdict.obstacles)
        if apart and inside and not walled:
            yield pose


def _reach(verdict: Verdict, poses: list[Pose]) -> Bounds:
    """The part of the plane in which places are looked for."""
    boxes = [zone.region.bounds for zone in verdict.zones] or [(p.x, p.y, p.x, p.y) for p in poses]
    return surrounding(boxes or [(-3.0, -3.0, 3.0, 3.0)])
