"""Several unknown robots at once: each sighting goes to the robot that it is of."""

import math
import random
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.agents.perception.line import fitted
from vrg.agents.perception.tracking import FORGET, FORGET_ONCE, TRACK_LENGTH, Track, Tracker
from vrg.bus.messages import Sighting
from vrg.types import Vector

SPEED = 0.5


def tell(tracker: Tracker, scan: Sequence[Sighting]) -> None:
    """The tracker is told of a scan as soon as it was made."""
    tracker.update(scan, max((each.time for each in scan), default=0.0))


def sighting(x: float, y: float, time: float, xx: float = 0.01, xy: float = 0.0, yy: float = 0.01) -> Sighting:
    return Sighting(x=x, y=y, time=time, xx=xx, xy=xy, yy=yy)


def on(start: Vector, velocity: Vector, time: float, rng: np.random.Generator | None = None) -> Sighting:
    """A sighting of a robot that was at `start` at 0 s, with 0.1 m of noise."""
    dx, dy = (0.0, 0.0) if rng is None else (0.1 * rng.standard_normal(2)).tolist()
    return sighting(start[0] + velocity[0] * time + dx, start[1] + velocity[1] * time + dy, time)


def times(begin: float, end: float) -> list[float]:
    """Ten times a second."""
    return np.arange(begin, end, 0.1).tolist()


def watched(*scans: list[Sighting]) -> Tracker:
    tracker = Tracker(SPEED)
    for scan in scans:
        tell(tracker, scan)
        if scan:
            tracker.tidy(scan[0].time)
    return tracker


def test_one_robot_is_one_track() -> None:
    rng = np.random.default_rng(0)
    tracker = watched(*([on((0, 0), (0.7, 0.2), t, rng)] for t in times(0.0, 5.0)))
    (track,) = tracker.tracks
    assert track.line.count == 50
    assert track.line.velocity == pytest.approx((0.7, 0.2), abs=0.03)


def test_only_the_latest_sightings_are_kept_to_be_shown_oldest_first() -> None:
    tracker = watched(*([on((0, 0), (0.7, 0.2), t)] for t in range(TRACK_LENGTH + 10)))
    (track,) = tracker.tracks
    assert [s.time for s in track.sightings] == list(range(10, TRACK_LENGTH + 10))
    assert track.line.count == TRACK_LENGTH + 10


def test_two_robots_that_are_seen_at_once_from_the_start_are_two_and_none_where_none_is_seen() -> None:
    tracker = watched([], [], [sighting(0, 0, 1.0), sighting(3, 0, 1.0)])
    assert [t.line.at(1.0) for t in tracker.tracks] == [pytest.approx((0, 0)), pytest.approx((3, 0))]
    assert len(watched([sighting(0, 0, 0.0), sighting(0.9, 0, 0.0)]).tracks) == 2
    nobody = watched([], [])
    nobody.tidy(5.0)
    assert nobody.tracks == []


@pytest.mark.parametrize("seed", range(10))
def test_two_crossing_courses_are_kept_apart(seed: int) -> None:
    """Both are seen at each scan, in any order. One passes the crossing 1.5 s before the other."""
    rng = np.random.default_rng(seed)
    first, second = ((-4.0, 0.0), (0.8, 0.0)), ((0.0, -5.2), (0.0, 0.8))

    def scan(t: float) -> list[Sighting]:
        both = [on(*first, t, rng), on(*second, t, rng)]
        return [both[i] for i in rng.permutation(2)]

    tracker = watched(*map(scan, times(0.0, 10.0)))
    tracks = sorted((t for t in tracker.tracks if t.line.count > 10), key=lambda track: track.line.velocity[1])
    for (start, velocity), track in zip((first, second), tracks, strict=True):
        assert track.line.velocity == pytest.approx(velocity, abs=0.05)
        assert track.line.at(0.0) == pytest.approx(start, abs=0.2)
        assert track.line.count >= 90


