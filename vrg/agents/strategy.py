"""The strategy, which decides what one player does. It is the part that a student writes."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from msgspec import Struct, structs

from vrg.agents.radio import TeamMessage
from vrg.blame import DecisionTimeoutError, DeferredError, failure_of, place_of_method
from vrg.bus.messages import FieldObject, PlayerStatus, RefereeState, Sighting, Stroke
from vrg.errors import StrategyError
from vrg.hal.actuators import UNUSED
from vrg.hal.models import RobotModel
from vrg.hal.readings import Readings
from vrg.hal.sensors.odometry import Odometry
from vrg.regions import Region
from vrg.types import LEVEL, STILL, Pose, Twist, Uncertainty, Vector


class Action(Struct, frozen=True, gc=False):
    """The decision of a player at one tick.

    Args:
        twist: the motion to drive with until the next tick.
        say: its message to its team: numbers, strings, lists and tables of these; None without one.
        sightings: the unknown robots that it reports to the referee.
        bids: its bids in the referee's auctions: the cost by lot. None withdraws a bid, or gives back what was won.
        sketch: dots and lines that windows show, for example what it has seen and where it wants to go. None leaves
            what was last sketched.
        use: what it does with actuators of its robot, by their names: `{"kicker": 4.0}` kicks at 4 m/s.
    """

    twist: Twist = STILL
    say: Any = None
    sightings: Sequence[Sighting] = ()
    bids: Mapping[str, float | None] = {}
    sketch: Sequence[Stroke] | None = None
    use: Mapping[str, float] = UNUSED


class View(Struct, frozen=True, gc=False):
    """The knowledge of a player at one tick.

    Args:
        time: the match time, s.
        me: this player as the referee sees it.
        readings: the readings of its own robot.
        referee: the referee's state, which all players receive.
        velocities: the velocity (x, y) of every player whose pose this player receives, by its name, m/s in the map's
            frame. It is estimated from those poses.
        robot: the description of its own robot.
        pose: where this player is according to its robot's own measurement, in the map's frame.
        uncertainty: how well that is known; None if the robot is not located by fusion.
        heard: the messages of its team mates since the last tick.
        priority: what the person who commands the team wants, one of the strategy's `priorities`; None if no one
            commands it.
        obstacles: the ground that walls and obstacles of the map cover, m in the map's frame.
    """

    time: float
    me: PlayerStatus
    readings: Readings
    referee: RefereeState
    velocities: Mapping[str, Vector]
    robot: RobotModel
    pose: Pose
    heard: Sequence[TeamMessage] = ()
    priority: str | None = None
    obstacles: Sequence[Region] = ()
    uncertainty: Uncertainty | None = None

    @property
    def position(self) -> Vector:
        """The position (x, y) of this player by `pose`, m in the map's frame."""
        return self.pose.x, self.pose.y

    @property
    def speed(self) -> float | None:
        """The forward speed of this player according to its wheels, m/s; None if its robot does not measure it."""
        odometry = self.readings.latest(Odometry)
        return None if odometry is None else odometry.value.twist.v

    def others(self) -> list[PlayerStatus]:
        """Every other player whose pose is known."""
        return [p for p in self.referee.players if p.name != self.me.name and p.pose is not None]

    @property
    def things(self) -> Sequence[FieldObject]:
        """The things of the game that are no robots, such as flags and balls: what, where and how fast each is.

        One that is `lost` is where it was seen last.
        """
        return self.referee.objects

    def thing(self, kind: str) -> FieldObject | None:
        """The first thing of a kind, such as `ball`; None if there is none."""
        return next((thing for thing in self.things if thing.kind == kind), None)

    def zone(self, kind: str) -> Region | None:
        """The region of the first zone of a kind, such as `field` or `safe`; None if there is no such zone."""
        return next((zone.region for zone in self.referee.zones if zone.kind == kind), None)


class Strategy(ABC):
    """Decides how one player moves. A subclass and one line in a match file make a new kind of player.

    Args:
        name: the player's name.
        robot: the description of its robot.

    Attributes:
        priorities: the names of the priorities that a person who commands the team may set; see `View.priority`.
        games: the names of the games that it can play; empty if it is tried in any.
        seed: a number from the seed of the match, the same for all players of a team. A strategy that plays by chance
            draws from it, so that a match can be played again. It is set before the first `act`.
    """

    priorities: ClassVar[Sequence[str]] = ()
    games: ClassVar[Sequence[str]] = ()

    def __init__(self, name: str, robot: RobotModel) -> None:
        self.name = name
        self.robot = robot
        self.seed = 0

    @property
    def mode(self) -> str:
        """The mode of the strategy, in one or two words, for spectators."""
        return "-"

    @abstractmethod
    def act(self, view: View) -> Twist | Action:
        """Return the twist to drive with until the next tick, or an action that also has a message to the team.

        It is called at each tick while the match is not halted and the robot has no fault. While the player may not
        move, the twist is ignored. Numbers may be Python's or numpy's.
        """

    def complaint(self, what: str) -> StrategyError:
        """The error about a wrong answer of the strategy, with the place in the code that it comes from."""
        place = place_of_method(self, "act")
        return StrategyError(f"{type(self).__name__}.act: {what}{f' ({place})' if place else ''}")


class ForfeitError(Exception):
    """A strategy that decides elsewhere has forfeited this step: its player wants nothing, and its robot stands."""


class RemoteStrategy(Strategy):
    """A strategy that decides elsewhere, while others do. `act` waits for its answer to the view that was sent.

    Attributes:
        forfeited: how many decisions it has forfeited.
    """

    forfeited = 0

    @abstractmethod
    def send(self, view: View) -> None:
        """Send the view of which `act` will be called next."""

    def check(self) -> None:
        """Look whether it can still decide, in a tick in which it is not asked, as in a halt.

        Raises:
            StrategyError: it has ended. DecisionTimeoutError: it does not come to the end of its last decision.
        """

    def close(self) -> None:
        """End what decides. Idempotent."""


def decided(strategy: Strategy, view: View) -> tuple[Action, str]:
    """The decision of a strategy, with Python's own numbers; and its mode.

    Raises:
        StrategyError: it raises an exception, ends the program, or answers with something else.
    """
    try:
        answer = strategy.act(view)
        mode = str(strategy.mode)
    except (DecisionTimeoutError, DeferredError, StrategyError):
        raise
    except ForfeitError:
        return Action(), "Late"
    except BaseException as error:  # a student's code may raise anything
        raise failure_of(error) from error
    try:
        return action_of(answer), mode
    except TypeError as error:
        raise strategy.complaint(str(error)) from None


def action_of(answer: object) -> Action:
    """Convert what a strategy has answered into an action with Python's own numbers.

    NaN and infinity pass here. The robot's device refuses them, which becomes a fault of the player.

    Raises:
        TypeError: the answer is neither a twist of numbers nor an action.
    """
    action = answer if isinstance(answer, Action) else Action(answer)  # type: ignore[arg-type]
    twist = action.twist
    if not isinstance(twist, Twist):
        raise TypeError(f"expected a Twist(v, w) or an Action, got {answer!r}")
    if type(twist.v) is type(twist.w) is type(twist.side) is type(twist.climb) is float:
        return action
    try:
        plain = Twist(float(twist.v), float(twist.w), float(twist.side), float(twist.climb) or LEVEL)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"expected a Twist of numbers, got {twist!r}") from None
    return structs.replace(action, twist=plain)
