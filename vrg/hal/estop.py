"""Whether the emergency stop of the match holds a robot. Pure."""

from collections.abc import Sequence

from vrg.bus.codec import Received
from vrg.bus.messages import Estop

SETTLE = 0.5
"""s of match time after a release in which the referee's state may still tell of the stop before it."""


def decisive(orders: Sequence[Received[Estop]]) -> Estop | None:
    """The order that holds of those that arrived in one tick, None of none.

    An engaging one wins, whoever's clock is ahead; of releases the last counts.
    """
    engaging = (order.body for order in orders if order.body.engaged)
    return next(engaging, orders[-1].body if orders else None)


class EstopLatch:
    """The latch of one robot. It is set by the order itself, and by a referee who knows of one that was missed.

    A missed release is made up for in the same way: once the referee has confirmed the stop, its word ends it. A stop
    that the referee has never known of stays, so that nobody moves after a stop that got lost elsewhere.

    Attributes:
        engaged: the robot must not move.
    """

    def __init__(self) -> None:
        self.engaged = False
        self._confirmed = False
        self._released_at: float | None = None

    def order(self, engaged: bool, now: float) -> None:
        """Somebody has engaged or released the stop; heard at match time `now`."""
        self.engaged = engaged
        self._confirmed = False
        self._released_at = None if engaged else now

    def referee(self, engaged: bool, stamp: float) -> None:
        """The referee's state of match time `stamp` says so."""
        if engaged:
            late = self._released_at is not None and stamp <= self._released_at + SETTLE
            if not late:
                self.engaged = self._confirmed = True
        elif self._confirmed:
            self.engaged = self._confirmed = False
