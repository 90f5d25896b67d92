"""Judges the supply of drives: whether a battery of the robot can have its voltage."""

import math

from vrg.hal.can.axis import AxisReport
from vrg.hal.can.judges.reasons import Cause, Reason

LOW_SUPPLY = 0.8
"""The part of the voltage of an empty battery below which no battery of this kind can be."""
HIGH_SUPPLY = 1.25
"""The part of the voltage of a full battery above which no battery of this kind can be, not even as motors brake."""
SUPPLY_TIMEOUT = 1.0
"""s for which a supply may be that low or high, as when many motors start at once. Time at which it is not is taken
off."""
ANY_SUPPLY = (0.0, math.inf)
"""The voltages of an empty and a full battery that are not known, V."""


class Supply:
    """Judges the supplies of all drives of a robot.

    Args:
        empty, full: the voltages of an empty and a full battery, V.
    """

    def __init__(self, empty: float, full: float) -> None:
        self._empty, self._full = empty, full
        self._odd: dict[int, tuple[float, float, bool]] = {}

    def begin(self) -> None:
        """Judge again from here."""
        self._odd.clear()

    def judge(self, axis: AxisReport, *, armed: bool) -> Reason | None:
        """The fault of a supply that was too low or too high for too long, while the robot is armed."""
        # Motors that are off draw nothing, and a person may have cut their power on purpose.
        if not armed or axis.voltage is None:
            self._odd.pop(axis.node, None)
        elif self._odd_for(axis, axis.voltage) >= SUPPLY_TIMEOUT:
            if axis.voltage > self._full:
                return Reason(axis.node, Cause.HIGH_SUPPLY, (axis.voltage, self._full))
            return Reason(axis.node, Cause.LOW_SUPPLY, (axis.voltage, self._empty))
        return None

    def _odd_for(self, axis: AxisReport, voltage: float) -> float:
        """s for which a supply was too low or too high, less those for which it was neither: those between two values
        that agree."""
        at, seconds, before = self._odd.get(axis.node, (axis.supplied, 0.0, False))
        odd, since = not LOW_SUPPLY * self._empty <= voltage <= HIGH_SUPPLY * self._full, axis.supplied - at
        if odd == before:
            seconds = seconds + since if odd else max(0.0, seconds - since)
        self._odd[axis.node] = axis.supplied, seconds, odd
        return seconds
