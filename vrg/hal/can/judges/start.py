"""Judges whether drives start, and stay in closed loop, once the player has armed their robot.

Where this computer has not sent its setpoints in time, no drive is to blame.
"""

from collections import Counter
from collections.abc import Collection, Iterable

from vrg.hal.can.axis import NEVER, AxisReport, MotorState
from vrg.hal.can.judges.reasons import Cause, Reason

START_TIMEOUT = 1.0
"""s from arming until every axis must be in closed loop."""
FAILED_STARTS = 3
"""Times in a row that a drive may report an expired watchdog although it was ordered to start: orders may get lost."""
SETPOINT_TIMEOUT = 0.2
"""s between setpoints from which on it is this computer that is too busy."""
LATE = 0.13
"""s between setpoints from which on a drive's own watchdog may have stopped its motor, and its wires may be good."""
STATUS_GRACE = 0.5
"""s after an explicit act in which what the drives still say of before does not latch again."""


class DriveStart:
    """Judges the starts of the drives of one robot. Times are monotonic, s.

    Attributes:
        armed_at: when the player has armed the robot last. started: the nodes that have been in closed loop since.
        commanded_at: when the newest setpoint was sent.
    """

    def __init__(self) -> None:
        self.armed_at = self.commanded_at = self._late_at = self._slow_at = NEVER
        self._gap = 0.0
        self.started: set[int] = set()
        self._failed = Counter[int]()

    def begin(self) -> None:
        """Forget the starts that have failed."""
        self._failed.clear()

    def arm(self, now: float) -> None:
        """The player arms the robot."""
        self.armed_at, self._late_at, self._slow_at = now, NEVER, NEVER
        self.started.clear()

    def command(self, now: float) -> None:
        """A setpoint is sent to every motor."""
        gap, self.commanded_at = self.uncommanded(now), now
        if gap > LATE:
            self._slow_at = now
        if gap > SETPOINT_TIMEOUT:
            self._gap, self._late_at = gap, now

    def uncommanded(self, now: float) -> float:
        """s for which no setpoint has been sent to a robot that is armed."""
        return now - max(self.commanded_at, self.armed_at)

    def late(self, heard_until: float) -> bool:
        """True if a drive's own watchdog may have met a setpoint that was late."""
        return self.uncommanded(heard_until) > LATE or heard_until - self._slow_at <= START_TIMEOUT

    def busy(self, heard_until: float) -> bool:
        """True if this computer was too busy lately to send setpoints."""
        return heard_until - self._late_at <= START_TIMEOUT

    def look(self, axes: Iterable[AxisReport], heard_until: float) -> None:
        """Note which drives of an armed robot have started."""
        for axis in axes:
            if heard_until > self.armed_at and axis.state is MotorState.CLOSED_LOOP and axis.node not in self.started:
                self.started.add(axis.node)
                axis.expiry_reported = False  # what it has reported of earlier times proves nothing

    def judge(self, axis: AxisReport, heard_until: float, excused: float) -> Reason | None:
        """The fault of a drive of an armed robot that is off; `excused`: until when it was not heard, s."""
        # A report from before this process stalled does not show how a drive has started since.
        due = axis.node in self.started or heard_until - max(self.armed_at, excused) > START_TIMEOUT
        if not due or axis.watchdog_expired or axis.state not in (MotorState.IDLE, MotorState.STARTING):
            return None
        if axis.refusal:
            return Reason(axis.node, Cause.REFUSES, (axis.refusal,))
        if self.busy(heard_until):
            return Reason(axis.node, Cause.NO_SETPOINTS, (self._gap,))
        return Reason(axis.node, Cause.IDLE)

    def judge_watchdogs(self, axes: Iterable[AxisReport], heard_until: float, proved: Collection[int]) -> Reason | None:
        """Says that a drive's watchdog has expired because setpoints were late; those in `proved` were to expire."""
        if heard_until - self.armed_at <= STATUS_GRACE:
            return None
        expired = (axis.node for axis in axes if axis.watchdog_expired and axis.node not in proved)
        return next((Reason(node, Cause.EXPIRED) for node in expired), None)

    def judge_failed(self, node: int) -> Reason | None:
        """Count how often a drive whose watchdog has expired was ordered to start, and has not; its fault."""
        self._failed[node] = 0 if node in self.started else self._failed[node] + 1
        return Reason(node, Cause.NEVER_STARTS, (FAILED_STARTS,)) if self._failed[node] >= FAILED_STARTS else None