def test_nobody_sees_one_robot_double() -> None:
    """One sighting is half a metre out. It is a false robot, which is forgotten and takes nothing from the true one."""
    double = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        seen = [(t, on((0.0, 0.0), (0.8, 0.0), t, rng)) for t in times(0.0, 6.0)]
        tracker = watched(*([s if abs(t - 2.0) > 0.01 else sighting(1.6, 0.5, t)] for t, s in seen))
        tracker.tidy(5.9 + FORGET_ONCE)
        if len(tracker.tracks) > 1:
            double.append((seed, [track.line.count for track in tracker.tracks]))
    assert double == []


def test_two_robots_whose_ways_cross_while_nobody_sees_them_stay_who_they_are() -> None:
    rng = np.random.default_rng(1)
    first, second = ((-4.0, 0.0), (0.8, 0.0)), ((0.0, -5.2), (0.0, 0.8))
    seen = [t for t in times(0.0, 10.0) if not 4.0 < t < 7.5]
    tracker = watched(*([on(*second, t, rng), on(*first, t, rng)] for t in seen))
    assert sorted(t.line.count for t in tracker.tracks) == [len(seen), len(seen)]


def test_two_robots_side_by_side_at_the_same_speed_are_never_joined() -> None:
    rng = np.random.default_rng(2)
    tracker = watched(*([on((0, 0), (0.7, 0), t, rng), on((0, 1.2), (0.7, 0), t, rng)] for t in times(0.0, 6.0)))
    assert [t.line.count for t in tracker.tracks] == [60, 60]


def test_sightings_of_two_pursuers_whose_errors_differ_are_better_than_those_of_each() -> None:
    """One sees from the west and is unsure of x; the other from the south and is unsure of y."""
    errors: dict[str, list[float]] = {"west": [], "south": [], "both": []}
    for seed in range(100):
        rng = np.random.default_rng(seed)
        told: dict[str, list[list[Sighting]]] = {"west": [], "south": [], "both": []}
        for t in np.arange(0.0, 3.0, 0.25).tolist():
            x, y = 1.0 + 0.6 * t, 2.0 + 0.5 * t
            west = sighting(x + 0.3 * rng.standard_normal(), y + 0.05 * rng.standard_normal(), t, 0.09, 0.0, 0.0025)
            south = sighting(x + 0.05 * rng.standard_normal(), y + 0.3 * rng.standard_normal(), t, 0.0025, 0.0, 0.09)
            told["west"].append([west])
            told["south"].append([south])
            told["both"] += [[west], [south]]
        for who, scans in told.items():
            tracker = watched(*scans)
            (track,) = tracker.tracks
            errors[who].append(math.dist(track.line.at(4.0), (1.0 + 0.6 * 4.0, 2.0 + 0.5 * 4.0)))
    mean = {who: float(np.mean(e)) for who, e in errors.items()}
    assert mean["both"] < 0.5 * min(mean["west"], mean["south"])


def test_a_false_sighting_is_forgotten_and_the_robot_is_not() -> None:
    tracker = Tracker(SPEED)
    for t in times(0.0, 6.0):
        tell(tracker, [on((0, 0), (0.7, 0), t), *([sighting(20.0, 20.0, t)] if t == 1.0 else [])])
        tracker.tidy(t)
        if t == 1.0 + FORGET_ONCE - 0.1:
            assert len(tracker.tracks) == 2
    (track,) = tracker.tracks
    assert track.line.velocity == pytest.approx((0.7, 0.0), abs=0.02)


def test_who_was_seen_once_is_forgotten_sooner_than_who_was_seen_twice() -> None:
    tracker = watched([sighting(0, 0, 0.0), sighting(10, 0, 0.0)], [sighting(0.1, 0, 0.2)])
    assert len(tracker.tracks) == 2
    tracker.tidy(FORGET_ONCE)
    assert len(tracker.tracks) == 2
    tracker.tidy(FORGET_ONCE + 0.01)
    assert [t.line.count for t in tracker.tracks] == [2]
    tracker.tidy(0.2 + FORGET)
    assert len(tracker.tracks) == 1
    tracker.tidy(0.2 + FORGET + 0.01)
    assert tracker.tracks == []
    by_two = watched([sighting(0, 0, 0.0)], [sighting(0.1, 0, 0.0)])
    assert [t.line.count for t in by_two.tracks] == [2]
    by_two.tidy(FORGET_ONCE + 0.01)
    assert by_two.tracks == [], "by two at one time only it was seen once"
    tell(by_two, [sighting(5, 5, 100.0)])
    tell(by_two, [sighting(5.07, 5, 100.1)])
    assert [t.line.count for t in by_two.tracks] == [2], "it begins anew"


