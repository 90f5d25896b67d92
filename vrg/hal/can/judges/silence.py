"""Judges the silence of drives, as far as it is theirs and not that of a process that did not run.

A drive that is not heard for a moment, as with a loose plug, has no fault: its watchdog stops its motor. But if that
happens again and again, the robot would start each time, with one wheel alone for a part of the time.
"""

import math
from collections import deque
from collections.abc import Iterable

from vrg.hal.can.axis import NEVER, AxisReport
from vrg.hal.can.judges.reasons import Cause, Reason

HEARTBEAT_TIMEOUT = 0.5
"""s without a heartbeat after which a drive is taken for dead. It sends one every 0.1 s."""
DROPOUTS, DROPOUT_WINDOW = 3, 10.0
"""Times within this many s that the wires to a drive may fail for a moment. Where a bus loses a tenth of its frames,
four setpoints in a row get lost about once in a quarter of an hour."""
DROPOUT = 0.2
"""s without an encoder message after which a robot stands, and the least s from one such moment to the next."""


class DriveSilence:
    """Judges for how long a drive has not been heard. Times are monotonic, s.

    Attributes:
        since: when a person has acted last; silence of before does not count.
        disturbed: since the robot was armed, this process did not run for a while.
    """

    def __init__(self) -> None:
        self.since = NEVER
        self.disturbed = False
        self._excused: dict[tuple[int, str], float] = {}
        self._dropouts: dict[int, deque[float]] = {}

    def begin(self, now: float) -> None:
        """Judge again from here."""
        self.since = now
        self._dropouts.clear()

    def catch_up(self, axes: Iterable[AxisReport], heard_until: float) -> None:
        """Nothing was heard, or asked, for a while until now, as this process did not run: silence counts from here.

        A drive that has not sent a kind of message since it was last excused is not excused again for that kind.
        """
        self.disturbed = True
        for axis in axes:
            for kind, at in (("heard", axis.heard), ("reported", axis.reported_at), ("measured", axis.measured)):
                if at > self.excuse(axis, kind):
                    self._excused[axis.node, kind] = heard_until

    def excuse(self, axis: AxisReport, kind: str) -> float:
        """Until when the silence of a drive, in messages of a kind, was that of this process."""
        return self._excused.get((axis.node, kind), NEVER)

    def judge(self, axis: AxisReport, heard_until: float, armed_at: float) -> Reason | None:
        """The fault of a drive that has fallen silent, or makes no sense.

        Args:
            axis: its report. heard_until: the present time. armed_at: when the robot was armed; infinite: it is not.
        """
        if axis.implausible:
            return Reason(axis.node, Cause.REPORTED, (axis.implausible,))
        if heard_until - max(axis.heard, self.since, self.excuse(axis, "heard")) > HEARTBEAT_TIMEOUT:
            return Reason(axis.node, Cause.NO_HEARTBEAT, (HEARTBEAT_TIMEOUT,))
        if _mute(axis, heard_until, max(axis.reported_at, armed_at, self.excuse(axis, "reported"))):
            return Reason(axis.node, Cause.NO_REPORT, (HEARTBEAT_TIMEOUT,))
        return None

    def judge_encoder(self, axis: AxisReport, heard_until: float) -> Reason | None:
        """The fault of a drive that is alive, and whose encoder is silent."""
        if _mute(axis, heard_until, self._measured(axis)):
            return Reason(axis.node, Cause.NO_ENCODER, (HEARTBEAT_TIMEOUT, axis.encoder_advice))
        return None

    def judge_moment(self, axis: AxisReport, heard_until: float) -> Reason | None:
        """Says that nothing has been heard from a drive for a moment, or that it does not hear this computer."""
        if axis.deaf:
            return Reason(axis.node, Cause.DEAF)
        if heard_until - max(axis.heard, self._measured(axis)) > DROPOUT:
            return Reason(axis.node, Cause.QUIET, (DROPOUT,))
        return None

    def judge_wires(self, node: int, now: float) -> Reason | None:
        """Count a moment in which a drive was not heard, or has not heard its setpoints; the fault if they are many."""
        times = self._dropouts.setdefault(node, deque([-math.inf], maxlen=DROPOUTS))
        if now - times[-1] <= DROPOUT:
            return None
        times.append(now)
        return Reason(node, Cause.WIRES, (DROPOUTS, DROPOUT_WINDOW)) if now - times[0] <= DROPOUT_WINDOW else None

    def _measured(self, axis: AxisReport) -> float:
        """Since when the silence of a drive's encoder counts."""
        return max(axis.measured, self.since, self.excuse(axis, "measured"))


def _mute(axis: AxisReport, heard_until: float, at: float) -> bool:
    """True if a drive has sent no message of a kind since `at`; one that is silent altogether has another fault."""
    return heard_until - at > HEARTBEAT_TIMEOUT and axis.heard - at > HEARTBEAT_TIMEOUT / 2
