"""A CiA 402 drive is asked who it is, and set up."""

import dataclasses
import random
from collections import deque

import pytest
from canopen import SdoAbortedError
from cia402_wire import NODE, Wire

from vrg.errors import RobotError
from vrg.hal.can.axis import MotorState
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.emulated import DriveOptions
from vrg.hal.can.workshop.faults import FaultKind
from vrg.hal.simulated_clock import SimulatedClock
from vrg.testing.wire import SERIAL_NUMBER, WireClock
from vrg_drives.cia402 import set_up
from vrg_drives.cia402.axis import Cia402Axis
from vrg_drives.cia402.codec import EVENT_TIMER, NODE_IDS, Function, NmtCommand, Object
from vrg_drives.cia402.drive import Cia402Drive
from vrg_drives.cia402.sdo import SdoClient
from vrg_drives.cia402.set_up import DEADLINE, SetUp, master_of
from vrg_drives.cia402.units import Cia402Options


def without_deadline(wire: Wire) -> Wire:
    """A drive whose RPDOs have no event timers."""
    for number in (0, 1):
        del wire.drive.objects.object_dictionary[Object.RPDO + number].subindices[EVENT_TIMER]
        wire.drive.objects._values.pop((Object.RPDO + number, EVENT_TIMER), None)
        wire.drive.objects._defaults.clear()
    return wire


class FixedMappings(SdoClient):
    """The objects of a drive whose PDOs have four entries each, however few a master wants."""

    def __init__(self) -> None:
        super().__init__(NODE, lambda _: None, SimulatedClock())
        self.objects: dict[tuple[int, int], bytes] = {}

    def upload(self, index: int, sub: int) -> bytes:
        return b"\x04" if not sub and self._maps(index) else self.objects.get((index, sub), b"\0")

    def download(self, index: int, sub: int, data: bytes, force_segment: bool = False) -> None:
        if not sub and self._maps(index):
            raise SdoAbortedError(0x0601_0002)
        self.objects[index, sub] = data

    def _maps(self, index: int) -> bool:
        return Object.RPDO_MAPPING <= index < Object.TPDO or Object.TPDO_MAPPING <= index < Object.TPDO_MAPPING + 0x200


