"""The numbers that decide the calls, computed from the poses of the calls and not as the rules found them."""

import math
from collections.abc import Sequence

from lion_and_man.rules import LionAndMan
from vrg.coordinator.proof import Case, Measure, Relation, outside


def prove(book: LionAndMan, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    call, settings = case.call, book.settings
    if call.rule == "caught":
        man, lion = ((pose.x, pose.y) for pose in call.poses)
        what = "distance between the centres of the man and the lion"
        return [Measure(what, math.dist(man, lion), Relation.AT_MOST, settings.capture_distance, ends=(man, lion))]
    if call.rule == "out":
        name = call.players[0]
        return [outside(f"distance of {name}'s centre outside the arena", settings.arena, case.now.poses[name])]
    if call.rule == "time_up":
        return [Measure("time of play", call.clock, Relation.AT_LEAST, settings.time, "s")]
    return []
