"""Players line up on their marks, and stand still there."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.coordinator.placing import assigned
from vrg.coordinator.rulebook import MARK_TOLERANCE, Observation, away, not_lined_up, on_marks
from vrg.types import Pose

MARKS = {"a": Pose(1.0, 2.0, 0.0), "b": Pose(5.0, 5.0, 1.0)}


def test_who_stands_on_its_mark_is_lined_up_whatever_its_heading() -> None:
    now = Observation({"a": Pose(1.0, 2.0, 3.0), "b": Pose(5.1, 4.9, -1.0)})
    assert on_marks(MARKS, now) == {"a", "b"}
    assert not_lined_up(MARKS, now) == {}


def test_the_reach_belongs_to_the_mark() -> None:
    assert on_marks({"a": Pose(0, 0, 0)}, Observation({"a": Pose(MARK_TOLERANCE, 0, 0)})) == {"a"}
    assert on_marks({"a": Pose(0, 0, 0)}, Observation({"a": Pose(math.nextafter(MARK_TOLERANCE, 1), 0, 0)})) == set()


@pytest.mark.parametrize(
    ("pose", "moving", "why"),
    [
        (None, False, "is not in the world"),
        (Pose(4.0, 6.0, 0.0), False, "is 5.0 m from its mark"),
        (Pose(4.0, 6.0, 0.0), True, "is 5.0 m from its mark"),
        (Pose(1.1, 2.0, 0.0), True, "is moving"),
    ],
)
def test_why_somebody_is_not_lined_up(pose: Pose | None, moving: bool, why: str) -> None:
    poses = {"b": MARKS["b"]} | ({} if pose is None else {"a": pose})
    assert not_lined_up(MARKS, Observation(poses, frozenset({"a"} if moving else set()))) == {"a": why}


def test_who_has_no_mark_is_never_waited_for() -> None:
    now = Observation({"a": MARKS["a"], "b": MARKS["b"], "c": Pose(9, 9, 0)}, frozenset({"c"}))
    assert on_marks(MARKS, now) == {"a", "b"}
    assert not_lined_up(MARKS, now) == {}
    assert not_lined_up({}, now) == {}


def test_the_distance_is_between_places() -> None:
    assert away(Pose(4.0, 6.0, 0.0), Pose(1.0, 2.0, 3.0)) == pytest.approx(5.0)


places = st.tuples(st.floats(-9, 9), st.floats(-9, 9)).map(lambda place: Pose(*place, 0.0))


@given(st.lists(st.tuples(places, places), max_size=8))
def test_ways_to_marks_do_not_cross(pairs: list[tuple[Pose, Pose]]) -> None:
    poses = {f"p{i}": pose for i, (pose, _) in enumerate(pairs)}
    found = assigned(poses, [mark for _, mark in pairs])
    assert set(found) == set(poses)
    for a, b in itertools.combinations(poses, 2):
        between = poses[a].x - poses[b].x, poses[a].y - poses[b].y
        marks = found[a].x - found[b].x, found[a].y - found[b].y
        assert between[0] * marks[0] + between[1] * marks[1] >= -1e-6, "nor do they meet on the way"


def test_of_more_marks_than_players_the_near_ones_are_taken() -> None:
    marks = [Pose(9, 9, 0), Pose(1, 0, 0), Pose(0, 1, 0)]
    assert assigned({"a": Pose(0, 0, 0), "b": Pose(1, 1, 0)}, marks)["b"] in marks[1:]
    assert assigned({}, marks) == {}
