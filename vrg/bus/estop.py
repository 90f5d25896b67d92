"""Which of several orders of the emergency stop holds."""

from collections.abc import Sequence

from vrg.bus.codec import Received
from vrg.bus.messages import Estop


def decisive(orders: Sequence[Received[Estop]]) -> Estop | None:
    """The order that holds of those that arrived in one tick, None of none.

    An engaging one wins, whoever's clock is ahead; of releases the last counts.
    """
    engaging = (order.body for order in orders if order.body.engaged)
    return next(engaging, orders[-1].body if orders else None)
