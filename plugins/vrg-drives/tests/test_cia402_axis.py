"""A CiA 402 axis drives its emulated drive, whose watchdog watches, and tells what goes wrong with it."""

import itertools
import math

import pytest
from cia402_wire import NODE, Wire

from vrg.hal.can.axis import MotorState
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.faults import FaultKind
from vrg_drives.cia402.codec import CONTROL_PDO, STATUS_PDO, Control, DriveState, Function, Nmt, NmtCommand, nmt
from vrg_drives.cia402.errors import RPDO_TIMEOUT
from vrg_drives.cia402.set_up import DEADLINE


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
    def test_a_drive_that_it_has_stopped_is_sent_nothing_and_starts_not_by_itself(self) -> None:
        wire = Wire().running(20.0)
        wire.sent.clear()
        wire.until(lambda: wire.axis.watchdog_expired)
        assert not wire.setpoints, "who only listens sends none"
        wire.advance(5.0)
        assert wire.drive.state is DriveState.FAULT

    def test_stepping_the_state_machine_feeds_it_not(self) -> None:
        wire = Wire().running(20.0)
        wire.advance(DEADLINE / 2)
        for _ in range(20):
            wire.inject(CONTROL_PDO.frame(NODE, Control.ENABLE_OPERATION))
            wire.advance(DEADLINE / 20)
        assert wire.drive.state is DriveState.FAULT
        assert wire.axis.watchdog_expired

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
        assert wire.axis.watchdog_expired
        assert wire.axis.fault is None
        wire.axis.idle()
        wire.advance(0.2)
        assert not wire.axis.watchdog_expired

    def test_a_drive_that_takes_it_for_an_error_while_it_holds_still_has_no_fault_either(self) -> None:
        wire = Wire().running()
        wire.axis.idle()
        wire.advance(0.05)
        wire.drive._fail(RPDO_TIMEOUT)
        wire.advance(0.2)
        assert wire.axis.watchdog_expired
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


class TestFaults:
    def test_a_fault_is_told_in_words(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.ERROR, value=0x3220)
        wire.advance(0.1)
        assert wire.says() == (MotorState.FAULT, "DC link undervoltage (0x3220)")
        assert not wire.axis.watchdog_expired

    def test_every_clear_is_an_edge(self) -> None:
        wire = Wire().running()
        for _ in range(3):
            wire.fault(FaultKind.ERROR)
            wire.advance(0.01)
            assert wire.axis.fault
            wire.axis.clear()
            wire.advance(0.001)
            assert wire.axis.fault is None

    def test_a_drive_that_has_not_heard_the_first_edge_gets_another(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.ERROR)
        wire.fault(FaultKind.FREEZE)
        wire.axis.idle()
        wire.axis.clear()
        wire.sent.clear()
        wire.axis.clear()
        assert wire.words == [Control.DISABLE_VOLTAGE, Control.FAULT_RESET]

    def test_a_drive_that_was_started_again_is_odd_and_must_be_set_up(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.REBOOT)
        wire.until(lambda: wire.axis.implausible)
        assert wire.axis.implausible == "it was started again"
        wire.axis.forget_implausible()
        wire.until(lambda: wire.axis.fault)
        wire.axis.clear()
        wire.advance(1.0)
        assert wire.axis.state is MotorState.FAULT
        assert "set up again" in (wire.axis.fault or "")
        wire.axis.prepare()
        wire.axis.start()
        wire.gets_going()
        assert wire.axis.implausible is None

    def test_a_heartbeat_that_was_under_way_as_the_set_up_ended_is_no_fault(self) -> None:
        faults: list[str | None] = []

        class Late(Wire):
            def send(self, frame: Frame, *, urgent: bool = False) -> None:
                super().send(frame, urgent=urgent)
                if frame == nmt(NODE, NmtCommand.START):
                    self.axis.receive(Frame(Function.HEARTBEAT | NODE, bytes([Nmt.PRE_OPERATIONAL]), at=self.now))
                    faults.append(self.axis.fault)

        wire = Late().running()
        assert faults == [None]
        assert wire.axis.state is MotorState.CLOSED_LOOP

    @pytest.mark.parametrize("command", [NmtCommand.STOP, NmtCommand.PRE_OPERATIONAL])
    def test_a_drive_that_is_taken_off_the_network_stops_and_is_a_fault(self, command: NmtCommand) -> None:
        wire = Wire().running()
        wire.inject(nmt(0, command))
        wire.until(lambda: wire.axis.fault)
        wire.advance(0.5)
        assert abs(wire.drive.motor.velocity) < 0.1
        assert wire.axis.state is MotorState.FAULT

    @pytest.mark.parametrize(
        ("function", "length"),
        [(Function.TPDO1, 5), (Function.TPDO2, 8), (Function.TPDO3, 4), (Function.EMCY, 8), (Function.HEARTBEAT, 1)],
    )
    def test_frames_of_the_wrong_length_are_odd(self, function: Function, length: int) -> None:
        for wrong in {0, length - 1, length + 1} - {length, 9}:
            wire = Wire().prepare()
            wire.axis.receive(Frame(function | NODE, bytes(wrong)))
            assert "malformed" in (wire.axis.implausible or "")
