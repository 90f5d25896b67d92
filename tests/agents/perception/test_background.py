"""The empty scene: a return is unusual only where the laser of a snapshot has seen through."""

import math
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.agents.perception.scenes import FULL_TURN, HALF_TURN, box, look, room, together
from vrg.agents.perception.background import OBSTACLE_MARGIN, SPREAD, Snapshot, returns_of, snapshot, unusual
from vrg.agents.perception.scan import Floats, Scan, make_scan
from vrg.types import Pose, Vector

HOME = Pose(1.0, 2.0, 0.4)
SCENE = together(room(-6.0, -5.0, 7.0, 6.5), box(4.0, 3.5, 0.5, (1.0, 0.6)), box(2.0, -2.0, 1.1, (0.8, 0.8)))
FANS = pytest.mark.parametrize("fan", [HALF_TURN, FULL_TURN], ids=["half turn", "full turn"])


def fan_of(ranges: object, pose: Pose = HOME, angle_min: float = -0.5, step: float = 0.05) -> Scan:
    return make_scan(ranges, pose, mount=0.0, angle_min=angle_min, angle_step=step, range_max=8.0)


def seen_through(scan: Scan, point: Vector, *, spread: int = 0, margin: float = 0.0) -> bool:
    """By brute force: whether the beam in whose direction a point is has gone past it, and its neighbours too."""
    away = math.dist(scan.origin, point)
    bearing = math.atan2(point[1] - scan.origin[1], point[0] - scan.origin[0])
    offsets = [abs(math.remainder(bearing - b, math.tau)) for b in scan.bearings.tolist()]
    nearest = min(range(len(offsets)), key=lambda i: offsets[i], default=None)
    if nearest is None or offsets[nearest] > scan.angle_step / 2:
        return False
    beams = range(max(0, nearest - spread), min(len(offsets), nearest + spread + 1))
    return all(away < min(scan.ranges[i], scan.range_max) - margin for i in beams)


def between_beams(scan: Scan, point: Vector) -> bool:
    """Whether a point is as near to one beam as to the next, so that rounding decides."""
    bearing = math.atan2(point[1] - scan.origin[1], point[0] - scan.origin[0])
    share = ((bearing - scan.heading - scan.angle_min) % math.tau) / scan.angle_step
    return abs(share % 1.0 - 0.5) < 1e-6


ranges_lists = st.lists(st.floats(0.5, 7.9) | st.just(8.0), min_size=1, max_size=60)


@given(ranges_lists, st.lists(st.tuples(st.floats(-9, 11), st.floats(-8, 12)), min_size=1, max_size=20))
def test_a_point_is_free_only_where_the_laser_saw_through_it(ranges: list[float], points: list[Vector]) -> None:
    seen = fan_of(ranges)
    free = snapshot([seen]).contains(np.array(points))
    for point, is_free in zip(points, free.tolist(), strict=True):
        if between_beams(seen, point):
            continue
        assert not is_free or seen_through(seen, point)
        assert is_free == seen_through(seen, point, spread=SPREAD, margin=OBSTACLE_MARGIN)


@given(st.floats(-20, 20), st.floats(-20, 20), st.lists(st.tuples(st.floats(-9, 11), st.floats(-8, 12)), min_size=1))
def test_a_full_turn_knows_all_directions_for_any_heading(heading: float, first: float, points: list[Vector]) -> None:
    seen = make_scan([5.0] * 360, Pose(1, 2, heading), mount=0, angle_min=first, angle_step=math.tau / 360, range_max=8)
    free = snapshot([seen]).contains(np.array(points))
    near = [math.dist(seen.origin, point) < 5.0 - OBSTACLE_MARGIN for point in points]
    assert free.tolist() == near


def test_nothing_behind_a_laser_is_known() -> None:
    empty = snapshot([look(SCENE, Pose(0.0, 0.0, 0.0))])
    assert (
        empty.contains(np.array([[1.0, 0.0], [-0.1, 0.0], [-1.0, 1.0], [-1.0, -1.0]])).tolist() == [True] + [False] * 3
    )


def test_points_that_are_not_finite_are_not_free() -> None:
    empty = snapshot([look(SCENE, HOME, fan=FULL_TURN)])
    points = [[math.nan, 0.0], [0.0, math.nan], [math.inf, math.inf], [-math.inf, 0.0], [HOME.x + 0.5, HOME.y]]
    assert empty.contains(np.array(points)).tolist() == [False, False, False, False, True]


