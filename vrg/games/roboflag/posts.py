"""Assigns the defenders of a team: some tag an opponent, the others stand at posts. Pure functions of a situation."""

import math
from collections.abc import Mapping, Sequence

from vrg.games.roboflag.situation import Known, Situation
from vrg.geometry import ahead
from vrg.portable.scalars import asin, atan2, total
from vrg.types import Vector, quantised

LOYALTY = 0.8
"""The factor by which the way of a player to its announced target counts less."""
MAX_CHASERS = 2
"""The number of players that go for an opponent that carries the flag."""
POST_DISTANCE = 0.3
"""The distance in m from the flag zone at which defenders stand."""
POST_CLEARANCE = 0.3
"""The distance in m between the circles around two defenders at their posts."""
ALL_ROUND = 0.9
"""The angle in rad between the posts of defenders that have no opponent to face."""


def targets(s: Situation, defenders: Sequence[Known], threats: Sequence[Known]) -> dict[str, Known]:
    """The opponent that each defender tags: the shortest ways first. A defender that is not in the result tags none."""
    wanted = {t.name: MAX_CHASERS if t.name == s.thief else 1 for t in threats}
    pairs = sorted(
        (quantised(d.away(t.place) * (LOYALTY if s.targets.get(d.name) == t.name else 1.0)), d.name, t.name)
        for d in defenders
        for t in threats
    )
    by_name = {threat.name: threat for threat in threats}
    found: dict[str, Known] = {}
    for _, defender, threat in pairs:
        if defender not in found and wanted[threat]:
            found[defender] = by_name[threat]
            wanted[threat] -= 1
    return found


def posts(s: Situation, guards: Sequence[Known]) -> dict[str, Vector]:
    """The posts of the guards: around the own flag zone, between the flag and the nearest opponents.

    Guards keep their order around the flag, so that their ways do not cross.
    """
    ground = s.ground
    radius = ground.own_zone.radius + POST_DISTANCE
    front = 0.0 if ground.ahead > 0 else math.pi
    flag = ground.own_flag

    def bearing(place: Vector) -> float:
        """The direction from the flag to a place, rad, relative to the direction of the opponents' half."""
        return math.remainder(atan2(place[1] - flag[1], place[0] - flag[0]) - front, math.tau)

    facing = sorted(s.hunters, key=lambda known: (known.away(flag), known.name))[: len(guards)]
    bearings = [bearing(known.place) for known in facing]
    free = len(guards) - len(bearings)
    bearings += [ALL_ROUND * (i - (free - 1) / 2) for i in range(free)]
    half = max((guard.radius for guard in guards), default=0.0) + POST_CLEARANCE / 2
    apart = min(2.0 * asin(min(1.0, half / radius)), math.tau / 8)
    spread = _spread(sorted(bearings), apart)
    order = sorted(guards, key=lambda guard: (bearing(guard.place), guard.name))
    return {guard.name: ahead(*flag, front + angle, radius) for guard, angle in zip(order, spread, strict=True)}


def shields(s: Situation, escorts: Sequence[Known], carrier: Known) -> dict[str, tuple[Vector, str]]:
    """The place of each escort: between the carrier and an opponent near it, with the opponent's name; the nearest
    first.

    An escort for whom no opponent is left is not in the result.
    """
    left = list(escorts)
    found: dict[str, tuple[Vector, str]] = {}
    for hunter in sorted(s.hunters, key=lambda known: (known.away(carrier.place), known.name)):
        if not left:
            break
        distance = math.dist(hunter.place, carrier.place) or 1.0
        share = max(0.5, 1.0 - (hunter.radius + carrier.radius) / distance)
        x, y = (c + (h - c) * share for c, h in zip(carrier.place, hunter.place, strict=True))
        escort = min(left, key=lambda known: (known.away((x, y)), known.name))
        left.remove(escort)
        found[escort.name] = ((x, y), hunter.name)
    return found


def known_in(names: Sequence[str], players: Sequence[Known]) -> list[Known]:
    """The players of these names, in the order of the names."""
    by_name: Mapping[str, Known] = {player.name: player for player in players}
    return [by_name[name] for name in names if name in by_name]


def _spread(bearings: list[float], apart: float) -> list[float]:
    """Sorted angles, moved so that neighbours are at least `apart` from one another, about their common middle.

    The circle is cut open at the widest gap between two of them.
    """
    if len(bearings) < 2:
        return bearings
    first = max(range(len(bearings)), key=lambda i: quantised((bearings[i] - bearings[i - 1]) % math.tau))
    opened = [*bearings[first:], *(angle + math.tau for angle in bearings[:first])]
    pushed = [opened[0]]
    for angle in opened[1:]:
        pushed.append(max(angle, pushed[-1] + apart))
    shift = (total(pushed) - total(opened)) / len(pushed)
    moved = [angle - shift for angle in pushed]
    return [*moved[-first:], *moved[:-first]] if first else moved
