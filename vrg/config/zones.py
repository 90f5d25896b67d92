"""Whether the zones of a game fit onto a map."""

from collections.abc import Sequence
from typing import Any

from vrg.bus.messages import LARGE_ZONES
from vrg.coordinator.rulebook import RuleBook
from vrg.errors import Problem
from vrg.hal.sim.config import WorldConfig
from vrg.hal.sim.map import Map, load_map
from vrg.regions import Polygon, touch


def zone_problems(book: RuleBook[Any], world: WorldConfig) -> list[Problem]:
    """The zones, except for large ones, that are not free of walls or that reach out of the map's bounds."""
    map_ = load_map(world.map)
    found = []
    for zone in book.zones(book.initial()):
        if zone.kind in LARGE_ZONES or _is_free(map_, zone.region.outline()):
            continue
        x_min, y_min, x_max, y_max = zone.region.bounds
        text = (
            f"the {zone.name} zone, x {x_min:g} to {x_max:g}, y {y_min:g} to {y_max:g}, "
            f"must be free of walls and obstacles and inside the bounds of map {map_.name!r}"
        )
        found.append(Problem(text, ("rules",)))
    return found


def _is_free(map_: Map, outline: Sequence[tuple[float, float]]) -> bool:
    region = Polygon(tuple(outline))
    inside = all(map_.bounds.contains(x, y) for x, y in outline)
    # A zone may touch a wall, so the obstacles are made a little smaller.
    return inside and not any(touch(region, obstacle.shrunk(1e-6)) for obstacle in map_.obstacles)
