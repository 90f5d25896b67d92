"""The emulated CiA 402 drive alone, as strict as real ones are, and as a node of its network."""

import struct

import pytest
from cia402_wire import NODE, Wire, download_request, upload_request

from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.emulated import BOOT
from vrg.hal.can.workshop.faults import FaultKind
from vrg_drives.cia402.codec import (
    COB_ID,
    CONTROL_PDO,
    INHIBIT,
    NOT_VALID,
    PROFILE_VELOCITY,
    SAVE,
    TRANSMISSION,
    Control,
    DriveState,
    Function,
    Nmt,
    NmtCommand,
    Object,
    drive_state,
    mapping_entry,
    nmt,
)
from vrg_drives.cia402.drive import Cia402Drive
from vrg_drives.cia402.objects import ENCODER_COUNTS
from vrg_drives.cia402.states import AbortOption, ErrorBehaviour


class TestDrive:
    """The emulated drive alone: it is as strict as real ones are."""

    def test_a_pdo_is_mapped_only_in_the_right_order(self) -> None:
        wire = Wire().meet()
        entry = mapping_entry(Object.TARGET_VELOCITY, 32)
        mapping, cob_id = Object.RPDO_MAPPING + 1, Function.RPDO2 | NODE
        assert wire.write(Object.RPDO + 1, COB_ID, cob_id, 4) == 0
        assert wire.write(mapping, 0, 0, 1) == 0x0800_0022, "it is switched on"
        assert wire.write(Object.TPDO, INHIBIT, 100, 2) == 0x0800_0022
        assert wire.write(Object.RPDO + 1, COB_ID, cob_id | NOT_VALID, 4) == 0
        assert wire.write(mapping, 1, entry, 4) == 0
        assert wire.write(mapping, 0, 1, 1) == 0
        assert wire.write(mapping, 1, entry, 4) == 0x0601_0000, "there are entries"
        wire.inject(nmt(NODE, NmtCommand.START))
        assert wire.write(mapping, 0, 0, 1) == 0x0800_0022, "it is operational"

    @pytest.mark.parametrize(
        ("index", "bits", "abort"),
        [
            (0x6999, 16, 0x0602_0000),
            (Object.STATUSWORD, 16, 0x0604_0041),  # no master writes it
            (Object.CONTROLWORD, 32, 0x0604_0041),
            (Object.HEARTBEAT_TIME, 16, 0x0604_0041),
        ],
    )
    def test_what_cannot_be_mapped_is_refused(self, index: int, bits: int, abort: int) -> None:
        wire = Wire().meet()
        assert wire.write(Object.RPDO_MAPPING + 2, 1, mapping_entry(index, bits), 4) == abort

    def test_a_pdo_has_eight_bytes(self) -> None:
        wire = Wire().meet()
        for sub in (1, 2, 3):
            entry = mapping_entry(Object.TARGET_VELOCITY, 32)
            assert wire.write(Object.RPDO_MAPPING + 2, sub, entry, 4) == 0
        assert wire.write(Object.RPDO_MAPPING + 2, 0, 3, 1) == 0x0604_0042
        assert wire.write(Object.RPDO_MAPPING + 2, 0, 2, 1) == 0

    def test_any_mapping_of_a_master_holds(self) -> None:
        wire = Wire().meet()
        both = ((Object.MODE, 8), (Object.TARGET_VELOCITY, 32), (Object.CONTROLWORD, 16))
        told = ((Object.VELOCITY, 32), (Object.MODE_DISPLAY, 8), (Object.STATUSWORD, 16))
        for communication, mapping, cob_id, entries in (
            (Object.RPDO + 3, Object.RPDO_MAPPING + 3, 0x123, both),
            (Object.TPDO + 3, Object.TPDO_MAPPING + 3, 0x124, told),
        ):
            for sub, (index, bits) in enumerate(entries, 1):
                assert wire.write(mapping, sub, mapping_entry(index, bits), 4) == 0
            assert wire.write(mapping, 0, len(entries), 1) == 0
            assert wire.write(communication, COB_ID, cob_id, 4) == 0
        wire.drive.receive(nmt(NODE, NmtCommand.START), wire.now)
        for word in (0x06, 0x07, 0x0F):
            answers = wire.drive.receive(Frame(0x123, struct.pack("<biH", 3, 50_000, word)), wire.now)
        (told_frame,) = [frame for frame in answers if frame.id == 0x124]
        _, mode, status = struct.unpack("<ibH", told_frame.data)
        assert mode == 3
        assert drive_state(status) is DriveState.OPERATION_ENABLED
        wire.advance(1.0)
        assert wire.drive.motor.velocity == pytest.approx(5.0, abs=0.3)

    @pytest.mark.parametrize("kind", [0, 1, 240, 252])
    def test_pdos_that_wait_for_a_sync_or_a_remote_frame_are_refused(self, kind: int) -> None:
        assert Wire().meet().write(Object.TPDO, TRANSMISSION, kind, 1) == 0x0609_0030

    def test_an_inhibit_time_holds_events_back_but_loses_none(self) -> None:
        wire = Wire().meet()
        cob_id = Function.TPDO1 | NODE
        wire.write(Object.TPDO, COB_ID, cob_id | NOT_VALID, 4)
        assert wire.write(Object.TPDO, INHIBIT, 500, 2) == 0
        wire.write(Object.TPDO, COB_ID, cob_id, 4)
        wire.inject(nmt(NODE, NmtCommand.START))
        wire.advance(0.2)
        wire.heard.clear()
        wire.inject(CONTROL_PDO.frame(NODE, Control.SHUTDOWN))
        wire.inject(CONTROL_PDO.frame(NODE, Control.SWITCH_ON))
        wire.advance(0.2)
        words = [int.from_bytes(f.data, "little") for f in wire.heard if f.id == cob_id]
        told = [drive_state(word) for word in words]
        assert told == [DriveState.READY_TO_SWITCH_ON, DriveState.SWITCHED_ON]

    @pytest.mark.parametrize(
        ("words", "state"),
        [
            ((), DriveState.SWITCH_ON_DISABLED),
            ((0x0F,), DriveState.SWITCH_ON_DISABLED),
            ((0x07,), DriveState.SWITCH_ON_DISABLED),
            ((0x06,), DriveState.READY_TO_SWITCH_ON),
            ((0x06, 0x07), DriveState.SWITCHED_ON),
            ((0x06, 0x0F), DriveState.OPERATION_ENABLED),
            ((0x06, 0x07, 0x0F), DriveState.OPERATION_ENABLED),
            ((0x06, 0x07, 0x06), DriveState.READY_TO_SWITCH_ON),
            ((0x06, 0x07, 0x02), DriveState.SWITCH_ON_DISABLED),
            ((0x06, 0x0F, 0x07), DriveState.SWITCHED_ON),
            ((0x06, 0x0F, 0x06), DriveState.READY_TO_SWITCH_ON),
            ((0x06, 0x0F, 0x02), DriveState.QUICK_STOP_ACTIVE),
            ((0x06, 0x0F, 0x02, 0x00), DriveState.SWITCH_ON_DISABLED),
            ((0x06, 0x0F, 0x00), DriveState.SWITCH_ON_DISABLED),
            ((0x06, 0x80), DriveState.READY_TO_SWITCH_ON),
        ],
    )
    def test_the_state_machine_is_the_standards(self, words: tuple[int, ...], state: DriveState) -> None:
        wire = Wire().meet()
        for word in words:
            assert wire.write(Object.CONTROLWORD, 0, word, 2) == 0
        assert wire.drive.state is state

    def turning(self) -> Wire:
        wire = Wire().meet()
        wire.write(Object.MODE, 0, PROFILE_VELOCITY, 1)
        wire.write(Object.TARGET_VELOCITY, 0, 20 * ENCODER_COUNTS, 4)
        for word in (0x06, 0x07, 0x0F):
            wire.write(Object.CONTROLWORD, 0, word, 2)
        wire.advance(1.0)
        assert wire.drive.motor.velocity == pytest.approx(20.0, abs=0.3)
        return wire

    def test_halt_stops_it_and_lets_it_go_on(self) -> None:
        wire = self.turning()
        wire.write(Object.CONTROLWORD, 0, Control.ENABLE_OPERATION | Control.HALT, 2)
        wire.advance(1.0)
        assert abs(wire.drive.motor.velocity) < 0.1
        assert wire.drive.state is DriveState.OPERATION_ENABLED
        wire.write(Object.CONTROLWORD, 0, Control.ENABLE_OPERATION, 2)
        wire.advance(1.0)
        assert wire.drive.motor.velocity > 10

    def test_a_quick_stop_brakes_and_then_switches_off(self) -> None:
        wire = self.turning()
        wire.write(Object.CONTROLWORD, 0, Control.QUICK_STOP, 2)
        assert wire.drive.state is DriveState.QUICK_STOP_ACTIVE
        wire.until(lambda: wire.drive.state is DriveState.SWITCH_ON_DISABLED)
        assert abs(wire.drive.motor.velocity) < 0.1

    def test_a_fault_may_brake_before_it_lets_go(self) -> None:
        wire = self.turning()
        assert wire.write(Object.FAULT_REACTION, 0, 2, 2) == 0
        wire.fault(FaultKind.ERROR)
        assert wire.drive.state is DriveState.FAULT_REACTION_ACTIVE
        wire.write(Object.CONTROLWORD, 0, Control.FAULT_RESET, 2)
        assert wire.drive.state is DriveState.FAULT_REACTION_ACTIVE, "not before it stands"
        wire.until(lambda: wire.drive.state is DriveState.FAULT)
        assert abs(wire.drive.motor.velocity) < 0.1

    def test_a_fault_is_told_by_an_emergency_frame_and_so_is_its_end(self) -> None:
        wire = self.turning()
        wire.heard.clear()
        wire.fault(FaultKind.ERROR, value=0x4310)
        wire.write(Object.CONTROLWORD, 0, 0, 2)
        frames = wire.drive.receive(download_request(NODE, Object.CONTROLWORD, 0, b"\x80\0"), wire.now)
        told = [struct.unpack("<HB5x", f.data) for f in [*wire.heard, *frames] if f.id == Function.EMCY | NODE]
        assert told == [(0x4310, 0b1001), (0, 0)]

    def test_only_an_edge_resets_a_fault(self) -> None:
        wire = self.turning()
        wire.write(Object.CONTROLWORD, 0, Control.FAULT_RESET, 2)
        wire.fault(FaultKind.ERROR)
        wire.write(Object.CONTROLWORD, 0, Control.FAULT_RESET, 2)
        assert wire.drive.state is DriveState.FAULT
        wire.write(Object.CONTROLWORD, 0, 0, 2)
        wire.write(Object.CONTROLWORD, 0, Control.FAULT_RESET, 2)
        assert wire.drive.state is DriveState.SWITCH_ON_DISABLED

    def test_a_text_comes_in_segments(self) -> None:
        wire = Wire().meet()
        assert wire.ask(Object.NAME).data is None
        text, toggle = b"", 0
        for _ in range(10):
            (frame,) = wire.drive.receive(
                Frame(Function.SDO_REQUEST | NODE, bytes([0x60 | toggle] + [0] * 7)), wire.now
            )
            text += frame.data[1 : 8 - (frame.data[0] >> 1 & 7)]
            toggle ^= 0x10
            if frame.data[0] & 1:
                break
        assert text == b"VRG emulated drive"

    def test_writes_of_the_wrong_kind_are_refused(self) -> None:
        wire = Wire().meet()
        assert wire.write(Object.STATUSWORD, 0, 0, 2) == 0x0601_0002
        assert wire.write(Object.CONTROLWORD, 0, 0, 4) == 0x0607_0010
        assert wire.write(0x5999, 0, 0, 4) == 0x0602_0000
        assert wire.write(Object.IDENTITY, 9, 0, 4) == 0x0609_0011
        assert wire.write(Object.MODE, 0, 9, 1) == 0x0609_0030

    def test_a_stopped_node_answers_nothing_but_its_heart_beats(self) -> None:
        wire = Wire().meet()
        wire.inject(nmt(NODE, NmtCommand.STOP))
        assert wire.drive.receive(upload_request(NODE, Object.STATUSWORD), wire.now) == []
        wire.heard.clear()
        wire.advance(0.5)
        assert {(f.id, f.data) for f in wire.heard} == {(Function.HEARTBEAT | NODE, bytes([Nmt.STOPPED]))}

    def test_a_reset_is_a_pause_and_a_boot_up_message(self) -> None:
        wire = Wire().prepare()
        wire.heard.clear()
        wire.inject(nmt(NODE, NmtCommand.RESET_NODE))
        wire.advance(BOOT / 2)
        assert not wire.heard
        wire.advance(BOOT)
        assert (wire.heard[0].id, wire.heard[0].data) == (Function.HEARTBEAT | NODE, b"\0")
        assert wire.heard[1].data == bytes([Nmt.PRE_OPERATIONAL])
        assert wire.ask(Object.RPDO_MAPPING + 1).unsigned == 0, "the set-up is forgotten"

    def test_what_integers_cannot_say_is_not_supported(self) -> None:
        assert Cia402Drive.supports == frozenset(FaultKind) - {FaultKind.NAN}


