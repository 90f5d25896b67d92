"""When the motors of a robot must be off: every reason that a CAN robot has, in one place. It has no bus and no clock.

A reason latches: it stays, whatever the drives say later, until a person clears it. The one exception is a drive's
watchdog: it tells of a commander that was late, not of a robot that is broken, so arming again is enough.
"""

import math
from collections.abc import Sequence

from vrg.hal.can.axis import Axis, State

HEARTBEAT_TIMEOUT = 0.5
"""s without a heartbeat after which a drive is taken for dead. It sends one every 0.1 s."""
START_TIMEOUT = 1.0
"""s from arming until every axis must be in closed loop."""
GRACE = 0.5
"""s after an explicit act in which what the drives still say of before does not latch again."""


class Guard:
    """See the module. Times are monotonic, s.

    `look` is told the time until which the bus has been heard, where the others are told the time that it is: a process
    that was kept from running finds heartbeats that wait to be read, and a drive is not dead for that.

    Args:
        axes: all axes of the robot.

    Attributes:
        fault: what has latched, in words; None where nothing has.
        estop: the emergency stop is latched, by the match or by a drive.
        at_drive: a drive has latched it, so somebody pressed a button there.
        wanted: the player has armed the robot, and nothing has disarmed it since.
    """

    def __init__(self, axes: Sequence[Axis]) -> None:
        self._axes = axes
        self.fault: str | None = None
        self.estop = False
        self.at_drive = False
        self.wanted = False
        self._since = -math.inf
        self._armed_at = -math.inf
        self._obeyed: set[int] = set()

    def begin(self, now: float) -> None:
        """A person has connected or recovered the robot: judge anew from here."""
        self.fault = None
        self._since = now
        for axis in self._axes:
            axis.forget_oddities()

    def release(self, now: float) -> None:
        """A person has released the emergency stop."""
        self.estop = self.at_drive = False
        self._since = now

    def engage(self) -> None:
        """The emergency stop of the match was engaged."""
        self.estop = True
        self.wanted = False

    def latch(self, words: str) -> None:
        """Keep a reason, unless there is one: the first is kept, as the others mostly follow from it."""
        self.fault = self.fault or words

    def arm(self, now: float) -> None:
        """The player arms the robot; ask `refusal` first."""
        self.wanted = True
        self._armed_at = now
        self._obeyed.clear()

    def disarm(self) -> None:
        """The player disarms the robot."""
        self.wanted = False

    @property
    def armed(self) -> bool:
        """Whether every motor really obeys."""
        return self.wanted and all(axis.state is State.CLOSED_LOOP for axis in self._axes)

    def refusal(self, now: float) -> str | None:
        """Why the robot cannot be armed now, or None."""
        if self.estop or any(axis.state is State.ESTOP for axis in self._axes):
            return "the emergency stop is engaged: release it, then arm"
        if self.fault:
            return self.fault
        for axis in self._axes:
            if axis.fault:
                return f"node {axis.node}: {axis.fault}"
            if now - axis.heard > HEARTBEAT_TIMEOUT:
                return f"node {axis.node}: no heartbeat yet"
        return None

    def look(self, heard_until: float) -> bool:
        """Judge what the axes have heard until then; True if the motors must be switched off."""
        if not self._forgiven(heard_until) and any(axis.state is State.ESTOP for axis in self._axes):
            self.estop = self.at_drive = True
        if self.wanted and heard_until > self._armed_at:
            self._obeyed |= {axis.node for axis in self._axes if axis.state is State.CLOSED_LOOP}
        problem = self._problem(heard_until)
        if problem is not None:
            self.latch(problem)
        starved = any(axis.starved for axis in self._axes) and heard_until - self._armed_at > GRACE
        if self.wanted and (self.fault or self.estop or starved):
            self.wanted = False
            return True
        return False

    def _forgiven(self, heard_until: float) -> bool:
        """Whether a drive may still say what it said before the explicit act; an armed one has nothing old to say."""
        return not self.wanted and heard_until - self._since <= GRACE

    def _problem(self, heard_until: float) -> str | None:
        forgiven = self._forgiven(heard_until)
        for axis in self._axes:
            name = f"node {axis.node}"
            if axis.odd:
                return f"{name}: {axis.odd}"
            if heard_until - max(axis.heard, self._since) > HEARTBEAT_TIMEOUT:
                return f"{name}: no heartbeat for {HEARTBEAT_TIMEOUT:g} s"
            if axis.fault and not forgiven:
                return f"{name}: {axis.fault}"
            due = axis.node in self._obeyed or heard_until - self._armed_at > START_TIMEOUT
            if self.wanted and due and not axis.starved and axis.state in (State.IDLE, State.STARTING):
                return f"{name}: expected closed-loop control, but it is idle and gives no reason"
        return None
