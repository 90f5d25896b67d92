"""The strategy of a player of Sharks and Minnows (thesis 4.3.3, Figures 4.12 and 4.13)."""

import math
from collections.abc import Sequence
from dataclasses import replace

from vrg.agents.avoidance import Obstacle, steer
from vrg.agents.charon import Agent, Automaton, Mode, Submode, Transition
from vrg.agents.control import linearise, scaled
from vrg.agents.interception import intercept
from vrg.agents.motion import TopSpeed
from vrg.agents.potential import descent, evade
from vrg.agents.strategy import Strategy, View
from vrg.bus.messages import PlayerStatus
from vrg.games.sharks_and_minnows import ACTIVE, INACTIVE, MINNOW, SHARK
from vrg.hal.models import RobotModel
from vrg.regions import Rectangle
from vrg.types import STILL, Pose, Twist, Vector

OFFSET = 0.25
"""The distance in m from the body's centre to the point that feedback linearisation steers."""
BORDER = 0.7
"""The distance in m that a body's centre keeps from the border: a little more than it needs to stop."""
EVADE_DISTANCE, CALM_DISTANCE = 2.0, 2.3
"""The distances between centres in m at which a minnow begins and ends to evade one shark."""
HOME_DEPTH = 0.6
"""The distance in m that a minnow drives into the end zone before it stops, to leave room behind it."""
HORIZON = 2.5
"""The time in s ahead for which bodies in the way are avoided."""
GAP = 0.15
"""The distance in m to keep between the circles around two bodies."""
LOYALTY = 0.8
"""A shark changes its target only if it meets the new one in less than this fraction of the old one's time."""
MARK_REACH = 0.2
"""The distance in m from its mark at which a player stops; the referee holds it already at a longer one."""


