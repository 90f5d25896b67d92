"""Nothing tunnels: the tag is found wherever two moving bodies come within reach of each other."""

import math
from collections.abc import Sequence
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.games.sharks_and_minnows import judging, tagging
from vrg.games.sharks_and_minnows.tagging import first_tag
from vrg.geometry import interpolate, outline_distance
from vrg.regions import Bounds, Rectangle
from vrg.types import Pose

P2AT = (0.5, 0.49)
NOWHERE = (1e6, 1e6, 1e6 + 1, 1e6 + 1)
coordinates = st.floats(-3, 3)
poses = st.builds(Pose, coordinates, coordinates, st.floats(-math.pi, math.pi))


def _still(x: float, y: float) -> tuple[Pose, Pose, tuple[float, float]]:
    return Pose(x, y, 0.0), Pose(x, y, 0.0), P2AT


def _across(y: float, step: float = 0.2) -> tuple[Pose, Pose, tuple[float, float]]:
    return Pose(-step / 2, y, 0.0), Pose(step / 2, y, 0.0), P2AT


def test_bodies_that_stand_apart_are_no_tag() -> None:
    assert first_tag(_still(0, 0), _still(0.81, 0), 0.30, NOWHERE) == math.inf


def test_outlines_within_reach_are_a_tag_at_once() -> None:
    assert first_tag(_still(0, 0), _still(0.79, 0), 0.30, NOWHERE) == 0.0


def test_distance_is_between_outlines_not_centres() -> None:
    turned = Pose(0.81, 0, math.pi / 4)
    assert first_tag(_still(0, 0), (turned, turned, P2AT), 0.30, NOWHERE) == 0.0


def test_two_metres_a_second_at_ten_hertz_do_not_jump_through() -> None:
    """Two bodies that rush past each other meet only between the ticks."""
    left = Pose(-1.0, 0.0, 0.0), Pose(1.0, 0.0, 0.0), P2AT
    right = Pose(1.0, 0.7, math.pi), Pose(-1.0, 0.7, math.pi), P2AT
    fraction = first_tag(left, right, 0.30, NOWHERE)
    assert 0.2 < fraction < 0.5


def test_a_tag_inside_the_refuge_is_none() -> None:
    refuge = (-5, -5, 5, 5)
    assert first_tag(_still(0, 0), _still(0.5, 0), 0.30, refuge) == math.inf


def test_a_minnow_that_reaches_the_refuge_first_is_safe() -> None:
    minnow = Pose(0.0, 0.1, 0.0), Pose(0.0, -0.1, 0.0), P2AT
    shark = Pose(1.0, -0.1, 0.0), Pose(0.75, -0.1, 0.0), P2AT
    refuge = (-5, -5, 5, 0)
    assert first_tag(shark, minnow, 0.30, refuge) == math.inf


def test_a_minnow_that_leaves_the_refuge_can_be_tagged_from_there_on() -> None:
    minnow = Pose(0.0, -0.1, 0.0), Pose(0.0, 0.1, 0.0), P2AT
    fraction = first_tag(_still(0.7, 0.0), minnow, 0.30, (-5, -5, 5, 0))
    assert 0.5 < fraction < 0.52


def test_a_minnow_that_leaves_the_refuge_beside_a_shark_of_the_same_speed_is_tagged() -> None:
    minnow = Pose(0.0, -0.1, 0.0), Pose(0.0, 0.1, 0.0), P2AT
    shark = Pose(0.7, -0.1, 0.0), Pose(0.7, 0.1, 0.0), P2AT
    assert first_tag(shark, minnow, 0.30, (-5, -5, 5, 0)) == pytest.approx(0.5)


REFUGES = st.sampled_from([NOWHERE, (-1.0, -1.0, 1.5, 0.5)])


@given(poses, poses, poses, poses, REFUGES)
def test_the_first_tag_is_a_tag_and_none_comes_before_it(
    h0: Pose, h1: Pose, p0: Pose, p1: Pose, refuge: Bounds
) -> None:
    fraction = first_tag((h0, h1, P2AT), (p0, p1, P2AT), 0.30, refuge)

    def gap(at: float) -> float:
        place = interpolate(p0, p1, at)
        if Rectangle(*refuge).signed_distance(place.x, place.y) < 1e-3:
            return 1.0
        return outline_distance(interpolate(h0, h1, at), place, P2AT, P2AT) - 0.30

    def safe(at: float) -> bool:
        place = interpolate(p0, p1, at)
        return Rectangle(*refuge).contains(place.x, place.y)

    if fraction < math.inf:
        assert not safe(fraction)
        places = interpolate(h0, h1, fraction), interpolate(p0, p1, fraction)
        assert outline_distance(*places, P2AT, P2AT) - 0.30 <= 1e-9
    end = min(1.0, fraction)
    # RESOLUTION of motion is 1 mm: a graze of less may pass.
    assert fraction == 0.0 or all(gap(end * i / 50) > -1.1e-3 for i in range(50))


