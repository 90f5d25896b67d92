"""The meanings of a display's buttons and fields, and the messages that follow. It needs no window and no gamepad.

The display drives as any person drives: it asks for motions under the human lease, which every player of every game
grants, and works out the motions of Goto and Reset itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from vrg.hal.models import RobotModel
from vrg.navigation.avoidance import Obstacle
from vrg.types import LEVEL, STILL, Twist, Vector
from vrg.ui.deeds import MAY_NOT_MOVE, NO_CLOCK, hindrance
from vrg.ui.driving import Driving, Hands
from vrg.ui.scene import Scene
from vrg_views.hud import words
from vrg_views.hud.form import Form
from vrg_views.hud.goals import Ground, OtherRobot, refusal
from vrg_views.hud.helm import Goal, Helm, Situation, Wish, way
from vrg_views.hud.telemetry import Telemetry

POSE_TIMEOUT: Final = 0.3
"""The match time in s after which a pose is too old to drive by: the robot stands."""
CLEARANCE: Final = 0.05
"""The distance in m that Goto keeps from walls, where there is room for it."""


@dataclass
class Desk:
    """Takes buttons, clicks and text in, and publishes driving commands.

    Args:
        driving: the hold on the player, which is taken while anything but WATCH is wanted.
        player: whose display it is. robot: the description of its robot.
        ground: where the robot can stand. home: where it began.

    Attributes:
        wish: what the person wants now. goal: of Goto; None before one was set.
        form: the fields of the goto panel.
        notice: a message to the person, such as why a goal was refused; empty if there is nothing.
    """

    driving: Driving
    player: str
    robot: RobotModel
    ground: Ground
    home: Goal
    wish: Wish = Wish.WATCH
    goal: Goal | None = None
    form: Form = field(default_factory=Form)
    notice: str = ""
    _helm: Helm = field(default_factory=Helm, repr=False)
    _others: Sequence[OtherRobot] = field(default=(), repr=False)

    @property
    def where(self) -> str:
        """The mode and the submode of the display's automaton, such as `Goto/Drive`."""
        return self._helm.where if self.wish is not Wish.WATCH else Wish.WATCH.value

    def see(self, others: Sequence[OtherRobot]) -> None:
        """Take in the other robots that the player knows."""
        self._others = others

    def aim(self, x: float, y: float) -> bool:
        """Set the goal to a place on the map, m, with the heading that stands in its field."""
        typed = self.form.read()
        heading = typed.heading if isinstance(typed, Goal) else None
        return self._set(Goal(x, y, heading))

    def confirm(self) -> bool:
        """Set the goal to what stands in the fields. Return whether it is good."""
        typed = self.form.read()
        if isinstance(typed, str):
            self._refuse(typed)
            return False
        return self._set(typed)

    def type(self, sign: str) -> None:
        """Take in one character for the field that is typed into."""
        self.notice = self.form.type(sign) or ""

    def want(self, wish: Wish, seen: Telemetry) -> None:
        """Take in that the button of a wish was pressed. That of the present wish gives the robot back."""
        self.notice = ""
        if wish is self.wish:
            if wish is Wish.GOTO and self._edited:
                self.confirm()
                return
            self.release()
            return
        if self.wish is Wish.WATCH and self._taken(seen):
            self.notice = words.TAKEN.format(player=self.player)
            return
        if wish is Wish.GOTO:
            if self.goal is None and not any(self.form.texts):
                self.notice = words.NO_GOAL
                return
            if not self.confirm():
                return
        self.form.leave()
        self.wish = wish
        self.driving.take(self.player)

    def release(self) -> None:
        """Give the robot back at once: its player plays on by itself."""
        if self.wish is not Wish.WATCH:
            self.driving.give_back()
        self.wish, self.notice = Wish.WATCH, ""
        self._helm.leave()

    def send(self, seen: Telemetry, hands: Hands, rate: float) -> None:
        """Publish the motion that the person wants. This is to be called at each tick while the clock runs.

        Args:
            rate: match seconds per real second.
        """
        if self.wish is Wish.WATCH:
            return
        situation = self.situation(seen, hands)
        twist = STILL if situation is None else self._helm.step(situation)
        self.driving.command(self._shares(twist), rate)

    def way(self, seen: Telemetry) -> list[Vector]:
        """The points of the way that the robot will drive, the goal last; empty while it is sent nowhere."""
        situation = self.situation(seen, Hands())
        return [] if situation is None else way(situation)

    def holder(self, seen: Telemetry) -> str:
        """The driver of the robot now, in words."""
        if seen.me is not None and seen.me.lease is not None:
            return words.REFEREE
        manual = seen.report is not None and seen.report.body.manual
        if self.wish is not Wish.WATCH:
            return words.YOU if manual else words.YOU_SOON
        return words.ANOTHER if self._taken(seen) else words.OWN_STRATEGY

    def hindrance(self, seen: Telemetry, scene: Scene) -> str:
        """The reason why the robot cannot be driven, in words; empty if there is none. `scene` is what is shown."""
        if not seen.live or seen.state is None:
            return words.NO_REFEREE if seen.live else NO_CLOCK
        scene = replace(scene, estop=scene.estop or self.stopped(seen))
        own = scene.player(self.player)
        why = hindrance(scene, own) or (MAY_NOT_MOVE if own is None else "")
        return why or (words.NO_POSE if self._stale(seen) else "")

    def situation(self, seen: Telemetry, hands: Hands) -> Situation | None:
        """The input of the automaton; None while the robot's pose is not known."""
        forward, turn, climb = hands.shares
        pose = seen.pose
        if pose is None or (self._stale(seen) and self.wish is not Wish.MANUAL):
            return None
        radius = self.ground.radius
        return Situation(
            now=seen.now,
            pose=pose,
            wish=self.wish,
            goal=self.goal or self.home,
            home=self.home,
            hands=Twist(
                forward * self.robot.v_max, turn * self.robot.w_max, climb=climb * self.robot.climb_max or LEVEL
            ),
            neighbours=[Obstacle(o.place, o.velocity, radius + o.radius) for o in self._others],
            bounds=self.ground.bounds,
            walls=self.ground.walls,
            margin=radius + CLEARANCE,
            speed=self.robot.v_max,
        )

    @property
    def _edited(self) -> bool:
        """True if the fields say something else than the goal."""
        if self.goal is None:
            return any(self.form.texts)
        shown = Form()
        shown.show(self.goal)
        return shown.texts != self.form.texts

    def _set(self, goal: Goal) -> bool:
        why = refusal(goal, self.ground, self._others)
        if why is not None:
            self._refuse(why)
            return False
        self.goal, self.notice = goal, ""
        self.form.show(goal)
        self.form.leave()
        return True

    def _refuse(self, why: str) -> None:
        old = self.goal
        self.notice = why if old is None else words.KEPT.format(reason=why, x=old.x, y=old.y)

    def _taken(self, seen: Telemetry) -> bool:
        """True if a person drives the robot who is not at this display."""
        return self.driving.taken(self.player, manual=seen.report is not None and seen.report.body.manual)

    @staticmethod
    def stopped(seen: Telemetry) -> bool:
        """True if the emergency stop is engaged, for all or at the robot itself."""
        report = seen.report
        return (seen.state is not None and seen.state.estop) or (report is not None and report.body.estop)

    @staticmethod
    def _stale(seen: Telemetry) -> bool:
        return seen.pose_age is None or seen.pose_age > POSE_TIMEOUT

    def _shares(self, twist: Twist) -> tuple[float, float, float]:
        """A motion as parts of what the robot can do. A motion that is too fast is slowed down on the same curve."""
        forward, turn = twist.v / self.robot.v_max, twist.w / self.robot.w_max
        most = max(1.0, abs(forward), abs(turn))
        return forward / most, turn / most, twist.climb / (self.robot.climb_max or 1.0)