MASTER = 100


def emergencies(wire: Wire) -> list[int]:
    return [int.from_bytes(f.data[:2], "little") for f in wire.heard if f.id == Function.EMCY | NODE]


@pytest.mark.parametrize("index", [0x1010, 0x1016, 0x1029, 0x6007])
def test_it_has_the_objects_of_the_standards(index: int) -> None:
    assert Wire().meet().ask(index).unsigned is not None


def test_a_stopped_node_sends_no_emergency() -> None:
    wire = Wire().running()
    wire.heard.clear()
    wire.inject(nmt(NODE, NmtCommand.STOP))
    wire.fault(FaultKind.ERROR)
    wire.advance(0.5)
    assert emergencies(wire) == []
    assert wire.drive.state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)


def test_what_is_saved_is_there_after_a_start_and_nothing_else() -> None:
    wire = Wire().meet()
    wire.write(Object.ACCELERATION, 0, 1234, 4)
    assert wire.write(Object.STORE, 1, 1, 4) == 0x0800_0020, "the word is missing"
    assert wire.write(Object.STORE, 1, SAVE, 4) == 0
    wire.write(Object.DECELERATION, 0, 4321, 4)
    wire.inject(nmt(NODE, NmtCommand.RESET_NODE))
    wire.advance(1.0)
    assert wire.ask(Object.ACCELERATION).unsigned == 1234
    assert wire.ask(Object.DECELERATION).unsigned != 4321


