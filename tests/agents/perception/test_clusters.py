"""Unusual returns that are near one another are of one robot."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.agents.perception.scenes import FULL_TURN, box, chain, look, room, together
from vrg.agents.perception.background import snapshot, unusual
from vrg.agents.perception.clusters import BREAKPOINT_DISTANCE, FEWEST, WIDEST, clusters
from vrg.agents.perception.scan import Floats, Scan, make_scan
from vrg.types import Pose

HERE = Pose(0.0, 0.0, 0.0)


def found(scene: Floats, *bodies: Floats, pose: Pose = HERE) -> list[list[int]]:
    """The clusters that bodies make which have come into a scene."""
    empty = snapshot([look(scene, pose)])
    scan = look(together(scene, *bodies), pose)
    return [group.tolist() for group in clusters(scan, unusual(scan, [empty]))]


def on(body: Floats, *others: Floats) -> list[int]:
    """The beams that meet a body before anything else."""
    seen, alone = look(together(body, *others), HERE), look(body, HERE)
    return np.flatnonzero(seen.hits & np.isclose(seen.ranges, alone.ranges)).tolist()


ROOM = room(-7.5, -7.5, 7.5, 7.5)


def test_one_robot_is_one_cluster_of_all_its_returns() -> None:
    body = box(4.0, 1.0, 0.3)
    assert found(ROOM, body) == [on(body)]


@pytest.mark.parametrize(
    ("left", "right"),
    [(box(4.0, 1.5, 0.3), box(4.0, -1.0, 1.3)), (box(4.0, 0.6), box(4.0, -0.6))],
    ids=["apart", "side by side with a gap wider than a gap"],
)
def test_two_robots_are_two(left: Floats, right: Floats) -> None:
    assert found(ROOM, left, right) == [on(right), on(left)]


def test_a_robot_that_stands_before_another_is_not_mixed_up_with_it() -> None:
    near, far = box(2.5, 0.7, 0.3), box(5.0, 0.2)
    assert found(ROOM, near, far) == [on(far, near), on(near)]


def test_a_robot_that_is_quite_hidden_is_not_seen() -> None:
    near, far = box(2.5, 0.0), box(5.0, 0.0)
    assert found(ROOM, near, far) == [on(near)]


def test_a_wall_that_is_too_wide_for_a_robot_and_a_single_return_are_none() -> None:
    assert found(ROOM, chain([(4.0, -1.0), (4.0, 1.0)], closed=False)) == []
    assert found(ROOM, chain([(3.0, 0.0), (4.3, 1.3)], closed=False)) == [], "whichever way it runs"
    assert len(found(ROOM, chain([(4.0, -0.7), (4.0, 0.7)], closed=False))) == 1, "as wide as a robot may be"
    assert found(ROOM, chain([(5.0, -0.02), (5.0, 0.02)], closed=False)) == []


def test_nothing_chosen_is_no_cluster() -> None:
    scan = look(ROOM, HERE)
    assert clusters(scan, np.zeros(181, dtype=np.bool_)) == []
    empty = make_scan([], HERE, mount=0, angle_min=0, angle_step=0.1, range_max=8)
    assert clusters(empty, np.zeros(0, dtype=np.bool_)) == []


def test_beams_that_met_nothing_are_in_no_cluster() -> None:
    scan = make_scan([3.0, math.inf, 3.0, 3.0], HERE, mount=0, angle_min=0, angle_step=0.02, range_max=8)
    assert [g.tolist() for g in clusters(scan, np.ones(4, dtype=np.bool_))] == [[0, 2, 3]]


@pytest.mark.parametrize("shape", [(180,), (182,), (0,), (1,), (181, 1), ()])
def test_a_mask_of_another_length_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"expected a mask of shape \(181,\)"):
        clusters(look(ROOM, HERE), np.ones(shape, dtype=np.bool_))


def test_a_robot_behind_a_laser_that_turns_fully_is_one_robot() -> None:
    """The first and the last beam of a full turn are side by side."""
    empty = snapshot([look(ROOM, HERE, fan=FULL_TURN)])
    scan = look(together(ROOM, box(-4.0, 0.05)), HERE, fan=FULL_TURN)
    assert len(clusters(scan, unusual(scan, [empty]))) == 1


def test_a_robot_that_comes_out_of_a_place_that_nobody_knows_is_seen_whole() -> None:
    """Only the part of it that has left the shadow of a wall is unusual; the rest is beside it."""
    body = box(4.0, 0.0)
    scan = look(together(ROOM, body), HERE)
    whole = on(body)
    chosen = np.zeros(181, dtype=np.bool_)
    chosen[whole[:3]] = True
    assert [g.tolist() for g in clusters(scan, chosen)] == [whole]
    chosen[whole[1:3]] = False
    assert clusters(scan, chosen) == [], "one return is too few also then"


def test_a_robot_beside_a_wall_is_not_taken_for_the_wall() -> None:
    wall, body = chain([(4.5, -4.0), (4.5, 4.0)], closed=False), box(4.0, 0.0, 0.0, (0.5, 0.5))
    scene = together(ROOM, wall)
    chosen = np.zeros(181, dtype=np.bool_)
    chosen[on(body)] = True
    assert [g.tolist() for g in clusters(look(together(scene, body), HERE), chosen)] == [on(body)]


def test_no_return_is_of_two_robots() -> None:
    """A stripe across a robot is where nobody knows what is free, so only its two ends are unusual."""
    body = box(3.0, 0.0)
    scan = look(together(ROOM, body), HERE)
    beams = np.array(on(body))
    chosen = np.zeros(181, dtype=np.bool_)
    chosen[beams[np.abs(scan.points[beams, 1]) > 0.22]] = True
    groups = [g.tolist() for g in clusters(scan, chosen)]
    assert groups == [beams.tolist()]


@given(
    st.lists(
        st.tuples(st.sampled_from([1.0, 1.2, 2.0, 2.3, 2.35, 5.0, math.inf]) | st.floats(0.5, 7.9), st.booleans()),
        max_size=40,
    )
)
def test_clusters_are_what_chaining_one_return_to_the_next_gives(beams: list[tuple[float, bool]]) -> None:
    scan = Scan((0.0, 0.0), 0.0, -0.5, 0.03, np.array([r for r, _ in beams], dtype=np.float64), 8.0)
    chosen = np.array([c for _, c in beams], dtype=np.bool_)
    met = {
        i: (r * math.cos(-0.5 + 0.03 * i), r * math.sin(-0.5 + 0.03 * i))
        for i, (r, _) in enumerate(beams)
        if math.isfinite(r)
    }
    groups: list[list[int]] = []
    for i in (i for i in met if beams[i][1]):
        if groups and math.dist(met[groups[-1][-1]], met[i]) <= BREAKPOINT_DISTANCE:
            groups[-1].append(i)
        else:
            groups.append([i])

    def extent(group: list[int]) -> float:
        xs, ys = [met[i][0] for i in group], [met[i][1] for i in group]
        return math.hypot(max(xs) - min(xs), max(ys) - min(ys))

    def completed(group: list[int]) -> list[int]:
        whole = list(group)
        while whole[0] - 1 in met and math.dist(met[whole[0] - 1], met[whole[0]]) <= BREAKPOINT_DISTANCE:
            whole.insert(0, whole[0] - 1)
        while whole[-1] + 1 in met and math.dist(met[whole[-1] + 1], met[whole[-1]]) <= BREAKPOINT_DISTANCE:
            whole.append(whole[-1] + 1)
        return whole if extent(whole) <= WIDEST else group

    expected = [completed(g) for g in groups if len(g) >= FEWEST and extent(g) <= WIDEST]
    assume(all(set(a).isdisjoint(b) for a, b in itertools.combinations(expected, 2)))
    assert [g.tolist() for g in clusters(scan, chosen)] == expected
