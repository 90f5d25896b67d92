"""The numbers that decide the calls of robot pursuit-evasion."""

import math
from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation, outside
from vrg.games.pursuit_evasion.crossing import COURSE_REACH
from vrg.games.pursuit_evasion.rules import TOUCH_DISTANCE, PursuitEvasion
from vrg.games.pursuit_evasion.seeing import SIGHTING_REACH
from vrg.geometry import nearest_points, outline_distance
from vrg.portable.scalars import cos_sin
from vrg.types import Pose, Vector


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
        case "missed":
            name = call.players[0]
            found = [outside(f"distance of {name}'s centre outside the area", book.area, call.poses[0])]
        case "off_course":
            name, place = call.players[0], (call.poses[0].x, call.poses[0].y)
            ends = _foot(case.state.courses[name].pose, place), place
            what = f"distance of {name} from its course"
            found = [Measure(what, math.dist(*ends), Relation.MORE_THAN, COURSE_REACH, ends=ends)]
        case "slow":
            name, place = call.players[0], (call.poses[0].x, call.poses[0].y)
            line, (since, past) = case.state.courses[name].pose, case.state.courses[name].mark
            then = past.x, past.y
            (x, y), (x0, y0), (c, s) = _foot(line, place), _foot(line, then), cos_sin(line.theta)
            way = (x - x0) * c + (y - y0) * s
            least = book.least_way(name, case.call.clock - since)
            what = f"distance of {name} along its course in the last {case.call.clock - since:.1f} s"
            found = [Measure(what, way, Relation.AT_MOST, least, ends=(then, place))]
        case "collision":
            name, other = call.players
            bodies = call.poses[0], case.now.poses[other], book.contestants[name].size, book.contestants[other].size
            what, gap = f"distance between the outlines of {name} and {other}", outline_distance(*bodies)
            found = [Measure(what, gap, Relation.AT_MOST, TOUCH_DISTANCE, ends=nearest_points(*bodies))]
        case "false_alarm":
            found = [_false_alarm(case)]
        case "launch":
            name = call.players[0]
            found = [Measure("time of play", call.clock, Relation.AT_LEAST, book.launches[name], "s")]
        case "time_up":
            found = [Measure("time of play", call.clock, Relation.AT_LEAST, book.settings.time, "s")]
        case _:
            found = []
    return found


def _foot(line: Pose, place: Vector) -> Vector:
    """The point of a line that is nearest to a place, m."""
    c, s = cos_sin(line.theta)
    way = (place[0] - line.x) * c + (place[1] - line.y) * s
    return line.x + way * c, line.y + way * s


def _false_alarm(case: Case) -> Measure:
    """The largest distance of the reported sightings from the robot that was nearest at that time."""
    who, gaps = case.call.players[0], []
    looks = [*((look.time, look.poses) for look in case.state.looks), (case.now.time, case.now.poses)]
    for sighting in (each for name, each in case.now.sightings if name == who):
        poses = min(looks, key=lambda look: abs(look[0] - sighting.time))[1]
        there, here = (sighting.x, sighting.y), [(p.x, p.y) for name, p in poses.items() if name != who]
        gaps.append(min((math.dist(there, place), there, place) for place in here))
    gap, there, place = max(gaps)
    what = f"distance from what {who} reported to the nearest robot then"
    return Measure(what, gap, Relation.MORE_THAN, SIGHTING_REACH, ends=(there, place))
