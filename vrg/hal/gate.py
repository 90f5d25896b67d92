"""What the referee lets move, as every backend enforces it, whatever a player does. Pure."""

from vrg.bus.messages import RefereeState
from vrg.bus.node import is_fresh

REFEREE_TIMEOUT = 0.5
"""s of match time after which a silent referee is taken for dead, once one has been heard."""
_EPS = 1e-9


class RefereeGate:
    """What the referee lets move. Open as long as no referee was ever heard.

    Args:
        refereed: one was heard before the world was restarted: closed until it is heard again.
    """

    def __init__(self, refereed: bool = False) -> None:
        self.refereed = refereed
        self._heard: float | None = None
        self._all_held = False
        self._held: frozenset[str] = frozenset()

    def hear(self, at: float, state: RefereeState) -> None:
        """The referee spoke, at match time `at`."""
        self.refereed = True
        self._heard = at
        self._all_held = state.halted is not None or state.estop
        self._held = frozenset(player.name for player in state.players if not player.may_move)

    def closed(self, now: float) -> bool:
        """Whether every robot is held: halted, stopped, or the referee is dead."""
        if self._heard is None:
            return self.refereed
        return self._all_held or not is_fresh(self._heard, now, REFEREE_TIMEOUT + _EPS)

    def holds(self, robot: str) -> bool:
        """Whether this robot's player may not move."""
        return robot in self._held
