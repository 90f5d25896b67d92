"""Whether the emergency stop of the match holds a robot. This module uses no bus and no clock."""

from collections.abc import Sequence

from vrg.bus.codec import Received
from vrg.bus.messages import Estop

SETTLE = 0.5
"""The match time in s after a release in which the referee's state may still report the stop before it."""


def decisive(orders: Sequence[Received[Estop]]) -> Estop | None:
    """The order that counts among those that arrived in one tick, or None if none arrived.

    An order that engages the stop wins, whatever the stamps say. If all are releases, the last one counts.
    """
    engaging = (order.body for order in orders if order.body.engaged)
    return next(engaging, orders[-1].body if orders else None)


class EstopLatch:
    """The latch of one robot's emergency stop.

    An order sets it. The referee's state sets it too, in case the order itself was lost on the way. A lost release is
    made up for in the same way: once the referee has confirmed the stop, its state also releases it. A stop that the
    referee has never reported stays engaged, so that no robot moves after a stop that the referee has not heard of.

    Attributes:
        engaged: True while the robot must not move.
    """

    def __init__(self) -> None:
        self.engaged = False
        self._confirmed = False
        self._released_at: float | None = None

    def order(self, engaged: bool, now: float) -> None:
        """Take in an order that engages or releases the stop, heard at match time `now`."""
        self.engaged = engaged
        self._confirmed = False
        self._released_at = None if engaged else now

    def referee(self, engaged: bool, stamp: float) -> None:
        """Take in whether the stop is engaged according to the referee's state of match time `stamp`."""
        if engaged:
            late = self._released_at is not None and stamp <= self._released_at + SETTLE
            if not late:
                self.engaged = self._confirmed = True
        elif self._confirmed:
            self.engaged = self._confirmed = False
