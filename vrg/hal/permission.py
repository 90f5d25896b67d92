"""The permission of robots to move. The device and the world enforce it by the same object, whatever a player does.

The referee may hold a robot, or lease it: then it drives the robot itself, by a motion that is part of its state. Each
state renews the lease. A state without the lease gives the robot back. If no state comes, the lease expires and the
robot stands, until the referee is heard again.

This module uses no bus and no clock.
"""

import math

from vrg.bus.messages import RefereeState
from vrg.bus.node import CLOCK_SKEW, is_fresh
from vrg.hal.models import RobotModel
from vrg.shared import shared
from vrg.types import Twist

REFEREE_TIMEOUT = 0.3
"""The match time in s for which a state of the referee holds. After it robots stand, until the referee is heard."""
_EPS = 1e-9


class Permission:
    """The referee's hold, its lease and its limits of speed. All may move as long as no referee was ever heard.

    Args:
        refereed: True if a referee was heard before the world was restarted; all are then held until a referee is
            heard again.
    """

    def __init__(self, refereed: bool = False) -> None:
        self.refereed = refereed
        self._heard: float | None = None
        self._all_held = False
        self._held: frozenset[str] = frozenset()
        self._leases: dict[str, Twist] = {}
        self._limits: dict[str, float] = {}
        self._closed: tuple[float, bool] | None = None
        """The match time for which it was last found out whether all are held, s, and the answer."""
        self._last: dict[str, tuple[Twist, float | None, Twist]] = {}
        """For each robot: the motion that it was last to make, the referee's limit, and the motion within it."""

    def hear(self, at: float, state: RefereeState) -> None:
        """Take in a state of the referee, of match time `at`."""
        self.refereed = True
        self._heard, self._closed = at, None
        self._all_held = state.halted is not None or state.estop
        self._held, self._leases = _held(state), _leases(state)

    def limit(self, robot: str, v_max: float) -> None:
        """Take in the referee's limit of a robot's speed, m/s."""
        self._limits[robot] = v_max

    def v_max(self, robot: str, model: RobotModel) -> float:
        """The top speed that the referee and its model allow a robot, m/s."""
        return min(self._limits.get(robot, model.v_max), model.v_max)

    def motion(self, robot: str, model: RobotModel, wanted: Twist, now: float) -> Twist | None:
        """The motion that a robot may make at match time `now`; None if it is held.

        It is that of the referee's lease, or the one that is wanted, and within its top speed.
        """
        if robot in self._held or self._is_closed(now):
            return None
        twist, limit = self._leases.get(robot, wanted), self._limits.get(robot)
        last = self._last.get(robot)
        if last is None or twist is not last[0] or limit != last[1]:
            last = self._last[robot] = twist, limit, model.limited(twist, limit)
        return last[2]

    def may_use(self, robot: str, now: float) -> bool:
        """True if a robot may use its actuators at match time `now`: it is neither held nor driven by the referee."""
        return not (robot in self._held or robot in self._leases or self._is_closed(now))

    def holds_until(self, now: float) -> float:
        """The match time up to which `motion` permits the same as at match time `now`, s, if nothing new is heard."""
        if self._heard is None:
            return math.inf
        early = now < self._heard - CLOCK_SKEW  # a state from the future counts once its time has come
        return -math.inf if early else self._heard + REFEREE_TIMEOUT

    def _is_closed(self, now: float) -> bool:
        """True if all are held: the match is halted, the emergency stop is engaged, or the referee is silent."""
        if self._closed is None or self._closed[0] != now:
            if self._heard is None:
                closed = self.refereed
            else:
                closed = self._all_held or not is_fresh(self._heard, now, REFEREE_TIMEOUT + _EPS)
            self._closed = now, closed
        return self._closed[1]


@shared
def _held(state: RefereeState) -> frozenset[str]:
    """The players that may not move."""
    return frozenset(player.name for player in state.players if not player.may_move)


@shared
def _leases(state: RefereeState) -> dict[str, Twist]:
    """The motions of the robots that the referee drives."""
    return {player.name: player.lease for player in state.players if player.lease is not None}
