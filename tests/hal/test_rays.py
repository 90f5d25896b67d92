"""Ray casting: against a plain intersection of every beam with every edge, and against PyBullet's rays."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from vrg.hal.sim.map import load_map
from vrg.hal.sim.sensors.rays import Edges, Fan, Floats, cast
from vrg.hal.sim.shapes import box_edges
from vrg.types import Pose

FAN = Fan.of(181, math.pi)
NO_DISCS = np.zeros((0, 3))

place = st.floats(-12, 12)
size = st.floats(0.1, 4)
angle = st.floats(-math.pi, math.pi)
boxes = st.lists(st.tuples(place, place, angle, size, size), max_size=8)
discs = st.lists(st.tuples(place, place, st.floats(0.05, 2)), max_size=4)


def plain(heading: float, fan: Fan, reach: float, segments: Floats, circles: Floats) -> Floats:
    """From the origin, beam by beam, edge by edge, by the textbook."""
    ranges = []
    for beam in fan.angles + heading:
        ux, uy, best = math.cos(beam), math.sin(beam), reach
        for x0, y0, x1, y1 in segments:
            dx, dy = x1 - x0, y1 - y0
            denominator = ux * dy - uy * dx
            if abs(denominator) > 1e-12:
                along = (x0 * dy - y0 * dx) / denominator
                share = (x0 * uy - y0 * ux) / denominator
                if along > 0 and 0 <= share <= 1:
                    best = min(best, along)
        for cx, cy, radius in circles:
            middle = cx * ux + cy * uy
            square = radius * radius - cx * cx - cy * cy + middle * middle
            if square >= 0 and middle > 0:
                best = min(best, middle - math.sqrt(square))
        ranges.append(best)
    return np.array(ranges)


def holds_origin(box: tuple[float, ...]) -> bool:
    x, y, heading, length, width = box
    u, v = x * math.cos(heading) + y * math.sin(heading), y * math.cos(heading) - x * math.sin(heading)
    return abs(u) <= length / 2 + 1e-3 and abs(v) <= width / 2 + 1e-3


@given(boxes, discs, angle, st.sampled_from([math.pi / 2, math.pi, 1.9 * math.pi]))
def test_every_beam_reads_the_nearest_body(bodies: list, circles: list, heading: float, fov: float) -> None:  # type: ignore[type-arg]
    assume(not any(holds_origin(box) for box in bodies))
    assume(not any(math.hypot(x, y) < r + 1e-3 for x, y, r in circles))
    fan = Fan.of(61, fov)
    segments = box_edges(np.array(bodies).reshape(-1, 5))
    rounds = np.array(circles).reshape(-1, 3)
    got = cast(0.0, 0.0, heading, fan, 8.0, Edges(segments), rounds)
    wanted = plain(heading, fan, 8.0, segments, rounds)
    # A beam that grazes a corner or a circle's rim may fall to either side of it.
    step = 1e-6
    slack = [plain(heading + d, fan, 8.0, segments, rounds) for d in (-step, step)]
    close = np.abs(got - wanted) < 1e-4 * (1 + wanted)
    grazing = (np.abs(got - slack[0]) < 1e-2) | (np.abs(got - slack[1]) < 1e-2)
    assert np.all(close | grazing)


@given(boxes, place, place, angle)
def test_turning_and_moving_everything_together_changes_nothing(
    bodies: list,
    x: float,
    y: float,
    turn: float,  # type: ignore[type-arg]
) -> None:
    assume(not any(holds_origin(box) for box in bodies))
    array = np.array(bodies).reshape(-1, 5)
    moved = array.copy()
    c, s = math.cos(turn), math.sin(turn)
    moved[:, 0], moved[:, 1] = x + array[:, 0] * c - array[:, 1] * s, y + array[:, 0] * s + array[:, 1] * c
    moved[:, 2] += turn
    a = cast(0.0, 0.0, 0.0, FAN, 8.0, Edges(box_edges(array)), NO_DISCS)
    b = cast(x, y, turn, FAN, 8.0, Edges(box_edges(moved)), NO_DISCS)
    # A corner may move across a beam by rounding: at most one beam a corner then differs.
    assert np.count_nonzero(np.abs(a - b) > 1e-6) <= 4 * len(bodies)
    if not bodies:
        assert np.all(a == 8.0)


def test_a_wall_ahead_is_seen_at_its_distance_and_slant() -> None:
    wall = Edges(box_edges(np.array([(5.1, 0.0, 0.0, 0.2, 40.0)])))
    ranges = cast(0.0, 0.0, 0.0, FAN, 8.0, wall, NO_DISCS)
    assert ranges[90] == pytest.approx(5.0)
    assert ranges[60] == pytest.approx(5.0 / math.cos(math.radians(30)))
    assert ranges[0] == ranges[180] == 8.0


def test_a_sensor_inside_a_body_sees_through_it_so_a_robot_never_sees_itself() -> None:
    own = np.array([(0.0, 0.0, 0.4, 0.5, 0.5), (3.0, 0.0, 0.0, 1.0, 1.0)])
    assert cast(0.1, 0.0, 0.0, FAN, 8.0, Edges(box_edges(own)), NO_DISCS)[90] == pytest.approx(2.4)


def test_edges_join() -> None:
    a, b = np.array([(3.0, 0.0, 0.0, 1.0, 1.0)]), np.array([(0.0, 4.0, 0.0, 1.0, 1.0)])
    both = Edges(box_edges(a)).join(Edges(box_edges(b)))
    whole = Edges(box_edges(np.vstack((a, b))))
    ranges = [cast(0.0, 0.0, 0.5, FAN, 8.0, edges, NO_DISCS) for edges in (both, whole)]
    assert np.array_equal(*ranges)


def test_agrees_with_pybullets_rays_within_5_mm() -> None:
    pybullet = pytest.importorskip("pybullet")
    from vrg.hal.sim.engines.pybullet import BulletEngine  # noqa: PLC0415

    map_ = load_map("courtyard")
    engine = BulletEngine(map_, [])
    try:
        pybullet.performCollisionDetection(physicsClientId=engine._client)
        edges, rng = Edges(map_.edges), np.random.default_rng(3)
        for _ in range(60):
            x, y, heading = rng.uniform(-13, 29), rng.uniform(-35, -9), rng.uniform(-math.pi, math.pi)
            if not map_.footprint_clear(Pose(x, y, heading), 0.5, 0.5):
                continue
            beams = FAN.angles + heading
            starts = [(x, y, 0.35)] * len(beams)
            ends = [(x + 8 * math.cos(b), y + 8 * math.sin(b), 0.35) for b in beams]
            hits = pybullet.rayTestBatch(starts, ends, physicsClientId=engine._client)
            theirs = np.array([hit[2] * 8.0 for hit in hits])
            ours = cast(x, y, heading, FAN, 8.0, edges, map_.discs)
            differs = np.abs(ours - theirs) > 0.005
            # A beam along a corner or a column's rim may hit for one and miss for the other.
            assert np.count_nonzero(differs) <= 1
    finally:
        engine.close()


def test_the_beams_of_a_full_turn_are_in_order_and_all_see() -> None:
    behind = Edges(box_edges(np.array([(-4.2, 0.0, 0.0, 0.4, 1.0)])))
    for beams in range(2, 400):
        fan = Fan.of(beams, 2 * math.pi)
        assert (np.diff(fan.order) > 0.0).all(), beams
        assert cast(0.0, 0.0, 0.0, fan, 8.0, behind, NO_DISCS)[[0, -1]] == pytest.approx(4.0), beams
