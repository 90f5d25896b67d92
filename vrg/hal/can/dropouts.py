"""Judges a drive that was not heard for a moment, as with a loose plug. It has no bus and no clock.

Such a moment alone is none of the faults that the guard knows: the drive's watchdog stops its motor, and the robot
would start again and again, with one wheel alone for a part of the time.
"""

import math
from collections import deque

DROPOUTS, DROPOUT_WINDOW = 3, 10.0
"""Times within so many s that the wires to a drive may fail for a moment. Where a bus loses a tenth of its frames,
four setpoints in a row get lost about once in a quarter of an hour."""
DROPOUT = 0.2
"""s without an encoder message after which a robot stands, and the least s from one such moment to the next."""
BEGINNING = 1.0
"""The turns around zero in which the position of a drive begins that was started again."""


class Dropouts:
    """See the module. Times are monotonic, s."""

    def __init__(self) -> None:
        self._times: dict[int, deque[float]] = {}

    def failed(self, node: int, now: float) -> str | None:
        """A drive was not heard for a moment, or has not heard its setpoints; what is wrong, in words."""
        times = self._times.setdefault(node, deque([-math.inf], maxlen=DROPOUTS))
        if now - times[-1] <= DROPOUT:
            return None
        times.append(now)
        if now - times[0] > DROPOUT_WINDOW:
            return None
        return (
            f"node {node}: its frames or its setpoints were lost {DROPOUTS} times within {DROPOUT_WINDOW:g} s, for "
            "long enough to stop its motor. Check the wires and the plug of this drive"
        )


def was_restarted(gap: float, position: float, way: float, velocity: float, slack: float) -> bool:
    """Whether a drive that is heard again was started again, instead of having rolled on at most as fast as before.

    Args:
        gap: the time since its last position, s; infinite = there was none.
        position: its position now, turns. way: how far that is from its last one, turns.
        velocity: its last velocity, turns/s.
        slack: the turns by which its motor may have rolled on farther than this velocity says.
    """
    if not DROPOUT < gap < math.inf or abs(position) >= BEGINNING:
        return False
    least, most = sorted((0.0, velocity * gap))
    return not least - slack <= way <= most + slack
