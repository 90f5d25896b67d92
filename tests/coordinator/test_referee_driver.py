"""How the coordinator drives robots into regions, seen by the ways that they take in a simple simulation."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import pytest

from vrg.bus.messages import Body, PlayerStatus
from vrg.coordinator.referee_driver import RefereeDriver
from vrg.geometry import wrap
from vrg.regions import Circle, Rectangle, Region, Sector
from vrg.types import STILL, Pose, Twist, Vector

DT, RADIUS, SPEED = 0.1, 0.35, 0.7
FIELD = Rectangle(-6, -4, 6, 4)
HOME = Sector(-6.0, -4.0, 1.2, 0.0, math.pi / 2)
TOUCH = 0.5
"""The distance of the centres of two Pioneers that touch, m."""
Others = Callable[[float], Mapping[str, tuple[Pose, float]]]
"""The pose and the speed of those that are not led, by the time."""


class Drive:
    """Robots of which some are led, and the ways that they take.

    Args:
        starts: where those that are led begin. others: the rest.
        goals: the region of each that is led; the home if none is given.
        leave: whether those that are home are gone, as they drive on. Otherwise they stand where they came in.

    Attributes:
        ways: the way of each that is led. closest: the shortest distance of two centres at any time, m.
    """

    def __init__(
        self,
        starts: Mapping[str, Pose],
        others: Others = lambda _: {},
        *,
        walls: Sequence[Region] = (),
        goals: Mapping[str, Region] = {},
        field: Region | None = FIELD,
        leave: bool = False,
    ) -> None:
        self._poses, self._others, self._field, self._leave = dict(starts), others, field, leave
        self._twists = dict.fromkeys(starts, STILL)
        self._goals = {name: goals.get(name, HOME) for name in starts}
        self._driver = RefereeDriver(dict.fromkeys(starts, SPEED), walls)
        self.ways: dict[str, list[Pose]] = {name: [pose] for name, pose in starts.items()}
        self.closest = math.inf
        self.time = 0.0

    def inside(self, name: str) -> bool:
        return self._goals[name].contains(self._poses[name].x, self._poses[name].y)

    def run(self, seconds: float = 60.0) -> set[str]:
        """Drive until all are in their regions or the time is up; who is there."""
        there: set[str] = set()
        while self.time < seconds and len(there) < len(self._goals):
            bodies = self._bodies()
            names = [name for name in self._goals if name not in there]
            players = [_status(name) for name in bodies]
            twists = self._driver.twists({n: self._goals[n] for n in names}, players, bodies, self._field, self.time)
            assert set(twists) == set(names)
            for name in self._poses:
                self._twists[name] = twists.get(name, STILL)
                self._poses[name] = _moved(self._poses[name], self._twists[name])
                self.ways[name].append(self._poses[name])
            self.time += DT
            self._look(bodies)
            there |= {name for name in names if self.inside(name)}
            if self._leave:
                self._poses = {name: pose for name, pose in self._poses.items() if name not in there}
        return there

    def _bodies(self) -> dict[str, Body]:
        bodies = {name: Body(name=name, pose=p, twist=Twist(self._twists[name].v, 0.0), physical=False)
                  for name, p in self._poses.items()}  # fmt: skip
        for name, (pose, v) in self._others(self.time).items():
            bodies[name] = Body(name=name, pose=pose, twist=Twist(v, 0.0), physical=False)
        return bodies

    def _look(self, bodies: Mapping[str, Body]) -> None:
        others = [pose for pose, _ in self._others(self.time).values()]
        for name, pose in self._poses.items():
            rest = [p for n, p in self._poses.items() if n != name] + others
            self.closest = min([self.closest, *(math.dist((pose.x, pose.y), (p.x, p.y)) for p in rest)])


def _status(name: str) -> PlayerStatus:
    return PlayerStatus(name=name, team="red", role="red", state="tagged", may_move=True, radius=RADIUS)


def _moved(pose: Pose, twist: Twist) -> Pose:
    """Where a Pioneer is that has followed a twist for a tick."""
    v, w = max(-SPEED, min(SPEED, twist.v)), max(-2.0, min(2.0, twist.w))
    theta = pose.theta + w * DT / 2
    return Pose(pose.x + v * math.cos(theta) * DT, pose.y + v * math.sin(theta) * DT, wrap(pose.theta + w * DT))


def standing(*places: Vector) -> Others:
    return lambda _: {f"body{i}": (Pose(x, y, 0.0), 0.0) for i, (x, y) in enumerate(places)}


def sensible(start: Pose, factor: float = 1.6) -> float:
    """The time in s in which a robot should be home: that of the straight way times a factor, and a little more."""
    return factor * math.dist((start.x, start.y), (HOME.x, HOME.y)) / SPEED + 6.0


@pytest.mark.parametrize("heading", [0.0, 2.0, math.pi, -1.5])
def test_a_robot_is_driven_home_over_an_empty_field(heading: float) -> None:
    start = Pose(4.0, 3.0, heading)
    drive = Drive({"red1": start})
    assert drive.run() == {"red1"}
    assert drive.time < sensible(start, 1.2)


@pytest.mark.parametrize("aside", [0.0, 0.3, -0.3])
def test_it_goes_round_a_body_that_stands_in_its_way(aside: float) -> None:
    start = Pose(4.0, 3.0, math.pi)
    drive = Drive({"red1": start}, standing((-1.0 + aside, -0.5), (2.0, 1.6 + aside)))
    assert drive.run() == {"red1"}
    assert drive.time < sensible(start)
    assert drive.closest > TOUCH


def crossing(now: float) -> Mapping[str, tuple[Pose, float]]:
    return {"blue1": (Pose(-1.0, min(3.0, -3.5 + 0.6 * now), math.pi / 2), 0.6 if now < 10.8 else 0.0)}


def towards(now: float) -> Mapping[str, tuple[Pose, float]]:
    x = min(3.5, -4.0 + 0.6 * now)
    return {"blue1": (Pose(x, -2.4 + 0.28 * (x + 4), math.atan(0.28)), 0.6 if x < 3.5 else 0.0)}


ROW = standing(*((-1.0, -2.0 + 0.7 * i) for i in range(6)))
TEAM = {f"red{i + 1}": Pose(1.0 + 0.8 * i, -1.5 + 1.0 * i, math.pi) for i in range(4)}
TWO_TEAMS = {"red1": Pose(4.0, 2.8, math.pi), "blue1": Pose(-4.0, -2.8, 0.0)}
OTHER_HOME = Sector(6.0, 4.0, 1.2, math.pi, math.pi / 2)
AT_HOME = [(-5.0, -3.3), (-5.1, -3.7), (-6.0, -4.0), (-5.2, -3.4), (-5.3, -3.5), (-5.4, -3.4), (-5.5, -3.2)]


@pytest.mark.parametrize(
    ("make", "distance"),
    [
        pytest.param(partial(Drive, {"red1": Pose(2.0, 0.0, math.pi)}, ROW), 1.0, id="round a row of bodies"),
        pytest.param(partial(Drive, {"red1": Pose(3.0, 1.0, math.pi)}, crossing), 1.0, id="one crosses its way"),
        pytest.param(partial(Drive, {"red1": Pose(3.0, -0.4, math.pi)}, towards), 0.8, id="one comes towards it"),
        pytest.param(
            partial(
                Drive,
                {"red1": Pose(0.0, 1.0, math.pi)},
                standing((-2.0, -3.4)),
                walls=[Rectangle(-2.2, -1.0, -1.8, 4.0)],
            ),
            1.0,
            id="between a wall and a body",
        ),
        *(
            pytest.param(
                partial(Drive, {"red1": Pose(0.0, 0.0, math.pi)}, standing(body)), 0.9, id=f"there is room at {body}"
            )
            for body in AT_HOME
        ),
        pytest.param(partial(Drive, TEAM, leave=True), 0.85, id="four of a team, one after the other"),
        pytest.param(
            partial(Drive, TWO_TEAMS, goals={"blue1": OTHER_HOME}), 0.8, id="two teams across each other's way"
        ),
        pytest.param(partial(Drive, {"red1": Pose(7.0, 5.0, 0.0)}), 1.0, id="from outside the field"),
        pytest.param(partial(Drive, {"red1": Pose(-6.5, 2.0, 0.0)}), 1.0, id="from outside the field and near"),
    ],
)
def test_all_that_are_led_come_home_and_touch_nobody(make: Callable[[], Drive], distance: float) -> None:
    drive = make()
    assert drive.run() == set(drive.ways)
    assert drive.closest > distance * TOUCH


def test_it_goes_round_a_wall() -> None:
    wall = Rectangle(-2.2, -4.0, -1.8, 2.0)
    start = Pose(0.0, -2.0, math.pi)
    drive = Drive({"red1": start}, walls=[wall])
    assert drive.run() == {"red1"}
    assert min(wall.distance(p.x, p.y) for p in drive.ways["red1"]) > 0.24, "half the width of its body"
    assert drive.time < sensible(start, 3.0)


def test_those_who_wait_at_the_home_corner_leave_a_way_for_the_next() -> None:
    """Three are home and stand where they came in; a fourth one still comes in."""
    crowd = standing((-4.9, -3.75), (-5.2, -3.2), (-5.75, -2.9))
    drive = Drive({"red1": Pose(-2.0, 0.0, math.pi)}, crowd)
    home = drive.run(60.0) == {"red1"}
    near = math.dist((drive.ways["red1"][-1].x, drive.ways["red1"][-1].y), (HOME.x, HOME.y))
    assert home or near < HOME.radius + 2 * RADIUS + 0.4, "if there is no room, it waits at the crowd"
    assert drive.closest > 0.85 * TOUCH


def test_a_field_is_not_needed() -> None:
    drive = Drive({"red1": Pose(0.0, 0.0, 0.0)}, goals={"red1": Circle(3.0, 3.0, 0.5)}, field=None)
    assert drive.run() == {"red1"}


def test_nobody_else_is_driven_and_one_that_the_world_does_not_report_stands() -> None:
    driver = RefereeDriver({"red1": SPEED, "red2": SPEED})
    bodies = {n: Body(name=n, pose=Pose(x, 0, 0), twist=STILL, physical=False) for n, x in (("red1", 0), ("red2", 2))}
    players = [_status(name) for name in bodies]
    assert set(driver.twists({"red1": HOME}, players, bodies, FIELD, 0.0)) == {"red1"}
    assert driver.twists({}, players, bodies, FIELD, 0.1) == {}
    assert RefereeDriver({"red1": SPEED}).twists({"red1": HOME}, players[:1], {}, FIELD, 0.0) == {"red1": STILL}


def test_no_robot_is_driven_faster_than_it_can() -> None:
    body = Body(name="red1", pose=Pose(0, 0, math.pi), twist=STILL, physical=False)
    twist = RefereeDriver({"red1": 0.4}).twists({"red1": HOME}, [_status("red1")], {"red1": body}, FIELD, 0.0)["red1"]
    assert 0.0 < math.hypot(twist.v, 0.25 * twist.w) <= 0.4 + 1e-9
