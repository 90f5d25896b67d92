"""Emulated ODrives: the protocol's state machine, everything that can be asked to go wrong, and what is kept."""

import math
import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.messages import AxisError, AxisState, Command
from vrg.hal.can.workshop.emulated import BOOT, DriveOptions
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, decode_fault, encode_fault, is_fault_request
from vrg.hal.can.workshop.odrive.drive import OdriveDrive

NODE = 6
SERIAL = 0xC0FFEE


class Bench:
    """One drive, and time."""

    def __init__(self, node: int = NODE, **options: float) -> None:
        self.now = 10.0
        self.drive = OdriveDrive(node, DriveOptions(serial=SERIAL, **options), self.now, random.Random(1))  # type: ignore[arg-type]
        self.frames: list[Frame] = []

    def tell(self, message: messages.Message, node: int = NODE) -> list[messages.Message]:
        """Send it a message; its answers."""
        return self.put(codec.encode(node, message))

    def put(self, frame: Frame) -> list[messages.Message]:
        """Send it a frame; its answers."""
        return [codec.decode(f) for f in self.drive.receive(frame, self.now)]

    def run(self, seconds: float, velocity: float | None = None) -> list[Frame]:
        """Let time pass, with a setpoint every 20 ms; the frames that came."""
        frames: list[Frame] = []
        for step in range(round(seconds / 0.005)):
            self.now += 0.005
            if velocity is not None and step % 4 == 0:
                self.tell(messages.SetInputVel(velocity))
            frames += self.drive.step(self.now)
        self.frames = frames
        return frames

    def close_loop(self) -> None:
        self.tell(messages.SetControllerMode(messages.VELOCITY_CONTROL, messages.PASSTHROUGH))
        self.tell(messages.SetAxisState(AxisState.CLOSED_LOOP_CONTROL))

    @property
    def heartbeat(self) -> messages.Heartbeat:
        """Asked for now."""
        (answer,) = self.put(codec.request(self.drive.node, Command.HEARTBEAT))
        assert isinstance(answer, messages.Heartbeat)
        return answer

    def fault(self, kind: FaultKind, duration: float = 0.0, value: int = 0) -> None:
        self.drive.receive(encode_fault(self.drive.node, FaultRequest(kind, duration, value)), self.now)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def count(frames: list[Frame], command: Command) -> int:
    return sum(codec.command_of(f.id) == command for f in frames)


