"""A player that drives by the mover comes past the obstacles of the map."""

from collections.abc import Callable

import pytest
from msgspec.structs import replace

from tests.hal.fake_driver import MODEL
from vrg.agents.mover import Mover
from vrg.agents.strategy import View
from vrg.bus.messages import PlayerStatus, RefereeState, Stage
from vrg.geometry import along_arc
from vrg.hal.readings import Readings
from vrg.regions import Circle, Polygon, Region
from vrg.types import Pose, Twist

DT = 0.1
FIELD = Circle(0.0, 0.0, 50.0)
RADIUS = 0.35
BAR = Polygon(((4.0, -2.0), (5.0, -2.0), (5.0, 2.0), (4.0, 2.0)))
COLUMN = Circle(4.0, 0.1, 0.8)


def view(time: float, pose: Pose, obstacles: tuple[Region, ...], *others: Pose) -> View:
    me = PlayerStatus(name="a", team="t", role="r", state="active", may_move=True, radius=RADIUS, pose=pose)
    players = (me, *(replace(me, name=f"b{n}", pose=other) for n, other in enumerate(others)))
    state = RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=players, zones=(),
    )  # fmt: skip
    readings = Readings(time, 0.0, armed=True, estop=False, fault=None, samples=[])
    return View(time, me, readings, state, {}, MODEL, pose, obstacles=obstacles)


def end(obstacle: Region, drive: Callable[[View], Twist]) -> Pose:
    """Where a robot is after a minute, or as soon as it is past the obstacle, of which it keeps clear."""
    pose = Pose(0.0, 0.0, 0.0)
    for tick in range(600):
        pose = along_arc(pose, MODEL.limited(drive(view(tick * DT, pose, (obstacle,)))), DT)
        assert obstacle.distance(pose.x, pose.y) > RADIUS - 0.02
        if pose.x > 6.0:
            break
    return pose


@pytest.mark.parametrize("obstacle", [BAR, COLUMN])
def test_it_finds_its_way_around_an_obstacle(obstacle: Region) -> None:
    mover = Mover()
    assert end(obstacle, lambda view: mover.go(view, (9.0, 0.0), FIELD)).x > 6.0


def test_it_gives_way_to_who_is_in_its_way_and_not_to_who_flies_above() -> None:
    alone, beside, below = (
        Mover().go(view(0.0, Pose(0.0, 0.0, 0.0), (), *others), (5.0, 0.0), FIELD)
        for others in ((), (Pose(1.0, 0.05, 0.0),), (Pose(1.0, 0.05, 0.0, 2.0),))
    )
    assert below == alone != beside
    high = Pose(0.0, 0.0, 0.0, 1.0)
    alone, beside, above = (
        Mover().go(view(0.0, high, (), *others), (5.0, 0.0), FIELD)
        for others in ((), (Pose(1.0, 0.05, 0.0, 1.2),), (Pose(1.0, 0.05, 0.0),))
    )
    assert above == alone != beside


@pytest.mark.parametrize("obstacle", [BAR, COLUMN])
def test_with_a_wanted_velocity_it_does_not_drive_into_an_obstacle(obstacle: Region) -> None:
    mover = Mover()
    assert end(obstacle, lambda view: mover.head(view, (0.7, 0.0), FIELD)).x > 2.5
