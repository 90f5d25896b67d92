"""The reasons for which the world brakes one robot, besides the referee's holds (vrg.hal.gate).

Nothing here drives a robot; each rule can only hold it. This module uses no bus and no clock.
"""

from vrg.hal.driver import COMMAND_TIMEOUT

_EPS = 1e-9


class Interlock:
    """One robot's arming, watchdog and emergency stop.

    After an emergency stop a robot stays disarmed until a command that disarms was heard and then, with the stop
    released, a command that arms. So a player that goes on sending the same commands does not move its robot.

    Attributes:
        armed: True if the motors accept commands.
        locked: True if the emergency stop has hit the robot and no command that disarms was heard since.
    """

    def __init__(self) -> None:
        self.armed = False
        self.locked = False
        self._heard = 0.0

    def drive(self, now: float, armed: bool, estop: bool) -> None:
        """Take in a command at match time `now`.

        Args:
            armed: False disarms the robot. estop: whether the emergency stop is engaged.
        """
        if not armed:
            self.armed = self.locked = False
        elif estop:
            self.locked = True
        elif not self.locked:
            self.armed = True
        self._heard = now

    def stop(self) -> None:
        """Disarm the robot, because the emergency stop was engaged."""
        self.locked = self.locked or self.armed
        self.armed = False

    def silent(self, now: float) -> bool:
        """True if an armed robot's player has sent no command for longer than COMMAND_TIMEOUT."""
        return self.armed and now - self._heard > COMMAND_TIMEOUT + _EPS
