"""The latch of the emergency stop of a match, for one robot. This module uses no clock."""

from collections.abc import Callable

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease
from vrg.bus.topics import Keys

SETTLE = 0.5
"""The match time in s after a release in which the referee's state may still report the stop before it."""


class EstopOrders:
    """The orders about the emergency stop that a node hears.

    Engaging and releasing are two keys, which only the router's rules tell apart. No order is kept between them on the
    bus, so a robot that receives both in one tick stays stopped.

    Args:
        mailbox: the mailbox of the node. keys: the keys of the match.
        alarm: called with each order that engages the stop, as soon as it arrives; see `Mailbox.subscribe`.
    """

    def __init__(self, mailbox: Mailbox, keys: Keys, alarm: Callable[[Received[Estop]], None] | None = None) -> None:
        self._alarm = alarm
        self._sounded = self._known = 0
        self._engaging = mailbox.subscribe(keys.estop, alarm=None if alarm is None else self._sound)
        self._releasing = mailbox.subscribe(keys.estop_release)

    def take(self) -> Estop | EstopRelease | None:
        """The order that counts among those that have arrived since the last call, or None if none has.

        The first one that engages the stop wins, whatever the stamps say. If all are releases, the last one counts,
        unless an alarm has sounded meanwhile, whose order is handed over at the next tick.
        """
        engaging, releasing = self._engaging.take(), self._releasing.take()
        known, self._known = self._known, self._sounded
        if engaging:
            return engaging[0].body
        return releasing[-1].body if releasing and known == self._sounded else None

    def _sound(self, order: Received[Estop]) -> None:
        self._sounded += 1
        assert self._alarm is not None
        self._alarm(order)


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