def test_two_halves_of_one_robot_become_one() -> None:
    """A pole hides its middle, so one scan sees it twice. Then it comes out from behind the pole."""
    tracker = Tracker(SPEED)
    tell(tracker, [sighting(0.0, 0.25, 0.0), sighting(0.0, -0.25, 0.0)])
    assert len(tracker.tracks) == 2
    tracker.tidy(0.0)
    (track,) = tracker.tracks
    assert track.line.count == 2
    assert track.line.at(0.0) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_courses_that_turn_out_to_be_of_one_robot_are_joined() -> None:
    rng = np.random.default_rng(0)
    tracker = Tracker(SPEED)
    tracker.tracks = [
        Track(fitted(seen, time=0.0, speed=SPEED), tuple(seen))
        for begin in (0.0, 0.05)
        for seen in [[on((0, 0), (0.7, 0.2), t, rng) for t in times(begin, 3.0)]]
    ]
    tracker.tidy(3.0)
    (track,) = tracker.tracks
    assert track.line.count == 60
    shown = [s.time for s in track.sightings]
    assert shown == sorted(shown)
    assert len(shown) == TRACK_LENGTH
    assert shown[-1] == pytest.approx(2.95)


def test_duplicates_do_not_make_a_robot_slow() -> None:
    """A pole hides its middle for 2 s, so that each scan sees it twice, again and again."""
    tracker = watched(*([sighting(0.8 * t, 0.25, t), sighting(0.8 * t, -0.25, t)] for t in times(0.0, 2.0)))
    (track,) = tracker.tracks
    alone = fitted([s for t in times(0.0, 2.0) for s in (sighting(0.8 * t, 0.0, t),) * 2], time=0.0, speed=SPEED)
    assert track.line.velocity[0] == pytest.approx(alone.velocity[0], abs=0.02)


def test_evidence_tells_which_robot_is_meant() -> None:
    rng = np.random.default_rng(0)
    first, second = ((0.0, 0.0), (0.7, 0.0)), ((0.0, 4.0), (0.5, -0.2))
    tracker = watched(*([on(*first, t, rng), on(*second, t, rng)] for t in times(0.0, 4.0)))
    for course in (first, second):
        track = tracker.track_of([on(*course, t) for t in (1.0, 1.5, 2.0)])
        assert track is not None
        assert any(track is known for known in tracker.tracks)
        assert track.line.velocity == pytest.approx(course[1], abs=0.05)


def test_evidence_of_somebody_else_is_a_robot_that_is_not_kept_and_one_wrong_sighting_does_not_matter() -> None:
    tracker = watched(*([on((0, 0), (0.7, 0), t)] for t in times(0.0, 4.0)))
    assert tracker.track_of([]) is None
    evidence = [on((0, 0), (0.7, 0), 1.0), sighting(30, 30, 1.5), on((0, 0), (0.7, 0), 2.0)]
    assert tracker.track_of(evidence) is tracker.tracks[0]
    evidence = [sighting(30 + 0.4 * t, 30, t) for t in (1.0, 2.0, 3.0)]
    track = tracker.track_of(evidence)
    assert track is not None
    assert [known.line.count for known in tracker.tracks] == [40], "what is known stays as it was"
    assert track is not tracker.tracks[0]
    assert track.sightings == tuple(evidence)
    assert track.line.at(4.0) == pytest.approx((31.6, 30.0), abs=0.1)


