"""The decisions of a recorded match: what each player saw, rebuilt from the recording, and the motion that it took.

A recording holds where all robots were, the referee's states and the commands, at the instants at which players decide.
A view is rebuilt from what had been published by then. Two things differ from what the player saw: its own pose and
velocity are the true ones, where its sensors added noise; and the action is worked out from the command, which is
what the limits have left of it. The README has the sizes of these differences.
"""

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from msgspec import structs

from vrg.agents.strategy import View
from vrg.bus.messages import PlayerStatus, RefereeState, Report, Stage
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.geometry import interpolate
from vrg.hal.models import RobotModel
from vrg.hal.readings import Readings
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.navigation.motion import VelocityEstimator
from vrg.recording.recorded import RecordedMatch
from vrg.types import Pose, Twist
from vrg_learn.action import fractions_of, limits_of
from vrg_learn.learning import learning_of
from vrg_learn.observation import Vector, observe
from vrg_learn.puppet import TARGET

LONGEST_GAP: Final = 0.3
"""The match time in s between two recorded instants beyond which nothing is said of the time between them."""
_TINY: Final = 1e-6
"""The match time in s, and the share of a speed, below which two are the same."""


class DrivenBy(StrEnum):
    """The source of a player's commands. Its strategy cannot choose it, as it can the mode that it reports."""

    STRATEGY = "strategy"
    HUMAN = "human"
    PROGRAM = "program"
    """One that learns in an environment: the set-up of the run has `vrg_learn.puppet.TARGET` as the strategy."""
    REFEREE = "referee"


class RecordedDecision(NamedTuple):
    """One decision of one player in play.

    Args:
        time: the match time, s. me: the player as the referee saw it. round: the round.
        driver: what drove it. able: True if its own motion counted: it might move, and the referee did not drive it.
        observation: as `vrg_learn.observation.observe` makes it. action: as `vrg_learn.action.fractions_of`.
    """

    time: float
    me: PlayerStatus
    round: int
    driver: DrivenBy
    able: bool
    observation: Vector
    action: npt.NDArray[np.float32]


def check(setup: MatchSetup) -> None:
    """Make sure that what players saw can be rebuilt from the recording of a match.

    Raises:
        ConfigError: it cannot; or no program can learn the game; or robots of the match have different actions.
    """
    if learning_of(setup.game).scan:
        raise ConfigError(
            f"{setup.game}: expected a game in which all poses are published: a recording does not tell which "
            "ones a player received, nor what it saw with its laser at each decision"
        )
    if setup.sight is not None:
        raise ConfigError(f"expected a match in which teams see everybody, got `sight` of {setup.sight:g} m")
    if len({len(limits_of(player.robot)) for player in setup.players}) > 1:
        raise ConfigError("expected robots that all can drive sideways, or none of them")


def decisions(setup: MatchSetup, recorded: RecordedMatch) -> Iterator[RecordedDecision]:
    """The decisions of all players while rounds are played, in the order of time.

    A decision in a gap of the recording, or beyond a torn end, is left out.

    Args:
        setup: of the match, as it was played: with its secret, if it had one.

    Raises:
        ConfigError: as `check`; or the model of a robot is not known.
    """
    check(setup)
    learning, track, motion = learning_of(setup.game), _Track(recorded), VelocityEstimator()
    limits = rulebook_of(setup).speed_limits()
    robots = {player.name: player.robot for player in setup.players}
    programs = {player.name for player in setup.players if player.strategy == TARGET}
    commands = sorted(
        ((stamp, name, sent) for name in robots for stamp, sent in recorded.commands.get(name, ())),
        key=lambda command: command[0],
    )
    reports = {name: _Reports(recorded.reports.get(name, ())) for name in robots}
    states, number, state = recorded.states, 0, None
    for stamp, name, sent in commands:
        # What the referee says at this instant comes after the decision.
        while number < len(states) and states[number][0] < stamp - _TINY:
            at, published = states[number]
            number += 1
            if (there := track.at(at)) is not None:
                state = _with_poses(published, there)
                motion.update(at, {other: (pose.x, pose.y) for other, (pose, _) in there.items()})
        own = track.at(stamp)
        if state is None or state.stage is not Stage.PLAY_ROUND or own is None or name not in own:
            continue
        if (me := state.player(name)) is None:
            continue
        (pose, twist), robot = own[name], robots[name]
        odometry = Sample(stamp, 0.0, Odometry(pose=pose, twist=twist))
        view = View(
            time=stamp,
            me=me,
            readings=Readings(stamp, 0.0, True, False, samples=[odometry]),
            referee=state,
            velocities=motion.velocities,
            robot=robot,
            pose=pose,
        )
        driver = DrivenBy.PROGRAM if name in programs else DrivenBy.STRATEGY
        # The referee's lease goes first, then a person's.
        if me.lease is not None:
            driver = DrivenBy.REFEREE
        elif reports[name].manual(stamp):
            driver = DrivenBy.HUMAN
        yield RecordedDecision(
            stamp,
            me,
            state.round,
            driver,
            me.may_move and driver is not DrivenBy.REFEREE,
            observe(view, learning),
            fractions_of(wanted(sent, robot, limits.get(name, robot.v_max)), limits_of(robot)),
        )


