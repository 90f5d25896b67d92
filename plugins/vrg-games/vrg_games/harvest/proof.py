"""The numbers that decide the calls, computed from the places of the calls and not as the rules found them."""

from collections.abc import Sequence

from vrg.bus.messages import Thing
from vrg.coordinator.proof import Case, Measure, Relation
from vrg.geometry import compose
from vrg.hal.sim.config import BodySetup
from vrg.types import Pose
from vrg_games.harvest import BLUES, OTHER, REDS
from vrg_games.harvest.rules import Harvest


def prove(book: Harvest, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    call, rules = case.call, book.settings
    pieces = {name: thing for name, thing in case.now.things.items() if name in book.pieces}
    outside = {name: how_far_outside(book, book.pieces[name], thing) for name, thing in pieces.items()}
    if call.rule in ("home", "taken"):
        name = next(name for name, thing in pieces.items() if thing.pose == call.poses[0])
        relation = Relation.AT_MOST if call.rule == "home" else Relation.MORE_THAN
        return [Measure(f"how far a part of {name} is outside the depot", outside[name], relation, 0.0)]
    if call.rule == "all_home":
        home = sum(far <= 0.0 for far in outside.values())
        return [Measure("pieces in depots", home, Relation.AT_LEAST, len(book.pieces), "")]
    if call.rule == "trespass":
        (name,), (pose,) = call.players, call.poses
        depot = rules.depot_of(OTHER[book.team_of(name)])
        far = depot.signed_distance(pose.x, pose.y)
        return [Measure(f"how far {name}'s middle is outside the depot", far, Relation.AT_MOST, 0.0)]
    if call.rule == "time_up":
        return [Measure("time of play", call.clock, Relation.AT_LEAST, rules.time, "s")]
    return []


def how_far_outside(book: Harvest, piece: BodySetup, thing: Thing) -> float:
    """How far the farthest part of a piece is outside the nearest depot, m; negative or 0 if all of it is inside."""
    rim = [compose(thing.pose, Pose(*corner, 0.0)) for corner in piece.corners] or [thing.pose]
    depots = [book.settings.depot_of(team) for team in (REDS, BLUES)]
    return piece.radius + min(max(depot.signed_distance(point.x, point.y) for point in rim) for depot in depots)
