"""Judges whether drives are off that were ordered to be off: by their own reports, and by whether their motors turn."""

import math
from collections.abc import Collection, Iterable

from vrg.hal.can.axis import NEVER, AxisReport
from vrg.hal.can.judges.reasons import Cause, Reason
from vrg.hal.can.judges.silence import HEARTBEAT_TIMEOUT

OBEY_TIMEOUT = 0.5
"""s for which a drive may still report that it is on after it was switched off."""
OFF_PERIOD = 0.05
"""s from one order to be off to the next, until every drive has reported that it is off."""
COAST_TIMEOUT = 1.0
"""s after the order to be off in which a motor must have become slower."""
COASTS = 0.9
"""The part of its speed at the order below which a motor that is off has become slower."""
COASTED = 0.25 * COAST_TIMEOUT
"""The s of that speed for which a motor must have turned since: an encoder may tell a speed and no way."""
TURNING_SPEED = 0.5
"""The speed in turn/s of the motor's shaft above which it counts as turning."""


class Off:
    """Judges the drives of one robot. Times are monotonic, s.

    Attributes:
        reason: a drive is on though it was switched off, for longer than OBEY_TIMEOUT, or its motor has not become
            slower within COAST_TIMEOUT, by its own estimates; None if there is none.
    """

    def __init__(self) -> None:
        self.reason: Reason | None = None
        self._on_since: dict[int, float] = {}
        self._ordered_at = NEVER
        self._coasting: dict[int, tuple[float, float, float]] | None = {}

    def begin(self) -> None:
        """Judge again from here; motors that coast are not forgotten."""
        self.reason = None
        self._on_since.clear()

    def arm(self) -> None:
        """The motors are to be on."""
        self._coasting = None

    def order(self, axes: Iterable[AxisReport], heard_until: float) -> None:
        """Every drive has been ordered to switch its motor off. From the first order on the motors must coast."""
        self._ordered_at = heard_until
        if self._coasting is None:
            self._coasting = {
                axis.node: (heard_until, abs(axis.velocity), axis.position)
                for axis in axes
                if abs(axis.velocity) > TURNING_SPEED
            }

    def confirmed(self, axes: Iterable[AxisReport]) -> bool:
        """True if every drive has reported since the order that its motor is off, and no motor turns on."""
        reported = all(axis.on is False and axis.reported_at > self._ordered_at for axis in axes)
        return reported and self.reason is None

    def due(self, axes: Iterable[AxisReport], heard_until: float) -> bool:
        """True if the order is to be repeated, as it may have been lost on the bus."""
        return not self.confirmed(axes) and heard_until - self._ordered_at >= OFF_PERIOD

    def judge(self, axes: Collection[AxisReport], heard_until: float) -> Reason | None:
        """Find a drive that reports for too long that it is on, against the order, or whose motor turns on."""
        # A silent drive does not report this either.
        recent = heard_until - HEARTBEAT_TIMEOUT
        on = {axis.node for axis in axes if axis.on and axis.reported_at >= recent}
        self._on_since = {node: self._on_since.get(node, heard_until) for node in on}
        disobeying = (node for node, since in self._on_since.items() if heard_until - since > OBEY_TIMEOUT)
        self.reason = next((Reason(node, Cause.ON) for node in disobeying), None)
        coasting = self._coasting or {}
        for axis in axes:
            ordered, speed, position = coasting.get(axis.node, (math.inf, 0.0, 0.0))
            if abs(axis.velocity) < COASTS * speed:
                coasting.pop(axis.node)  # from now on a person may push the robot
            elif axis.measured - ordered > COAST_TIMEOUT and abs(axis.position - position) > COASTED * speed:
                self.reason = Reason(axis.node, Cause.TURNS, (axis.velocity,))
        return self.reason
