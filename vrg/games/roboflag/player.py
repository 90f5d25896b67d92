"""A player of RoboFlag: the statechart of Figure 4.18 and what a player can do in each of its states (thesis 4.4.3).

What the players of a team do together is a `Tactic`, by which the strategies differ.
"""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from vrg.agents.charon import Agent, Automaton, Mode, Submode, Transition
from vrg.agents.interception import intercept
from vrg.agents.mover import Mover
from vrg.agents.strategy import Action, Strategy, View
from vrg.games.roboflag import FLAGGED, NORMAL, TAGGED
from vrg.games.roboflag.evasion import BestDirection, Flags, Floats, Safe, best_course, in_bounds, points_in_disc
from vrg.games.roboflag.formation import FEINT, feint, formed_up, lane, places
from vrg.games.roboflag.posts import known_in, posts, shields, targets
from vrg.games.roboflag.situation import Known, Memory, Situation, TeamField, situation_of
from vrg.games.roboflag.tactics import Tactic
from vrg.games.roboflag.talk import Talk
from vrg.hal.models import RobotModel
from vrg.navigation.control import scaled
from vrg.regions import Circle, Rectangle, Region
from vrg.types import STILL, Twist, Vector

MIDLINE = 0.1
"""The distance in m that a player keeps from the midline that tags an opponent on its own half."""
MAX_TIME_MARGIN = 0.25
"""The time in s by which a way must be safe at first."""
BOLDNESS = 0.12
"""The seconds of safety that a player gives up for each second that it has been waiting."""
RISK = -1.5
"""The safety in s below which no player goes of its own will."""
MIN_PROGRESS = 0.1
"""The progress in m below which a carrier waits where it is, and an attacker drives to and fro behind the midline."""
NEARLY = 1.5
"""The distance in m from its place from which on an attacker waits for the others."""
FORM_UP_TIMEOUT = 10.0
"""The match time in s for which an attacker waits until all have formed up."""
AT_POST, OFF_POST = 0.15, 0.35
"""The distances in m from its post at which a guard stops, and at which it drives there again."""
APPROACH, SLOWEST = 1.5, 0.2
"""The speed in m/s at which a guard drives to its post, for each metre that is left, and at least."""
MARK_REACH = 0.2
"""The distance in m from its mark at which a player stops before a round."""


