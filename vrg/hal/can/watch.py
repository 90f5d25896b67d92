"""The axes of one robot under their guard: what is judged, and done, to all of them together.

Three threads meet here: the robot's own, which drives; the bus' receive thread, which hears; and the one on which the
match's emergency stop arrives. One lock guards all that they touch, and it is here. Setpoints are sent by the robot's
own thread alone: if it freezes or dies, nothing is sent, and the drives' own watchdogs stop the motors. The others
never send a setpoint; what they may do is switch motors off.
"""

import logging
import math
import threading
from collections.abc import Callable, Mapping, Sequence

from vrg.errors import RobotError
from vrg.hal.can.axis import Axis, State
from vrg.hal.can.guard import REPEAT, START_TIMEOUT, Guard
from vrg.hal.can.plausibility import Bounds, Plausibility
from vrg.hal.clock import Clock
from vrg.hal.driver import COMMAND_TIMEOUT

log = logging.getLogger(__name__)

TIMES = 2
"""Times that a setpoint is sent. A player has one for a drive in 0.1 s, and a lost one leaves 0.1 s for the next."""
POLL_PERIOD = 0.05
"""s between questions to drives that do not send by themselves."""
BLIND = 0.3
"""s without news of the bus after which nobody drives: the receive thread has been kept from running."""


