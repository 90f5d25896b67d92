"""The referee's gate for the motion of robots. The device and the world enforce it, whatever a player does.

The referee may hold a robot, or lease it: then it drives the robot itself, by a motion that is part of its state. Each
state renews the lease. A state without the lease gives the robot back. If no state comes, the lease expires and the
robot stands, until the referee is heard again.

This module uses no bus and no clock.
"""

from vrg.bus.messages import RefereeState
from vrg.bus.node import is_fresh
from vrg.shared import shared
from vrg.types import STILL, Twist

REFEREE_TIMEOUT = 0.3
"""The match time in s for which a state of the referee holds. After it robots stand, until the referee is heard."""
_EPS = 1e-9


class RefereeGate:
    """Holds the robots that the referee does not let move. It is open as long as no referee was ever heard.

    Args:
        refereed: True if a referee was heard before the world was restarted; the gate is then closed until a referee is
            heard again.
    """

    def __init__(self, refereed: bool = False) -> None:
        self.refereed = refereed
        self._heard: float | None = None
        self._all_held = False
        self._held: frozenset[str] = frozenset()
        self._leases: dict[str, Twist] = {}

    def hear(self, at: float, state: RefereeState) -> None:
        """Take in a state of the referee, of match time `at`."""
        self.refereed = True
        self._heard = at
        self._all_held = state.halted is not None or state.estop
        self._held, self._leases = _held(state), _leases(state)

    def closed(self, now: float) -> bool:
        """True if every robot is held: the match is halted, the emergency stop is engaged, or the referee is silent."""
        if self._heard is None:
            return self.refereed
        return self._all_held or not is_fresh(self._heard, now, REFEREE_TIMEOUT + _EPS)

    def holds(self, robot: str) -> bool:
        """True if this robot's player may not move."""
        return robot in self._held

    def passed(self, robot: str, wanted: Twist, now: float) -> Twist:
        """The motion that a robot may make now: none, that of the referee's lease, or the one that is wanted."""
        return STILL if self.closed(now) or self.holds(robot) else self.led(robot, wanted)

    def led(self, robot: str, wanted: Twist) -> Twist:
        """The motion of a robot that nothing holds: that of the referee's lease, or the one that is wanted.

        A robot that is to stand stands also during a lease, as its device knows why.
        """
        return STILL if wanted == STILL else self._leases.get(robot, wanted)


@shared
def _held(state: RefereeState) -> frozenset[str]:
    """The players that may not move."""
    return frozenset(player.name for player in state.players if not player.may_move)


@shared
def _leases(state: RefereeState) -> dict[str, Twist]:
    """The motions of the robots that the referee drives."""
    return {player.name: player.lease for player in state.players if player.lease is not None}