def test_who_has_seen_nothing_relies_on_the_evidence() -> None:
    assert Tracker(SPEED).track_of([]) is None
    track = Tracker(SPEED).track_of([sighting(3.0, 3.0, 1.0)])
    assert track is not None
    assert track.line.at(1.0) == pytest.approx((3.0, 3.0))


def test_robots_can_be_compared() -> None:
    tracker = watched([sighting(0, 0, 0.0), sighting(9, 0, 0.0)], [sighting(0.1, 0, 0.1), sighting(9, 0.1, 0.1)])
    first, second = tracker.tracks
    assert first == first  # noqa: PLR0124 - this is the question
    assert first != second
    assert second in tracker.tracks


@given(st.integers(0, 1000), st.randoms(use_true_random=False))
def test_sightings_that_come_late_and_out_of_order_give_the_same_course(seed: int, mixer: random.Random) -> None:
    """Each comes up to 0.5 s too late, as over a slow radio. None is so far out that it seems to be another robot."""
    rng = np.random.default_rng(seed)
    seen = [
        sighting(0.7 * t + rng.uniform(-0.15, 0.15), 0.2 * t + rng.uniform(-0.15, 0.15), t) for t in times(0.0, 4.0)
    ]
    late = sorted(seen, key=lambda s: s.time + mixer.uniform(0.0, 0.5))
    one, other = Tracker(SPEED), Tracker(SPEED)
    for tracker, order in ((one, seen), (other, late)):
        for s in order:
            tell(tracker, [s])
        tracker.tidy(4.0)
    assert len(one.tracks) == len(other.tracks) == 1
    a, b = one.tracks[0].line, other.tracks[0].line
    assert (a.count, a.first, a.last) == (b.count, b.first, b.last)
    assert b.velocity == pytest.approx(a.velocity, rel=1e-6, abs=1e-6)
    assert b.at(6.0) == pytest.approx(a.at(6.0), rel=1e-6, abs=1e-6)


def test_the_order_in_which_a_scan_lists_its_sightings_does_not_matter() -> None:
    rng = np.random.default_rng(4)
    courses = [((0.0, 0.0), (0.7, 0.0)), ((0.0, 2.0), (0.5, -0.1)), ((6.0, 1.0), (-0.6, 0.1))]
    scans = [[on(*course, t, rng) for course in courses] for t in times(0.0, 4.0)]
    ends = []
    for order in ((0, 1, 2), (2, 0, 1)):
        tracker = watched(*([scan[i] for i in order] for scan in scans))
        ends.append(sorted(tuple(round(v, 6) for v in t.line.at(4.0)) for t in tracker.tracks))
    assert ends[0] == ends[1]
    assert len(ends[0]) == 3


def test_a_sighting_that_is_very_sure_breaks_nothing() -> None:
    """A team mate may play by another program, whose sightings are as sure as a message allows."""
    tracker = watched(*([on((0, 0), (0.7, 0), t)] for t in range(0, 61, 5)))
    for t in (60.5, 61.0):
        tell(tracker, [sighting(10.0, 10.0, t, 1e-9, 0.0, 1e-9)])
        tracker.tidy(t)
    assert len(tracker.tracks) == 2


def test_a_sighting_from_the_future_is_not_kept_for_ever() -> None:
    """The clock of a team mate's program is wrong."""
    tracker = watched([])
    tracker.update([sighting(5.0, 5.0, 1e6)], 0.0)
    for t in range(0, 120, 10):
        tell(tracker, [on((0, 0), (0.7, 0), t)])
        tracker.tidy(t)
    assert [t.line.last for t in tracker.tracks] == [110.0]


def of_team(seed: int) -> list[tuple[str, list[Sighting]]]:
    """The scans of three players, at different times, of three robots that keep clear of one another."""
    rng = np.random.default_rng(seed)
    courses = [((0.0, 0.0), (0.7, 0.0)), ((0.0, 4.0), (0.5, 0.3)), ((6.0, -3.0), (-0.6, -0.2))]

    def seen(start: Vector, velocity: Vector, time: float) -> Sighting:
        dx, dy = rng.uniform(-0.15, 0.15, 2).tolist()
        return on((start[0] + dx, start[1] + dy), velocity, time)

    scans = [
        (who, [seen(*each, t) for each in courses if rng.random() < 0.7])
        for start, who in ((0.0, "ann"), (0.03, "bob"), (0.06, "cid"))
        for t in np.arange(start, 4.0, 0.2).tolist()
    ]
    return sorted(((who, scan) for who, scan in scans if scan), key=lambda each: each[1][0].time)


