"""Every reason for which the motors of a CAN robot must be off, in one place. It has no bus and no clock.

The judges of `vrg.hal.can.judges` find the reasons, each of one kind. The guard asks them in a fixed order, and acts.

A reason latches: it stays, whatever the drives say later, until a person clears it. The one exception is a drive's
watchdog: it means that setpoints were late, not that the robot is broken, so arming again is enough.
"""

import math
from collections.abc import Mapping, Sequence

from vrg.hal.can.axis import AxisReport, MotorState
from vrg.hal.can.judges.identity import DriveIdentity
from vrg.hal.can.judges.off import Off
from vrg.hal.can.judges.proof import ProofStep, WatchdogProof
from vrg.hal.can.judges.reasons import Cause, Reason
from vrg.hal.can.judges.silence import HEARTBEAT_TIMEOUT, DriveSilence
from vrg.hal.can.judges.start import STATUS_GRACE, DriveStart
from vrg.hal.can.judges.supply import ANY_SUPPLY, Supply


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
        disarmed_because: the words for the moment without setpoints, or without news of a drive, that has disarmed the
            robot, until something else arms or disarms it; None if there was none.
        rearm_pending: the robot is to be armed once more, as the player has asked: the watchdogs have been seen to
            work, or are to be tried again.
        start: judges the starts of the drives. proof: judges the drives' own watchdogs. While it is `pending`, the
            drives are left without setpoints when the robot is armed, at zero speed, until each reports that its
            watchdog has stopped its motor.
    """

    def __init__(
        self,
        axes: Sequence[AxisReport],
        supply: tuple[float, float] = ANY_SUPPLY,
        serials: Mapping[int, str] | None = None,
    ) -> None:
        self._axes = axes
        self.fault: str | None = None
        self.disarmed_because: str | None = None
        self.estop = self.at_drive = False
        self.armed_by_player = self.rearm_pending = False
        self.start, self.proof = DriveStart(), WatchdogProof()
        self._silence, self._off = DriveSilence(), Off()
        self._supply, self._identity = Supply(*supply), DriveIdentity(axes, serials or {})

    def begin(self, now: float) -> None:
        """A person has connected or recovered the robot: judge again from here."""
        self.fault = self.disarmed_because = None
        self.rearm_pending = False
        self.start.begin()
        self.proof.begin(self._axes)
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
        self.start.arm(now)
        self.proof.proved.clear()
        self._off.arm()
        self._silence.disturbed = False

    def disarm(self, because: str | None = None) -> None:
        """The player disarms the robot, or, in words, a moment in which something did not come in time."""
        self.armed_by_player = self.rearm_pending = False
        self.disarmed_because = because

    def catch_up(self, heard_until: float) -> None:
        """Nothing was heard, or asked, for a while until now, as this process did not run: silence counts from here."""
        self._silence.catch_up(self._axes, heard_until)

    @property
    def unknown(self) -> int | None:
        """The node of a drive that must say again who it is, before the robot is armed; None if there is none."""
        return self._identity.unknown

    @property
    def proving(self) -> bool:
        """True if no setpoint may be sent now, because it is seen whether the drives' own watchdogs work."""
        return (self.armed_by_player and self.proof.pending) or self.rearm_pending

    @property
    def withholding(self) -> bool:
        """True if every motor has been on since it was armed, and now gets no setpoints, to prove its watchdog."""
        started = self.start.started.issuperset(axis.node for axis in self._axes)
        return self.armed_by_player and self.proof.pending and started

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
        if self.armed_by_player:
            self.start.look(self._axes, heard_until)
        self.latch(self._problem(heard_until))
        if self._off.reason is None and (stranger := self._identity.judge()):
            self.fault = str(stranger)  # it explains what else has latched
        self._identity.forget([axis for axis in self._axes if self._silence.judge_moment(axis, heard_until)])
        again = False
        if self.fault or self.estop or stopped:
            self.rearm_pending = False
        elif self.armed_by_player and self.proof.pending:
            again = self._prove(heard_until)
        lapse = self._lapse(heard_until) if self.armed_by_player else None
        if self.armed_by_player and (again or self.fault or self.estop or lapse):
            self.disarm(None if again or self.fault or self.estop else str(lapse))
            self.rearm_pending = again and not self.fault
            if lapse and not self.start.busy(heard_until) and not self._silence.disturbed:
                self.proof.doubt(self._axes)  # what was late or lost on the bus may be so from now on
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

    def _forgiven(self, heard_until: float) -> bool:
        """True if a drive may still report the state before the explicit act; an armed one reports no old state."""
        return not self.armed_by_player and heard_until - self._silence.since <= STATUS_GRACE

    def _problem(self, heard_until: float) -> Reason | None:
        """The first fault that the reports of the drives show."""
        armed, forgiven = self.armed_by_player, self._forgiven(heard_until)
        for axis in self._axes:
            problem = (
                self._silence.judge(axis, heard_until, self.start.armed_at if armed else math.inf)
                or (Reason(axis.node, Cause.REPORTED, (axis.fault,)) if axis.fault and not forgiven else None)
                or self._silence.judge_encoder(axis, heard_until)
                or self._supply.judge(axis, armed=armed)
                or (self.start.judge(axis, heard_until, self._silence.excuse(axis, "reported")) if armed else None)
            )
            if problem:
                return problem
        return None

    def _prove(self, heard_until: float) -> bool:
        """Act on what is seen of the drives' own watchdogs; True if that is to be tried once more."""
        found = self.proof.judge(
            self._axes, self.start.started, self.start.uncommanded(heard_until), disturbed=self._silence.disturbed
        )
        if found is ProofStep.PROVED:
            self.armed_by_player, self.rearm_pending = False, True
            self.start.begin()
        elif isinstance(found, Reason):
            self.latch(found)
        return found is ProofStep.AGAIN

    def _lapse(self, heard_until: float) -> Reason | None:
        """Why an armed robot must stand until it is armed again; None if there is no reason.

        A fault of a moment latches if it comes too often.
        """
        lapse = self.start.judge_watchdogs(self._axes, heard_until, self.proof.proved)
        counts = True
        if lapse:
            self.latch(self.start.judge_failed(lapse.node))
            counts = lapse.node in self.start.started and not self.start.late(heard_until)
        elif self.armed:
            moments = (self._silence.judge_moment(axis, heard_until) for axis in self._axes)
            lapse = next(filter(None, moments), None)
        if lapse and counts:
            self.latch(self._silence.judge_wires(lapse.node, heard_until))
        return lapse
