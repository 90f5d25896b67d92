"""CiA 402: the codec, and an axis and an emulated drive that are connected back to back. No bus, no real time."""

import itertools
import math
import random
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vrg.errors import RobotError
from vrg.hal.can import cia402, cia402_axis
from vrg.hal.can.axis import State
from vrg.hal.can.cia402 import Control, DriveState, Function, Nmt, NmtCommand, Object
from vrg.hal.can.cia402_axis import DEADLINE, Cia402Axis
from vrg.hal.can.emulator.cia402_drive import Cia402Drive
from vrg.hal.can.emulator.drive import BOOT, DriveOptions
from vrg.hal.can.emulator.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.frame import Frame
from vrg.hal.can.survey import Survey, questions

NODE = 5
SERIAL = 0xBEEF
LONG = 30.0
"""s of the drive's time for what it must do sooner or later."""
i32 = st.integers(-(2**31), 2**31 - 1)
u32 = st.integers(0, 2**32 - 1)


class Wire:
    """An axis, drives and a clock. What the axis sends is delivered before the call returns."""

    def __init__(self, *serials: int, node: int = NODE) -> None:
        self.now = 100.0
        self.sent: list[Frame] = []
        self.heard: list[Frame] = []
        self.axis = Cia402Axis(node, self.send)
        self.drives = [
            Cia402Drive(node, DriveOptions(serial=serial), self.now, random.Random(serial))
            for serial in serials or (SERIAL,)
        ]
        self.drive = self.drives[0]
        self._under_way: deque[Frame] = deque()
        self._pumping = False

    def send(self, frame: Frame) -> None:
        """The axis sends."""
        self.sent.append(frame)
        self.inject(frame)

    def inject(self, frame: Frame) -> None:
        """A frame reaches the drives, and their answers the axis."""
        for drive in self.drives:
            self._under_way.extend(drive.receive(frame, self.now))
        self._pump()

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        until = self.now + seconds
        while self.now < until:
            self.now = min(until, max(self.now + 1e-4, min(drive.due for drive in self.drives)))
            for drive in self.drives:
                self._under_way.extend(drive.step(self.now))
            self._pump()

    def until(self, condition: Callable[[], object], act: Callable[[], object] = lambda: None) -> None:
        """Let time pass until the condition holds; `act` every 20 ms."""
        end = self.now + LONG
        while not condition():
            assert self.now < end, "it has not come about"
            act()
            self.advance(0.02)

    def drive_on(self, velocity: float, seconds: float) -> None:
        """Send setpoints for a while."""
        end = self.now + seconds
        self.until(lambda: self.now >= end, lambda: self.axis.command(velocity))

    def fault(self, kind: FaultKind, duration: float = 0.0, value: int = 0) -> None:
        """Let something go wrong."""
        self.inject(encode_fault(NODE, FaultRequest(kind, duration, value)))

    def meet(self) -> "Wire":
        """Until the axis knows the drive."""
        self.advance(0.01)
        self.axis.identify()
        self.until(lambda: self.axis.identified and self.axis.heard > 0)
        return self

    def prepared(self) -> "Wire":
        """Until the drive is set up."""
        self.meet()
        assert self.axis.problem is None
        self.axis.prepare()
        self.until(lambda: self.axis.state is State.IDLE and self.axis.measured > 0)
        return self

    def running(self, velocity: float = 10.0) -> "Wire":
        """Until the motor turns."""
        self.prepared()
        self.axis.start()
        self.until(lambda: self.axis.velocity > 0.8 * velocity, lambda: self.axis.command(velocity))
        assert self.axis.state is State.CLOSED_LOOP
        return self

    def gets_going(self) -> None:
        """Setpoints, until the motor is under control and turns by them."""
        self.until(
            lambda: self.drive._energised and self.axis.state is State.CLOSED_LOOP and 7 < self.axis.velocity < 9,
            lambda: self.axis.command(8.0),
        )

    @property
    def words(self) -> list[int]:
        """Controlwords that were sent."""
        return [int.from_bytes(f.data, "little") for f in self.sent if f.id == Function.RPDO1 | NODE]

    @property
    def setpoints(self) -> list[Frame]:
        """That were sent."""
        return [f for f in self.sent if f.id == Function.RPDO2 | NODE]

    def ask(self, index: int, sub: int = 0) -> cia402.Answer:
        """What the drive says of an object, by SDO."""
        return self._transfer(cia402.upload_request(NODE, index, sub))

    def write(self, index: int, sub: int, value: int, size: int) -> int:
        """Write an object by SDO; the abort code, 0 for none."""
        data = (value % (1 << 8 * size)).to_bytes(size, "little")
        answer = self._transfer(cia402.download_request(NODE, index, sub, data))
        return 0 if answer.data is not None else struct.unpack_from("<I", self.heard[-1].data, 4)[0]

    def _transfer(self, request: Frame) -> cia402.Answer:
        answers = [f for f in self.drive.receive(request, self.now) if f.id == Function.SDO_ANSWER | NODE]
        assert len(answers) == 1
        self.heard += answers
        answer = cia402.answer(answers[0].data)
        assert answer is not None
        return answer

    def _pump(self) -> None:
        if self._pumping:
            return
        self._pumping = True
        try:
            while self._under_way:
                frame = replace(self._under_way.popleft(), at=self.now)
                self.heard.append(frame)
                self.axis.receive(frame)
        finally:
            self._pumping = False