def test_a_way_through_the_refuge_is_not_looked_at_in_small_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    looks = []
    monkeypatch.setattr(tagging, "outline_distance", lambda *a: looks.append(a) or outline_distance(*a))
    minnow = Pose(-1.0, -0.1, 0.0), Pose(1.0, -0.1, 0.0), P2AT
    assert first_tag(_still(0.0, 0.2), minnow, 0.30, (-5, -5, 5, 0)) == math.inf
    assert len(looks) < 5


@given(poses, poses, poses, poses)
def test_who_is_hunter_and_who_prey_does_not_change_the_instant(h0: Pose, h1: Pose, p0: Pose, p1: Pose) -> None:
    one = first_tag((h0, h1, P2AT), (p0, p1, P2AT), 0.30, NOWHERE)
    other = first_tag((p0, p1, P2AT), (h0, h1, P2AT), 0.30, NOWHERE)
    assert one == other == math.inf or math.isclose(one, other, abs_tol=1e-6)


Motion = tuple[Pose, Pose, tuple[float, float]]


def tagged(
    hunters: Sequence[Motion], prey: Motion, reach: float, refuge: Bounds, exits: Sequence[float] | None = None
) -> tuple[float, list[int]]:
    """When a prey is tagged first, and by which of the hunters.

    Args:
        exits: when each of the hunters leaves the field; they never do by default.
    """
    bodies, count = [*hunters, prey], len(hunters)
    before, now = ([(p.x, p.y, p.theta) for p in poses] for poses in list(zip(*bodies, strict=True))[:2])
    sizes = [size for _, _, size in bodies]
    s = SimpleNamespace(tag_distance=reach, order=range(count + 1))
    t = SimpleNamespace(
        roles=[judging.SHARK] * count + [judging.MINNOW],
        active=[True] * (count + 1),
        seen=[judging.BOTH] * (count + 1),
        exits=[*(exits or [math.inf] * count), math.inf],
        hunters=[0] * (count + 1),
        boxes=[NOWHERE] * (count + 1),
    )
    found = judging.find_hunters(s, t, before, now, sizes)
    assert found == count
    at = judging.tagged_at(s, t, before, now, sizes, found, count, refuge)
    t.instants = [at] * (count + 1)
    return at, [n for n in range(count) if at < math.inf and judging.tags(s, t, before, now, sizes, n, count)]


def test_all_who_are_within_reach_as_the_prey_leaves_its_refuge_have_tagged_it() -> None:
    refuge = (-5, -5, 5, 0)
    prey = Pose(0.0, -0.05, 0.0), Pose(0.0, 0.05, 0.0), P2AT
    near, nearer, away, gone = _still(0.75, 0.0), _still(-0.6, 0.0), _still(1.5, 0.0), _still(0.0, 0.7)
    late = Pose(0.0, 1.0, 0.0), Pose(0.0, 0.7, 0.0), P2AT
    exits = [math.inf, math.inf, math.inf, math.inf, 0.2]
    at, taggers = tagged([near, nearer, away, late, gone], prey, 0.30, refuge, exits)
    assert at == pytest.approx(0.5, abs=0.01)
    assert taggers == [0, 1]


far = st.floats(-4, 4)
anywhere = st.builds(Pose, far, far, st.floats(-math.pi, math.pi))
sizes = st.tuples(st.floats(0.1, 1.0), st.floats(0.1, 1.0))
motions = st.tuples(anywhere, anywhere, sizes)


@given(st.lists(motions, min_size=1, max_size=5), motions, st.floats(0.0, 0.5), REFUGES)
def test_the_first_tag_of_any_hunter_counts_and_whoever_is_within_reach_then_is_named(
    hunters: list[Motion], prey: Motion, reach: float, refuge: Bounds
) -> None:
    """Also where hunters that surely meet nobody are not looked at."""
    at, taggers = tagged(hunters, prey, reach, refuge)
    assert at == min(first_tag(hunter, prey, reach, refuge) for hunter in hunters)
    if at < math.inf:
        place = interpolate(*prey[:2], at)
        within = [
            n
            for n, (before, now, size) in enumerate(hunters)
            if outline_distance(interpolate(before, now, at), place, size, prey[2]) <= reach
        ]
        assert taggers == within != []
