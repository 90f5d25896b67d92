"""The numbers that decide the calls of sumo."""

import math
from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation, outside
from vrg_games.sumo.rules import AT_ONCE, LEAD, STOOD, Sumo


def prove(book: Sumo, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    call, ring = case.call, book.settings.ring
    match call.rule:
        case "out":
            where = {name: case.now.poses[name] for name in call.players}
            return [outside(f"distance of {name}'s centre outside the ring", ring, at) for name, at in where.items()]
        case "standstill" | "yusei" | "locked":
            return _stood(book, case) + _lead(book, case)
        case "time_up":
            return [Measure("time of play in this bout", call.clock, Relation.AT_LEAST, book.settings.time, "s")]
    return []


def _stood(book: Sumo, case: Case) -> list[Measure]:
    """How long each player of the call has stood, and within what distance."""
    call, found = case.call, list[Measure]()
    stops = {name: case.state.stops[name] for name in call.players}  # nobody has got ahead at the look of the call
    first = min(stop.since for stop in stops.values())
    for name, stop in stops.items():
        pose = case.now.poses[name]
        ends = (stop.x, stop.y), (pose.x, pose.y)
        least = book.settings.standstill - (0.0 if stop.since == first else AT_ONCE)
        found += [
            Measure(f"way that {name} has got ahead", math.dist(*ends), Relation.AT_MOST, STOOD, ends=ends),
            Measure(f"time for which {name} has stood", call.clock - stop.since, Relation.AT_LEAST, least, "s"),
        ]
    return found


def _lead(book: Sumo, case: Case) -> list[Measure]:
    """How much deeper in the ring one stands than the other, where both stand."""
    call, ring = case.call, book.settings.ring
    if call.rule == "standstill":
        return []
    outer, inner = (ring.depth(pose.x, pose.y) for pose in call.poses)
    if call.rule == "locked":
        return [Measure("difference of their distances from the edge", abs(inner - outer), Relation.AT_MOST, LEAD)]
    return [Measure(f"way that {call.players[1]} is deeper in the ring", inner - outer, Relation.AT_LEAST, LEAD)]