class TestCodec:
    @given(st.integers(0, 0xFFFF))
    def test_a_statusword_stands_for_one_state_at_most(self, word: int) -> None:
        fitting = [state for state in DriveState if word & state.value[0] == state.value[1]]
        assert len(fitting) <= 1
        assert cia402.drive_state(word) is (fitting[0] if fitting else None)

    @given(st.integers(1, 2**31 - 1), st.integers(1, 1000), i32)
    def test_positions_keep_every_count_and_wrap_after_32_bits(self, counts: int, turns: int, position: int) -> None:
        units = cia402.units(counts, turns, None)
        assert units is not None
        assert round(units.turns(position) * units.counts) == position
        assert units.turns(2**31 - 1) - units.turns(-(2**31)) == pytest.approx(units.wrap)

    @given(st.floats(-500, 500), st.sampled_from([0, 0x00B44700, 0xFDB44700, 0x00B40300, 0xFEB40300, 0x00B50300]))
    def test_a_velocity_comes_back_to_the_nearest_unit(self, velocity: float, unit: int) -> None:
        units = cia402.units(4096, 1, unit)
        assert units is not None
        assert units.turns_per_s(units.velocity_of(velocity)) == pytest.approx(velocity, abs=0.5001 / units.velocity)

    @given(st.floats(allow_nan=False))
    def test_a_velocity_always_fits_the_object(self, velocity: float) -> None:
        units = cia402.units(4096, 1, 0xFDB44700)
        assert units is not None
        assert -(2**31) <= units.velocity_of(velocity) < 2**31

    @pytest.mark.parametrize(
        ("unit", "in_one_turn_per_second"),
        [(0x00B44700, 60), (0xFFB44700, 600), (0xFDB44700, 60_000), (0x00B40300, 1), (0x00B50300, 2000), (None, 2000)],
    )
    def test_velocity_units_are_what_the_object_says(self, unit: int | None, in_one_turn_per_second: int) -> None:
        units = cia402.units(4000, 2, unit)
        assert units is not None
        assert units.velocity_of(1.0) == in_one_turn_per_second

    @pytest.mark.parametrize("bad", [(0, 1, None), (1, 0, None), (1, 1, 0x00010300), (1, 1, 0x00B44701)])
    def test_units_that_make_no_sense_are_none(self, bad: tuple[int, int, int | None]) -> None:
        assert cia402.units(*bad) is None

    @given(u32, st.integers(1, 4), st.integers(0, 0xFFFF), st.integers(0, 255))
    def test_an_sdo_answer_carries_what_was_asked(self, value: int, size: int, index: int, sub: int) -> None:
        data = value.to_bytes(4, "little")[:size]
        command = 0x43 | (4 - size) << 2
        answer = cia402.answer(struct.pack("<BHB", command, index, sub) + data.ljust(4, b"\0"))
        assert answer == cia402.Answer(index, sub, data)

    @given(st.integers(1, 0xFFFF))
    def test_every_error_has_words_and_its_number(self, code: int) -> None:
        assert f"(0x{code:04X})" in cia402.describe_error(code)
        assert cia402.error_register(code) & 1

    def test_no_error_is_no_words(self) -> None:
        assert cia402.describe_error(0) == ""
        assert cia402.error_register(0) == 0


