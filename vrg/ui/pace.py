"""Tells from match time alone how often to draw."""

from typing import Final

from vrg.bus.node import Tick, due_index

FULL_SPEED_RATE: Final = 10.0
"""Match seconds per real second that are assumed where the world runs as fast as it can."""


def match_speed(rate: float) -> float:
    """Return the match seconds per real second, at least 1. A rate of 0 means as fast as possible."""
    return max(1.0, rate if rate > 0 else FULL_SPEED_RATE)


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
