"""The numbers that decide the calls of both games."""

import math
from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation, outside
from vrg_games.pursuit.rules import Hunt


def prove(book: Hunt, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    call, settings, port = case.call, book.settings, book.settings.port
    match call.rule:
        case "caught":
            one, other = ((pose.x, pose.y) for pose in call.poses)
            what = f"distance between the centres of {' and '.join(call.players)}"
            limit = settings.capture_distance
            return [Measure(what, math.dist(one, other), Relation.AT_MOST, limit, ends=(one, other))]
        case "out":
            name = call.players[0]
            return [outside(f"distance of {name}'s centre outside the field", settings.field, case.now.poses[name])]
        case "home" if port is not None:
            what, pose = f"distance of {call.players[0]}'s centre from the harbour", call.poses[0]
            return [Measure(what, port.distance(pose.x, pose.y), Relation.AT_MOST, 0)]
        case "time_up":
            return [Measure("time of play in this round", call.clock, Relation.AT_LEAST, settings.time, "s")]
    return []
