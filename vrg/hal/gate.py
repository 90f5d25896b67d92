"""Which robots the referee lets move. The device and the world enforce it, whatever a player does.

This module uses no bus and no clock.
"""

from vrg.bus.messages import RefereeState
from vrg.bus.node import is_fresh

REFEREE_TIMEOUT = 0.5
"""The match time in s after which a silent referee is taken for dead, once one has been heard."""
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

    def hear(self, at: float, state: RefereeState) -> None:
        """Take in a state of the referee, of match time `at`."""
        self.refereed = True
        self._heard = at
        self._all_held = state.halted is not None or state.estop
        self._held = frozenset(player.name for player in state.players if not player.may_move)

    def closed(self, now: float) -> bool:
        """Whether every robot is held: the match is halted, the emergency stop is engaged, or the referee is dead."""
        if self._heard is None:
            return self.refereed
        return self._all_held or not is_fresh(self._heard, now, REFEREE_TIMEOUT + _EPS)

    def holds(self, robot: str) -> bool:
        """Whether this robot's player may not move."""
        return robot in self._held
