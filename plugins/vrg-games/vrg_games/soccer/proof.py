"""The numbers that decide the calls, computed from the places of the calls and not as the rules found them."""

import math
from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation
from vrg_games.soccer import BALL
from vrg_games.soccer.rules import NEAR, Soccer


def prove(book: Soccer, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    call, rules = case.call, book.settings
    ball = next(body for body in book.bodies.values() if body.kind == BALL)
    if call.rule in ("goal", "free_kick"):
        (where,) = call.poses
        beyond = max(abs(where.x) - rules.length / 2, abs(where.y) - rules.width / 2)
        what = "how far the middle of the ball is over the line"
        measures = [Measure(what, beyond, Relation.AT_LEAST, ball.radius)]
        if call.rule == "goal":
            what = "distance from the middle of the goal"
            measures.append(Measure(what, abs(where.y), Relation.AT_MOST, rules.goal / 2))
        return measures
    if call.rule == "foul" and len(call.poses) == 2:
        at, pose = case.now.things[ball.name].pose, call.poses[0]
        far = math.dist((at.x, at.y), (pose.x, pose.y))
        return [Measure("distance of who is pushed from the ball", far, Relation.AT_MOST, NEAR)]
    if call.rule == "time_up":
        played = case.state.played + call.clock
        return [Measure("time of play in the match", played, Relation.AT_LEAST, rules.time, "s")]
    return []
