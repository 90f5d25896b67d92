"""When the world brakes a robot, all of it in one place. Pure.

Nothing here drives a robot; each rule can only hold it.
"""

from vrg.bus.messages import RefereeState
from vrg.hal.robot import COMMAND_TIMEOUT

REFEREE_TIMEOUT = 0.5
"""s of match time after which a silent referee is taken for dead, once one has been heard."""
_EPS = 1e-9


class Interlock:
    """One robot's arming, watchdog and emergency stop.

    After an emergency stop a robot stays disarmed until a command that disarms was heard and then, with the stop
    released, one that arms: a player that goes on sending what it sent before moves nothing.
    """

    def __init__(self) -> None:
        self.armed = False
        self.locked = False
        self.left = 0.0
        self.right = 0.0
        self._heard = 0.0

    def drive(self, now: float, left: float, right: float, armed: bool, estop: bool) -> None:
        """A command arrived (rad/s), at match time `now`."""
        if not armed:
            self.armed = self.locked = False
        elif estop:
            self.locked = True
        elif not self.locked:
            self.armed = True
        self.left, self.right = left, right
        self._heard = now

    def stop(self) -> None:
        """The emergency stop was engaged."""
        self.locked = self.locked or self.armed
        self.armed = False

    def silent(self, now: float) -> bool:
        """Whether an armed robot's player has gone quiet for longer than COMMAND_TIMEOUT."""
        return self.armed and now - self._heard > COMMAND_TIMEOUT + _EPS


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

    def hear(self, now: float, state: RefereeState) -> None:
        """The referee spoke, at match time `now`."""
        self.refereed = True
        self._heard = now
        self._all_held = state.halted is not None or state.estop
        self._held = frozenset(player.name for player in state.players if not player.may_move)

    def closed(self, now: float) -> bool:
        """Whether every robot is held: halted, stopped, or the referee is dead."""
        if self._heard is None:
            return self.refereed
        return self._all_held or now - self._heard > REFEREE_TIMEOUT + _EPS

    def holds(self, robot: str) -> bool:
        """Whether this robot's player may not move."""
        return robot in self._held
