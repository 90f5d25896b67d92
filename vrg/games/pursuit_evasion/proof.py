"""The numbers that decide the calls of robot pursuit-evasion."""

import math
from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation, outside
from vrg.games.pursuit_evasion.rules import PursuitEvasion


def prove(book: PursuitEvasion, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    call = case.call
    match call.rule:
        case "capture":
            (intruder, pursuer), (here, there) = call.players, call.poses
            ends = (here.x, here.y), (there.x, there.y)
            what = f"distance between the centres of {intruder} and {pursuer}"
            # The call tells the instant at which the two came as near as the limit: at once after it they are closer.
            found = [Measure(what, math.dist(*ends), Relation.AT_MOST, book.settings.capture_distance, ends=ends)]
        case "escape":
            name = call.players[0]
            found = [outside(f"distance of {name}'s centre outside the area", book.area, case.now.poses[name])]
        case "launch":
            name = call.players[0]
            found = [Measure("time of play", call.clock, Relation.AT_LEAST, book.launches[name], "s")]
        case "time_up":
            found = [Measure("time of play", call.clock, Relation.AT_LEAST, book.settings.time, "s")]
        case _:
            found = []
    return found