class TestMeeting:
    def test_a_drive_says_who_it_is(self) -> None:
        wire = Wire().prepared()
        assert wire.axis.serial == f"{SERIAL:X}"
        assert wire.axis.firmware == "1.0.0"
        wire.until(lambda: wire.axis.voltage is not None)
        assert wire.axis.voltage == 24.0

    def test_a_drive_that_was_never_told_to_send_a_heartbeat_is_told(self) -> None:
        wire = Wire()
        wire.drive = Cia402Drive(NODE, DriveOptions(serial=1, heartbeat=0.0), wire.now, random.Random(1))
        wire.drives[:] = [wire.drive]
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
        wire.axis.identify()
        assert wire.axis.identified

    @pytest.mark.parametrize("serials", [(1, 2), (7, 7), (0, 0)])
    def test_two_drives_with_one_id_are_noticed(self, serials: tuple[int, int]) -> None:
        wire = Wire(*serials).meet()
        if serials[0] == serials[1] != 0:
            assert wire.axis.problem is None, "one that answers two requests has one serial number too"
        else:
            assert wire.axis.problem is not None
            assert "two drives" in wire.axis.problem

    @pytest.mark.parametrize(
        ("key", "value", "words"),
        [
            ((Object.DEVICE_TYPE, 0), 0x0191, "401"),
            ((Object.SUPPORTED_MODES, 0), 0x1, "profile velocity"),
            ((Object.ENCODER_RESOLUTION, 2), 0, "0x608F"),
            ((Object.VELOCITY_UNIT, 0), 0x00010300, "0x60A9"),
        ],
    )
    def test_one_that_cannot_do_it_is_refused_in_words(self, key: tuple[int, int], value: int, words: str) -> None:
        wire = Wire()
        wire.advance(0.01)
        wire.drive._objects[key] = value
        wire.meet()
        assert wire.axis.problem is not None
        assert words in wire.axis.problem

    def test_ids_are_1_to_127(self) -> None:
        assert [node for node in range(-1, 130) if Cia402Axis.check_node(node) is None] == list(range(1, 128))

    def test_setting_up_works_whatever_state_the_drive_was_left_in(self) -> None:
        wire = Wire().running()
        second = Cia402Axis(NODE, wire.send)
        wire.axis = second
        wire.advance(0.2)
        wire.prepared()
        assert wire.axis.state is State.IDLE
        wire.until(lambda: abs(wire.drive.motor.velocity) < 0.1)

    def test_it_energises_nothing(self) -> None:
        wire = Wire().prepared()
        wire.advance(1.0)
        assert wire.axis.state is State.IDLE
        assert not wire.drive._energised
        assert not wire.setpoints

    def test_the_drive_has_the_deadline_that_it_was_given(self) -> None:
        assert Wire().prepared().ask(Object.RPDO + 1, cia402.EVENT_TIMER).unsigned == DEADLINE * 1000
        assert Wire().prepared().ask(Object.RPDO, cia402.EVENT_TIMER).unsigned == 0

    def test_a_drive_without_a_deadline_is_refused(self) -> None:
        wire = Wire().meet()
        del wire.drive._objects.object_dictionary[Object.RPDO + 1].subindices[cia402.EVENT_TIMER]
        with pytest.raises(RobotError, match=r"node 5: .*Subindex"):
            wire.axis.prepare()

    def test_a_drive_that_forgets_its_deadline_is_refused(self, monkeypatch: pytest.MonkeyPatch) -> None:
        wire = Wire().meet()
        objects = wire.drive._objects
        monkeypatch.setattr(wire.drive, "_wrote", lambda *_: None)
        real = objects.__class__.__setitem__

        def forgetful(self: object, key: tuple[int, int], value: int) -> None:
            real(objects, key, 0 if key == (Object.RPDO + 1, cia402.EVENT_TIMER) else value)

        monkeypatch.setattr(objects.__class__, "__setitem__", forgetful)
        with pytest.raises(RobotError, match="0x1401:05"):
            wire.axis.prepare()

    def test_a_drive_without_a_voltmeter_is_taken(self) -> None:
        wire = Wire().meet()
        del wire.drive._objects.object_dictionary[Object.VOLTAGE]
        wire.axis.prepare()
        wire.advance(2.0)
        assert wire.axis.voltage is None
        assert wire.axis.odd is None

    def test_one_that_falls_silent_is_an_error_and_no_endless_wait(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(cia402_axis, "SDO_TIMEOUT", 0.01)
        wire = Wire().meet()
        wire.fault(FaultKind.SILENCE)
        with pytest.raises(RobotError, match="node 5: expected the drive's answers"):
            wire.axis.prepare()

    @pytest.mark.parametrize("kind", [FaultKind.GARBAGE, FaultKind.LENGTH])
    def test_rubbish_while_it_is_set_up_is_an_error(self, kind: FaultKind, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(cia402_axis, "SDO_TIMEOUT", 0.01)
        wire = Wire().meet()
        wire.fault(kind)
        with pytest.raises(RobotError, match="node 5"):
            wire.axis.prepare()


class TestDriving:
    def test_a_start_takes_three_steps_each_after_the_drive_has_confirmed_the_last(self) -> None:
        wire = Wire().prepared()
        wire.sent.clear()
        wire.axis.start()
        wire.until(lambda: wire.axis.state is State.CLOSED_LOOP)
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
        assert wire.axis.state is State.CLOSED_LOOP

    def test_the_position_begins_anew_after_32_bits(self) -> None:
        wire = Wire().prepared()
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
        assert wire.axis.state is State.IDLE
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
        wire.inject(cia402.CONTROL_PDO.frame(NODE, word))
        wire.drive_on(10.0, 2.0)
        assert not wire.drive._energised
        assert abs(wire.axis.velocity) < 0.1
        assert wire.axis.state is State.IDLE
        wire.axis.idle()
        wire.axis.start()
        wire.gets_going()

    def test_it_may_be_started_in_the_moment_after_it_was_switched_off(self) -> None:
        wire = Wire().running()
        for _ in range(5):
            wire.axis.idle()
            wire.axis.receive(cia402.STATUS_PDO.frame(NODE, 0x0627, 0, 3))  # sent before that came
            wire.axis.start()
            wire.axis.receive(cia402.STATUS_PDO.frame(NODE, 0x0627, 0, 3))
            wire.gets_going()

    def test_a_motor_that_somebody_else_switches_on_is_switched_off(self) -> None:
        wire = Wire().prepared()
        for word in (Control.SHUTDOWN, Control.SWITCH_ON, Control.ENABLE_OPERATION):
            wire.inject(cia402.CONTROL_PDO.frame(NODE, word))
        wire.advance(0.5)
        assert not wire.drive._energised


class TestWatchdog:
    def test_it_stops_when_setpoints_cease_which_is_no_fault(self) -> None:
        wire = Wire().running(20.0)
        wire.sent.clear()
        wire.until(lambda: wire.axis.starved)
        wire.until(lambda: abs(wire.drive.motor.velocity) < 0.1)
        assert wire.axis.fault is None
        assert wire.axis.state is State.IDLE
        assert not wire.setpoints, "who only listens sends none"
        assert wire.drive._state is DriveState.FAULT
        wire.advance(5.0)
        assert wire.drive._state is DriveState.FAULT, "nor does it start again by itself"

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
            wire.inject(cia402.CONTROL_PDO.frame(NODE, Control.ENABLE_OPERATION))
            wire.advance(DEADLINE / 20)
        assert wire.drive._state is DriveState.FAULT
        assert wire.axis.starved

    def test_who_freezes_in_the_midst_of_a_start_leaves_no_motor_on(self) -> None:
        wire = Wire().prepared()
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
        wire.drive._fail(cia402.RPDO_TIMEOUT)
        wire.advance(0.2)
        assert wire.axis.starved
        assert (wire.axis.state, wire.axis.fault) == (State.IDLE, None)
        wire.axis.clear()
        wire.axis.start()
        wire.gets_going()

    def test_it_runs_from_the_first_setpoint_on(self) -> None:
        wire = Wire().prepared()
        for word in (Control.SHUTDOWN, Control.SWITCH_ON, Control.ENABLE_OPERATION):
            wire.drive.receive(cia402.CONTROL_PDO.frame(NODE, word), wire.now)
        assert wire.drive._energised
        wire.drive.step(wire.now + 10.0)
        assert wire.drive._energised, "as CiA 301 has it, which is why a start sends a setpoint first"


class TestFaults:
    def test_a_fault_is_told_in_words_and_stays_until_it_is_cleared(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.ERROR, value=0x3220)
        wire.advance(0.1)
        assert wire.axis.state is State.FAULT
        assert wire.axis.fault == "DC link undervoltage (0x3220)"
        assert not wire.axis.starved
        wire.drive_on(10.0, 1.0)
        assert abs(wire.drive.motor.velocity) < 0.1
        wire.axis.clear()
        wire.advance(0.2)
        assert (wire.axis.state, wire.axis.fault) == (State.IDLE, None)
        wire.drive_on(10.0, 1.0)
        assert wire.axis.state is State.IDLE, "cleared is not started"

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
        assert wire.axis.state is State.ESTOP
        wire.advance(1.0)
        assert (wire.axis.state, wire.axis.fault) == (State.ESTOP, None)
        assert abs(wire.drive.motor.velocity) < 0.1
        wire.axis.idle()
        wire.advance(0.2)
        assert wire.axis.state is State.ESTOP
        wire.axis.clear()
        wire.advance(0.2)
        assert wire.axis.state is State.IDLE

    def test_a_drive_that_was_started_again_is_odd_and_must_be_set_up(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.REBOOT)
        wire.until(lambda: wire.axis.odd)
        assert wire.axis.odd == "it was started again"
        wire.axis.forget_oddities()
        wire.until(lambda: wire.axis.fault)
        wire.axis.clear()
        wire.advance(1.0)
        assert wire.axis.state is State.FAULT
        assert wire.axis.fault is not None
        assert "set up anew" in wire.axis.fault
        wire.axis.prepare()
        wire.axis.start()
        wire.gets_going()
        assert wire.axis.odd is None

    @pytest.mark.parametrize("command", [NmtCommand.STOP, NmtCommand.PRE_OPERATIONAL])
    def test_a_drive_that_is_taken_off_the_network_stops_and_is_a_fault(self, command: NmtCommand) -> None:
        wire = Wire().running()
        wire.inject(cia402.nmt(0, command))
        wire.until(lambda: wire.axis.fault)
        wire.advance(0.5)
        assert abs(wire.drive.motor.velocity) < 0.1
        assert wire.axis.state is State.FAULT

    @pytest.mark.parametrize(
        "frame",
        [
            cia402.CONTROL_PDO.frame(NODE, 0x0F),
            cia402.SETPOINT_PDO.frame(NODE, 1),
            Frame(Function.RPDO3 | NODE, b"\0"),
            Frame(Function.RPDO4 | NODE, b"\0"),
            cia402.nmt(NODE, NmtCommand.START),
            cia402.nmt(0, NmtCommand.STOP),
            cia402.download_request(NODE, Object.MODE, 0, b"\1"),
        ],
    )
    def test_another_master_is_noticed(self, frame: Frame) -> None:
        wire = Wire().prepared()
        wire.axis.receive(frame)
        assert wire.axis.odd is not None
        assert "another program" in wire.axis.odd

    @pytest.mark.parametrize("node", [1, 4, 6, 127])
    def test_the_masters_of_other_nodes_are_not(self, node: int) -> None:
        wire = Wire().prepared()
        wire.axis.receive(cia402.SETPOINT_PDO.frame(node, 1))
        wire.axis.receive(cia402.nmt(node, NmtCommand.START))
        wire.axis.receive(cia402.upload_request(NODE, Object.STATUSWORD))  # who only asks does no harm
        assert wire.axis.odd is None

    @pytest.mark.parametrize(
        ("function", "length"),
        [(Function.TPDO1, 5), (Function.TPDO2, 8), (Function.TPDO3, 4), (Function.EMCY, 8), (Function.HEARTBEAT, 1)],
    )
    def test_frames_of_the_wrong_length_are_odd(self, function: Function, length: int) -> None:
        for wrong in {0, length - 1, length + 1} - {length, 9}:
            wire = Wire().prepared()
            wire.axis.receive(Frame(function | NODE, bytes(wrong)))
            assert wire.axis.odd is not None
            assert "malformed" in wire.axis.odd

    @given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=30), st.booleans())
    @settings(max_examples=50, deadline=None)
    def test_no_frame_is_too_strange_to_be_heard(self, frames: list[tuple[int, bytes]], prepared: bool) -> None:
        wire = Wire().prepared() if prepared else Wire()
        for identifier, data in frames:
            wire.axis.receive(Frame(identifier & ~0x7F | NODE, data))
            wire.axis.receive(Frame(identifier, data))


