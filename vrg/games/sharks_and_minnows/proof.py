"""The numbers that decide the calls of Sharks and Minnows."""

from collections.abc import Sequence

from vrg.coordinator.proof import Case, Measure, Relation, outside
from vrg.games.sharks_and_minnows.rules import SharksAndMinnows
from vrg.geometry import nearest_points, outline_distance


def prove(book: SharksAndMinnows, case: Case) -> Sequence[Measure]:
    """The numbers that decided a call; see `vrg.coordinator.proof.Prover`."""
    match case.call.rule:
        case "tag":
            found = _tag(book, case)
        case "out_of_bounds":
            found = _out(book, case)
        case "pass_limit":
            what = f"distance of {case.call.players[0]}'s centre from the safe zone"
            found = [Measure("time of play in this pass", case.call.clock, Relation.AT_LEAST, book.pass_limit, "s")]
            # A minnow that the world does not report is late, too.
            found += [outside(what, book.safe_zone(case.state), pose) for pose in case.call.poses]
        case "pass_over":
            zone = book.safe_zone(case.state)
            away = max((zone.distance(pose.x, pose.y) for pose in case.call.poses), default=0.0)
            what = "greatest distance from the safe zone of the centre of a minnow that is left"
            found = [Measure(what, away, Relation.AT_MOST, 0)]
        case _:
            found = []
    return found


def _tag(book: SharksAndMinnows, case: Case) -> list[Measure]:
    minnow, *sharks = case.call.players
    here, *theirs = case.call.poses
    size = book.contestants[minnow].size
    found = []
    for shark, pose in zip(sharks, theirs, strict=True):
        own = book.contestants[shark].size
        found.append(
            Measure(
                f"distance between the outlines of {minnow} and {shark}",
                outline_distance(here, pose, size, own),
                Relation.AT_MOST,
                book.settings.tag_distance,
                ends=nearest_points(here, pose, size, own),
            )
        )
    what = f"distance of {minnow}'s centre from the safe zone, where it would be safe"
    found.append(outside(what, book.safe_zone(case.state), here))
    return found


def _out(book: SharksAndMinnows, case: Case) -> list[Measure]:
    name = case.call.players[0]
    return [outside(f"distance of {name}'s centre outside the field", book.settings.field, case.now.poses[name])]
