"""The choice among the balls of a picture: another one may lie beside the field, or be an orange shirt."""

import math
from collections.abc import Iterable, Sequence
from typing import Final

from vrg.bus.messages import LOST
from vrg.localisation.thing import FASTEST, SLACK
from vrg_locate.ssl.packets import SeenBall

WEIGHT: Final = 1.0
"""The distance from the last place that speaks against a ball as much as full confidence speaks for it, m."""


def likely_ball(
    balls: Iterable[SeenBall], last: SeenBall, since: float, others: Sequence[SeenBall] = ()
) -> SeenBall | None:
    """The ball of a picture that is most likely the one of the match; None if none of them can be.

    It is the one with the most confidence left after its distance from the last place in m, divided by WEIGHT, is
    subtracted; of equal ones the first. Until it has not been seen for LOST, only those count to which it can have
    come, at FASTEST and SLACK more. Of these, one that lies within SLACK of where another ball was seen beside the last
    one, and nearer to it than all others and than the last place, is that other ball.

    Args:
        last: where it was seen last. since: the time since then, s.
        others: the other balls that were seen then.
    """
    found = list(balls)
    if since <= LOST:
        reach = FASTEST * max(0.0, since) + SLACK
        for other in others:
            near = min(found, key=lambda ball: apart(ball, other), default=other)
            if near in found and apart(near, other) < min(SLACK, apart(near, last)):
                found.remove(near)
        found = [ball for ball in found if apart(ball, last) <= reach]
    return max(found, key=lambda ball: ball.confidence - apart(ball, last) / WEIGHT, default=None)


def apart(one: SeenBall, other: SeenBall) -> float:
    """The distance of two balls, m."""
    return math.dist((one.x, one.y), (other.x, other.y))