def wanted(sent: Twist, robot: RobotModel, limit: float) -> Twist:
    """The motion for which a command was sent, as far as it shows.

    One that is as fast as the referee lets this player drive is taken for one as fast as the robot can: a strategy does
    not know its limit, and the motion that follows from it is the same.

    Args:
        sent: the command. limit: the top speed that the referee gives the player, m/s.
    """
    faster = robot.limited(_scaled(sent, 1.0 + 2.0 * _TINY), limit)
    if limit <= 0.0 or max(abs(faster.v - sent.v), abs(faster.w - sent.w), abs(faster.side - sent.side)) > _TINY**2:
        return sent
    return _scaled(sent, max(1.0, robot.v_max / limit))


def _scaled(twist: Twist, factor: float) -> Twist:
    return Twist(twist.v * factor, twist.w * factor, twist.side * factor)


def _with_poses(state: RefereeState, there: Mapping[str, tuple[Pose, Twist]]) -> RefereeState:
    """The state as it was published: a recording holds the poses beside it."""
    players = [structs.replace(p, pose=there[p.name][0] if p.name in there else None) for p in state.players]
    return structs.replace(state, players=tuple(players))


class _Track:
    """Where all robots were, and how they moved, at any time of a recording."""

    def __init__(self, recorded: RecordedMatch) -> None:
        self._times = [stamp for stamp, _ in recorded.poses]
        self._poses = [poses for _, poses in recorded.poses]

    def at(self, time: float) -> Mapping[str, tuple[Pose, Twist]] | None:
        """The pose and the twist of each robot by name; None in a gap of the recording, or beyond its ends.

        Between two instants, as they are recorded in a match of several processes, both are interpolated.
        """
        after = bisect_right(self._times, time + _TINY)
        if after == 0:
            return None
        before = after - 1
        first = {body.name: (body.pose, body.twist) for body in self._poses[before].bodies}
        gone = time - self._times[before]
        if gone <= _TINY:
            return first
        if after == len(self._times) or self._times[after] - self._times[before] > LONGEST_GAP:
            return None
        part = gone / (self._times[after] - self._times[before])
        return {
            body.name: (
                interpolate(first[body.name][0], body.pose, part),
                _between(first[body.name][1], body.twist, part),
            )
            for body in self._poses[after].bodies
            if body.name in first
        }


def _between(a: Twist, b: Twist, part: float) -> Twist:
    return Twist(a.v + (b.v - a.v) * part, a.w + (b.w - a.w) * part, a.side + (b.side - a.side) * part)


class _Reports:
    """The reports of one player, by their times."""

    def __init__(self, reports: Sequence[tuple[float, Report]]) -> None:
        self._times = [stamp for stamp, _ in reports]
        self._reports = [report for _, report in reports]

    def manual(self, time: float) -> bool:
        """True if a person held the player."""
        number = bisect_right(self._times, time + _TINY)
        return number > 0 and self._reports[number - 1].manual