class TestDrive:
    """The emulated drive alone: it is as strict as real ones are."""

    def test_a_pdo_is_mapped_only_in_the_right_order(self) -> None:
        wire = Wire().meet()
        entry = cia402.mapping_entry(Object.TARGET_VELOCITY, 32)
        mapping, cob_id = Object.RPDO_MAPPING + 1, Function.RPDO2 | NODE
        assert wire.write(Object.RPDO + 1, cia402.COB_ID, cob_id, 4) == 0
        assert wire.write(mapping, 0, 0, 1) == 0x0800_0022, "it is switched on"
        assert wire.write(Object.TPDO, cia402.INHIBIT, 100, 2) == 0x0800_0022
        assert wire.write(Object.RPDO + 1, cia402.COB_ID, cob_id | cia402.NOT_VALID, 4) == 0
        assert wire.write(mapping, 1, entry, 4) == 0
        assert wire.write(mapping, 0, 1, 1) == 0
        assert wire.write(mapping, 1, entry, 4) == 0x0601_0000, "there are entries"
        wire.inject(cia402.nmt(NODE, NmtCommand.START))
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
        assert wire.write(Object.RPDO_MAPPING + 2, 1, cia402.mapping_entry(index, bits), 4) == abort

    def test_a_pdo_has_eight_bytes(self) -> None:
        wire = Wire().meet()
        for sub in (1, 2, 3):
            entry = cia402.mapping_entry(Object.TARGET_VELOCITY, 32)
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
                assert wire.write(mapping, sub, cia402.mapping_entry(index, bits), 4) == 0
            assert wire.write(mapping, 0, len(entries), 1) == 0
            assert wire.write(communication, cia402.COB_ID, cob_id, 4) == 0
        wire.drive.receive(cia402.nmt(NODE, NmtCommand.START), wire.now)
        for word in (0x06, 0x07, 0x0F):
            answers = wire.drive.receive(Frame(0x123, struct.pack("<biH", 3, 50_000, word)), wire.now)
        (told_frame,) = [frame for frame in answers if frame.id == 0x124]
        _, mode, status = struct.unpack("<ibH", told_frame.data)
        assert mode == 3
        assert cia402.drive_state(status) is DriveState.OPERATION_ENABLED
        wire.advance(1.0)
        assert wire.drive.motor.velocity == pytest.approx(5.0, abs=0.3)

    def test_synchronous_pdos_wait_for_their_sync(self) -> None:
        wire = Wire().meet()
        assert wire.write(Object.TPDO, cia402.TRANSMISSION, 2, 1) == 0
        assert wire.write(Object.RPDO, cia402.TRANSMISSION, 1, 1) == 0
        assert wire.write(Object.TPDO, cia402.TRANSMISSION, 250, 1) == 0x0609_0030
        wire.drive.receive(cia402.nmt(NODE, NmtCommand.START), wire.now)
        wire.drive.receive(cia402.CONTROL_PDO.frame(NODE, Control.SHUTDOWN), wire.now)
        assert wire.drive._state is DriveState.SWITCH_ON_DISABLED
        sync = Frame(cia402.SYNC)
        sent = [len(wire.drive.receive(sync, wire.now)) for _ in range(6)]
        assert wire.drive._state is DriveState.READY_TO_SWITCH_ON
        assert sent == [0, 1, 0, 1, 0, 1]

    def test_an_inhibit_time_holds_events_back_but_loses_none(self) -> None:
        wire = Wire().meet()
        cob_id = Function.TPDO1 | NODE
        wire.write(Object.TPDO, cia402.COB_ID, cob_id | cia402.NOT_VALID, 4)
        assert wire.write(Object.TPDO, cia402.INHIBIT, 500, 2) == 0
        wire.write(Object.TPDO, cia402.COB_ID, cob_id, 4)
        wire.inject(cia402.nmt(NODE, NmtCommand.START))
        wire.advance(0.2)
        wire.heard.clear()
        wire.inject(cia402.CONTROL_PDO.frame(NODE, Control.SHUTDOWN))
        wire.inject(cia402.CONTROL_PDO.frame(NODE, Control.SWITCH_ON))
        wire.advance(0.2)
        words = [int.from_bytes(f.data, "little") for f in wire.heard if f.id == cob_id]
        told = [cia402.drive_state(word) for word in words]
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
        assert wire.drive._state is state

    def turning(self) -> Wire:
        wire = Wire().meet()
        wire.write(Object.MODE, 0, cia402.PROFILE_VELOCITY, 1)
        wire.write(Object.TARGET_VELOCITY, 0, 20 * cia402.ENCODER_COUNTS, 4)
        for word in (0x06, 0x07, 0x0F):
            wire.write(Object.CONTROLWORD, 0, word, 2)
        wire.advance(1.0)
        assert wire.drive.motor.velocity == pytest.approx(20.0, abs=0.3)
        return wire

    def test_halt_stops_it_and_lets_it_go_on(self) -> None:
        wire = self.turning()
        wire.write(Object.CONTROLWORD, 0, 0x0F | Control.HALT, 2)
        wire.advance(1.0)
        assert abs(wire.drive.motor.velocity) < 0.1
        assert wire.drive._state is DriveState.OPERATION_ENABLED
        wire.write(Object.CONTROLWORD, 0, 0x0F, 2)
        wire.advance(1.0)
        assert wire.drive.motor.velocity > 10

    def test_a_quick_stop_brakes_and_then_switches_off(self) -> None:
        wire = self.turning()
        wire.write(Object.CONTROLWORD, 0, Control.QUICK_STOP, 2)
        assert wire.drive._state is DriveState.QUICK_STOP_ACTIVE
        wire.until(lambda: wire.drive._state is DriveState.SWITCH_ON_DISABLED)
        assert abs(wire.drive.motor.velocity) < 0.1

    def test_a_fault_may_brake_before_it_lets_go(self) -> None:
        wire = self.turning()
        assert wire.write(Object.FAULT_REACTION, 0, 2, 2) == 0
        wire.fault(FaultKind.ERROR)
        assert wire.drive._state is DriveState.FAULT_REACTION_ACTIVE
        wire.write(Object.CONTROLWORD, 0, Control.FAULT_RESET, 2)
        assert wire.drive._state is DriveState.FAULT_REACTION_ACTIVE, "not before it stands"
        wire.until(lambda: wire.drive._state is DriveState.FAULT)
        assert abs(wire.drive.motor.velocity) < 0.1

    def test_a_fault_is_told_by_an_emergency_frame_and_so_is_its_end(self) -> None:
        wire = self.turning()
        wire.heard.clear()
        wire.fault(FaultKind.ERROR, value=0x4310)
        wire.write(Object.CONTROLWORD, 0, 0, 2)
        frames = wire.drive.receive(cia402.download_request(NODE, Object.CONTROLWORD, 0, b"\x80\0"), wire.now)
        told = [struct.unpack("<HB5x", f.data) for f in [*wire.heard, *frames] if f.id == Function.EMCY | NODE]
        assert told == [(0x4310, 0b1001), (0, 0)]

    def test_only_an_edge_resets_a_fault(self) -> None:
        wire = self.turning()
        wire.write(Object.CONTROLWORD, 0, Control.FAULT_RESET, 2)
        wire.fault(FaultKind.ERROR)
        wire.write(Object.CONTROLWORD, 0, Control.FAULT_RESET, 2)
        assert wire.drive._state is DriveState.FAULT
        wire.write(Object.CONTROLWORD, 0, 0, 2)
        wire.write(Object.CONTROLWORD, 0, Control.FAULT_RESET, 2)
        assert wire.drive._state is DriveState.SWITCH_ON_DISABLED

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
        wire.inject(cia402.nmt(NODE, NmtCommand.STOP))
        assert wire.drive.receive(cia402.upload_request(NODE, Object.STATUSWORD), wire.now) == []
        wire.heard.clear()
        wire.advance(0.5)
        assert {(f.id, f.data) for f in wire.heard} == {(Function.HEARTBEAT | NODE, bytes([Nmt.STOPPED]))}

    def test_a_reset_is_a_pause_and_a_boot_up_message(self) -> None:
        wire = Wire().prepared()
        wire.heard.clear()
        wire.inject(cia402.nmt(NODE, NmtCommand.RESET_NODE))
        wire.advance(BOOT / 2)
        assert not wire.heard
        wire.advance(BOOT)
        assert (wire.heard[0].id, wire.heard[0].data) == (Function.HEARTBEAT | NODE, b"\0")
        assert wire.heard[1].data == bytes([Nmt.PRE_OPERATIONAL])
        assert wire.ask(Object.RPDO_MAPPING + 1).unsigned == 0, "the set-up is forgotten"

    @given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=40))
    @settings(max_examples=100, deadline=None)
    def test_no_frame_is_too_strange_for_it(self, frames: list[tuple[int, bytes]]) -> None:
        wire = Wire().prepared()
        for identifier, data in frames:
            for known in (identifier, Function.SDO_REQUEST | NODE, Function.RPDO1 | NODE):
                for frame in wire.drive.receive(Frame(known, data), wire.now):
                    assert len(frame.data) <= 8

    def test_what_integers_cannot_say_is_not_supported(self) -> None:
        assert Cia402Drive.supports == frozenset(FaultKind) - {FaultKind.NAN}