class TestProtocol:
    def test_cyclic_frames(self, bench: Bench) -> None:
        frames = bench.run(2.0)
        assert count(frames, Command.HEARTBEAT) in (20, 21)
        assert 190 <= count(frames, Command.ENCODER_ESTIMATES) <= 201
        assert count(frames, Command.BUS_VOLTAGE_CURRENT) in (2, 3)
        assert all(codec.node_of(f.id) == NODE for f in frames)

    def test_the_watchdog_wants_setpoints_and_nothing_else(self, bench: Bench) -> None:
        bench.close_loop()
        bench.run(1.0, 10.0)
        for _ in range(8):
            bench.run(0.05)
            bench.put(codec.request(NODE, Command.ENCODER_ESTIMATES))
            bench.tell(messages.SetLimits(100.0, 10.0))
            bench.tell(messages.ClearErrors(), node=3)
        assert bench.heartbeat.error == AxisError.WATCHDOG_TIMER_EXPIRED
        assert bench.heartbeat.state == AxisState.IDLE
        assert abs(bench.drive.motor.velocity) < 0.1

    def test_a_watchdog_error_bars_closed_loop_until_cleared(self, bench: Bench) -> None:
        bench.close_loop()
        bench.run(0.5)
        bench.close_loop()
        assert bench.heartbeat.state == AxisState.IDLE
        assert bench.heartbeat.result != 0
        bench.tell(messages.ClearErrors())
        bench.close_loop()
        assert bench.heartbeat.state == AxisState.CLOSED_LOOP_CONTROL
        assert bench.heartbeat.error == 0

    def test_without_a_watchdog_it_goes_on(self) -> None:
        bench = Bench(watchdog=0.0)
        bench.close_loop()
        bench.run(1.0, 10.0)
        bench.run(2.0)
        assert bench.drive.motor.velocity == pytest.approx(10.0, rel=0.02)

    @pytest.mark.parametrize("node", [codec.BROADCAST, NODE], ids=["to all", "to it"])
    def test_an_estop_latches(self, bench: Bench, node: int) -> None:
        bench.close_loop()
        bench.run(0.5, 10.0)
        bench.tell(messages.Estop(), node=node)
        assert bench.heartbeat.error == AxisError.ESTOP_REQUESTED
        bench.close_loop()
        assert bench.heartbeat.state == AxisState.IDLE
        bench.tell(messages.ClearErrors())
        assert bench.heartbeat.error == 0

    @pytest.mark.parametrize(
        "command",
        [
            Command.VERSION, Command.HEARTBEAT, Command.ENCODER_ESTIMATES, Command.BUS_VOLTAGE_CURRENT, Command.ADDRESS,
        ],
    )  # fmt: skip
    def test_requests_by_remote_and_by_empty_frames(self, bench: Bench, command: Command) -> None:
        identifier = codec.frame_id(NODE, command)
        for frame in (Frame(identifier, remote=True), Frame(identifier)):
            (answer,) = bench.drive.receive(frame, bench.now)
            assert answer.id == identifier
            codec.decode(answer)

    def test_enumeration_and_a_new_id(self, bench: Bench) -> None:
        (who,) = bench.put(codec.request(codec.BROADCAST, Command.ADDRESS))
        assert who == messages.Address(NODE, SERIAL)
        bench.tell(messages.Address(9, SERIAL + 1), node=codec.BROADCAST)
        assert bench.drive.node == NODE
        bench.tell(messages.Address(9, SERIAL), node=codec.BROADCAST)
        assert bench.drive.node == 9

    def test_a_drive_without_an_id_sends_nothing_until_it_is_given_one(self) -> None:
        bench = Bench(node=codec.BROADCAST)
        assert bench.run(1.0) == []
        (who,) = bench.put(codec.request(codec.BROADCAST, Command.ADDRESS))
        assert who == messages.Address(codec.BROADCAST, SERIAL)
        bench.tell(messages.Address(4, SERIAL), node=codec.BROADCAST)
        assert count(bench.run(1.0), Command.HEARTBEAT) >= 9

    def test_setpoints_of_other_modes_feed_its_watchdog_and_do_nothing_else(self, bench: Bench) -> None:
        bench.close_loop()
        for _ in range(10):
            bench.put(Frame(codec.frame_id(NODE, Command.SET_INPUT_POS), bytes(8)))
            bench.put(Frame(codec.frame_id(NODE, Command.SET_INPUT_TORQUE), bytes(4)))
            bench.run(0.1)
        assert bench.heartbeat.state == AxisState.CLOSED_LOOP_CONTROL
        assert bench.drive.motor.position == 0.0

    def test_endpoints(self, bench: Bench) -> None:
        raw = struct.unpack("<I", struct.pack("<f", 1.5))[0]
        (answer,) = bench.tell(messages.RxSdo(1, 1, raw))
        assert answer == messages.TxSdo(0, 1, raw)
        bench.close_loop()
        bench.run(1.0)
        assert bench.heartbeat.error == 0, "its watchdog now waits longer"
        assert bench.tell(messages.RxSdo(0, 999, 0)) == []

    def test_a_reboot_by_frame_only_when_idle(self, bench: Bench) -> None:
        bench.close_loop()
        bench.run(0.5, 10.0)
        bench.tell(messages.Reboot(0))
        assert bench.heartbeat.state == AxisState.CLOSED_LOOP_CONTROL
        bench.tell(messages.SetAxisState(AxisState.IDLE))
        bench.tell(messages.Reboot(0))
        assert bench.run(BOOT - 0.02) == []
        bench.run(0.2)
        assert bench.drive.motor.position == 0.0


