"""The strategy of an intruder: straight on, at constant speed (thesis 4.2.3, eq. 4.1)."""

from vrg.agents.charon import Agent, Automaton, Mode, Submode, Transition
from vrg.agents.strategy import Strategy, View
from vrg.games.pursuit_evasion import CROSSING, WAITING
from vrg.geometry import wrap
from vrg.hal.models import RobotModel
from vrg.portable.scalars import cos_sin
from vrg.types import STILL, Pose, Twist

TURN_GAIN = 1.5
"""The gain by which it turns back to its heading, 1/s."""
LOOKAHEAD = 2.0
"""The distance in m ahead on its course to which it heads."""


class Intruder(Strategy):
    """Waits until the referee lets it go, and then drives along the line on which it stood.

    Its course is fixed by where it stands and where it heads while it waits. A strategy that is started in the middle
    of the crossing goes on in the direction in which its robot drives.
    """

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._automaton = Automaton(self.agent())
        self._course: Pose | None = None

    @property
    def mode(self) -> str:
        """The mode and submode of the automaton, such as `Intruder/Cross`."""
        return self._automaton.where

    def act(self, view: View) -> Twist:
        """Return the twist of one step of the automaton."""
        return self._automaton.step(view)

    def agent(self) -> Agent[View, Twist]:
        """The automaton of Figure 4.6."""
        intruder = Mode(
            "Intruder",
            [Submode("Wait", self._wait), Submode("Cross", self._cross), Submode("Stop", lambda _: STILL)],
            [
                Transition[View]("Wait", "Cross", "Go", lambda v: v.me.state == CROSSING),
                Transition("Cross", "Stop", "Captured or Escaped", lambda v: v.me.state not in (CROSSING, WAITING)),
                Transition("Cross", "Wait", "Reset", lambda v: v.me.state == WAITING),
                Transition("Wait", "Stop", "Captured or Escaped", lambda v: v.me.state not in (CROSSING, WAITING)),
                Transition("Stop", "Wait", "Reset", lambda v: v.me.state in (CROSSING, WAITING)),
            ],
        )
        return Agent(
            name="Intruder",
            modes=[intruder],
            transitions=[],
            initial=lambda _: "Intruder",
            starts=[("Intruder", "Start")],
            inputs=["referee state", "INS"],
            outputs=["twist"],
        )

    def _wait(self, view: View) -> Twist:
        self._course = None
        return STILL

    def _cross(self, view: View) -> Twist:
        if self._course is None:
            self._course = view.pose
        course, pose = self._course, view.pose
        # Its distance to the left of the course is small, so it may stand for the sine of the angle back to it.
        cos, sin = cos_sin(course.theta)
        left = (pose.y - course.y) * cos - (pose.x - course.x) * sin
        error = wrap(course.theta - pose.theta) - max(-0.5, min(0.5, left / LOOKAHEAD))
        return Twist(self.robot.v_max, TURN_GAIN * error)