class Watch:
    """See the module. Hold `lock` to use anything here.

    Args:
        name: the robot's name, for messages. axes: all of the robot's. clock: the time of their bus.

    Attributes:
        lock: guards all that several threads touch; one thread may take it several times.
        axes: by node. guard: judges them.
        connected: every drive has been met. reopening: the bus is being opened anew, and nothing can be sent meanwhile.
        heard_until: monotonic time up to which all that was on the bus has been heard, s: what waits unread is not
            missing.
    """

    def __init__(self, name: str, axes: Sequence[Axis], clock: Clock) -> None:
        self.name = name
        self._clock = clock
        self.lock = threading.RLock()
        self.connected = self.reopening = False
        self.heard_until = -math.inf
        self._told: str | None = None
        self._proved = False
        self._complained = ""
        self._polled = self._ordered = self._commanded = -math.inf
        self.begin(axes, {})

    def begin(self, axes: Sequence[Axis], bounds: Mapping[int, Bounds]) -> None:
        """Begin with axes of which nothing has been heard, and with what the motor of each can do, by node."""
        self.axes = {axis.node: axis for axis in axes}
        self.guard = Guard(axes)
        self.bind(bounds)

    def bind(self, bounds: Mapping[int, Bounds]) -> None:
        """Judge by other bounds from now on what the motors do."""
        self._plausibility = {node: Plausibility(own) for node, own in bounds.items()}

    @property
    def deaf(self) -> float:
        """s since the receive thread was last known to keep up with the bus."""
        return self._clock.now() - self.heard_until

    def hear_until(self, until: float) -> None:
        """All that was on the bus until then has been heard."""
        if until - self.heard_until > BLIND:
            self.guard.catch_up(until)
        self.heard_until = max(self.heard_until, until)

    def look(self) -> None:
        """Judge, switch off if need be, and say once what is wrong and when the drives have said that they are off."""
        if self._late:
            self.guard.lapse(f"its motors were switched off, as no setpoint came for {COMMAND_TIMEOUT:g} s")
            self.idle()
        # Where the bus is not heard any more, the order is repeated all the same.
        again = self.deaf > REPEAT and self._clock.now() - self._ordered >= REPEAT and not self.reopening
        if self.guard.look(self.heard_until) or (again and not self.guard.wanted and not self.guard.off):
            self.idle()
        if self.guard.fault != self._told:
            self._told = self.guard.fault
            if self._told:
                self._proved = False
                log.error("%s: %s: its motors are told to be off until it is recovered", self.name, self._told)
        if self._told and not self._proved and self.guard.off:
            self._proved = True
            log.warning("%s: every drive says that its motor is off", self.name)

    @property
    def _late(self) -> bool:
        """True if the robot's own thread sends no setpoints to motors that may turn. The first one may take long.

        Where the bus was not heard, the drives have judged this themselves, and what they say of it waits to be read.
        """
        guard, now = self.guard, self._clock.now()
        since = self._commanded if self._commanded > guard.armed_at else guard.armed_at + START_TIMEOUT
        return guard.wanted and not guard.proving and now - since > COMMAND_TIMEOUT and self.deaf <= BLIND

    def compare(self, node: int, way: float | None) -> None:
        """Compare what an encoder has just said with what its motor was asked.

        Args:
            way: how far the motor has turned since the estimate before, turns; None where it cannot have turned so far.
        """
        axis, guard = self.axes[node], self.guard
        if way is None and guard.armed:
            guard.latch(f"node {node}: its position jumped: was the drive started again?")
        # Without setpoints a motor stops, as it must.
        fresh = axis.measured - self._commanded <= COMMAND_TIMEOUT
        driven = guard.wanted and axis.state is State.CLOSED_LOOP and fresh
        problem = self._plausibility[node].judge(axis.velocity, way, axis.measured, driven=driven)
        if problem:
            guard.latch(f"node {node}: {problem}")

    def poll(self) -> None:
        """Ask the drives for what they do not send by themselves, if it is time. What cannot be asked latches."""
        now = self._clock.now()
        if self.reopening or now - self._polled < POLL_PERIOD:
            return
        self._polled = now
        try:
            for axis in self.axes.values():
                axis.poll(now)
        except RobotError as error:
            self.guard.latch(str(error))

    def require_armed(self) -> None:
        """Judge whether setpoints may be sent.

        Raises:
            RobotError: the emergency stop, a fault, not armed, or nothing has been heard of the bus.
        """
        self.look()
        if self.guard.estop:
            raise RobotError(f"{self.name}: the emergency stop is engaged: release it, then arm again")
        if self.guard.fault:
            raise RobotError(f"{self.name}: {self.guard.fault}")
        if self.guard.lapsed is not None:
            raise RobotError(f"{self.name}: {self.guard.lapsed}: is this computer too busy? Arm again")
        if not self.guard.wanted and not self.guard.proving:
            raise RobotError(f"{self.name}: expected an armed robot to drive: call arm() first")
        if self.deaf > BLIND:
            raise RobotError(f"{self.name}: nothing has been heard of the bus for {self.deaf:.1f} s")

    def command(self, setpoints: Sequence[tuple[int, float]]) -> None:
        """Send setpoints by node, turn/s. One that cannot go out is dropped, and switches the motors off.

        Raises:
            RobotError: one could not go out; this has latched.
        """
        if self.guard.withholding or self.guard.ready:
            return
        if self.guard.proving:
            # The motors are brought up at zero speed, and then left alone.
            setpoints = [(node, 0.0) for node, _ in setpoints]
        self._commanded = self._clock.now()
        try:
            for node, velocity in [*setpoints] * TIMES:
                self.axes[node].command(velocity)
            for node, velocity in setpoints:
                self._plausibility[node].ask(velocity, self._clock.now())
        except RobotError as error:
            self.guard.latch(str(error))
            self.look()
            raise RobotError(f"{self.name}: {self.guard.fault}") from None

    def idle(self) -> None:
        """Switch every motor off. The match's emergency stop has a shorter way to do so than the others."""
        self._ordered = self._clock.now()
        self.guard.told_off(self.heard_until)
        stopped = self.guard.estop and not self.guard.at_drive
        self.each("switch off", [axis.stop_now if stopped else axis.idle for axis in self.axes.values()])

    def clear(self) -> None:
        """Let every drive forget its errors."""
        self.each("clear errors", [axis.clear for axis in self.axes.values()])

    def each(self, what: str, actions: Sequence[Callable[[], None]]) -> None:
        """Do something to several axes, whatever becomes of the others. What cannot be done latches.

        Args:
            what: is done, for the log.
        """
        for act in actions:
            try:
                act()
            except RobotError as error:
                words = f"{what}: {error}"
                if words != self._complained:  # a player that is stopped asks again at every tick
                    self._complained = words
                    log.warning("%s: %s", self.name, words)
                self.guard.latch(str(error))