def test_it_has_a_fault_when_the_network_leaves_it() -> None:
    wire = Wire().running()
    wire.write(Object.ABORT_CONNECTION_OPTION, 0, AbortOption.FAULT, 2)
    wire.inject(nmt(NODE, NmtCommand.PRE_OPERATIONAL))
    assert wire.drive.state is DriveState.FAULT


@pytest.mark.parametrize(
    ("behaviour", "network"),
    [
        (ErrorBehaviour.PRE_OPERATIONAL, Nmt.PRE_OPERATIONAL),
        (ErrorBehaviour.NO_CHANGE, Nmt.OPERATIONAL),
        (ErrorBehaviour.STOPPED, Nmt.STOPPED),
    ],
)
def test_a_master_that_falls_silent_is_noticed(behaviour: ErrorBehaviour, network: Nmt) -> None:
    wire = Wire().running()
    wire.write(Object.ERROR_BEHAVIOUR, 1, behaviour, 1)
    wire.write(Object.CONSUMER_HEARTBEAT, 1, MASTER << 16 | 300, 4)
    wire.drive_on(8.0, 1.0)
    assert wire.drive._nmt == Nmt.OPERATIONAL, "it begins with the first heartbeat"
    for _ in range(5):
        wire.inject(Frame(Function.HEARTBEAT | MASTER, bytes([Nmt.OPERATIONAL])))
        wire.drive_on(8.0, 0.2)
    assert 0x8130 not in emergencies(wire)
    wire.drive_on(8.0, 0.3)
    assert (0x8130 in emergencies(wire)) == (network is not Nmt.STOPPED)
    assert wire.drive._nmt == network
    assert wire.drive.state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)


def test_a_drive_that_goes_on_when_it_is_cut_off_is_switched_off_all_the_same() -> None:
    wire = Wire().running()
    wire.write(Object.ABORT_CONNECTION_OPTION, 0, AbortOption.NOTHING, 2)
    wire.inject(nmt(NODE, NmtCommand.PRE_OPERATIONAL))
    assert wire.drive.state is DriveState.OPERATION_ENABLED
    wire.advance(0.3)
    assert wire.motor_speed > 5.0
    assert wire.axis.on
    wire.axis.idle()
    wire.advance(0.5)
    assert abs(wire.motor_speed) < 0.1
    assert wire.axis.on is False


def test_the_set_up_lets_no_drive_go_on_without_a_network() -> None:
    wire = Wire().meet()
    wire.write(Object.ABORT_CONNECTION_OPTION, 0, AbortOption.NOTHING, 2)
    wire.axis.prepare()
    assert wire.ask(Object.ABORT_CONNECTION_OPTION).unsigned == AbortOption.FAULT