def picture(heard: Sequence[tuple[float, str, list[Sighting]]]) -> list[tuple[float, ...]]:
    """Where the robots are at 5 s by what was heard and when, how well that is known, and how often each was seen."""
    tracker = Tracker(SPEED)
    for now, who, scan in sorted(heard, key=lambda each: each[0]):
        tracker.update(scan, now, who)
        tracker.tidy(now)
    return sorted((*t.line.at(5.0), *t.line.covariance_at(5.0), t.line.count) for t in tracker.tracks)


@given(st.integers(0, 1000), st.randoms(use_true_random=False))
def test_who_hears_the_team_late_twice_or_in_another_order_knows_the_same(seed: int, mixer: random.Random) -> None:
    """Messages come up to half a second late, and a third of them comes twice."""
    scans = of_team(seed)
    heard = [(scan[0].time + mixer.uniform(0.0, 0.5), who, scan) for who, scan in scans]
    heard += [(time + mixer.uniform(0.0, 3.0), who, scan) for time, who, scan in heard if mixer.random() < 0.33]
    late, known = picture(heard), picture([(scan[0].time, who, scan) for who, scan in scans])
    assert len(known) == 3
    assert late == [pytest.approx(each, rel=1e-6, abs=1e-6) for each in known]


def test_a_message_that_comes_twice_tells_nothing_new_also_after_a_halt() -> None:
    tracker, scan = Tracker(SPEED), [sighting(0.0, 0.0, 1.0), sighting(5.0, 0.0, 1.0)]
    for _ in range(3):
        tracker.update(scan, 1.0, "ann")
        tracker.update([scan[0], scan[0]], 1.0, "ann")
    tracker.shift(7.0)
    tracker.update([sighting(0.0, 0.0, 8.0), sighting(5.0, 0.0, 8.0)], 8.0, "ann")
    assert [track.line.count for track in tracker.tracks] == [1, 1]
    tracker.update([sighting(0.0, 0.0, 8.0)], 8.0, "bob")
    assert [track.line.count for track in tracker.tracks] == [2, 1], "another player has seen it, too"


def test_a_team_mate_that_falls_silent_leaves_what_it_has_told() -> None:
    tracker = Tracker(SPEED)
    for t in times(0.0, 3.0):
        tracker.update([on((0, 0), (0.7, 0), t)], t, "ann")
        if t < 1.0:
            tracker.update([on((0, 5), (0.7, 0), t)], t, "bob")
        tracker.tidy(t)
    near, far = sorted(tracker.tracks, key=lambda track: track.line.at(3.0)[1])
    assert near.line.at(3.0) == pytest.approx((2.1, 0.0), abs=0.1)
    assert far.line.at(3.0) == pytest.approx((2.1, 5.0), abs=0.2)
    grown = [max(far.line.covariance_at(t)) for t in (1.0, 3.0, 9.0)]
    assert grown == sorted(grown), "where nobody looks, it is known less and less"


def test_who_takes_itself_to_be_elsewhere_is_heard_as_far_as_it_is_sure() -> None:
    """Bob's pose is off by half a metre. If he says that he is unsure, he spoils little; a robot seen twice is one."""
    errors = {}
    for error in (0.5, 0.1):
        tracker = Tracker(SPEED)
        for t in times(0.0, 3.0):
            tracker.update([on((0, 0), (0.7, 0), t)], t, "ann")
            tracker.update([sighting(0.7 * t, 0.5, t, error**2, 0.0, error**2)], t, "bob")
            tracker.tidy(t)
        errors[error] = max(track.line.at(3.0)[1] for track in tracker.tracks)
    assert errors[0.5] < 0.05 < errors[0.1]