def test_nothing_is_unusual_for_a_snapshot_or_a_scan_of_no_beams_without_snapshots_or_hits() -> None:
    nothing, empty = snapshot([fan_of([])]), snapshot([look(SCENE, HOME)])
    assert not nothing.contains(np.array([[1.0, 2.0], [3.0, 3.0]])).any()
    assert unusual(look(SCENE, HOME), [nothing]).sum() == 0
    assert unusual(fan_of([]), [empty]).shape == (0,)
    assert not unusual(look(together(SCENE, box(3, 2)), HOME), []).any()
    assert not unusual(fan_of([math.inf] * 181, angle_min=-math.pi / 2, step=math.radians(1)), [empty]).any()


@pytest.mark.parametrize(
    ("scans", "said"),
    [([], "at least one scan"), ([[1.0, 2.0, 3.0], [1.0, 2.0]], r"same number of beams, got \[2, 3\]")],
    ids=["none", "of different lengths"],
)
def test_scans_that_make_no_snapshot_are_refused(scans: list[list[float]], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        snapshot([fan_of(scan) for scan in scans])


def test_a_scan_of_another_number_of_beams_is_judged_by_places() -> None:
    """A laser of three beams sees a robot at 2 m where one of 181 saw a wall at 5 m."""
    wall = snapshot([look(room(-5, -5, 5, 5), Pose(0, 0, 0))])
    seen = fan_of([2.0, 5.0, 2.0], Pose(0, 0, 0), angle_min=-0.3, step=0.3)
    assert unusual(seen, [wall]).tolist() == [True, False, True]


def test_where_nothing_was_met_all_is_free_up_to_the_longest_range() -> None:
    empty = snapshot([fan_of([math.inf] * 21, Pose(0, 0, 0))])
    points = np.array(
        [[0.5, 0.0], [8.0 - OBSTACLE_MARGIN - 0.01, 0.0], [8.0 - OBSTACLE_MARGIN + 0.01, 0.0], [9.0, 0.0]]
    )
    assert empty.contains(points).tolist() == [True, True, False, False]


@pytest.mark.parametrize("reading", [math.nan, 0.0, -1.0], ids=["no number", "zero", "negative"])
def test_a_beam_that_measured_no_distance_has_seen_through_nothing(reading: float) -> None:
    """A laser that is dazzled or covered says so in a range that is no distance. That is no free way."""
    ranges = [reading] * 21
    assert not snapshot([fan_of(ranges, Pose(0, 0, 0))]).contains(np.array([[1.0, 0.0], [5.0, 0.5]])).any()


def test_several_scans_agree_on_the_shortest_way() -> None:
    far, near = fan_of([6.0] * 9, Pose(0, 0, 0), angle_min=-0.2), fan_of([3.0] * 9, Pose(0, 0, 0), angle_min=-0.2)
    points = np.array([[2.6, 0.0], [2.8, 0.0], [5.0, 0.0]])
    for scans in ([far, near], [near, far], [far, near, far]):
        assert snapshot(scans).contains(points).tolist() == [True, False, False]


@FANS
def test_what_has_come_into_free_space_is_unusual_and_nothing_else_is(fan: tuple[int, float]) -> None:
    empty = snapshot([look(SCENE, HOME, fan=fan)])
    body = box(3.2, 2.4, 0.7)
    seen = look(together(SCENE, body), HOME, fan=fan)
    on_body = np.isclose(seen.ranges, look(body, HOME, fan=fan).ranges) & seen.hits
    assert on_body.sum() > 10
    assert unusual(seen, [empty]).tolist() == on_body.tolist()


@FANS
def test_it_is_unusual_from_another_place_too_also_for_who_drives(fan: tuple[int, float]) -> None:
    """The place of the scene that a snapshot knows counts, not the place of the scan."""
    empty = snapshot([look(SCENE, HOME, fan=fan)])
    body = box(3.2, 2.4, 0.7)
    for other in (Pose(0.0, 0.5, 0.7), Pose(6.0, 3.0, math.pi), Pose(3.0, 5.5, -1.4), Pose(4.0, 0.0, 2.0)):
        assert not unusual(look(SCENE, other, fan=fan), [empty]).any(), "the empty scene"
        seen = look(together(SCENE, body), other, fan=fan)
        on_body = np.isclose(seen.ranges, look(body, other, fan=fan).ranges) & seen.hits
        assert on_body.sum() > 5
        found = unusual(seen, [empty])
        assert (found & ~on_body).sum() == 0
        assert found.sum() > 0.9 * on_body.sum(), "all of it is where the snapshot saw through"


def test_what_a_wall_hid_from_the_snapshot_is_not_unusual() -> None:
    scene = together(room(-6, -6, 6, 6), box(3.0, 0.0, 0.0, (0.2, 3.0)))
    empty = snapshot([look(scene, Pose(0, 0, 0))])
    behind = together(scene, box(5.0, 0.0))
    witness = Pose(5.0, 4.0, -math.pi / 2)
    assert np.isclose(look(behind, witness).ranges, look(box(5.0, 0.0), witness).ranges).any(), "it can be seen"
    assert not unusual(look(behind, witness), [empty]).any()
    assert unusual(look(behind, witness), [empty, snapshot([look(scene, witness)])]).any(), "unless another knows"


def test_team_mates_that_tell_where_they_are_are_not_unusual() -> None:
    empty = snapshot([look(SCENE, HOME)])
    seen = look(together(SCENE, box(3.2, 2.4)), HOME)
    assert unusual(seen, [empty]).any()
    assert not unusual(seen, [empty], returns_of(seen, [((3.2, 2.4), 0.6)])).any()
    elsewhere, small = returns_of(seen, [((0.0, 0.0), 0.6)]), returns_of(seen, [((3.2, 2.4), 0.1)])
    assert unusual(seen, [empty], elsewhere).any(), "one that is elsewhere explains nothing"
    assert unusual(seen, [empty], small).any(), "nor one that is too small"


def test_nothing_that_a_scan_may_hold_makes_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        empty = snapshot([fan_of([math.nan, 1.0, math.inf, 0.0, 8.0])])
        odd = fan_of([math.nan, 1.0, math.inf, 0.0, 8.0])
        found = unusual(odd, [empty], returns_of(odd, [((0.0, 0.0), 1.0)]))
    assert not found.any()


def crowded(rng: np.random.Generator) -> tuple[Floats, Pose]:
    """A room with boxes about a robot that stands in it at least 1.5 m from everything."""
    walls = room(*(-rng.uniform(2.5, 9.0, 2)), *rng.uniform(2.5, 9.0, 2))
    boxes = []
    for _ in range(rng.integers(1, 6)):
        away, bearing = rng.uniform(2.3, 7.5), rng.uniform(-math.pi, math.pi)
        size = rng.uniform(0.4, 1.0), rng.uniform(0.4, 1.0)
        boxes.append(box(away * math.cos(bearing), away * math.sin(bearing), rng.uniform(0, 3), size))
    return together(walls, *boxes), Pose(0.0, 0.0, rng.uniform(-math.pi, math.pi))


def off(pose: Pose, rng: np.random.Generator) -> Pose:
    """A pose that is wrong by at most 2 cm and half a degree."""
    away, bearing = rng.uniform(0.0, 0.02), rng.uniform(-math.pi, math.pi)
    turn = math.radians(rng.uniform(-0.5, 0.5))
    return Pose(pose.x + away * math.cos(bearing), pose.y + away * math.sin(bearing), pose.theta + turn)


@FANS
@pytest.mark.parametrize("moved", [False, True], ids=["wrongly believed", "come back nearly"])
def test_nearly_the_same_scene_has_nothing_unusual_whatever_the_noise(fan: tuple[int, float], moved: bool) -> None:
    """Ranges are wrong by up to 2 cm, and the pose from which the scan is put on the map by 2 cm and half a degree."""
    wrong = []
    for seed in range(150):
        rng = np.random.default_rng(1000 * moved + seed)
        scene, pose = crowded(rng)
        near = off(pose, rng)
        noises = [rng.uniform(-0.02, 0.02, fan[0]) for _ in range(4)]
        empty = snapshot([look(scene, pose, fan=fan, noise=noise) for noise in noises[:3]])
        there, believed = (near, pose) if moved else (pose, near)
        found = unusual(look(scene, there, believed=believed, fan=fan, noise=noises[3]), [empty])
        if found.any():
            wrong.append((seed, np.flatnonzero(found).tolist()))
    assert wrong == []


@pytest.mark.parametrize("side", [1, -1], ids=["the last beam", "the first beam"])
def test_the_first_and_the_last_beam_of_a_full_turn_are_neighbours(side: int) -> None:
    """A box ends just where the full turn ends. Half a degree and 2 cm of error do not make it unusual."""
    scene = together(room(-7, -7, 7, 7), box(-3.0, 0.53 * side, 0.0, (1.0, 1.0)))
    empty = snapshot([look(scene, Pose(0.0, 0.0, 0.0), fan=FULL_TURN)])
    believed = Pose(0.0, -0.02 * side, math.radians(0.5 * side))
    found = unusual(look(scene, Pose(0.0, 0.0, 0.0), believed=believed, fan=FULL_TURN), [empty])
    assert np.flatnonzero(found).tolist() == []


def test_a_snapshot_says_what_it_is_made_of() -> None:
    scan = look(SCENE, HOME)
    made = snapshot([scan])
    assert isinstance(made, Snapshot)
    assert (made.origin, made.heading, made.angle_min, made.angle_step) == (
        scan.origin, scan.heading, scan.angle_min, scan.angle_step,
    )  # fmt: skip
    assert made.free.shape == scan.ranges.shape
    assert (made.free >= 0.0).all()
    assert (made.free <= np.minimum(scan.ranges, 8.0)).all()
