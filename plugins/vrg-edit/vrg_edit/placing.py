"""The place of a new player, and the player that goes when there are to be fewer. Pure: no place is checked."""

import math
from collections import Counter
from collections.abc import Iterator

from vrg.games import game_of
from vrg.hal.models import MODELS
from vrg.regions import surrounding
from vrg.types import Pose, Vector
from vrg_edit.checking import CheckResult
from vrg_edit.draft import COLUMNS, Draft, Entry

APART = 1.1
"""The distance in m between the centres of a new robot and the others, where there is room for it."""
STEP = 0.5
"""The distance in m between two places that are tried."""
GAP = 0.05
"""The distance in m between outlines that is enough where there is less room."""
MAX_PLAYERS = 64
"""The number of players that can be asked for."""
UNKNOWN_SIZE = (0.5, 0.5)
"""The length and width in m of a robot whose model is not known."""


def robot_size(model: str) -> Vector:
    """The length and width of a robot, m; an empty name is that of the usual model."""
    found = MODELS.find(model or COLUMNS["model"])
    return UNKNOWN_SIZE if found is None else found.size


def with_count(draft: Draft, count: int, ground: CheckResult) -> Draft:
    """Return the draft with this many players, at least 1: the last ones go, or new ones come."""
    count = min(max(1, count), MAX_PLAYERS)
    while len(draft.players) > count:
        draft = fewer(draft)
    while len(draft.players) < count:
        draft = more(draft, ground)
    return draft


def more(draft: Draft, ground: CheckResult) -> Draft:
    """Return the draft with one more player, in the role that is short of players, near those of its role.

    Args:
        ground: what a check of the draft has found, now or before the last players came.
    """
    role = _short_of(draft)
    like = [entry for entry in draft.players if entry.role == role and entry.pose is not None]
    model = like[-1].model if like else ""
    return draft.add(Entry(draft.free_name(role), role, model, "", "", _place(draft, role, model, ground)))


def fewer(draft: Draft) -> Draft:
    """Return the draft without the last player of the role that has the most players for its part in the game."""
    shares, counts = _shares(draft.game), Counter(entry.role for entry in draft.players)
    role = max(counts, key=lambda role: (counts[role] > 1, (counts[role] - 0.5) / max(1, shares[role])))
    return draft.remove([max(i for i, entry in enumerate(draft.players) if entry.role == role)])


def _shares(game: str) -> Counter[str]:
    """The number of players of each role in the default match of a game."""
    found = game_of(game)
    if not found.name:
        return Counter()
    return Counter(entry.role for entry in Draft.of_game(game, found.default_match().parent).players)


def _short_of(draft: Draft) -> str:
    """The role that has the fewest players for its part in the game, by the method of Sainte-Laguë.

    A role that the default match has not, as it may need another robot, is for a person to choose.
    """
    game, shares = game_of(draft.game), _shares(draft.game)
    counts = Counter(entry.role for entry in draft.players)
    usual = [role for role in game.start_roles if shares[role]]
    roles = usual or game.start_roles or tuple(counts) or ("",)
    return min(roles, key=lambda role: (counts[role] + 0.5) / max(1, shares[role]))


def _place(draft: Draft, role: str, model: str, ground: CheckResult) -> Pose | None:
    """A free place in the same zones as a player of the same role, as near to all of those as can be; None if none."""
    placed = [(entry, entry.pose) for entry in draft.players if entry.pose is not None]
    near = [pose for entry, pose in placed if entry.role == role] or [pose for _, pose in placed]
    near = [pose for pose in near if _inside(ground, (pose.x, pose.y), 0.0)] or [Pose(*_middle(ground), 0.0)]
    zones = {_zones(ground, (pose.x, pose.y)) for pose in near}
    radius = math.hypot(*robot_size(model)) / 2
    others = [(pose.x, pose.y, radius + math.hypot(*robot_size(entry.model)) / 2 + GAP) for entry, pose in placed]
    lattice = _lattice(ground, near)
    for least in (APART, 0.0):
        for place in lattice:
            apart = all(math.dist(place, (x, y)) >= max(least, room) for x, y, room in others)
            # What takes longest comes last.
            if apart and _zones(ground, place) in zones and _inside(ground, place, radius):
                return Pose(*place, _heading(ground, place, near))
    return None


def _lattice(ground: CheckResult, near: list[Pose]) -> list[Vector]:
    """Places all over the ground, those first that are nearest to the middle of `near`."""
    boxes = [zone.region.bounds for zone in ground.zones] + [(p.x - 8, p.y - 8, p.x + 8, p.y + 8) for p in near]
    x_min, y_min, x_max, y_max = surrounding(boxes)
    step = max(STEP, (x_max - x_min) / 100, (y_max - y_min) / 100)

    def along(low: float, start: float, high: float) -> Iterator[float]:
        first = start - math.floor((start - low) / step) * step
        return (first + i * step for i in range(math.floor((high - first) / step) + 1))

    centre = (sum(p.x for p in near) / len(near), sum(p.y for p in near) / len(near))
    ys = list(along(y_min, near[0].y, y_max))
    return sorted(((x, y) for x in along(x_min, near[0].x, x_max) for y in ys), key=lambda p: math.dist(p, centre))


def _heading(ground: CheckResult, at: Vector, near: list[Pose]) -> float:
    """That of the nearest of `near`; outside all zones, the direction to their middle."""
    if ground.zones and not _zones(ground, at):
        x_min, y_min, x_max, y_max = surrounding(zone.region.bounds for zone in ground.zones)
        return math.atan2((y_min + y_max) / 2 - at[1], (x_min + x_max) / 2 - at[0])
    return min(near, key=lambda pose: math.dist(at, (pose.x, pose.y))).theta


def _zones(ground: CheckResult, at: Vector) -> frozenset[str]:
    """The names of the zones that a place is in."""
    return frozenset(zone.name for zone in ground.zones if zone.region.contains(*at))


def _inside(ground: CheckResult, at: Vector, radius: float) -> bool:
    """True if a robot of this radius is within the bounds of the map, m, and touches no wall."""
    bounded = ground.bounds is None or ground.bounds.signed_distance(*at) <= -radius
    return bounded and all(obstacle.distance(*at) > radius for obstacle in ground.obstacles)


def _middle(ground: CheckResult) -> Vector:
    return (0.0, 0.0) if ground.bounds is None else ground.bounds.middle
