"""Robots that overlap are separated: who gives way, and where nobody can."""

from types import SimpleNamespace

import pytest

from vrg.hal.sim.engines.pushing import Walls, body, overlaps, push_apart, separate, share_of
from vrg.hal.sim.shapes import box_gap

NO_WALLS = Walls([], [], [])
WALL = Walls([(-1.0, 0.0, 0.0, 1.0, 4.0)], [(1.0, 0.0)], [])
"""A wall whose side is at x = -0.5."""
SIZE = (0.4, 0.4)


def motion(*places: float, braking: tuple[bool, ...] = ()) -> SimpleNamespace:
    """Robots of SIZE beside one another along x, at rest; those that do not brake drive in the direction of -x."""
    count = len(places)
    braking = braking or (True,) * count
    return SimpleNamespace(
        poses=[[x, 0.0, 0.0] for x in places],
        before=[[x, 0.0, 0.0] for x in places],
        velocities=[[0.0 if still else -1.0, 0.0, 0.0] for still in braking],
        speeds=[[0.0, 0.0] for _ in places],
        braking=braking,
        shifts=[[0.0, 0.0] for _ in places],
        **{name: [False] * count for name in ("moved", "shifted", "blocked", "stuck", "back")},
    )


def robots(count: int) -> SimpleNamespace:
    """As many robots of one kind."""
    return SimpleNamespace(
        sizes=[SIZE] * count,
        grip=[10.0] * count,
        rates=[[(10.0, -2.0, 0.0), (10.0, 2.0, 0.0)]] * count,
        kinematic=[False] * count,
    )


def test_two_that_brake_share_the_way_and_one_that_drives_gives_way() -> None:
    m = motion(0.0, 0.39)
    assert push_apart(m, robots(2), NO_WALLS, [], [(0, 1)], 1.0)
    assert [m.poses[0][0], m.poses[1][0]] == pytest.approx([-0.005, 0.395])
    m = motion(0.0, 0.39, braking=(True, False))
    assert push_apart(m, robots(2), NO_WALLS, [], [(0, 1)], 1.0)
    assert [m.poses[0][0], m.poses[1][0]] == pytest.approx([0.0, 0.4])


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_who_is_in_a_wall_holds_and_makes_hold_whom_it_stops(order: tuple[int, int]) -> None:
    m, r = motion(-0.305, 0.2), robots(2)
    push_apart(m, r, WALL, [(0, 0)], [], 1.0)
    assert m.blocked == [True, False]
    assert m.poses[0][0] == pytest.approx(-0.3)
    m.poses[1][0] = 0.09
    gap = box_gap(body(m, r, order[0]), body(m, r, order[1]))
    assert share_of(m, r, *order, gap) == float(order[0] == 1), "the other one takes the whole push"
    assert m.blocked == [True, True]


def test_those_that_have_no_room_are_put_back_at_rest() -> None:
    pen = Walls([*WALL.boxes, (1.0, 0.0, 0.0, 1.0, 4.0)], [*WALL.turns, (1.0, 0.0)], [])
    m = motion(-0.29, 0.29, 0.0, braking=(False,) * 3)
    m.before = [[-0.3, 0.3, 0.0], [0.3, 0.3, 0.0], [0.0, -0.3, 0.0]]
    sides = [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)]
    assert separate(m, robots(3), pen, sides, [(0, 1), (0, 2), (1, 2)], [(0, 1), (0, 2), (1, 2)], 0.02, 1.0)
    assert not any(overlaps(m, robots(3), pen, n, wall) for n, wall in sides)
    assert [pose[:2] for pose in m.poses] == [[-0.3, 0.3], [0.3, 0.3], [0.0, -0.3]]
    assert all(speeds == [0.0, 0.0] for speeds in m.speeds)
