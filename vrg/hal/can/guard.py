"""Every reason for which the motors of a CAN robot must be off, in one place. It has no bus and no clock.

A reason latches: it stays, whatever the drives say later, until a person clears it. The one exception is a drive's
watchdog: it tells of a commander that was late, not of a robot that is broken, so arming again is enough.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from vrg.hal.can.axis import AxisReport, MotorState
from vrg.hal.can.dropouts import DROPOUT, Dropouts
from vrg.hal.can.judges.identity import Identity
from vrg.hal.can.judges.supply import ANY_SUPPLY, Supply

HEARTBEAT_TIMEOUT = 0.5
"""s without a heartbeat after which a drive is taken for dead. It sends one every 0.1 s."""
START_TIMEOUT = 1.0
"""s from arming until every axis must be in closed loop."""
OBEY_TIMEOUT = 0.5
"""s for which a drive may still report that it is on after it was switched off."""
OFF_PERIOD = 0.05
"""s from one order to be off to the next, until every drive has reported that it is off."""
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
COAST_TIMEOUT = 1.0
"""s after the order to be off in which a motor must have become slower."""
COASTS = 0.9
"""The part of its speed at the order below which a motor that is off has become slower."""
COASTED = 0.25 * COAST_TIMEOUT
"""The s of that speed for which a motor must have turned since: an encoder may tell a speed and no way."""
TURNING_SPEED = 0.5
"""The speed in turn/s of the motor's shaft above which it counts as turning."""
BUSY = "was this program stopped, or is this computer too busy?"
"""What a person should ask about setpoints that did not come."""
CUT_POWER = "cut the power of its motor"
"""What a person must do about a motor that no order stops."""
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
        not_off: the node of a drive that is on though it was switched off, for longer than OBEY_TIMEOUT, or whose motor
            has not become slower within COAST_TIMEOUT, by its own estimates; None if there is none.
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
        self.not_off: int | None = None
        self._excused: dict[tuple[int, str], float] = {}
        self._on_since: dict[int, float] = {}
        self._ordered_off = -math.inf
        self._ordered = True
        self._coasting: dict[int, tuple[float, float, float]] = {}
        self._since = -math.inf
        self.armed_at = -math.inf
        self._commanded = -math.inf
        self._gap, self._late_at, self._slow_at = 0.0, -math.inf, -math.inf
        self._proofs, self._proved_before, self._disturbed = 0, False, False
        self._failed_starts = Counter[int]()
        self._dropouts = Dropouts()
        self._started: set[int] = set()
        self._proved: set[int] = set()

    def begin(self, now: float) -> None:
        """A person has connected or recovered the robot: judge anew from here."""
        self.fault = None
        self.not_off = self.disarmed_because = None
        self.unproved = not self._unwatched
        self.rearm_pending, self._proofs, self._proved_before = False, 0, False
        self._on_since.clear()
        self._failed_starts.clear()
        self._dropouts = Dropouts()
        self._supply.begin()
        self._since = now
        self._identity.judge()  # whoever has answered first is expected from now on
        for axis in self._axes:
            axis.forget_implausible()

    def release(self, now: float) -> None:
        """A person has released the emergency stop."""
        self.estop = self.at_drive = False
        self._since = now

    def engage(self) -> None:
        """The emergency stop of the match was engaged."""
        self.estop = True
        self.disarm()

    def latch(self, words: str) -> None:
        """Keep a reason, unless there is one: the first is kept, as the others mostly follow from it."""
        self.fault = self.fault or words

    def arm(self, now: float) -> None:
        """The player arms the robot; ask `refusal` first."""
        self.armed_by_player, self.rearm_pending, self.disarmed_because = True, False, None
        self._ordered = self._disturbed = False
        self._coasting.clear()
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
        """Nothing was heard, or asked, for a while until now, as this process did not run: silence counts from here.

        A drive that has not sent a kind of message since it was last excused is not excused again for that kind.
        """
        self._disturbed = True
        for axis in self._axes:
            for kind, at in (("heard", axis.heard), ("reported", axis.reported_at), ("measured", axis.measured)):
                if at > self._excused.get((axis.node, kind), -math.inf):
                    self._excused[axis.node, kind] = heard_until

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
        reported = all(axis.on is False and axis.reported_at > self._ordered_off for axis in self._axes)
        return not self.armed_by_player and reported and self.not_off is None

    def ordered_off(self, heard_until: float) -> None:
        """Every drive has been ordered to switch its motor off."""
        self._ordered_off = heard_until
        if not self._ordered:
            self._ordered = True
            self._coasting = {
                axis.node: (heard_until, abs(axis.velocity), axis.position)
                for axis in self._axes
                if abs(axis.velocity) > TURNING_SPEED
            }

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
        problem = self._problem(heard_until)
        if problem is not None:
            self.latch(problem)
        if self.not_off is None and (wrong := self._identity.judge()):
            self.fault = str(wrong)  # it explains what else has latched
        self._identity.forget([axis for axis in self._axes if self._is_silent(axis, heard_until)])
        again = False
        if self.fault or self.estop or stopped:
            self.rearm_pending = False
        elif self.armed_by_player and self.unproved:
            again = self._prove(heard_until)
        lapsed = self._lapse(heard_until) if self.armed_by_player else None
        if self.armed_by_player and (again or self.fault or self.estop or lapsed):
            self.armed_by_player, self.disarmed_because = False, None if again or self.fault or self.estop else lapsed
            self.rearm_pending = again and not self.fault
            if lapsed and heard_until - self._late_at > START_TIMEOUT and not self._disturbed:
                self.unproved = not self._unwatched  # what was late or lost on the bus may be so from now on
            self.ordered_off(heard_until)
            return True
        self._find_not_off(heard_until)
        if not self.armed_by_player and not self.off and heard_until - self._ordered_off >= OFF_PERIOD:
            # The order may have been lost on the bus.
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
            axis = next((axis for axis in self._axes if self.armed and self._is_silent(axis, heard_until)), None)
            if axis is None:
                return None
            node, counts = axis.node, True
            what = "it answers nothing" if axis.deaf else f"nothing was heard of it for {DROPOUT:g} s"
            words = f"node {node}: {what}: check its wires and its plug."
        if counts and (fault := self._dropouts.failed(node, heard_until)):
            self.latch(fault)
        return words

    def _is_silent(self, axis: AxisReport, heard_until: float) -> bool:
        """True if nothing has been heard of a drive for a moment, or if it does not hear this computer."""
        return axis.deaf or heard_until - max(axis.heard, self._heard_of(axis)) > DROPOUT

    def _heard_of(self, axis: AxisReport) -> float:
        """Since when the silence of a drive's encoder counts."""
        return max(axis.measured, self._since, self._excuse(axis, "measured"))

    def _count_failed_start(self, node: int) -> None:
        """Count how often a drive whose watchdog has expired was ordered to start, and has not."""
        self._failed_starts[node] = 0 if node in self._started else self._failed_starts[node] + 1
        if self._failed_starts[node] >= FAILED_STARTS:
            self.latch(
                f"node {node}: it was ordered {FAILED_STARTS} times to start, and goes on reporting that its watchdog "
                "has stopped it: it does not hear this computer. Check the wires and the plug of this drive"
            )

    def _excuse(self, axis: AxisReport, kind: str) -> float:
        """Until when the silence of a drive, in messages of a kind, was that of this process."""
        return self._excused.get((axis.node, kind), -math.inf)

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
            self._proofs += not self._disturbed  # a drive that was not asked, or not heard, has had no chance
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

    def _find_not_off(self, heard_until: float) -> None:
        """Find a drive that reports for too long that it is on, against the order, or whose motor turns on."""
        if self.armed_by_player:
            self.not_off = None
            self._on_since.clear()
            return
        # A silent drive does not report this either.
        recent = heard_until - HEARTBEAT_TIMEOUT
        on = {axis.node for axis in self._axes if axis.on and axis.reported_at >= recent}
        self._on_since = {node: self._on_since.get(node, heard_until) for node in on}
        self.not_off = next((n for n, at in self._on_since.items() if heard_until - at > OBEY_TIMEOUT), None)
        # Both are worse than whatever has latched before, so they take its place.
        if self.not_off is not None:
            self.fault = f"node {self.not_off}: it is on, though it was ordered to be off: {CUT_POWER}"
        for axis in self._axes:
            ordered, speed, position = self._coasting.get(axis.node, (math.inf, 0.0, 0.0))
            if abs(axis.velocity) < COASTS * speed:
                self._coasting.pop(axis.node)  # from now on a person may push the robot
            elif axis.measured - ordered > COAST_TIMEOUT and abs(axis.position - position) > COASTED * speed:
                self.not_off = axis.node
                turns = f"it turns at {axis.velocity:.3g} turn/s"
                self.fault = f"node {axis.node}: {turns}, though it was ordered to be off: {CUT_POWER}"

    def _forgiven(self, heard_until: float) -> bool:
        """True if a drive may still report the state before the explicit act; an armed one reports no old state."""
        return not self.armed_by_player and heard_until - self._since <= STATUS_GRACE

    def _problem(self, heard_until: float) -> str | None:
        forgiven = self._forgiven(heard_until)
        for axis in self._axes:
            problem = self._silence(axis, heard_until) or (axis.fault if not forgiven else None)
            problem = problem or self._lack(axis, heard_until)
            if not problem and (found := self._supply.judge(axis, armed=self.armed_by_player)):
                return str(found)
            # What a drive has reported before this process did not run shows nothing of how it has started since.
            began = max(self.armed_at, self._excuse(axis, "reported"))
            due = self.armed_by_player and (axis.node in self._started or heard_until - began > START_TIMEOUT)
            if due and not axis.watchdog_expired and axis.state in (MotorState.IDLE, MotorState.STARTING):
                problem = problem or f"expected closed-loop control, but it is idle{self._reason(axis, heard_until)}"
            if problem:
                return f"node {axis.node}: {problem}"
        return None

    def _silence(self, axis: AxisReport, heard_until: float) -> str | None:
        """The fault of a drive that has fallen silent, or makes no sense."""
        if axis.implausible:
            return axis.implausible
        if heard_until - max(axis.heard, self._since, self._excuse(axis, "heard")) > HEARTBEAT_TIMEOUT:
            return f"no heartbeat for {HEARTBEAT_TIMEOUT:g} s"
        reported = max(axis.reported_at, self.armed_at, self._excuse(axis, "reported"))
        # One that has fallen silent altogether is left to the judgement above.
        mute = heard_until - reported > HEARTBEAT_TIMEOUT and axis.heard - reported > HEARTBEAT_TIMEOUT / 2
        if self.armed_by_player and mute:
            return f"it has not said for {HEARTBEAT_TIMEOUT:g} s whether its motor is on"
        return None

    def _lack(self, axis: AxisReport, heard_until: float) -> str | None:
        """The fault of a drive that is alive: it sends no encoder messages."""
        measured = self._heard_of(axis)
        if heard_until - measured > HEARTBEAT_TIMEOUT and axis.heard - measured > HEARTBEAT_TIMEOUT / 2:
            return f"no encoder message for {HEARTBEAT_TIMEOUT:g} s, though it is alive: {axis.encoder_advice}"
        return None

    def _reason(self, axis: AxisReport, heard_until: float) -> str:
        """Why a motor may be off that should be on, in words."""
        if axis.refusal:
            return f" and reports {axis.refusal}"
        if heard_until - self._late_at <= START_TIMEOUT:
            return f": this computer is too busy, it sent no setpoint for {self._gap:.2g} s. Close other programs"
        return " and gives no reason: does it hear this computer, and can it start (see `vrg can scan`)?"
