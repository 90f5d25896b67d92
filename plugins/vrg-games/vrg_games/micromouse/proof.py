"""The numbers that decide the calls, computed from their poses and not as the rules found them."""

from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation
from vrg_games.micromouse.rules import Micromouse


def prove(book: Micromouse, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    call = case.call
    if call.rule == "time_up":
        return [Measure("time of play", call.clock, Relation.AT_LEAST, book.settings.time, "s")]
    if not call.poses:
        return []
    [pose], (name, region) = call.poses, ("middle", book.goal) if call.rule == "goal" else ("start cell", book.start)
    # The pose of a call is that in which the centre crosses the border.
    distance = abs(region.signed_distance(pose.x, pose.y))
    return [
        Measure(f"distance of {call.players[0]}'s centre from the border of the {name}", distance, Relation.AT_MOST, 0)
    ]