class SharksAndMinnowsPlayer(Strategy):
    """Plays as a minnow or a shark, or stands still if inactive, as the referee's state says."""

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._automaton = Automaton(self.agent())
        self._top_speed = TopSpeed(robot.v_max)
        self._target: str | None = None

    @property
    def mode(self) -> str:
        """The mode and submode of the automaton, such as `Minnows/Cross`."""
        return self._automaton.where

    def act(self, view: View) -> Twist:
        """Return the twist of one step of the automaton."""
        if view.speed is not None:
            self._top_speed.update(view.time, view.speed)
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
                Transition("Intercept", "Wait", "NoPrey", lambda v: not _prey(v)),
                Transition("Wait", "Intercept", "Prey", lambda v: bool(_prey(v))),
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
        if mark is None:
            return STILL
        if math.dist(view.position, (mark.x, mark.y)) < MARK_REACH:
            return STILL
        way = mark.x - view.pose.x, mark.y - view.pose.y
        speed = min(self.robot.v_max, max(0.15, math.hypot(*way)))
        return self._steer(view, scaled(way, speed), horizon=min(HORIZON, math.hypot(*way) / speed))

    def _cross(self, view: View) -> Twist:
        safe = view.zone("safe")
        if safe is None:
            return STILL
        sharks = [_place(p) for p in view.others() if _is_active(p, SHARK)]
        return self._steer(view, scaled(descent(view.position, safe, sharks), self.robot.v_max))

    def _evade(self, view: View) -> Twist:
        shark, _ = _nearest_shark(view)
        safe, field = view.zone("safe"), view.zone("field")
        if shark is None or safe is None or field is None:
            return self._cross(view)
        away = evade(view.position, _place(shark), safe, field.shrunk(BORDER))
        return self._steer(view, scaled(away, self.robot.v_max), ignore=shark.name)

    def _safe(self, view: View) -> Twist:
        """Drive so deep into the end zone that there is room for those who come after."""
        safe = view.zone("safe")
        if safe is None or safe.shrunk(HOME_DEPTH).contains(*view.position):
            return STILL
        inward = safe.shrunk(HOME_DEPTH + 0.2).nearest(*view.position)
        way = inward[0] - view.pose.x, inward[1] - view.pose.y
        return self._steer(view, scaled(way, self.robot.v_max))

    def _intercept(self, view: View) -> Twist:
        """Drive straight to where the minnow that can be met first will be."""
        speed = self._top_speed.value
        meetings: dict[str, tuple[float, Vector]] = {}
        for minnow in _prey(view):
            reach = minnow.radius + view.me.radius
            velocity = view.velocities.get(minnow.name, (0.0, 0.0))
            met = intercept(view.position, speed, _place(minnow), velocity, reach=reach)
            if met is None:
                # A minnow that drives away faster cannot be met. If there are only such ones, the nearest is chased.
                meetings[minnow.name] = (1e3 + math.dist(view.position, _place(minnow)), _place(minnow))
            else:
                meetings[minnow.name] = (met.time, met.point)
        if not meetings:
            return STILL
        best = min(meetings, key=lambda name: (meetings[name][0], name))
        if self._target not in meetings or meetings[best][0] < LOYALTY * meetings[self._target][0]:
            self._target = best
        field = view.zone("field")
        point = meetings[self._target][1]
        if field is not None:
            point = field.shrunk(BORDER).nearest(*point)
        way = point[0] - view.pose.x, point[1] - view.pose.y
        prey = next(p for p in _prey(view) if p.name == self._target)
        return self._steer(view, scaled(way, self._approach_speed(view, prey)), ignore=self._target)

    def _approach_speed(self, view: View, prey: PlayerStatus) -> float:
        """Full speed, but near its prey only so fast that the shark can still stop if the prey stops now (m/s)."""
        between = math.dist(view.position, _place(prey)) - view.me.radius - prey.radius
        braking = math.sqrt(2 * self.robot.a_max * max(0.0, between))
        follow = math.hypot(*view.velocities.get(prey.name, (0.0, 0.0)))
        return min(self.robot.v_max, max(braking, follow))

    def _steer(self, view: View, wanted: Vector, *, ignore: str = "", horizon: float = HORIZON) -> Twist:
        """The twist for a wanted velocity, which leads around bodies and stays inside the field."""
        field = view.zone("field")
        bounds = field.shrunk(BORDER) if field else Rectangle(-1e5, -1e5, 1e5, 1e5)
        u = steer(view.position, wanted, _bodies(view, ignore), bounds, horizon)
        return linearise(u, view.pose.theta, OFFSET)


def _bodies(view: View, ignore: str) -> Sequence[Obstacle]:
    return [
        Obstacle(
            _place(other),
            view.velocities.get(other.name, (0.0, 0.0)) if other.may_move else (0.0, 0.0),
            view.me.radius + other.radius + GAP,
        )
        for other in view.others()
        if other.name != ignore
    ]


def _place(player: PlayerStatus) -> Vector:
    pose: Pose | None = player.pose
    if pose is None:
        raise ValueError(f"{player.name}: its pose is not known")
    return pose.x, pose.y


def _is_active(player: PlayerStatus, role: str) -> bool:
    return player.role == role and player.state == ACTIVE


def _nearest_shark(view: View) -> tuple[PlayerStatus | None, float]:
    sharks = [p for p in view.others() if _is_active(p, SHARK)]
    nearest = min(sharks, key=lambda p: math.dist(view.position, _place(p)), default=None)
    return nearest, math.dist(view.position, _place(nearest)) if nearest else math.inf


def _prey(view: View) -> list[PlayerStatus]:
    """The active minnows outside the end zone."""
    safe = view.zone("safe")
    return [p for p in view.others() if _is_active(p, MINNOW) and (safe is None or not safe.contains(*_place(p)))]


def _mode_of(view: View) -> str:
    if view.me.state == INACTIVE:
        return "Inactive"
    return "Sharks" if view.me.role == SHARK else "Minnows"


def _inactive(view: View) -> bool:
    return view.me.state == INACTIVE


def _lining_up(view: View) -> bool:
    return view.me.mark is not None


def _home(view: View) -> bool:
    safe = view.zone("safe")
    return safe is not None and safe.contains(*view.position)


def _still(_view: View) -> Twist:
    return STILL
