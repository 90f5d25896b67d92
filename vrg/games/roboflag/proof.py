"""The numbers that decide the calls of RoboFlag."""

import math
from collections.abc import Sequence

from vrg.coordinator.proof import ROUNDING, Case, Measure, Relation
from vrg.coordinator.rulebook import away
from vrg.games.roboflag import FLAGGED, other
from vrg.games.roboflag.judging import near
from vrg.games.roboflag.rules import RoboFlag
from vrg.geometry import interpolate
from vrg.segments import NEVER
from vrg.types import Pose, Vector


def prove(book: RoboFlag, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    players, poses = case.call.players, case.call.poses
    team = book.teams.get(players[0], "") if players else ""
    match case.call.rule:
        case "tag":
            found = _tag(book, case)
        case "home" | "capture":
            home = book.layout.home(team)
            what = f"distance of {players[0]}'s centre from the corner of its home zone"
            found = [_distance(what, poses[0], (home.x, home.y), book.layout.home_reach)]
        case "flag":
            place, opponents = book.layout.flag(other(team)), other(team)
            what = f"distance of {players[0]}'s centre from the flag of {opponents}"
            found = [_distance(what, poses[0], place, book.layout.flag_reach)]
        case "time":
            limit = book.time_limit(case.state)
            found = [Measure("time of play in this round", case.call.clock, Relation.AT_LEAST, limit, "s")]
        case _:
            found = []
    return found


def _tag(book: RoboFlag, case: Case) -> list[Measure]:
    (name, *taggers), (here, *theirs) = case.call.players, case.call.poses
    reach, found = book.layout.tag_distance, []
    ways = {n: case.now.way(n, case.before) for n in case.call.players}
    later = any(away(here, pose) <= reach + ROUNDING for pose in theirs)
    for by, pose in zip(taggers, theirs, strict=True):
        ends = here, pose
        if later and away(here, pose) > reach + ROUNDING:
            a, b = [((was.x, was.y), (now.x, now.y)) for was, now in (ways[name], ways[by])]
            # The poses of the call are those of the first tag; this opponent comes near enough after it.
            if (stretch := near(*a, *b, reach)) != NEVER:
                ends = interpolate(*ways[name], stretch[0]), interpolate(*ways[by], stretch[0])
        what = f"distance between the centres of {name} and {by}"
        found.append(_distance(what, ends[0], (ends[1].x, ends[1].y), reach))
    if case.state.states[name] != FLAGGED:
        ours = book.layout.half(book.teams[name])
        opponents = book.layout.half(other(book.teams[name]))
        beyond = abs(here.x - book.layout.midline)
        inside = ours.contains(here.x, here.y) and not opponents.contains(here.x, here.y)
        what = f"distance of {name}'s centre beyond the midline"
        line = ((here.x, here.y), (book.layout.midline, here.y))
        found.append(Measure(what, -beyond if inside else beyond, Relation.AT_LEAST, 0, ends=line))
    for zone in book.layout.flag_zones():
        between = math.dist((here.x, here.y), (zone.x, zone.y))
        if between < 2 * zone.radius:
            what = f"distance of {name}'s centre from the middle of a flag zone, where it would be safe"
            found.append(
                Measure(what, between, Relation.MORE_THAN, zone.radius, ends=((here.x, here.y), (zone.x, zone.y)))
            )
    return found


def _distance(what: str, pose: Pose, place: Vector, limit: float) -> Measure:
    here = (pose.x, pose.y)
    return Measure(what, math.dist(here, place), Relation.AT_MOST, limit, ends=(here, place))
