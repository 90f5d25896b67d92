"""The numbers that decide the calls, computed from the places of the calls and not as the rules found them."""

import math
from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation
from vrg.geometry import corners
from vrg.regions import Polygon
from vrg_games.soccer import BALL, BLUES, REDS
from vrg_games.soccer.rules import NEAR, REPEATED, TOUCH, Soccer


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
    if call.rule == "foul":
        at, pose, name = case.now.things[ball.name].pose, call.poses[0], call.players[0]
        if len(call.poses) == 2:
            far = math.dist((at.x, at.y), (pose.x, pose.y))
            return [Measure("distance of who is pushed from the ball", far, Relation.AT_MOST, NEAR)]
        outline = Polygon(tuple(corners(pose, *book.contestants[name].size)))
        gap = outline.signed_distance(at.x, at.y) - ball.radius
        measures = [Measure(f"distance between {name} and the ball", gap, Relation.AT_MOST, TOUCH)]
        if case.state.kick in ("", book.team_of(name)):
            far = min(rules.area_of(team).signed_distance(at.x, at.y) for team in (REDS, BLUES))
            what = "how far the middle of the ball is outside the defence area"
            measures.append(Measure(what, far, Relation.AT_MOST, 0.0))
        return measures
    if call.rule == "no_progress" and case.state.fouls < REPEATED:
        stuck = call.clock - case.state.since
        return [Measure("time without progress", stuck, Relation.AT_LEAST, rules.stuck, "s")]
    if call.rule == "time_up":
        played = case.state.played + call.clock
        return [Measure("time of play in the match", played, Relation.AT_LEAST, rules.time, "s")]
    return []
