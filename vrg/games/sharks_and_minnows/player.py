"""The strategy of a player of Sharks and Minnows (thesis 4.3.3, Figures 4.12 and 4.13)."""

import math
from dataclasses import replace

from vrg.agents.charon import Agent, Automaton, Mode, Submode, Transition
from vrg.agents.interception import intercept
from vrg.agents.mover import Mover
from vrg.agents.potential import descent, evade
from vrg.agents.strategy import Strategy, View
from vrg.games.sharks_and_minnows import INACTIVE, SHARK
from vrg.games.sharks_and_minnows.scene import Surroundings, scene
from vrg.hal.models import RobotModel
from vrg.navigation.avoidance import CrowdBody
from vrg.navigation.control import scaled
from vrg.navigation.motion import TopSpeed
from vrg.types import STILL, Twist, Vector, quantised

SHARK_OFFSET = 0.5
"""The distance in m from a shark's centre to the point that feedback linearisation steers. It is longer than that of
others: a shark turns less at once, which costs it less of its speed while it follows a minnow that dodges."""
EVADE_DISTANCE, CALM_DISTANCE = 2.0, 2.3
"""The distances between centres in m at which a minnow begins and ends to evade one shark."""
MARK_REACH = 0.2
"""The distance in m from its mark or berth at which a player stops; on marks the referee holds it at a longer one."""


