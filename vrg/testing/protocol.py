"""The contract of every protocol of motor controllers. A protocol's test subclasses ProtocolContract.

    class TestMyProtocol(ProtocolContract):
        protocol = my_package.PROTOCOL
        nodes = (1, 127)
        impossible_nodes = (0, 128)

The protocol's axis is run against its own emulated drive, in memory: no bus, no threads, and a clock that the test
turns on. So the protocol must have an emulated drive; without a listener the tests of that are skipped.
"""

import math
import random
from collections.abc import Sequence

import pytest

from vrg.hal.can.axis import AxisReport, MotorState, ProtocolOptions
from vrg.hal.can.frame import CLASSIC_BYTES, FD_BYTES, STANDARD_MASK, Frame, fd_size
from vrg.hal.can.protocols import Protocol
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.workshop.survey import Survey
from vrg.testing.wire import SERIAL_NUMBER, SPEED, WATCHDOG, ProtocolWire, WireClock

STANDSTILL_SPEED = 0.1
"""turn/s below which a motor stands."""


class ProtocolContract:
    """Subclasses have these attributes.

    Attributes:
        protocol: what is tested. options: its axis' options of the drives; None for the defaults.
        nodes: some ids that a drive can have, the lowest and the highest among them.
        impossible_nodes: some ids that a drive cannot have.
    """

    protocol: Protocol
    options: ProtocolOptions | None = None
    nodes: Sequence[int]
    impossible_nodes: Sequence[int]

    @pytest.fixture
    def wire(self) -> ProtocolWire:
        return ProtocolWire(self.protocol, self.nodes[0], options=self.options)

    def test_it_says_which_ids_a_drive_can_have(self) -> None:
        kind = self.protocol.axis_type
        assert [kind.check_node(node) for node in self.nodes] == [None] * len(self.nodes)
        for node in self.impossible_nodes:
            why = kind.check_node(node)
            assert why, f"{node}: expected words"
            assert str(node) in why

    def test_every_possible_id_drives(self) -> None:
        for node in self.nodes:
            ProtocolWire(self.protocol, node, options=self.options).running()

    def test_it_is_silent_until_it_has_been_heard(self, wire: ProtocolWire) -> None:
        assert wire.axis.state is MotorState.SILENT
        assert wire.axis.heard == wire.axis.measured == -math.inf
        assert (wire.axis.voltage, wire.axis.fault, wire.axis.implausible) == (None, None, None)
        assert not wire.axis.identified

    def test_a_drive_says_who_it_is(self, wire: ProtocolWire) -> None:
        wire.meet()
        assert wire.axis.problem is None
        assert wire.axis.state is MotorState.IDLE
        assert wire.axis.heard == pytest.approx(wire.now, abs=0.5)

    def test_two_drives_with_one_id_are_a_problem(self) -> None:
        wire = ProtocolWire(self.protocol, self.nodes[0], (SERIAL_NUMBER, SERIAL_NUMBER + 1), self.options)
        wire.meet()
        assert wire.axis.problem

    def test_it_says_anew_which_drive_it_is(self, wire: ProtocolWire) -> None:
        wire.running()
        before = set(wire.axis.serials)
        wire.axis.forget_serials()
        assert not wire.axis.serials
        wire.axis.ask_serial()
        wire.advance(0.5)
        assert wire.axis.serials == before
        assert wire.axis.implausible is None

    def test_setting_up_energises_nothing(self, wire: ProtocolWire) -> None:
        wire.prepare()
        wire.advance(1.0)
        assert wire.axis.state is MotorState.IDLE
        assert wire.motor_speed == 0.0

    def test_it_can_be_set_up_again(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.axis.idle()
        wire.axis.prepare()
        wire.advance(0.5)
        assert wire.axis.state is MotorState.IDLE
        wire.get_going()

    def test_a_setpoint_alone_starts_nothing(self, wire: ProtocolWire) -> None:
        wire.prepare()
        wire.drive_on(SPEED, 0.5)
        assert wire.motor_speed == 0.0

    def test_a_start_begins_at_rest(self, wire: ProtocolWire) -> None:
        wire.prepare()
        wire.drive_on(SPEED, 0.1)
        wire.axis.start()
        assert wire.axis.state in (MotorState.STARTING, MotorState.CLOSED_LOOP)
        wire.until(lambda: wire.axis.state is MotorState.CLOSED_LOOP, lambda: wire.axis.command(0.0))
        assert abs(wire.motor_speed) < STANDSTILL_SPEED

    def test_it_follows_setpoints_both_ways(self, wire: ProtocolWire) -> None:
        wire.running(SPEED)
        wire.drive_on(-SPEED / 2, 1.0)
        assert wire.motor_speed == pytest.approx(-SPEED / 2, rel=0.1)
        wire.drive_on(0.0, 0.5)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED
        assert wire.axis.state is MotorState.CLOSED_LOOP

    def test_it_measures_turns_and_turns_per_second(self, wire: ProtocolWire) -> None:
        wire.running(SPEED)
        before, truly, began = wire.axis.position, wire.drive.motor.position, wire.axis.measured
        wire.drive_on(SPEED, 1.0)
        assert wire.axis.velocity == pytest.approx(wire.motor_speed, rel=0.05)
        assert wire.axis.position - before == pytest.approx(wire.drive.motor.position - truly, rel=0.05)
        assert wire.axis.position - before == pytest.approx(SPEED * (wire.axis.measured - began), rel=0.05)
        assert wire.axis.measured == pytest.approx(wire.now, abs=0.05)

    def test_idle_switches_off_and_setpoints_do_not_switch_on_again(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.axis.idle()
        wire.drive_on(SPEED, 1.0)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED
        assert wire.axis.state is MotorState.IDLE
        assert wire.axis.fault is None
        if wire.axis.watchdog_expired:
            wire.axis.clear()
        wire.get_going()

    def test_the_emergency_stop_of_the_match_switches_off(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.axis.stop_now()
        wire.drive_on(SPEED, 1.0)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED
        assert wire.axis.state is not MotorState.CLOSED_LOOP
        wire.axis.clear()
        wire.drive_on(SPEED, 0.5)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED, "cleared is not started"
        wire.get_going()

    def test_a_button_at_the_drive_latches_until_it_is_cleared(self, wire: ProtocolWire) -> None:
        if FaultKind.ESTOP not in wire.drive.supports:
            pytest.skip("it has no button, or does not report it")
        wire.running()
        wire.fault(FaultKind.ESTOP)
        wire.until(lambda: wire.axis.state is MotorState.ESTOP)
        for act in (wire.axis.idle, wire.axis.start, lambda: wire.axis.command(SPEED)):
            act()
            wire.advance(0.5)
            assert abs(wire.motor_speed) < STANDSTILL_SPEED
        wire.axis.idle()
        wire.advance(0.5)
        assert wire.says()[0] is MotorState.ESTOP
        wire.fault(FaultKind.END)  # a button that stays down is released
        wire.axis.clear()
        wire.advance(0.5)
        assert wire.says()[0] is MotorState.IDLE
        assert abs(wire.motor_speed) < STANDSTILL_SPEED
        wire.get_going()

    def test_its_watchdog_stops_it_when_setpoints_cease_which_is_no_fault(self, wire: ProtocolWire) -> None:
        wire.running()
        began = wire.now
        wire.until(lambda: abs(wire.motor_speed) < STANDSTILL_SPEED)
        assert wire.now - began < WATCHDOG + 0.5, "nobody but the one who drives may feed it"
        wire.until(lambda: wire.axis.watchdog_expired)
        assert wire.axis.fault is None
        assert wire.axis.state is MotorState.IDLE
        wire.advance(2.0)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED, "it does not start again by itself"
        wire.axis.clear()
        wire.get_going()
        assert not wire.axis.watchdog_expired

    def test_a_fault_that_is_planted_is_no_order_of_another_master(self, wire: ProtocolWire) -> None:
        wire.prepare()
        for kind in FaultKind:
            for value in (0, 5, 0x2000):
                wire.axis.receive(encode_fault(wire.node, FaultRequest(kind, 0.0, value)))
        assert wire.axis.implausible is None

    def test_a_drive_to_which_nobody_speaks_any_more_stops_by_itself(self, wire: ProtocolWire) -> None:
        wire.running()
        drive, now = wire.drive, wire.now
        for _ in range(1000):
            if now > wire.now + WATCHDOG + 0.5:
                break
            now = drive.due
            drive.step(now)
        assert wire.now + WATCHDOG < now < math.inf, "its own `due` says when it must be let go on"
        assert abs(wire.motor_speed) < STANDSTILL_SPEED

    def test_a_fault_is_told_in_words_and_stays_until_it_is_cleared(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.fault(FaultKind.ERROR)
        wire.until(lambda: wire.axis.state is MotorState.FAULT)
        assert wire.says()[1]
        wire.drive_on(SPEED, 1.0)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED
        assert wire.says()[1]
        if wire.axis.watchdog_expired:
            wire.axis.clear()
        wire.axis.clear()
        wire.advance(0.5)
        assert wire.says() == (MotorState.IDLE, None)
        wire.drive_on(SPEED, 0.5)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED, "cleared is not started"
        wire.get_going()

    def test_silence_makes_what_was_heard_old(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.fault(FaultKind.SILENCE)
        wire.advance(1.0)
        assert wire.now - wire.axis.heard > 0.9
        assert wire.now - wire.axis.measured > 0.9

    def test_a_drive_that_starts_again_is_not_taken_for_one_that_drives(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.fault(FaultKind.REBOOT)
        wire.drive_on(SPEED, 1.0)
        assert wire.axis.state is not MotorState.CLOSED_LOOP
        assert abs(wire.motor_speed) < STANDSTILL_SPEED

    def test_numbers_that_are_not_finite_are_odd_and_change_nothing(self, wire: ProtocolWire) -> None:
        if FaultKind.NAN not in wire.drive.supports:
            pytest.skip("its numbers are always finite")
        wire.running()
        wire.fault(FaultKind.NAN)
        wire.advance(0.5)
        assert wire.axis.implausible
        for report in (wire.axis, *wire.survey.nodes):
            assert math.isfinite(report.position + report.velocity)

    def test_frames_that_are_too_short_are_odd(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.fault(FaultKind.LENGTH)
        wire.advance(0.5)
        assert wire.axis.implausible
        wire.fault(FaultKind.END)
        wire.axis.forget_implausible()
        wire.advance(0.5)
        assert wire.axis.implausible is None

    def test_another_master_is_noticed(self, wire: ProtocolWire) -> None:
        wire.running()
        assert wire.axis.implausible is None
        wire.sent.clear()
        wire.axis.command(1.0)
        for frame in wire.sent:
            wire.axis.receive(frame)
        assert wire.axis.implausible

    def test_drives_of_other_ids_are_none_of_its_business(self, wire: ProtocolWire) -> None:
        other = ProtocolWire(self.protocol, self.nodes[-1], options=self.options)
        other.running()
        for frame in other.heard:
            wire.axis.receive(frame)
        assert wire.axis.state is MotorState.SILENT
        assert wire.axis.measured == -math.inf

    @pytest.mark.parametrize("prepared", [False, True])
    def test_no_frame_is_too_strange(self, wire: ProtocolWire, prepared: bool) -> None:
        if prepared:
            wire.running()
        own = sorted({frame.id for frame in [*wire.sent, *wire.heard]})
        rng = random.Random(1)
        for _ in range(500):
            identifier = rng.choice(own) if own and rng.random() < 0.7 else rng.randrange(STANDARD_MASK + 1)
            fd = rng.random() < 0.3
            size = fd_size(rng.randrange(FD_BYTES + 1)) if fd else rng.randrange(CLASSIC_BYTES + 1)
            extended = rng.random() < 0.3 or identifier > STANDARD_MASK
            frame = Frame(identifier, rng.randbytes(size), rng.random() < 0.1, extended, wire.now, fd)
            wire.axis.receive(frame)
            wire.survey.hear(frame)
            for answer in wire.drive.receive(frame, wire.now):
                assert len(answer.data) <= (FD_BYTES if answer.fd else CLASSIC_BYTES)
            assert math.isfinite(wire.axis.position)
            assert math.isfinite(wire.axis.velocity)
            assert wire.axis.voltage is None or math.isfinite(wire.axis.voltage)
        wire.advance(1.0)
        assert math.isfinite(wire.drive.motor.velocity)

    def test_garbage_of_a_drive_is_survived(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.fault(FaultKind.GARBAGE)
        wire.advance(2.0)
        assert math.isfinite(wire.axis.position)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED

    def test_a_listener_finds_the_drive_and_tells_of_it(self, wire: ProtocolWire) -> None:
        wire.running()
        found = self.look(wire)
        assert found.node == wire.node
        assert found.words
        assert not found.errors
        if self.options is None:
            # A listener knows no wiring: what only that tells, it cannot know.
            assert found.position == pytest.approx(wire.drive.motor.position, abs=0.5)
            assert found.velocity == pytest.approx(wire.motor_speed, abs=0.5)
        assert str(wire.node) in str(wire.survey)
        wire.fault(FaultKind.ERROR)
        wire.advance(0.2)
        assert self.look(wire).errors

    def test_a_listener_that_is_asked_nothing_sends_nothing(self, wire: ProtocolWire) -> None:
        """Somebody else asks the drives, sets them up and drives them."""
        self.require_listener()
        sent: list[Frame] = []
        survey = Survey([self.protocol.listener_type(lambda frame, **_: sent.append(frame), WireClock(wire))])
        for frame in wire.running().heard:
            survey.hear(frame)
        assert ([node.node for node in survey.nodes], sent) == ([wire.node], [])

    def test_a_listener_switches_off_whoever_drives(self, wire: ProtocolWire) -> None:
        wire.running()
        assert self.look(wire).on
        wire.survey.stop()
        wire.advance(0.5)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED
        assert self.look(wire).on is False

    def test_a_listener_switches_off_drives_that_it_has_not_heard(self) -> None:
        self.require_listener()
        wire = ProtocolWire(self.protocol, self.nodes[0], options=self.options)
        wire.running()
        Survey([self.protocol.listener_type(wire.question, WireClock(wire))]).stop()
        wire.advance(0.5)
        assert abs(wire.motor_speed) < STANDSTILL_SPEED

    def test_a_listener_clears_errors_and_starts_nothing(self, wire: ProtocolWire) -> None:
        wire.running()
        wire.fault(FaultKind.ERROR)
        wire.until(lambda: wire.axis.state is MotorState.FAULT)
        found = self.look(wire)
        wire.survey.listener_of(found).clear(found)
        wire.advance(1.0)
        assert not self.look(wire).errors
        assert abs(wire.motor_speed) < STANDSTILL_SPEED

    def require_listener(self) -> None:
        """Skip a test of the listener if the protocol has none."""
        if self.protocol.listener is None:
            pytest.skip("it has no listener")

    def look(self, wire: ProtocolWire) -> AxisReport:
        """The one node that is on the wire, after it was asked for all that it tells."""
        self.require_listener()
        wire.survey.greet()
        (found,) = wire.survey.nodes
        wire.survey.ask(found)
        return found
