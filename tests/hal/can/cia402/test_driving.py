"""A CiA 402 axis drives its emulated drive, whose watchdog watches."""

import itertools
import math

import pytest

from tests.hal.can.cia402.wire import NODE, Wire
from vrg.hal.can.axis import MotorState
from vrg.hal.can.cia402.codec import CONTROL_PDO, STATUS_PDO, Control, DriveState, Function
from vrg.hal.can.cia402.errors import RPDO_TIMEOUT
from vrg.hal.can.cia402.set_up import DEADLINE
from vrg.hal.can.workshop.faults import FaultKind


class TestDriving:
    def test_a_start_takes_three_steps_each_after_the_drive_has_confirmed_the_last(self) -> None:
        wire = Wire().prepare()
        wire.sent.clear()
        wire.axis.start()
        wire.until(lambda: wire.axis.state is MotorState.CLOSED_LOOP)
        steps = [word for word, _ in itertools.groupby(wire.words)]
        assert steps == [Control.SHUTDOWN, Control.SWITCH_ON, Control.ENABLE_OPERATION]
        assert wire.sent[0].id == Function.RPDO2 | NODE, "a setpoint of zero comes before all"
        assert wire.sent[0].data == bytes(4)

    def test_it_turns_as_it_is_told_and_says_so(self) -> None:
        wire = Wire().running(10.0)
        before, began = wire.axis.position, wire.axis.measured
        wire.drive_on(10.0, 1.0)
        assert wire.axis.velocity == pytest.approx(10.0, abs=0.3)
        assert wire.axis.position - before == pytest.approx(10.0 * (wire.axis.measured - began), rel=0.05)
        wire.drive_on(-4.0, 1.0)
        assert wire.axis.velocity == pytest.approx(-4.0, abs=0.3)
        wire.drive_on(0.0, 0.5)
        assert wire.axis.velocity == pytest.approx(0.0, abs=0.1)
        assert wire.axis.state is MotorState.CLOSED_LOOP

    def test_the_position_begins_anew_after_32_bits(self) -> None:
        wire = Wire().prepare()
        wire.drive.motor.position = wire.axis.wrap / 2 - 5
        wire.advance(0.1)
        before = wire.axis.position
        wire.axis.start()
        wire.drive_on(10.0, 2.0)
        assert before > 0 > wire.axis.position
        way = math.remainder(wire.axis.position - before, wire.axis.wrap)
        assert way == pytest.approx(wire.drive.motor.position - (wire.axis.wrap / 2 - 5), abs=0.5)

    @pytest.mark.parametrize("off", ["idle", "stop_now"])
    def test_one_frame_switches_it_off(self, off: str) -> None:
        wire = Wire().running()
        wire.sent.clear()
        getattr(wire.axis, off)()
        assert wire.words[0] == Control.DISABLE_VOLTAGE
        assert not wire.drive._energised
        wire.advance(2.0)
        assert wire.axis.state is MotorState.IDLE
        assert abs(wire.axis.velocity) < 0.1
        assert not wire.setpoints

    def test_it_starts_again_after_it_was_switched_off(self) -> None:
        wire = Wire().running()
        wire.axis.idle()
        wire.advance(1.0)
        assert wire.axis.fault is None
        wire.axis.start()
        wire.gets_going()

    @pytest.mark.parametrize("word", [Control.DISABLE_VOLTAGE, Control.SHUTDOWN, Control.SWITCH_ON, Control.QUICK_STOP])
    def test_a_drive_that_leaves_operation_by_itself_is_not_brought_back(self, word: Control) -> None:
        wire = Wire().running()
        wire.inject(CONTROL_PDO.frame(NODE, word))
        wire.drive_on(10.0, 2.0)
        assert not wire.drive._energised
        assert abs(wire.axis.velocity) < 0.1
        assert wire.axis.state is MotorState.IDLE
        wire.axis.idle()
        wire.axis.start()
        wire.gets_going()

    def test_it_may_be_started_in_the_moment_after_it_was_switched_off(self) -> None:
        wire = Wire().running()
        for _ in range(5):
            wire.axis.idle()
            wire.axis.receive(STATUS_PDO.frame(NODE, 0x0627, 0, 3))  # sent before that came
            wire.axis.start()
            wire.axis.receive(STATUS_PDO.frame(NODE, 0x0627, 0, 3))
            wire.gets_going()

    def test_a_motor_that_somebody_else_switches_on_is_switched_off(self) -> None:
        wire = Wire().prepare()
        for word in (Control.SHUTDOWN, Control.SWITCH_ON, Control.ENABLE_OPERATION):
            wire.inject(CONTROL_PDO.frame(NODE, word))
        wire.advance(0.5)
        assert not wire.drive._energised


class TestWatchdog:
    def test_it_stops_when_setpoints_cease_which_is_no_fault(self) -> None:
        wire = Wire().running(20.0)
        wire.sent.clear()
        wire.until(lambda: wire.axis.starved)
        wire.until(lambda: abs(wire.drive.motor.velocity) < 0.1)
        assert wire.axis.fault is None
        assert wire.axis.state is MotorState.IDLE
        assert not wire.setpoints, "who only listens sends none"
        assert wire.drive.state is DriveState.FAULT
        wire.advance(5.0)
        assert wire.drive.state is DriveState.FAULT, "nor does it start again by itself"

    def test_after_that_it_starts_again_at_once(self) -> None:
        wire = Wire().running(20.0)
        wire.until(lambda: wire.axis.starved)
        wire.axis.clear()
        wire.axis.start()
        wire.gets_going()
        assert not wire.axis.starved

    def test_stepping_the_state_machine_feeds_it_not(self) -> None:
        wire = Wire().running(20.0)
        wire.advance(DEADLINE / 2)
        for _ in range(20):
            wire.inject(CONTROL_PDO.frame(NODE, Control.ENABLE_OPERATION))
            wire.advance(DEADLINE / 20)
        assert wire.drive.state is DriveState.FAULT
        assert wire.axis.starved

    def test_who_freezes_in_the_midst_of_a_start_leaves_no_motor_on(self) -> None:
        wire = Wire().prepare()
        wire.fault(FaultKind.SILENCE)
        wire.axis.start()
        wire.advance(2 * DEADLINE)
        wire.fault(FaultKind.END)
        wire.sent.clear()
        wire.advance(2.0)
        assert not wire.words
        assert not wire.drive._energised
        assert wire.axis.starved
        assert wire.axis.fault is None
        wire.axis.idle()
        wire.advance(0.2)
        assert not wire.axis.starved

    def test_a_drive_that_takes_it_for_an_error_while_it_holds_still_has_no_fault_either(self) -> None:
        wire = Wire().running()
        wire.axis.idle()
        wire.advance(0.05)
        wire.drive._fail(RPDO_TIMEOUT)
        wire.advance(0.2)
        assert wire.axis.starved
        assert (wire.axis.state, wire.axis.fault) == (MotorState.IDLE, None)
        wire.axis.clear()
        wire.axis.start()
        wire.gets_going()

    def test_it_runs_from_the_first_setpoint_on(self) -> None:
        wire = Wire().prepare()
        for word in (Control.SHUTDOWN, Control.SWITCH_ON, Control.ENABLE_OPERATION):
            wire.drive.receive(CONTROL_PDO.frame(NODE, word), wire.now)
        assert wire.drive._energised
        wire.drive.step(wire.now + 10.0)
        assert wire.drive._energised, "as CiA 301 has it, which is why a start sends a setpoint first"