class TestSurvey:
    def survey(self, wire: Wire) -> Survey:
        survey = Survey()
        for frame in wire.heard:
            survey.hear(frame)
        return survey

    def test_a_drive_is_known_by_its_answers(self) -> None:
        wire = Wire().running(10.0)
        wire.advance(0.12)
        survey = self.survey(wire)
        (found,) = survey.nodes
        for frame in questions(found):
            for answer in wire.drive.receive(frame, wire.now):
                survey.hear(answer)
        assert (found.protocol, found.node, found.serials) == ("canopen", NODE, (f"{SERIAL:X}",))
        assert found.state == "operational, operation enabled"
        assert found.errors == ""
        assert found.voltage == 24.0
        assert found.position == pytest.approx(wire.drive.motor.position, abs=0.001)
        assert found.velocity == pytest.approx(wire.drive.motor.velocity, abs=0.001)
        assert str(survey) == "CANopen node 5"

    def test_its_error_is_told_in_words(self) -> None:
        wire = Wire().running()
        wire.fault(FaultKind.ERROR, value=0x7300)
        wire.advance(0.2)
        survey = self.survey(wire)
        for frame in questions(survey.nodes[0]):
            for answer in wire.drive.receive(frame, wire.now):
                survey.hear(answer)
        assert survey.nodes[0].errors == "position sensor (0x7300)"
        assert survey.nodes[0].state == "operational, fault"

    def test_a_text_that_fits_one_frame_is_the_firmware(self) -> None:
        survey = Survey()
        survey.hear(Frame(0x705, b"\x05"))
        survey.hear(Frame(0x585, struct.pack("<BHB4s", 0x43, Object.FIRMWARE, 0, b"2.1\0")))
        assert survey.nodes[0].firmware == "2.1"

    def test_it_is_not_taken_for_an_odrive(self) -> None:
        wire = Wire(node=1)
        wire.advance(0.01)
        wire.axis.identify()
        wire.advance(0.2)
        wire.axis.prepare()
        wire.advance(0.5)
        survey = self.survey(wire)
        assert [(found.protocol, found.node) for found in survey.nodes] == [("canopen", 1)]
        late = Survey()
        for frame in sorted(wire.heard, key=lambda f: f.id & ~0x7F == Function.HEARTBEAT):
            late.hear(frame)
        assert [(found.protocol, found.node) for found in late.nodes] == [("canopen", 1)]

    def test_two_drives_with_one_id_show_both_serial_numbers(self) -> None:
        wire = Wire(1, 2).meet()
        assert self.survey(wire).nodes[0].serials == ("1", "2")