class SharksAndMinnowsPlayer(Strategy):
    """Plays as a minnow or a shark, or stands still if inactive, by the referee's state."""

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._automaton = Automaton(self.agent())
        self._top_speed = TopSpeed(robot.v_max)
        self._mover = Mover(walls=False)

    @property
    def mode(self) -> str:
        """The mode and submode of the automaton, such as `Minnows/Cross`."""
        return self._automaton.where

    def act(self, view: View) -> Twist:
        """Return the twist of one step of the automaton."""
        speed = view.speed
        if speed is not None and not _lining_up(view):
            self._top_speed.update(view.time, speed)
        twist = self._automaton.step(view)
        if self._automaton.mode != _mode_of(view):
            # An official has overruled a call, and no event of the game leads to the new mode.
            self._automaton.restart()
            twist = self._automaton.step(view)
        return twist

    def agent(self) -> Agent[View, Twist]:
        """The automaton of Figure 4.12. Its submodes are the control laws below."""
        begin = Transition[View]("LineUp", "Play", "RoundStart", lambda v: v.me.mark is None)
        minnows = Mode(
            "Minnows",
            [
                Submode("LineUp", self._line_up),
                Submode("Cross", self._cross),
                Submode("Evade", self._evade),
                Submode("Safe", self._safe),
            ],
            [
                replace(begin, target="Cross"),
                Transition("Cross", "LineUp", "Initialize", _lining_up),
                Transition("Evade", "LineUp", "Initialize", _lining_up),
                Transition("Safe", "LineUp", "Initialize", _lining_up),
                Transition("Cross", "Safe", "InEndZone", _home),
                Transition("Evade", "Safe", "InEndZone", _home),
                Transition("Safe", "Cross", "PushedOut", lambda v: not _home(v)),
                Transition("Cross", "Evade", "SharkNear", lambda v: _nearest_shark(v)[1] < EVADE_DISTANCE),
                Transition("Evade", "Cross", "SharkFar", lambda v: _nearest_shark(v)[1] > CALM_DISTANCE),
            ],
        )
        sharks = Mode(
            "Sharks",
            [
                Submode("LineUp", self._line_up),
                Submode("Intercept", self._intercept),
                Submode("Wait", _still),
            ],
            [
                replace(begin, target="Intercept"),
                Transition("Intercept", "LineUp", "Initialize", _lining_up),
                Transition("Wait", "LineUp", "Initialize", _lining_up),
                Transition("Intercept", "Wait", "NoPrey", lambda v: not _seen(v).prey),
                Transition("Wait", "Intercept", "Prey", lambda v: bool(_seen(v).prey)),
            ],
        )
        return Agent(
            name="Sharks and Minnows player",
            modes=[minnows, sharks, Mode("Inactive", [Submode("Stop", _still)])],
            transitions=[
                Transition("Minnows", "Inactive", "Tagged or OutOfBounds", _inactive),
                Transition("Sharks", "Inactive", "OutOfBounds", _inactive),
                Transition("Inactive", "Sharks", "PassOver", lambda v: _mode_of(v) == "Sharks"),
            ],
            initial=_mode_of,
            starts=[("Minnows", "Minnow"), ("Sharks", "Shark")],
            inputs=["referee state", "INS", "wheel speed"],
            outputs=["twist"],
        )

    def _line_up(self, view: View) -> Twist:
        mark = view.me.mark
        return self._drive_to(view, None if mark is None else (mark.x, mark.y))

    def _drive_to(self, view: View, place: Vector | None) -> Twist:
        if place is None or math.dist(view.position, place) < MARK_REACH:
            return self._mover.stay(view)
        speed = min(self.robot.v_max, max(0.15, math.dist(view.position, place)))
        return self._mover.go(view, place, _seen(view).bounds, speed=speed)

    def _cross(self, view: View) -> Twist:
        seen = _seen(view)
        berth = seen.berths.get(self.name)
        if berth is None:
            return STILL
        sharks = [shark.position for shark in seen.sharks if shark.name != self.name]
        wanted = scaled(descent(view.position, berth, sharks), self.robot.v_max)
        return self._mover.head(view, wanted, seen.bounds)

    def _evade(self, view: View) -> Twist:
        seen = _seen(view)
        shark, _ = _nearest_shark(view)
        if shark is None or seen.safe is None or seen.start is None:
            return self._cross(view)
        away = evade(view.position, shark.position, seen.safe, seen.bounds, seen.start)
        return self._mover.head(view, scaled(away, self.robot.v_max), seen.bounds, ignore=(shark.name,))

    def _safe(self, view: View) -> Twist:
        """Drive on to its own place, so that there is room for those who come after."""
        return self._drive_to(view, _seen(view).berths.get(self.name))

    def _intercept(self, view: View) -> Twist:
        """Drive straight to where the minnow that is this shark's will be met."""
        seen = _seen(view)
        prey = seen.prey_of.get(self.name)
        if prey is None:
            return STILL
        reach = prey.radius + view.me.radius
        met = intercept(view.position, self._top_speed.value, prey.position, prey.velocity, reach=reach)
        # One that drives away faster cannot be met: it is followed until a border or another shark turns it.
        point = prey.position if met is None else met.point
        if seen.field is not None:
            point = seen.bounds.nearest(*point)
        way = point[0] - view.pose.x, point[1] - view.pose.y
        wanted = scaled(way, self._approach_speed(view, prey))
        ignored = [minnow.name for minnow in seen.prey]
        return self._mover.head(view, wanted, seen.bounds, ignore=ignored, offset=SHARK_OFFSET)

    def _approach_speed(self, view: View, prey: CrowdBody) -> float:
        """Full speed, but near its prey only so fast that the shark can still stop if the prey brakes now (m/s)."""
        between = math.dist(view.position, prey.position) - view.me.radius - prey.radius
        vx, vy = prey.velocity
        return min(self.robot.v_max, math.sqrt(2 * self.robot.a_max * max(0.0, between) + vx * vx + vy * vy))


def _seen(view: View) -> Surroundings:
    return scene(view.referee, view.velocities)


def _nearest_shark(view: View) -> tuple[CrowdBody | None, float]:
    sharks = [s for s in _seen(view).sharks if s.name != view.me.name]
    shark = min(sharks, key=lambda s: (quantised(math.dist(view.position, s.position)), s.name), default=None)
    return shark, math.inf if shark is None else math.dist(view.position, shark.position)


def _mode_of(view: View) -> str:
    if view.me.state == INACTIVE:
        return "Inactive"
    return "Sharks" if view.me.role == SHARK else "Minnows"


def _inactive(view: View) -> bool:
    return view.me.state == INACTIVE


def _lining_up(view: View) -> bool:
    return view.me.mark is not None


def _home(view: View) -> bool:
    safe = _seen(view).safe
    return safe is not None and safe.contains(*view.position)


def _still(_view: View) -> Twist:
    return STILL
