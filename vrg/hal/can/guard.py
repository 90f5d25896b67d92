"""Every reason for which the motors of a CAN robot must be off, in one place. It has no bus and no clock.

A reason latches: it stays, whatever the drives say later, until a person clears it. The one exception is a drive's
watchdog: it tells of a commander that was late, not of a robot that is broken, so arming again is enough.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from vrg.hal.can.axis import AxisReport, MotorState
from vrg.hal.can.judges.identity import Identity
from vrg.hal.can.judges.off import Off
from vrg.hal.can.judges.reasons import Cause, Reason
from vrg.hal.can.judges.silence import HEARTBEAT_TIMEOUT, Silence
from vrg.hal.can.judges.supply import ANY_SUPPLY, Supply

START_TIMEOUT = 1.0
"""s from arming until every axis must be in closed loop."""
PROOF_TIMEOUT = 0.33
"""s from the last setpoint within which every drive must report that its own watchdog has stopped its motor, when that
is proved: 0.2 s, and the way of the report."""
PROOFS = 2
"""Times that a watchdog is tried: on a busy computer the first setpoint may leave late, or a report may get lost."""
FAILED_STARTS = 3
"""Times in a row that a drive may report an expired watchdog although it was ordered to start: orders may get lost."""
SETPOINT_TIMEOUT = 0.2
"""s between setpoints from which on it is this computer that is too busy."""
LATE = 0.13
"""s between setpoints from which on a drive's own watchdog may have stopped its motor, and its wires may be good."""
BUSY = "was this program stopped, or is this computer too busy?"
"""What a person should ask about setpoints that did not come."""
STATUS_GRACE = 0.5
"""s after an explicit act in which what the drives still say of before does not latch again."""


