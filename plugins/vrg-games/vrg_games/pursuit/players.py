"""The strategies of both games: a Marco and Polos, and a pursuer and evaders that play by the circle of Apollonius."""

import math

from vrg.agents import Action, Strategy, Stroke, View
from vrg.bus.messages import PlayerStatus
from vrg.geometry import ahead
from vrg.hal.models import RobotModel
from vrg.navigation.control import linearise, scaled
from vrg.regions import Circle
from vrg.types import STILL, Twist, Vector
from vrg_games.pursuit import ANSWER, APOLLONIUS, EVADER, MARCO, MARCO_POLO, PURSUER, RATIO
from vrg_games.pursuit.circle import apollonius, nearest_to

OFFSET = 0.2
"""The distance from a robot's centre to the point that is steered, m."""
BORDER = 0.5
"""How far the hunted stay from the border of the field, m."""
STEP = 0.8
"""The length of a move that a Polo plans, m."""
CROWDED = 1.5
"""The distance in m from another Polo below which a Polo keeps away from it."""


class Marco(Strategy):
    """Calls as often as it may, and drives to where the nearest answer came from."""

    games = (MARCO_POLO.name,)
    mode = "Marco!"

    def act(self, view: View) -> Action:
        """Call, and drive to an answer."""
        answers = [(each.x, each.y) for each in view.referee.objects]
        goal = min(answers, key=lambda place: math.dist(place, view.position), default=view.position)
        return Action(towards(view, goal), bids={ANSWER: 0.0})


class Polo(Strategy):
    """Looks at moves in all directions, and takes the one after which Marco is far, and the others are not near.

    It tells the others over the radio where it is, as it does not see them either.
    """

    games = (MARCO_POLO.name,)
    mode = "Polo!"

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._others: dict[str, Vector] = {}

    def act(self, view: View) -> Action:
        """Take the best of 16 moves, or stay."""
        for each in view.heard:
            match each.words:
                case [float(x), float(y)]:
                    self._others[each.speaker] = x, y
        field, marcos = view.zone("field"), [place(p) for p in view.others() if p.role == MARCO]
        if field is None or not marcos:
            return Action(STILL)
        others = [self._others[p.name] for p in in_play(view) if p.name in self._others]

        def worth(goal: Vector) -> float:
            """The distance from Marco after a move, less what is lost near the others and in a corner."""
            crowd = max((CROWDED - math.dist(goal, other) for other in others), default=0.0)
            return math.dist(goal, marcos[0]) - max(0.0, crowd) - 0.15 * math.dist(goal, field.middle)

        goals = [field.shrunk(BORDER).nearest(*ahead(*view.position, math.tau * i / 16, STEP)) for i in range(16)]
        twist = towards(view, max([*goals, view.position], key=worth))
        return Action(twist, say=[round(each, 2) for each in view.position])


class Pursuer(Strategy):
    """Drives to the point nearest to the harbour that an evader can reach in time, one evader after the other.

    It begins with the one that comes nearest to the harbour. One whose circle overlaps with the harbour gets home
    whatever the pursuer does, so it goes on to another one.
    """

    games = (APOLLONIUS.name,)
    mode = "Intercept"

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._target = ""

    def act(self, view: View) -> Action:
        """Drive to the point of the circle, and show both."""
        port, field, ratio = view.zone("safe"), view.zone("field"), view.referee.numbers.get(RATIO)
        evaders = {p.name: place(p) for p in in_play(view) if p.role == EVADER and p.pose is not None}
        if port is None or field is None or ratio is None or not evaders or view.me.mark is not None:
            return Action(STILL, sketch=[])
        circles = {name: apollonius(at, view.position, ratio) for name, at in evaders.items()}
        margins = {name: port.distance(*circle.middle) - circle.radius for name, circle in circles.items()}
        if margins.get(self._target, -1.0) < 0.0:
            self._target = min(margins, key=lambda name: (margins[name] < 0.0, margins[name]))
        circle = circles[self._target]
        goal = field.nearest(*nearest_to(circle, port))
        return Action(towards(view, goal), sketch=shown(circle, goal))


class Evader(Strategy):
    """Drives to the point of its circle that is nearest to the harbour."""

    games = (APOLLONIUS.name,)
    mode = "Run"

    def act(self, view: View) -> Twist:
        """Drive there."""
        port, field, ratio = view.zone("safe"), view.zone("field"), view.referee.numbers.get(RATIO)
        pursuers = [place(p) for p in view.others() if p.role == PURSUER]
        if port is None or field is None or ratio is None or not pursuers or view.me.mark is not None:
            return STILL
        goal = nearest_to(apollonius(view.position, pursuers[0], ratio), port)
        return towards(view, field.shrunk(BORDER).nearest(*goal))


def shown(circle: Circle, goal: Vector) -> list[Stroke]:
    """A circle, and the point of it to which a player drives."""
    line = tuple(ahead(*circle.middle, math.tau * i / 60, circle.radius) for i in range(61))
    return [Stroke(points=line), Stroke(points=(goal,), label="meeting")]


def in_play(view: View) -> list[PlayerStatus]:
    """The players that are neither caught nor at home."""
    return [player for player in view.referee.players if player.state == "active"]


def place(player: PlayerStatus) -> Vector:
    """Where a player is whose pose is known, m."""
    assert player.pose is not None
    return player.pose.x, player.pose.y


def towards(view: View, goal: Vector) -> Twist:
    """Drive to a place, m, at top speed."""
    way = goal[0] - view.position[0], goal[1] - view.position[1]
    return linearise(scaled(way, view.robot.v_max), view.pose.theta, OFFSET)
