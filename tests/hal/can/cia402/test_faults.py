"""What goes wrong with a CiA 402 drive, as its axis tells it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.hal.can.cia402.wire import NODE, Wire, download_request, upload_request
from vrg.hal.can.axis import MotorState
from vrg.hal.can.cia402.codec import CONTROL_PDO, SETPOINT_PDO, Control, Function, Nmt, NmtCommand, Object, nmt
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.faults import FaultKind


class TestFaults:
    def test_a_fault_is_told_in_words_and_stays_until_it_is_cleared(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.ERROR, value=0x3220)
        wire.advance(0.1)
        assert wire.axis.state is MotorState.FAULT
        assert wire.axis.fault == "DC link undervoltage (0x3220)"
        assert not wire.axis.starved
        wire.drive_on(10.0, 1.0)
        assert abs(wire.drive.motor.velocity) < 0.1
        wire.axis.clear()
        wire.advance(0.2)
        assert (wire.axis.state, wire.axis.fault) == (MotorState.IDLE, None)
        wire.drive_on(10.0, 1.0)
        assert wire.axis.state is MotorState.IDLE, "cleared is not started"

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

    def test_a_button_at_the_drive_is_an_emergency_stop_until_it_is_cleared(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.ESTOP)
        assert wire.axis.state is MotorState.ESTOP
        wire.advance(1.0)
        assert (wire.axis.state, wire.axis.fault) == (MotorState.ESTOP, None)
        assert abs(wire.drive.motor.velocity) < 0.1
        wire.axis.idle()
        wire.advance(0.2)
        assert wire.axis.state is MotorState.ESTOP
        wire.axis.clear()
        wire.advance(0.2)
        assert wire.axis.state is MotorState.IDLE

    def test_a_drive_that_was_started_again_is_odd_and_must_be_set_up(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.REBOOT)
        wire.until(lambda: wire.axis.odd)
        assert wire.axis.odd == "it was started again"
        wire.axis.forget_oddities()
        wire.until(lambda: wire.axis.fault)
        wire.axis.clear()
        wire.advance(1.0)
        assert wire.axis.state is MotorState.FAULT
        assert wire.axis.fault is not None
        assert "set up anew" in wire.axis.fault
        wire.axis.prepare()
        wire.axis.start()
        wire.gets_going()
        assert wire.axis.odd is None

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
        "frame",
        [
            CONTROL_PDO.frame(NODE, 0x0F),
            SETPOINT_PDO.frame(NODE, 1),
            Frame(Function.RPDO3 | NODE, b"\0"),
            Frame(Function.RPDO4 | NODE, b"\0"),
            nmt(NODE, NmtCommand.START),
            nmt(0, NmtCommand.STOP),
            download_request(NODE, Object.MODE, 0, b"\1"),
        ],
    )
    def test_another_master_is_noticed(self, frame: Frame) -> None:
        wire = Wire().prepare()
        wire.axis.receive(frame)
        assert wire.axis.odd is not None
        assert "another program" in wire.axis.odd

    @pytest.mark.parametrize("node", [1, 4, 6, 127])
    def test_the_masters_of_other_nodes_are_not(self, node: int) -> None:
        wire = Wire().prepare()
        wire.axis.receive(SETPOINT_PDO.frame(node, 1))
        wire.axis.receive(nmt(node, NmtCommand.START))
        wire.axis.receive(upload_request(NODE, Object.STATUSWORD))  # who only asks does no harm
        assert wire.axis.odd is None

    @pytest.mark.parametrize(
        ("function", "length"),
        [(Function.TPDO1, 5), (Function.TPDO2, 8), (Function.TPDO3, 4), (Function.EMCY, 8), (Function.HEARTBEAT, 1)],
    )
    def test_frames_of_the_wrong_length_are_odd(self, function: Function, length: int) -> None:
        for wrong in {0, length - 1, length + 1} - {length, 9}:
            wire = Wire().prepare()
            wire.axis.receive(Frame(function | NODE, bytes(wrong)))
            assert wire.axis.odd is not None
            assert "malformed" in wire.axis.odd

    @given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=30), st.booleans())
    def test_no_frame_is_too_strange_to_be_heard(self, frames: list[tuple[int, bytes]], prepared: bool) -> None:
        wire = Wire().prepare() if prepared else Wire()
        for identifier, data in frames:
            wire.axis.receive(Frame(identifier & ~0x7F | NODE, data))
            wire.axis.receive(Frame(identifier, data))