class Guard:
    """Keeps the reasons for which the motors of one robot must be off. Times are monotonic, s.

    `look` gets the time until which the bus has been heard, where the others get the present time: a process
    that was kept from running finds heartbeats that wait to be read, and a drive is not dead for that.

    Args:
        axes: the reports of all axes of the robot. supply: the voltages of an empty and a full battery, V.
        serials: the serial numbers of the drives that the robot was calibrated with, by node, as far as they are known.

    Attributes:
        fault: what has latched, in words; None where nothing has.
        estop: the emergency stop is latched, by the match or by a drive.
        at_drive: a drive has latched it, as a button was pressed there.
        armed_by_player: the player has armed the robot, and nothing has disarmed it since.
        unproved: the drives' own watchdogs have not been seen to work since the robot was connected or recovered.
            At the first arming the drives are therefore left without setpoints, at zero speed, until each reports that
            its watchdog has stopped its motor.
        disarmed_because: the words for the moment without setpoints, or without news of a drive, that has disarmed the
            robot, until something else arms or disarms it; None if there was none.
        armed_at: when the player has armed it last.
        rearm_pending: the robot is to be armed once more, as the player has asked: the watchdogs have been seen to
            work, or are to be tried again.
    """

    def __init__(
        self,
        axes: Sequence[AxisReport],
        supply: tuple[float, float] = ANY_SUPPLY,
        serials: Mapping[int, str] | None = None,
    ) -> None:
        self._axes = axes
        self._identity = Identity(axes, serials or {})
        self._supply = Supply(*supply)
        self.fault: str | None = None
        self.estop = False
        self.at_drive = False
        self.armed_by_player = False
        self.unproved = True
        self.disarmed_because: str | None = None
        self.rearm_pending = False
        self._silence, self._off = Silence(), Off()
        self.armed_at = -math.inf
        self._commanded = -math.inf
        self._gap, self._late_at, self._slow_at = 0.0, -math.inf, -math.inf
        self._proofs, self._proved_before = 0, False
        self._failed_starts = Counter[int]()
        self._started: set[int] = set()
        self._proved: set[int] = set()

    def begin(self, now: float) -> None:
        """A person has connected or recovered the robot: judge anew from here."""
        self.fault = None
        self.disarmed_because = None
        self.unproved = not self._unwatched
        self.rearm_pending, self._proofs, self._proved_before = False, 0, False
        self._failed_starts.clear()
        self._off.begin()
        self._supply.begin()
        self._silence.begin(now)
        self._identity.judge()  # whoever has answered first is expected from now on
        for axis in self._axes:
            axis.forget_implausible()

    def release(self, now: float) -> None:
        """A person has released the emergency stop."""
        self.estop = self.at_drive = False
        self._silence.since = now

    def engage(self) -> None:
        """The emergency stop of the match was engaged."""
        self.estop = True
        self.disarm()

    def latch(self, reason: Reason | str | None) -> None:
        """Keep a reason, unless there is one: the first is kept, as the others mostly follow from it. None is none."""
        if reason is not None:
            self.fault = self.fault or str(reason)

    def arm(self, now: float) -> None:
        """The player arms the robot; ask `refusal` first."""
        self.armed_by_player, self.rearm_pending, self.disarmed_because = True, False, None
        self._off.arm()
        self._silence.disturbed = False
        self.armed_at = self._commanded = now
        self._late_at = self._slow_at = -math.inf
        self._started.clear()
        self._proved.clear()

    def command(self, now: float) -> None:
        """A setpoint is sent to every motor."""
        if now - self._commanded > LATE:
            self._slow_at = now
        if now - self._commanded > SETPOINT_TIMEOUT:
            self._gap, self._late_at = now - self._commanded, now
        self._commanded = now

    def disarm(self) -> None:
        """The player disarms the robot."""
        self.armed_by_player = self.rearm_pending = False
        self.disarmed_because = None

    def catch_up(self, heard_until: float) -> None:
        """Nothing was heard, or asked, for a while until now, as this process did not run: silence counts from here."""
        self._silence.catch_up(self._axes, heard_until)

    def disarm_late(self, words: str) -> None:
        """No setpoint came in time: the robot is disarmed until it is armed again."""
        self.disarm()
        self.disarmed_because = words

    @property
    def _unwatched(self) -> bool:
        """True if no drive has a watchdog to prove."""
        return all(axis.unwatched for axis in self._axes)

    @property
    def unknown(self) -> int | None:
        """The node of a drive that must say anew who it is, before the robot is armed; None if there is none."""
        return self._identity.unknown

    @property
    def proving(self) -> bool:
        """True if no setpoint may be sent now, because it is seen whether the drives' own watchdogs work."""
        return (self.armed_by_player and self.unproved) or self.rearm_pending

    @property
    def armed(self) -> bool:
        """True if every motor really obeys."""
        started = all(axis.state is MotorState.CLOSED_LOOP for axis in self._axes)
        return self.armed_by_player and not self.proving and started

    def refusal(self, now: float) -> str | None:
        """Return why the robot cannot be armed now, or None."""
        if self.estop or any(axis.state is MotorState.ESTOP for axis in self._axes):
            return "the emergency stop is engaged: release it, then arm"
        if self.fault:
            return self.fault
        for axis in self._axes:
            if axis.fault:
                return f"node {axis.node}: {axis.fault}"
            if now - axis.heard > HEARTBEAT_TIMEOUT:
                return f"node {axis.node}: no heartbeat yet"
        if self.unknown is not None:
            return f"node {self.unknown}: it has not said yet which drive it is"
        return None

    @property
    def off(self) -> bool:
        """True if every drive has reported since the order that its motor is off, and no motor turns on."""
        return not self.armed_by_player and self._off.confirmed(self._axes)

    def ordered_off(self, heard_until: float) -> None:
        """Every drive has been ordered to switch its motor off."""
        self._off.order(self._axes, heard_until)

    def look(self, heard_until: float) -> bool:
        """Judge what the axes have heard until then; True if the motors must be switched off, once more if need be."""
        stopped = MotorState.ESTOP in [axis.state for axis in self._axes]
        if stopped and not (self.estop or self._forgiven(heard_until)):
            # After the emergency stop of the match the drives report it too, though no button was pressed there.
            self.estop = self.at_drive = True
        if self.armed_by_player and heard_until > self.armed_at:
            for axis in self._axes:
                if axis.state is MotorState.CLOSED_LOOP and axis.node not in self._started:
                    self._started.add(axis.node)
                    axis.expiry_reported = False  # what it has reported of earlier times proves nothing
        self.latch(self._problem(heard_until))
        if self._off.reason is None and (wrong := self._identity.judge()):
            self.fault = str(wrong)  # it explains what else has latched
        self._identity.forget([axis for axis in self._axes if self._silence.judge_moment(axis, heard_until)])
        again = False
        if self.fault or self.estop or stopped:
            self.rearm_pending = False
        elif self.armed_by_player and self.unproved:
            again = self._prove(heard_until)
        lapsed = self._lapse(heard_until) if self.armed_by_player else None
        if self.armed_by_player and (again or self.fault or self.estop or lapsed):
            self.armed_by_player, self.disarmed_because = False, None if again or self.fault or self.estop else lapsed
            self.rearm_pending = again and not self.fault
            if lapsed and heard_until - self._late_at > START_TIMEOUT and not self._silence.disturbed:
                self.unproved = not self._unwatched  # what was late or lost on the bus may be so from now on
            self.ordered_off(heard_until)
            return True
        if self.armed_by_player:
            self._off.begin()
        elif not_off := self._off.judge(self._axes, heard_until):
            self.fault = str(not_off)  # it is worse than whatever has latched before
        if not self.armed_by_player and self._off.due(self._axes, heard_until):
            self.ordered_off(heard_until)
            return True
        return False

    def _lapse(self, heard_until: float) -> str | None:
        """Why an armed robot must stand until it is armed again, in words; None if there is no reason.

        What has failed for a moment too often latches.
        """
        late = heard_until - self._commanded > LATE or heard_until - self._slow_at <= START_TIMEOUT
        node = self._late_node(heard_until)
        if node is not None:
            self._count_failed_start(node)
            words = f"node {node}: its watchdog has stopped its motor, as no setpoint came in time: {BUSY}"
            counts = node in self._started and not late
        else:
            moments = (self._silence.judge_moment(axis, heard_until) for axis in self._axes if self.armed)
            moment = next(filter(None, moments), None)
            if moment is None:
                return None
            node, words, counts = moment.node, str(moment), True
        if counts:
            self.latch(self._silence.judge_wires(node, heard_until))
        return words

    def _count_failed_start(self, node: int) -> None:
        """Count how often a drive whose watchdog has expired was ordered to start, and has not."""
        self._failed_starts[node] = 0 if node in self._started else self._failed_starts[node] + 1
        if self._failed_starts[node] >= FAILED_STARTS:
            self.latch(
                f"node {node}: it was ordered {FAILED_STARTS} times to start, and goes on reporting that its watchdog "
                "has stopped it: it does not hear this computer. Check the wires and the plug of this drive"
            )

    def _late_node(self, heard_until: float) -> int | None:
        """The node of a drive whose watchdog has met a commander that was late; None if there is none."""
        if self.rearm_pending or heard_until - self.armed_at <= STATUS_GRACE:
            return None
        return next((axis.node for axis in self._axes if axis.watchdog_expired and axis.node not in self._proved), None)

    def _prove(self, heard_until: float) -> bool:
        """Judge whether every drive's own watchdog has stopped its motor; True if that is to be tried once more."""
        watched = [axis for axis in self._axes if not axis.unwatched]
        late = heard_until - self._commanded > PROOF_TIMEOUT
        if not late:
            self._proved |= {axis.node for axis in watched if axis.expiry_reported and axis.node in self._started}
        if self._proved.issuperset(axis.node for axis in watched):
            self.unproved, self.armed_by_player, self.rearm_pending = False, False, True
            self._proved_before, self._proofs = True, 0
            self._failed_starts.clear()
        elif late and self.withholding:
            self._proofs += not self._silence.disturbed  # a drive that was not asked, or not heard, has had no chance
            if self._proofs < PROOFS:
                return True
            node = next(axis.node for axis in watched if axis.node not in self._proved)
            self.latch(f"node {node}: {self._unproved_words}")
        return False

    @property
    def _unproved_words(self) -> str:
        """Why a drive's watchdog is not proved, in words."""
        if self._proved_before:
            return (
                "its frames or its setpoints were lost, or they come late: its own watchdog has stopped it before, and "
                f"not within {PROOF_TIMEOUT:g} s now. Check the wires and the plug of this drive, and what is between"
            )
        return (
            f"its own watchdog has not stopped it within {PROOF_TIMEOUT:g} s without setpoints, as far as it reports: "
            "set the watchdog in the drive to 0.2 s. Where it has that, frames come late: try without gateways, or "
            'with another adapter. To do without, write watchdog = "unsafe" in the wiring of this robot (`vrg can '
            "jog`: --unsafe)"
        )

    @property
    def withholding(self) -> bool:
        """True if every motor has been on since it was armed, and now gets no setpoints, to prove its watchdog."""
        return self.armed_by_player and self.unproved and self._started.issuperset(axis.node for axis in self._axes)

    def _forgiven(self, heard_until: float) -> bool:
        """True if a drive may still report the state before the explicit act; an armed one reports no old state."""
        return not self.armed_by_player and heard_until - self._silence.since <= STATUS_GRACE

    def _problem(self, heard_until: float) -> str | None:
        forgiven = self._forgiven(heard_until)
        for axis in self._axes:
            found = (
                self._silence.judge(axis, heard_until, self.armed_at if self.armed_by_player else math.inf)
                or (Reason(axis.node, Cause.REPORTED, (axis.fault,)) if axis.fault and not forgiven else None)
                or self._silence.judge_encoder(axis, heard_until)
                or self._supply.judge(axis, armed=self.armed_by_player)
            )
            if found:
                return str(found)
            # What a drive has reported before this process did not run shows nothing of how it has started since.
            began = max(self.armed_at, self._silence.excuse(axis, "reported"))
            due = self.armed_by_player and (axis.node in self._started or heard_until - began > START_TIMEOUT)
            if due and not axis.watchdog_expired and axis.state in (MotorState.IDLE, MotorState.STARTING):
                reason = self._reason(axis, heard_until)
                return f"node {axis.node}: expected closed-loop control, but it is idle{reason}"
        return None

    def _reason(self, axis: AxisReport, heard_until: float) -> str:
        """Why a motor may be off that should be on, in words."""
        if axis.refusal:
            return f" and reports {axis.refusal}"
        if heard_until - self._late_at <= START_TIMEOUT:
            return f": this computer is too busy, it sent no setpoint for {self._gap:.2g} s. Close other programs"
        return " and gives no reason: does it hear this computer, and can it start (see `vrg can scan`)?"
