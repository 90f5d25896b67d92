"""Tells from match time alone how often to draw."""

from vrg.bus.node import Tick, due_index
from vrg.bus.pacing import match_speed


class Pace:
    """Says when a frame is due. Ticks come by match time; at ten times real time, to draw at each is too much.

    Frames are due by counting whole periods of match time, as the ticks of nodes are. So the steps of the match clock,
    of which one and a half may make a frame, cost no frames.

    Args:
        period: s of real time between frames.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._last: int | None = None

    def due(self, tick: Tick, rate: float) -> bool:
        """True if a frame is due now, at `rate` match seconds per real second. Without a clock one is always due."""
        index = due_index(tick.time, self._period * match_speed(rate))
        if tick.live and index == self._last:
            return False
        self._last = index
        return True
