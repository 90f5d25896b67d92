"""The numbers that decide the calls, computed from the places of the calls and not as the rules found them."""

from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation
from vrg_games.harvest import REDS
from vrg_games.harvest.rules import Harvest


def prove(book: Harvest, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    call, rules = case.call, book.settings
    if call.rule == "home":
        (pose,) = call.poses
        inner = rules.length / 2 - rules.depot
        return [Measure("distance of the piece's middle from the middle line", abs(pose.x), Relation.AT_LEAST, inner)]
    if call.rule == "trespass":
        side = 1.0 if book.team_of(call.players[0]) == REDS else -1.0
        beyond = side * call.poses[0].x - (rules.length / 2 - rules.depot)
        return [Measure(f"how far {call.players[0]}'s middle is in the depot", beyond, Relation.AT_LEAST, 0.0)]
    if call.rule == "time_up":
        return [Measure("time of play", call.clock, Relation.AT_LEAST, rules.time, "s")]
    return []