class TestFaults:
    def test_silence_ends_by_itself_or_by_a_word(self, bench: Bench) -> None:
        bench.fault(FaultKind.SILENCE, 0.5)
        assert bench.run(0.49) == []
        assert bench.run(0.5)
        bench.fault(FaultKind.SILENCE)
        assert bench.run(5.0) == []
        bench.fault(FaultKind.END)
        assert bench.run(0.5)

    @pytest.mark.parametrize(("kind", "velocity"), [(FaultKind.SILENCE, 10.0), (FaultKind.FREEZE, 0.0)])
    def test_a_silent_drive_goes_on_and_a_frozen_one_not(self, bench: Bench, kind: FaultKind, velocity: float) -> None:
        bench.close_loop()
        bench.run(1.0, 10.0)
        bench.fault(kind)
        assert bench.run(0.5, 10.0) == []
        assert bench.drive.motor.velocity == pytest.approx(velocity, rel=0.02, abs=0.01)

    def test_reboot(self, bench: Bench) -> None:
        bench.close_loop()
        bench.run(1.0, 10.0)
        bench.fault(FaultKind.REBOOT)
        assert bench.run(BOOT - 0.02) == []
        bench.run(0.3)
        assert bench.drive.motor.position == pytest.approx(0.0, abs=0.1)
        assert bench.heartbeat.state == AxisState.IDLE

    @pytest.mark.parametrize(
        ("kind", "value", "error"),
        [
            (FaultKind.ESTOP, 0, AxisError.ESTOP_REQUESTED),
            (FaultKind.ERROR, 0, AxisError.DRV_FAULT),
            (FaultKind.ERROR, 0x2200, AxisError.DC_BUS_UNDER_VOLTAGE | AxisError.MOTOR_OVER_TEMP),
        ],
    )
    def test_latched_errors(self, bench: Bench, kind: FaultKind, value: int, error: AxisError) -> None:
        bench.close_loop()
        bench.fault(kind, value=value)
        assert bench.heartbeat.error == error
        assert bench.heartbeat.state == AxisState.IDLE

    def test_nan_and_a_jump(self, bench: Bench) -> None:
        bench.fault(FaultKind.NAN, 0.5)
        (nan,) = bench.put(codec.request(NODE, Command.ENCODER_ESTIMATES))
        assert isinstance(nan, messages.EncoderEstimates)
        assert math.isnan(nan.position)
        bench.fault(FaultKind.END)
        bench.fault(FaultKind.JUMP, value=-7)
        (jumped,) = bench.put(codec.request(NODE, Command.ENCODER_ESTIMATES))
        assert isinstance(jumped, messages.EncoderEstimates)
        assert jumped.position == -7.0

    def test_garbage_and_length(self, bench: Bench) -> None:
        bench.fault(FaultKind.GARBAGE)
        frames = [f for f in bench.run(1.0) if codec.command_of(f.id) == Command.ENCODER_ESTIMATES]
        assert len({f.data for f in frames}) == len(frames)
        bench.fault(FaultKind.END)
        bench.fault(FaultKind.LENGTH)
        assert {len(f.data) for f in bench.run(1.0)} == {7}

    @given(
        st.sampled_from(FaultKind), st.integers(0, 0xFFFF), st.integers(-(1 << 31), (1 << 31) - 1), st.integers(0, 127)
    )
    def test_requests_travel_whole(self, kind: FaultKind, ticks: int, value: int, node: int) -> None:
        frame = encode_fault(node, FaultRequest(kind, ticks * 0.01, value))
        assert is_fault_request(frame, node)
        assert not is_fault_request(frame, node + 1)
        back = decode_fault(frame)
        assert (back.kind, back.value) == (kind, value)
        assert back.duration == pytest.approx(ticks * 0.01)

    @pytest.mark.parametrize("data", [b"", bytes(6), b"\x63" + bytes(6)])
    def test_odd_requests_are_refused_and_harmless(self, bench: Bench, data: bytes) -> None:
        frame = Frame(encode_fault(NODE, FaultRequest(FaultKind.END)).id, data, extended=True)
        with pytest.raises(FrameError):
            decode_fault(frame)
        assert bench.drive.receive(frame, bench.now) == []

    @pytest.mark.parametrize(("duration", "value"), [(-1.0, 0), (1e4, 0), (0.0, 1 << 40)])
    def test_requests_that_do_not_fit_are_refused(self, duration: float, value: int) -> None:
        with pytest.raises(ValueError, match="expected"):
            encode_fault(0, FaultRequest(FaultKind.SILENCE, duration, value))


WATCHDOG = 1


def watchdog(bench: Bench) -> float:
    """What its first endpoint says."""
    (answer,) = bench.tell(messages.RxSdo(0, WATCHDOG), node=bench.drive.node)
    assert isinstance(answer, messages.TxSdo)
    return float(struct.unpack("<f", struct.pack("<I", answer.value))[0])


def change(bench: Bench) -> None:
    """Another id, watchdog and limits."""
    bench.tell(messages.RxSdo(1, WATCHDOG, struct.unpack("<I", struct.pack("<f", 0.5))[0]))
    bench.tell(messages.SetLimits(7.0, 3.0))
    bench.tell(messages.Address(9, SERIAL), node=codec.BROADCAST)


def test_what_was_not_saved_is_forgotten(bench: Bench) -> None:
    before = watchdog(bench)
    change(bench)
    assert watchdog(bench) == 0.5
    bench.tell(messages.Reboot(0), node=9)
    bench.run(1.0)
    assert (bench.drive.node, watchdog(bench)) == (NODE, before)
    assert bench.drive.motor.velocity_limit == bench.drive.options.motor.velocity_limit


def test_what_was_saved_is_kept(bench: Bench) -> None:
    change(bench)
    bench.tell(messages.Reboot(1), node=9)
    bench.run(1.0)
    assert (bench.drive.node, watchdog(bench)) == (9, 0.5)
    assert (bench.drive.motor.velocity_limit, bench.drive.motor.current_limit) == (7.0, 3.0)


def test_what_is_erased_is_as_from_the_box(bench: Bench) -> None:
    bench.tell(messages.Reboot(2))
    bench.run(1.0)
    assert bench.drive.node == codec.BROADCAST, "it has no id"
    assert bench.run(1.0) == []


def test_one_whose_id_another_drive_is_given_waits_for_a_new_one(bench: Bench) -> None:
    bench.tell(messages.Address(NODE, SERIAL + 1), node=codec.BROADCAST)
    assert bench.drive.node == codec.BROADCAST
    bench.tell(messages.Address(9, SERIAL), node=codec.BROADCAST)
    assert bench.drive.node == 9


def test_nobody_takes_the_id_of_one_that_drives(bench: Bench) -> None:
    bench.close_loop()
    bench.tell(messages.Address(NODE, SERIAL + 1), node=codec.BROADCAST)
    bench.tell(messages.Address(9, SERIAL), node=codec.BROADCAST)
    assert bench.drive.node == NODE
