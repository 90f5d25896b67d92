"""How a robot is driven to a place, seen by the way that it takes in a simple simulation."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from vrg.geometry import wrap
from vrg.navigation.avoidance import Obstacle
from vrg.navigation.pilot import PROGRESS_TIMEOUT, Pilot
from vrg.regions import Circle, Rectangle, Region
from vrg.types import STILL, Pose, Twist, Vector

RADIUS, SPEED, DT = 0.35, 0.6, 0.1
FIELD = Rectangle(-10, -10, 10, 10)
AT_REST = (0.0, 0.0)


def moved(pose: Pose, twist: Twist, dt: float = DT) -> Pose:
    """Where a unicycle is that has followed a twist, with the speed and the turn of a Pioneer."""
    v, w = max(-0.75, min(0.75, twist.v)), max(-2.0, min(2.0, twist.w))
    theta = pose.theta + w * dt / 2
    return Pose(pose.x + v * math.cos(theta) * dt, pose.y + v * math.sin(theta) * dt, wrap(pose.theta + w * dt))


def standing(*places: Vector) -> Callable[[float], list[Obstacle]]:
    return lambda _: [Obstacle(place, AT_REST, 2 * RADIUS) for place in places]


def driven(
    start: Pose,
    goal: Vector,
    neighbours: Callable[[float], list[Obstacle]] = lambda _: [],
    *,
    walls: Sequence[tuple[Region, float]] = (),
    field: Region = FIELD,
    seconds: float = 40.0,
    reach: float = 0.3,
) -> list[Pose]:
    """The way of a robot until it is at its goal or the time is up."""
    pilot, pose, way = Pilot(), start, [start]
    for i in range(round(seconds / DT)):
        if math.dist((pose.x, pose.y), goal) < reach:
            break
        pose = moved(pose, pilot.go(i * DT, pose, [goal], neighbours(i * DT), field, SPEED, walls))
        way.append(pose)
    return way


def arrived(way: Sequence[Pose], goal: Vector, reach: float = 0.3) -> bool:
    return math.dist((way[-1].x, way[-1].y), goal) < reach


def nearest(way: Sequence[Pose], place: Vector) -> float:
    return min(math.dist((pose.x, pose.y), place) for pose in way)


AHEAD, GOAL = Pose(0, 0, 0), (4.0, 0.0)
WALL, BESIDE = Rectangle(1.8, -1.5, 2.2, 3.0), Rectangle(-2.0, 0.4, 2.0, 1.0)
WAYS: dict[str, tuple[Pose, Vector, list[Vector], dict[str, Any]]] = {
    **{f"heading {one}": (Pose(0, 0, one), (4.0, 1.0), [], {"seconds": 12.0}) for one in (0.0, 1.5, math.pi, -2.0)},
    **{f"past a body {aside} m aside": (AHEAD, GOAL, [(2.0, aside)], {}) for aside in (0.0, 0.2, -0.4)},
    "past a row of bodies": (AHEAD, GOAL, [(2.0, -1.2 + 0.6 * i) for i in range(5)], {}),
    "past a wall": (AHEAD, GOAL, [], {"walls": [(WALL, RADIUS + 0.1)]}),
    "away from a wall that is too near": (AHEAD, (0.0, -3.0), [], {"walls": [(BESIDE, RADIUS + 0.1)]}),
    "within its bounds": (AHEAD, GOAL, [(2.0, 0.0)], {"field": Rectangle(-1, -1.2, 5, 1.2)}),
    "into its bounds from outside": (Pose(-2, 0, math.pi), GOAL, [], {"field": Rectangle(-1, -1, 5, 1)}),
    "within a disc": (Pose(0, 0, 2.0), (2.0, 0.0), [], {"field": Circle(0.0, 0.0, 3.0)}),
}


@pytest.mark.parametrize(("start", "goal", "bodies", "more"), WAYS.values(), ids=WAYS)
def test_it_reaches_its_goal_without_touching_a_body_or_a_wall(
    start: Pose, goal: Vector, bodies: list[Vector], more: dict[str, Any]
) -> None:
    way, field = driven(start, goal, standing(*bodies), **more), more.get("field", FIELD)
    assert arrived(way, goal)
    assert all(nearest(way, body) > 2 * RADIUS * 0.87 for body in bodies)
    assert all(wall.distance(pose.x, pose.y) > RADIUS * 0.8 for wall, _ in more.get("walls", []) for pose in way)
    if field.contains(start.x, start.y):
        assert all(field.shrunk(-0.15).contains(pose.x, pose.y) for pose in way)


def test_a_body_that_crosses_the_way_is_not_hit() -> None:
    def crossing(now: float) -> list[Obstacle]:
        return [Obstacle((2.0, -2.0 + 0.5 * now), (0.0, 0.5), 2 * RADIUS)]

    way = driven(AHEAD, GOAL, crossing, seconds=20.0)
    assert arrived(way, GOAL)
    for i, pose in enumerate(way):
        assert math.dist((pose.x, pose.y), crossing(i * DT)[0].position) > 2 * RADIUS * 0.8


@pytest.mark.parametrize("aside", [0.0, 0.1, -0.3])
def test_two_that_meet_head_on_pass_each_other(aside: float) -> None:
    pilots = [Pilot(), Pilot()]
    poses = [Pose(-3, 0, 0), Pose(3, aside, math.pi)]
    goals = [(3.0, 0.0), (-3.0, aside)]
    twists = [STILL, STILL]
    closest = math.inf
    for i in range(400):
        velocities = [(t.v * math.cos(p.theta), t.v * math.sin(p.theta)) for p, t in zip(poses, twists, strict=True)]
        others = [[Obstacle((poses[k].x, poses[k].y), velocities[k], 2 * RADIUS)] for k in (1, 0)]
        twists = [pilots[k].go(i * DT, poses[k], [goals[k]], others[k], FIELD, SPEED) for k in (0, 1)]
        poses = [moved(pose, twist) for pose, twist in zip(poses, twists, strict=True)]
        closest = min(closest, math.dist((poses[0].x, poses[0].y), (poses[1].x, poses[1].y)))
        if all(math.dist((p.x, p.y), g) < 0.4 for p, g in zip(poses, goals, strict=True)):
            assert closest > 2 * RADIUS * 0.7
            return
    raise AssertionError(f"both must have arrived, but they are at {poses}")


def test_if_the_first_place_is_taken_it_drives_to_the_next_one() -> None:
    pilot, pose = Pilot(), Pose(0, 0, 0)
    taken, free = (3.0, 0.0), (3.0, 2.0)
    body = [Obstacle(taken, AT_REST, 2 * RADIUS)]
    for i in range(300):
        pose = moved(pose, pilot.go(i * DT, pose, [taken, free], body, FIELD, SPEED))
    assert math.dist((pose.x, pose.y), free) < 0.5


def test_shut_in_it_does_not_ram_those_around_it_and_gets_out_when_they_leave_a_gap() -> None:
    ring = [(0.95 * math.cos(i * math.tau / 8), 0.95 * math.sin(i * math.tau / 8)) for i in range(8)]
    goal = (5.0, 1.0)
    shut_in = driven(Pose(0, 0, math.pi), goal, standing(*ring), seconds=15.0)
    assert not arrived(shut_in, goal)
    assert min(nearest(shut_in, body) for body in ring) > 0.45
    assert arrived(driven(Pose(0, 0, math.pi), goal, lambda now: standing(*ring[0 if now < 8.0 else 2 :])(now)), goal)


def test_time_in_which_nobody_drove_it_is_no_time_without_progress() -> None:
    """After a halt it goes on as before, rather than out of a crowd."""
    pilot, pose = Pilot(), Pose(0, 0, 0)
    before = pilot.go(0.0, pose, [(4.0, 0.0)], [], FIELD, SPEED)
    after = pilot.go(PROGRESS_TIMEOUT + 30.0, pose, [(4.0, 0.0)], [], FIELD, SPEED)
    assert after == before


def test_a_robot_that_cannot_get_on_tries_another_direction() -> None:
    """Something that nobody sees holds it."""
    pilot, pose = Pilot(), Pose(0, 0, 0)
    twists = [pilot.go(i * DT, pose, [(4.0, 0.0)], [], FIELD, SPEED) for i in range(40)]
    assert twists[0].v > 0.5
    assert min(twist.v for twist in twists) < 0.0, "backwards, as there is no body to get away from"


def test_a_robot_that_stays_turns_towards_a_place_and_then_stands() -> None:
    pilot, pose = Pilot(), Pose(0, 0, 0)
    for i in range(60):
        twist = pilot.stay(i * DT, pose, (0.0, 5.0))
        assert twist.v == 0.0
        pose = moved(pose, twist)
    assert pose.theta == pytest.approx(math.pi / 2, abs=0.25)
    assert pilot.stay(6.0, pose, (0.0, 5.0)) == STILL
    assert pilot.stay(6.0, pose) == STILL


def test_the_same_calls_give_the_same_way() -> None:
    ways = [driven(Pose(0, 0, 0), (4.0, 0.0), standing((2.0, 0.1), (1.5, -0.8))) for _ in range(2)]
    assert ways[0] == ways[1]


def test_a_goal_within_a_disc_is_approached_as_near_as_possible() -> None:
    way = driven(Pose(0, 0, 0), (4.0, 0.0), standing((4.0, 0.0)), seconds=20.0)
    assert nearest(way, (4.0, 0.0)) < 1.2
    assert nearest(way, (4.0, 0.0)) > 2 * RADIUS * 0.8