class RoboFlagPlayer(Strategy):
    """Plays in the state that the referee publishes. Subclasses choose a tactic.

    Attributes:
        tactic: how the team shares the work.
        orders: the tactics that a person who commands the team may set, by priority.
    """

    tactic: Tactic
    orders: Mapping[str, Tactic]

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._automaton = Automaton(self.agent())
        self._mover = Mover()
        self._memory = Memory()
        self._ground: TeamField | None = None
        self._zones: object = None
        self._talk = Talk(name)
        self._job = "Guard"
        self._since = 0.0
        self._staying = False
        self._charging = False
        self._waiting_since: float | None = None
        self._situation: Situation
        self._chosen: Tactic
        self._target: Known | None = None
        self._goal: Vector | None = None

    @property
    def mode(self) -> str:
        """The mode and submode of the automaton, such as `Normal/Attack`."""
        return self._automaton.where

    def choose(self, view: View, s: Situation) -> Tactic:
        """The tactic of this tick: what the team's commander wants, or the strategy's own."""
        return self.orders.get(view.priority or "", self.tactic)

    def act(self, view: View) -> Action:
        """One step of the automaton, with the bid for the attack and what the team must know."""
        if self._ground is None or view.referee.zones != self._zones:
            self._zones, self._ground = view.referee.zones, TeamField.of(view)
        if self._ground is None:
            return Action(STILL)
        s = self._situation = situation_of(view, self._ground, self._memory, self._talk.targets(view))
        self._chosen = self.choose(view, s)
        self._goal = None
        job = self._job_of(view, s)
        if job != self._job or view.me.state != NORMAL:
            self._charging, self._waiting_since = False, None
        if job != self._job:
            self._job, self._since = job, view.time
        twist = self._automaton.step(view)
        if self._automaton.mode != _mode_of(view):
            # An official has overruled a call, and no event of the game leads to the new mode.
            self._automaton.restart()
            twist = self._automaton.step(view)
        target = self._target.name if self._automaton.submode == "Tag" and self._target is not None else None
        talk = self._talk
        return Action(
            twist, say=talk.claim(view, target), bids=talk.bids(view, s), sketch=talk.sketch(view, self._goal)
        )

    def agent(self) -> Agent[View, Twist]:
        """The automaton of Figure 4.18. The submodes of Normal are the jobs of a player."""
        jobs = {
            "LineUp": (self._line_up, "Initialize"),
            "Attack": (self._attack, "LowestBid"),
            "Escort": (self._escort, "FlagTakenByMate"),
            "Tag": (self._tag, "OpponentNear"),
            "Guard": (self._guard, "NothingElse"),
        }
        between = [
            Transition(source, target, event, self._has_job(target))
            for source in jobs
            for target, (_, event) in jobs.items()
            if source != target
        ]
        return Agent(
            name="RoboFlag player",
            modes=[
                Mode("Normal", [Submode(name, law) for name, (law, _) in jobs.items()], between),
                Mode("Flagged", [Submode("Evade", self._evade)]),
                Mode("Tagged", [Submode("LedHome", _still)]),
            ],
            transitions=[
                Transition("Normal", "Flagged", "FlagTaken", lambda v: v.me.state == FLAGGED),
                Transition("Normal", "Tagged", "TaggedOnTheirHalf", lambda v: v.me.state == TAGGED),
                Transition("Flagged", "Tagged", "Tagged", lambda v: v.me.state == TAGGED),
                Transition("Flagged", "Normal", "HomeWithTheFlag", lambda v: v.me.state == NORMAL),
                Transition("Tagged", "Normal", "Home", lambda v: v.me.state == NORMAL),
            ],
            initial=_mode_of,
            starts=[("Normal", "Begin")],
            inputs=["referee state", "pose", "team talk", "priority"],
            outputs=["twist", "bid", "team talk"],
        )

    def _has_job(self, job: str) -> Callable[[View], bool]:
        return lambda _view: self._job == job

    def _job_of(self, view: View, s: Situation) -> str:
        """The present job of a normal player."""
        self._target = None
        if view.me.mark is not None:
            return "LineUp"
        if s.carrier is None:
            if self.name in self._chosen.attackers(s):
                return "Attack"
        elif self.name in self._chosen.escorts(s):
            return "Escort"
        self._target = targets(s, self._defenders(s), self._threats(s)).get(self.name)
        return "Guard" if self._target is None else "Tag"

    def _defenders(self, s: Situation) -> list[Known]:
        """The players of the team that neither attack, nor shield the carrier, nor carry the flag."""
        busy = self._chosen.attackers(s) if s.carrier is None else self._chosen.escorts(s)
        return [known for known in s.team if known.name not in busy and known.state == NORMAL]

    def _threats(self, s: Situation) -> Sequence[Known]:
        return [threat for threat in s.threats if self._chosen.chases or threat.name == s.thief]

    def _line_up(self, view: View) -> Twist:
        mark = view.me.mark
        if mark is None or math.dist(view.position, (mark.x, mark.y)) < MARK_REACH:
            return self._mover.stay(view)
        return self._mover.go(view, (mark.x, mark.y), self._bounds())

    def _attack(self, view: View) -> Twist:
        """Go for the flag on a way on which no opponent can tag this player, and with less care the longer it takes."""
        s = self._situation
        ground = s.ground
        if self._chosen.together and not self._charging:
            formation = places(ground, self._chosen.attackers(s), self._chosen.flanks)
            place = formation[self.name]
            if self._waiting_since is None and math.dist(view.position, place) <= NEARLY:
                self._waiting_since = view.time
            late = self._waiting_since is not None and view.time - self._waiting_since > FORM_UP_TIMEOUT
            self._charging = late or formed_up(s.team, formation)
            if not self._charging:
                aside = (place[0], place[1] + ground.ahead * FEINT * feint(view.time))
                return self._to_place(view, self._bounds().nearest(*aside), ground.their_flag)

        def harmless(points: Floats) -> Flags:
            own = (points[..., 0] - ground.midline) * ground.ahead < 0.0
            return own | points_in_disc(points, ground.their_zone)

        wait = None
        if ground.beyond(view.position[0]) < 0.0:
            wait = lane(self._bounds().bounds, ground.midline, ground.ahead, view.time)
        return self._drive_safely(
            view, ground.their_flag, harmless, bold=self._charging and self._chosen.bold, wait=wait
        )

    def _evade(self, view: View) -> Twist:
        """Bring the flag home, on the way on which no opponent can tag this player."""
        s = self._situation
        home = Circle(s.ground.home.x, s.ground.home.y, s.ground.home.radius)

        def harmless(points: Floats) -> Flags:
            return (
                points_in_disc(points, home)
                | points_in_disc(points, s.ground.their_zone)
                | points_in_disc(points, s.ground.own_zone)
            )

        return self._drive_safely(view, s.ground.haven.nearest(*view.position), harmless, bold=False)

    def _drive_safely(
        self, view: View, goal: Vector, harmless: Safe, *, bold: bool, wait: Vector | None = None
    ) -> Twist:
        """Drive towards a goal, or to the place `wait` while no way is safe; None stands for the own place."""
        s = self._situation
        bounds = self._bounds().bounds
        course: BestDirection = best_course(
            view.position,
            goal,
            np.array([hunter.place for hunter in s.hunters]).reshape(-1, 2),
            speed=self.robot.v_max,
            reach=s.ground.tag_distance,
            margin=RISK if bold else max(RISK, MAX_TIME_MARGIN - BOLDNESS * (view.time - self._since)),
            inside=lambda points: in_bounds(points, bounds),
            harmless=harmless,
        )
        self._goal = goal
        if (
            0.0 <= course.progress < MIN_PROGRESS
            and course.margin > 0.0
            and math.dist(view.position, goal) > MIN_PROGRESS
        ):
            return self._mover.stay(view, goal) if wait is None else self._mover.go(view, wait, self._bounds())
        return self._mover.head(view, scaled(course.heading, self.robot.v_max), self._bounds())

    def _escort(self, view: View) -> Twist:
        """Be in the way of the opponent that is near the carrier, and else go along with the carrier."""
        s = self._situation
        carrier = next((mate for mate in s.mates if mate.name == s.carrier), None)
        if carrier is None:
            return self._guard(view)
        place, opponent = shields(s, known_in(self._chosen.escorts(s), s.team), carrier).get(
            self.name, (carrier.place, carrier.name)
        )
        self._goal = place
        return self._mover.go(view, self._bounds().nearest(*place), self._bounds(), ignore=[opponent])

    def _tag(self, view: View) -> Twist:
        """Drive to where the opponent can be met, but not beyond the midline unless it carries the flag."""
        s, target = self._situation, self._target
        if target is None:
            return self._guard(view)
        met = intercept(view.position, self.robot.v_max, target.place, target.velocity)
        point = target.place if met is None else met.point
        bounds = self._bounds() if target.name == s.thief else s.ground.own_half.shrunk(MIDLINE)
        point = bounds.nearest(*point)
        self._goal = point
        return self._mover.go(view, point, self._bounds(), ignore=[target.name])

    def _guard(self, view: View) -> Twist:
        """Stand outside the flag zone, between the flag and an opponent."""
        s = self._situation
        defenders = self._defenders(s)
        tagging = targets(s, defenders, self._threats(s))
        guards = [known for known in defenders if known.name not in tagging]
        post = posts(s, guards).get(self.name)
        if post is None:
            return self._mover.stay(view)
        return self._to_place(view, self._bounds().nearest(*post), (s.ground.midline, view.position[1]))

    def _to_place(self, view: View, place: Vector, towards: Vector) -> Twist:
        """Drive to a place, and stand there, turned towards another one."""
        away = math.dist(place, view.position)
        self._staying = away < (OFF_POST if self._staying else AT_POST)
        if self._staying:
            return self._mover.stay(view, towards)
        self._goal = place
        return self._mover.go(view, place, self._bounds(), speed=min(self.robot.v_max, max(SLOWEST, APPROACH * away)))

    def _bounds(self) -> Region:
        return Rectangle(-1e5, -1e5, 1e5, 1e5) if self._ground is None else self._ground.inner


def _mode_of(view: View) -> str:
    return {FLAGGED: "Flagged", TAGGED: "Tagged"}.get(view.me.state, "Normal")


def _still(_view: View) -> Twist:
    return STILL
