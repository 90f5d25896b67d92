"""The display's automaton drives a robot to its goal, past what stands, and obeys the person at once."""

import math
from dataclasses import dataclass, field

import pytest
from msgspec import structs

from vrg.geometry import wrap
from vrg.navigation.avoidance import Obstacle
from vrg.regions import Circle, Rectangle
from vrg.types import STILL, Pose, Twist
from vrg_views.hud.helm import GOAL_TOLERANCE, Goal, Helm, Situation, Wish, way

STEP = 0.05
BEGIN = Situation(
    now=0.0, pose=Pose(0.0, 0.0, 0.0), wish=Wish.WATCH, goal=Goal(3.0, 2.0, math.pi / 2), home=Goal(0.0, 0.0, 0.0),
    hands=STILL, neighbours=(), bounds=Rectangle(-5.0, -5.0, 5.0, 5.0), walls=(), margin=0.35, speed=0.7,
)  # fmt: skip


@dataclass
class Robot:
    """A unicycle that does at once what the helm asks for."""

    situation: Situation = BEGIN
    helm: Helm = field(default_factory=Helm)
    modes: list[str] = field(default_factory=list)
    path: list[Pose] = field(default_factory=list)

    def run(self, seconds: float, **changes: object) -> Twist:
        self.situation = structs.replace(self.situation, **changes)
        twist = STILL
        for _ in range(round(seconds / STEP)):
            twist = self.helm.step(self.situation)
            if self.helm.where not in self.modes[-1:]:
                self.modes.append(self.helm.where)
            x, y, theta = self.situation.pose.x, self.situation.pose.y, self.situation.pose.theta
            pose = Pose(
                x + twist.v * math.cos(theta) * STEP, y + twist.v * math.sin(theta) * STEP, wrap(theta + twist.w * STEP)
            )
            self.path.append(pose)
            self.situation = structs.replace(self.situation, now=self.situation.now + STEP, pose=pose)
        return twist

    @property
    def pose(self) -> Pose:
        return self.situation.pose


def test_nobody_is_driven_while_the_person_only_watches() -> None:
    robot = Robot()
    assert robot.run(1.0) == STILL
    assert robot.modes == ["Watch/Idle"]


@pytest.mark.parametrize(
    "goal", [Goal(3.0, 2.0, math.pi / 2), Goal(-3.0, 0.0, math.pi), Goal(0.0, -2.0), Goal(0.3, 0.0)]
)
def test_goto_drives_turns_and_arrives(goal: Goal) -> None:
    robot = Robot()
    assert robot.run(30.0, wish=Wish.GOTO, goal=goal) == STILL
    assert math.dist((robot.pose.x, robot.pose.y), (goal.x, goal.y)) < GOAL_TOLERANCE
    if goal.heading is not None:
        assert abs(wrap(robot.pose.theta - goal.heading)) < 0.05
    assert robot.modes[0] == "Goto/Drive"
    assert robot.modes[-1] == "Goto/Arrived"


def test_a_new_goal_is_driven_to_at_once() -> None:
    robot = Robot()
    robot.run(30.0, wish=Wish.GOTO)
    robot.run(30.0, goal=Goal(-2.0, -2.0))
    assert math.dist((robot.pose.x, robot.pose.y), (-2.0, -2.0)) < GOAL_TOLERANCE
    assert robot.modes[-3:] == ["Goto/Drive", "Goto/Turn", "Goto/Arrived"]


def test_reset_goes_back_to_where_it_began() -> None:
    robot = Robot()
    robot.run(10.0, wish=Wish.GOTO)
    robot.run(40.0, wish=Wish.RESET)
    assert math.hypot(robot.pose.x, robot.pose.y) < GOAL_TOLERANCE
    assert abs(robot.pose.theta) < 0.05
    assert robot.modes[-1] == "Reset/Arrived"


def test_manual_does_what_the_hands_want() -> None:
    assert Robot().run(STEP, wish=Wish.MANUAL, hands=Twist(0.3, -0.2)) == Twist(0.3, -0.2)


def test_a_wall_and_a_robot_in_the_way_are_driven_around() -> None:
    robot = Robot()
    wall = Rectangle(1.4, -1.0, 1.6, 1.5)
    other = Obstacle((2.6, 1.4), (0.0, 0.0), 0.7)
    assert robot.run(40.0, wish=Wish.GOTO, walls=(wall,), neighbours=(other,), goal=Goal(4.0, 0.5)) == STILL
    assert math.dist((robot.pose.x, robot.pose.y), (4.0, 0.5)) < GOAL_TOLERANCE
    assert min(wall.distance(pose.x, pose.y) for pose in robot.path) > 0.2
    assert min(math.dist((pose.x, pose.y), other.position) for pose in robot.path) > 0.55


def test_the_way_is_known_before_it_is_driven() -> None:
    assert way(BEGIN) == []
    free = structs.replace(BEGIN, wish=Wish.GOTO)
    assert way(free) == [(3.0, 2.0)]
    around = way(structs.replace(free, walls=(Circle(1.5, 1.0, 0.4),)))
    assert len(around) > 1
    assert around[-1] == (3.0, 2.0)
    assert way(structs.replace(free, wish=Wish.RESET, pose=Pose(1.0, 0.0, 0.0))) == [(0.0, 0.0)]


@pytest.mark.parametrize("before", [Wish.GOTO, Wish.RESET, Wish.MANUAL])
def test_giving_back_ends_every_mode(before: Wish) -> None:
    robot = Robot()
    robot.run(1.0, wish=before, pose=Pose(2.0, 0.0, 0.0))
    assert robot.run(STEP, wish=Wish.WATCH) == STILL
    assert robot.helm.where == "Watch/Idle"
