"""The automaton by which a head-up display drives a robot: Watch, Goto, Manual and Reset (thesis 4.1 and Figure 2.4).

It is the same for a player of any game: the display works out the motion and asks for it as the person who holds the
lease. It uses no bus, no clock and no window.
"""

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Final

from msgspec import Struct

from vrg.agents.charon import Agent, Automaton, Mode, Submode, Transition
from vrg.geometry import wrap
from vrg.navigation.avoidance import Obstacle
from vrg.navigation.pilot import Pilot
from vrg.navigation.route import grown, route
from vrg.regions import Circle, Region
from vrg.types import STILL, Pose, Twist, Vector

GOAL_TOLERANCE: Final = 0.10
"""The distance in m within which a place counts as reached."""
AWAY: Final = 0.30
"""The distance in m beyond which a robot that had reached its place drives there again."""
SLOWING: Final = 1.0
"""The rate in 1/s at which the remaining way decays near the goal: the gain of equation 2.6."""
MIN_SPEED: Final = 0.12
"""The lowest speed in m/s with which the last piece is driven."""
TURNED: Final = 0.04
"""The error of the heading in rad within which it counts as reached."""
TURNED_AWAY: Final = 0.15
"""The error of the heading in rad beyond which a robot turns again."""
TURN_GAIN: Final = 2.0
TURN_LIMIT: Final = 1.0
"""The gain in 1/s, and the limit in rad/s, with which a robot turns on the spot."""


class Wish(StrEnum):
    """A wish of the person at the display; also the names of the automaton's modes.

    WATCH leaves the robot to its own strategy.
    """

    WATCH = "Watch"
    GOTO = "Goto"
    MANUAL = "Manual"
    RESET = "Reset"


class Goal(Struct, frozen=True):
    """A place to drive to.

    Args:
        x, y: m, in the map's frame. heading: how to stand there, rad; None if that does not matter.
    """

    x: float
    y: float
    heading: float | None = None


class Situation(Struct, frozen=True):
    """The data that the automaton decides by.

    Args:
        now: the match time, s. pose: where the robot is.
        wish: what the person wants. goal: of Goto. home: of Reset.
        hands: the motion that the person's hands ask for.
        neighbours: the other bodies that the player knows of.
        bounds: the area in which the body's centre may be. walls: the regions that it may not enter.
        margin: the distance to keep from walls, m.
        speed: the top speed, m/s.
    """

    now: float
    pose: Pose
    wish: Wish
    goal: Goal
    home: Goal
    hands: Twist
    neighbours: Sequence[Obstacle]
    bounds: Region
    walls: Sequence[Region]
    margin: float
    speed: float


def way(situation: Situation) -> list[Vector]:
    """The points at which the way to where the robot is sent turns, and the goal as the last one, m.

    It is empty if the robot is not sent anywhere, and only the goal if no way leads there now.
    """
    goal = _sent(situation)
    if goal is None:
        return []
    place = (goal.x, goal.y)
    bars: list[Region] = [Circle(*n.position, n.clearance) for n in situation.neighbours]
    bars += [grown(wall, situation.margin) for wall in situation.walls]
    return route((situation.pose.x, situation.pose.y), place, bars, situation.bounds.contains) or [place]


def helm() -> Agent[Situation, Twist]:
    """The declaration of the automaton."""
    pilot = Pilot()

    def drive(situation: Situation) -> Twist:
        goal = _goal(situation)
        speed = min(situation.speed, max(MIN_SPEED, SLOWING * _distance(situation)))
        walls = [(wall, situation.margin) for wall in situation.walls]
        place, others = (goal.x, goal.y), situation.neighbours
        return pilot.go(situation.now, situation.pose, [place], others, situation.bounds, speed, walls)

    def steer(situation: Situation) -> Twist:
        return situation.hands

    def stand(situation: Situation) -> Twist:
        return STILL

    def turn(situation: Situation) -> Twist:
        error = _heading_error(situation)
        return Twist(0.0, max(-TURN_LIMIT, min(TURN_LIMIT, TURN_GAIN * error)))

    def sent(name: Wish) -> Mode[Situation, Twist]:
        return Mode(
            name,
            (Submode("Drive", drive), Submode("Turn", turn), Submode("Arrived", stand)),
            (
                Transition("Drive", "Turn", "goal reached", lambda s: _distance(s) < GOAL_TOLERANCE),
                Transition("Turn", "Drive", "goal left", lambda s: _distance(s) > AWAY),
                Transition("Turn", "Arrived", "heading reached", lambda s: abs(_heading_error(s)) < TURNED),
                Transition("Arrived", "Drive", "goal left", lambda s: _distance(s) > AWAY),
                Transition("Arrived", "Turn", "heading left", lambda s: abs(_heading_error(s)) > TURNED_AWAY),
            ),
        )

    events = {Wish.WATCH: "give back", Wish.GOTO: "goto", Wish.MANUAL: "manual", Wish.RESET: "reset"}
    return Agent(
        name="helm",
        modes=(
            Mode(Wish.WATCH, (Submode("Idle", stand),)),
            sent(Wish.GOTO),
            Mode(Wish.MANUAL, (Submode("Steer", steer),)),
            sent(Wish.RESET),
        ),
        transitions=tuple(
            Transition(source, target, event, _wanted(target))
            for source in Wish
            for target, event in events.items()
            if source is not target
        ),
        initial=lambda situation: situation.wish,
        starts=((Wish.WATCH, "display opened"),),
        inputs=("wish", "goal", "hands", "pose", "neighbours"),
        outputs=("manual",),
    )


class Helm:
    """A running helm."""

    def __init__(self) -> None:
        self._automaton = Automaton(helm())

    @property
    def where(self) -> str:
        """The mode and the submode, such as `Goto/Drive`."""
        return self._automaton.where

    def step(self, situation: Situation) -> Twist:
        """The motion to ask for now."""
        return self._automaton.step(situation)

    def leave(self) -> None:
        """Leave the robot to its strategy, whatever the mode was."""
        self._automaton.restart()


def _wanted(wish: Wish) -> Callable[[Situation], bool]:
    return lambda situation: situation.wish is wish


def _sent(situation: Situation) -> Goal | None:
    return {Wish.GOTO: situation.goal, Wish.RESET: situation.home}.get(situation.wish)


def _goal(situation: Situation) -> Goal:
    return situation.home if situation.wish is Wish.RESET else situation.goal


def _distance(situation: Situation) -> float:
    goal = _goal(situation)
    return math.hypot(goal.x - situation.pose.x, goal.y - situation.pose.y)


def _heading_error(situation: Situation) -> float:
    """The angle to turn to the goal's heading, rad; 0 if it does not matter."""
    heading = _goal(situation).heading
    return 0.0 if heading is None else wrap(heading - situation.pose.theta)