class TestMeeting:
    def test_a_drive_says_who_it_is(self) -> None:
        wire = Wire().prepare()
        assert wire.axis.serial == f"{SERIAL_NUMBER:X}"
        assert wire.axis.firmware == "1.0.0"
        wire.until(lambda: wire.axis.voltage is not None)
        assert wire.axis.voltage == 24.0

    def test_a_drive_that_was_never_told_to_send_a_heartbeat_is_told(self) -> None:
        wire = Wire()
        wire.drives[:] = [Cia402Drive(NODE, DriveOptions(serial=1, heartbeat=0.0), wire.now, random.Random(1))]
        wire.meet()
        beats = sum(f.id == Function.HEARTBEAT | NODE for f in wire.heard)
        wire.advance(1.0)
        assert sum(f.id == Function.HEARTBEAT | NODE for f in wire.heard) - beats == pytest.approx(10, abs=1)

    def test_one_that_was_stopped_is_woken(self) -> None:
        wire = Wire()
        wire.advance(0.01)
        wire.inject(Frame(0, bytes([NmtCommand.STOP, NODE])))
        wire.until(lambda: wire.axis.heard > 0)
        wire.advance(0.2)
        wire.axis.identify(1.0)
        assert wire.axis.identified

    @pytest.mark.parametrize("serials", [(1, 2), (7, 7), (0, 0)])
    def test_two_drives_with_one_id_are_noticed(self, serials: tuple[int, int]) -> None:
        wire = Wire(*serials).meet()
        if serials[0] == serials[1] != 0:
            assert wire.axis.problem is None, "one that answers two requests has one serial number too"
        else:
            assert "two drives" in (wire.axis.problem or "")

    def test_an_answer_that_comes_once_more_and_late_is_none_to_another_question(self) -> None:
        wire = Wire()
        wire.advance(0.01)
        wire.drive.objects.remove(Object.SUPPORTED_MODES)  # it is optional
        receive, step, last, coming = wire.drive.receive, wire.drive.step, list[Frame](), deque[list[Frame]]()

        def received(frame: Frame, now: float) -> list[Frame]:
            frames = receive(frame, now)
            answers = [f for f in frames if f.id == Function.SDO_ANSWER | NODE]
            coming.extend([[*last], answers])
            last[:] = answers
            return [f for f in frames if f not in answers]

        def stepped(now: float) -> list[Frame]:
            return [*(coming.popleft() if coming else []), *step(now)]

        wire.drive.receive, wire.drive.step = received, stepped  # type: ignore[method-assign]
        wire.prepare()
        assert (wire.axis.firmware, wire.axis.serial) == ("1.0.0", f"{SERIAL_NUMBER:X}")
        wire.get_going()

    @pytest.mark.parametrize(
        ("key", "value", "words"),
        [
            ((Object.DEVICE_TYPE, 0), 0x0191, "401"),
            ((Object.SUPPORTED_MODES, 0), 0x1, "profile velocity"),
            ((Object.ENCODER_RESOLUTION, 2), 0, "0x608F"),
            ((Object.VELOCITY_UNIT, 0), 0x00010300, "of its velocity it says 0x00010300 (0x60A9)"),
            ((Object.VELOCITY_UNIT, 0), 0, "of its velocity it says nothing (0x60A9)"),
        ],
    )
    def test_one_that_cannot_do_it_is_refused_in_words(self, key: tuple[int, int], value: int, words: str) -> None:
        wire = Wire()
        wire.advance(0.01)
        wire.drive.objects[key] = value
        wire.meet()
        assert words in (wire.axis.problem or "")

    def test_setting_up_works_whatever_state_the_drive_was_left_in(self) -> None:
        wire = Wire().running()
        second = Cia402Axis(NODE, wire.send, WireClock(wire))
        wire.axis = second
        wire.advance(0.2)
        wire.prepare()
        assert wire.axis.state is MotorState.IDLE
        wire.until(lambda: abs(wire.drive.motor.velocity) < 0.1)

    def test_the_drive_has_the_deadline_that_it_was_given_and_no_setpoint(self) -> None:
        wire = Wire().prepare()
        assert wire.ask(Object.RPDO + 1, EVENT_TIMER).unsigned == DEADLINE * 1000
        assert wire.ask(Object.RPDO, EVENT_TIMER).unsigned == 0
        assert not wire.setpoints

    def test_a_drive_without_a_deadline_is_refused(self) -> None:
        wire = without_deadline(Wire().meet())
        wire.drive.objects.remove(Object.CONSUMER_HEARTBEAT)
        with pytest.raises(RobotError, match=r"node 5: expected a deadline of 0.2 s.*watchdog = \"unsafe\""):
            wire.axis.prepare()

    def test_unless_a_person_can_do_without(self) -> None:
        wire = without_deadline(Wire().meet())
        wire.drive.objects.remove(Object.CONSUMER_HEARTBEAT)
        wire.axis.unwatched = True
        wire.running()
        wire.advance(1.0)
        assert wire.axis.state is MotorState.CLOSED_LOOP, "nothing stops it"
        wire.axis.idle()
        wire.until(lambda: wire.axis.state is MotorState.IDLE)

    def test_a_drive_that_forgets_its_deadline_is_refused(self, monkeypatch: pytest.MonkeyPatch) -> None:
        wire = Wire().meet()
        objects = wire.drive.objects
        monkeypatch.setattr(wire.drive, "_wrote", lambda *_: None)
        real = objects.__class__.__setitem__

        def forgetful(self: object, key: tuple[int, int], value: int) -> None:
            real(objects, key, 0 if key == (Object.RPDO + 1, EVENT_TIMER) else value)

        monkeypatch.setattr(objects.__class__, "__setitem__", forgetful)
        objects.remove(Object.CONSUMER_HEARTBEAT)
        with pytest.raises(RobotError, match="0x1401:05"):
            wire.axis.prepare()

    def test_a_drive_without_a_deadline_watches_its_master_instead(self) -> None:
        wire = without_deadline(Wire().meet())
        wire.running()
        assert wire.drive.objects[Object.CONSUMER_HEARTBEAT, 1] == 122 << 16 | 200
        wire.sent.clear()
        wire.until(lambda: abs(wire.drive.motor.velocity) < 0.1)
        assert wire.axis.watchdog_expired
        assert wire.axis.expiry_reported
        assert not [frame for frame in wire.sent if frame.id in (0x77A, 0x305)], "who is silent feeds nothing"
        assert (wire.axis.state, wire.axis.fault) == (MotorState.IDLE, None)
        wire.axis.clear()
        wire.axis.start()
        wire.gets_going()

    def test_the_masters_of_two_drives_are_two(self) -> None:
        assert len({master_of(node) for node in NODE_IDS}) == len(NODE_IDS)
        assert all(master_of(node) != node for node in NODE_IDS)

    def test_what_the_drive_refuses_is_named(self) -> None:
        wire = Wire().meet()
        wire.drive.objects.remove(Object.MODE)
        with pytest.raises(RobotError, match="object 0x6060:00"):
            wire.axis.prepare()

    def test_a_voltage_that_no_pdo_can_carry_is_asked_for(self) -> None:
        wire = Wire().meet()
        wire.drive.objects.object_dictionary[Object.VOLTAGE].pdo_mappable = False
        wire.axis.prepare()
        wire.prepare()
        wire.until(lambda: wire.axis.voltage == 24.0)
        wire.drive.options = dataclasses.replace(wire.drive.options, voltage=21.5)
        wire.until(lambda: wire.axis.voltage == 21.5)

    def test_a_drive_that_does_not_tell_its_units_is_refused(self) -> None:
        wire = Wire()
        wire.advance(0.01)
        wire.drive.objects.remove(Object.VELOCITY_UNIT)
        wire.meet()
        assert "velocity_unit" in (wire.axis.problem or "")

    def test_what_a_person_says_of_the_units_stands_above_what_the_drive_says(self) -> None:
        wire = Wire()
        wire.axis = Cia402Axis(NODE, wire.send, WireClock(wire), Cia402Options(velocity_unit="1/min"))
        wire.advance(0.01)
        wire.drive.objects[Object.VELOCITY_UNIT, 0] = 0x00B40300
        wire.prepare()
        wire.axis.start()
        wire.axis.command(8.0)
        assert wire.drive.objects[Object.TARGET_VELOCITY, 0] == 480

    def test_a_drive_without_a_voltmeter_is_taken(self) -> None:
        wire = Wire().meet()
        del wire.drive.objects.object_dictionary[Object.VOLTAGE]
        wire.axis.prepare()
        wire.advance(2.0)
        assert wire.axis.voltage is None
        assert wire.axis.implausible is None

    @pytest.mark.parametrize(
        ("kind", "words"),
        [
            (FaultKind.SILENCE, "node 5: expected the drive's answers"),
            (FaultKind.GARBAGE, "node 5"),
            (FaultKind.LENGTH, "node 5"),
        ],
    )
    def test_silence_and_rubbish_while_it_is_set_up(
        self, kind: FaultKind, words: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(set_up, "SDO_TIMEOUT", 0.01)
        wire = Wire().meet()
        wire.fault(kind)
        with pytest.raises(RobotError, match=words):
            wire.axis.prepare()


def test_pdos_with_a_fixed_number_of_entries_are_filled_up_with_empty_ones() -> None:
    drive = FixedMappings()
    SetUp(NODE, drive, lambda _: None, SimulatedClock()).configure()
    entries = [drive.objects[Object.RPDO_MAPPING, sub].hex() for sub in range(1, 5)]
    assert entries == ["10004060", "00000000", "00000000", "00000000"]
    assert drive.objects[Object.RPDO, 1] == (Function.RPDO1 | NODE).to_bytes(4, "little"), "it is switched on"
