"""One VESC axis and its emulated drive, where they differ from the contract."""

import random

import pytest

from vrg.hal.can.axis import MotorState
from vrg.hal.can.frame import Frame
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.workshop.faults import FaultKind
from vrg.testing.wire import ProtocolWire
from vrg_drives.vesc.axis import MIN_ERPM, VescOptions
from vrg_drives.vesc.codec import BROADCAST, HOSTS, Comm, Packet, frame_id, packet_of, payload_frames, setpoint

NODE = 5


@pytest.fixture
def wire() -> ProtocolWire:
    return ProtocolWire(PROTOCOLS.get("vesc"), NODE, options=VescOptions(pole_pairs=7))


def test_a_motor_that_is_pushed_is_not_on(wire: ProtocolWire) -> None:
    wire.prepare()
    for _ in range(20):
        wire.drive.motor.velocity = 12.0
        wire.advance(0.05)
    assert wire.axis.on is False
    assert wire.axis.state is MotorState.IDLE
    assert wire.axis.velocity > 1.0


def test_it_is_on_by_its_own_word_whoever_drives_it(wire: ProtocolWire) -> None:
    wire.prepare()
    for _ in range(20):
        wire.inject(setpoint(Packet.SET_RPM, NODE, 5000))
        wire.advance(0.05)
    assert wire.axis.on


def test_no_setpoint_is_sent_to_one_that_is_off(wire: ProtocolWire) -> None:
    wire.prepare()
    wire.sent.clear()
    wire.axis.command(5.0)
    assert wire.sent == [], "a VESC would obey it"


def test_it_stands_where_it_is_asked_for_less_than_it_regulates(wire: ProtocolWire) -> None:
    slowest = MIN_ERPM / 60 / 7
    wire.running()
    wire.drive_on(1.05 * slowest, 1.0)
    assert wire.motor_speed == pytest.approx(1.05 * slowest, rel=0.1)
    wire.drive_on(0.95 * slowest, 1.0)
    assert abs(wire.motor_speed) < 0.01
    assert wire.axis.state is MotorState.CLOSED_LOOP


def test_one_that_answers_nothing_does_not_hear_its_setpoints(wire: ProtocolWire) -> None:
    wire.running()
    hear = wire.drive._hear
    wire.drive._hear = lambda frame, now: []  # type: ignore[method-assign]
    began = wire.now
    wire.until(lambda: wire.axis.implausible)
    assert "it does not hear this computer" in (wire.axis.implausible or "")
    assert wire.now - began < 0.5
    wire.drive._hear = hear  # type: ignore[method-assign]
    wire.axis.forget_implausible()
    wire.advance(1.0)
    assert wire.axis.implausible is None


@pytest.mark.parametrize("seed", range(3))
def test_one_on_a_bus_that_loses_frames_is_not_taken_for_deaf(wire: ProtocolWire, seed: int) -> None:
    wire.running()
    wire.axis.idle()
    rng, hear, cyclic = random.Random(seed), wire.drive._hear, wire.drive._cyclic

    def rest(frames: list[Frame]) -> list[Frame]:
        return [frame for frame in frames if rng.random() >= 0.3]

    wire.drive._hear = lambda frame, now: rest(hear(frame, now)) if rest([frame]) else []  # type: ignore[method-assign]
    wire.drive._cyclic = lambda now: rest(cyclic(now))  # type: ignore[method-assign]
    wire.advance(120.0)
    assert wire.axis.implausible is None


@pytest.mark.parametrize(("sent", "missing"), [(Packet.STATUS, 5), (Packet.STATUS_5, 1)])
def test_the_status_message_that_is_not_switched_on_is_named(wire: ProtocolWire, sent: Packet, missing: int) -> None:
    cyclic = wire.drive._cyclic
    wire.drive._cyclic = lambda now: [f for f in cyclic(now) if packet_of(f) == sent]  # type: ignore[method-assign]
    wire.meet()
    assert f"expected its status message {missing}: switch 1 and 5 on" in (wire.axis.problem or "")


def test_a_fault_that_the_drive_forgets_is_kept_here(wire: ProtocolWire) -> None:
    wire.running()
    wire.fault(FaultKind.ERROR, value=5)
    wire.until(lambda: wire.axis.fault)
    wire.drive_on(8.0, 2.0)
    assert wire.says() == (MotorState.FAULT, "OVER_TEMP_FET")
    assert abs(wire.motor_speed) < 0.1


def test_the_kill_switch_is_an_emergency_stop_as_long_as_it_is_pressed(wire: ProtocolWire) -> None:
    wire.running()
    wire.fault(FaultKind.ESTOP)
    wire.until(lambda: wire.axis.state is MotorState.ESTOP)
    wire.axis.clear()
    wire.advance(1.0)
    assert wire.axis.state is MotorState.ESTOP


def test_without_pole_pairs_it_is_refused() -> None:
    wire = ProtocolWire(PROTOCOLS.get("vesc"), NODE)
    wire.meet()
    assert "pole_pairs" in (wire.axis.problem or "")


def payload(receiver: int, *numbers: int) -> list[Frame]:
    """What another program tells a drive's interpreter, or a drive another program."""
    return payload_frames(receiver, 7, bytes(numbers))


FOREIGN = {
    "a duty cycle for all": [setpoint(Packet.SET_DUTY, BROADCAST, 5000)],
    "payload 8": payload(NODE, 8, 0, 0, 3, 132),  # the speed
    "payload 6": payload(NODE, 6, 0, 0, 3, 132),  # the current
    "payload 29": payload(NODE, 29),  # start again
    "payload 30": payload(NODE, 30),  # keep the time-out away
    "payload 13": payload(NODE, 13, *range(100)),  # new settings, in many frames
}


@pytest.mark.parametrize("frames", FOREIGN.values(), ids=FOREIGN)
def test_what_another_program_commands_is_seen(wire: ProtocolWire, frames: list[Frame]) -> None:
    wire.prepare()
    for frame in frames:
        wire.axis.receive(frame)
    assert "another program commands it too" in (wire.axis.implausible or "")


@pytest.mark.parametrize("asked", [(0,), (4,), (50, 0, 0, 128, 0), (14,), (33,), (96,), (128,), (134,)])
def test_another_program_may_ask(wire: ProtocolWire, asked: tuple[int, ...]) -> None:
    wire.prepare()
    for frame in payload(NODE, *asked):
        wire.axis.receive(frame)
    assert wire.axis.implausible is None


def of_process(number: int, monkeypatch: pytest.MonkeyPatch) -> ProtocolWire:
    """An axis in a process of this number, and its drive."""
    monkeypatch.setattr("os.getpid", lambda: number)
    return ProtocolWire(PROTOCOLS.get("vesc"), NODE, options=VescOptions(pole_pairs=7))


def test_each_process_asks_by_an_id_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = (of_process(number, monkeypatch).meet() for number in (4711, 4712))
    assert {one.axis.host, other.axis.host} <= set(HOSTS)  # type: ignore[attr-defined]
    assert not {frame_id(Packet.PROCESS_RX_BUFFER, host) for host in (one.axis.host,)} & {  # type: ignore[attr-defined]
        frame.id for frame in other.heard
    }


def test_answers_to_two_processes_may_come_at_the_same_time(monkeypatch: pytest.MonkeyPatch) -> None:
    wires = [of_process(number, monkeypatch) for number in (4711, 4712)]
    firmware = [Comm.FW_VERSION, 6, 5, *b"VRG", 0, *range(12), 0, 0]
    frames = [payload_frames(wire.axis.host, NODE, bytes(firmware)) for wire in wires]  # type: ignore[attr-defined]
    for pieces in zip(*frames, strict=True):
        for piece in pieces:
            for wire in wires:
                wire.axis.receive(piece)
    assert [wire.axis.firmware for wire in wires] == ["6.05", "6.05"]
    assert [wire.axis.implausible for wire in wires] == [None, None]


def test_answers_to_another_robot_on_the_bus_are_no_fault_even_if_it_has_the_same_id(wire: ProtocolWire) -> None:
    """The pieces of two answers get mixed up then, and this process asks by another id from there on."""
    wire.prepare()
    host = wire.axis.host  # type: ignore[attr-defined]
    one, other = payload(host, 0, *range(40)), payload(host, 0, *range(60, 120))
    for pair in zip(one, other[: len(one)], strict=True):
        for frame in pair:
            wire.axis.receive(frame)
    wire.axis.receive(Frame(frame_id(Packet.PROCESS_SHORT_BUFFER, host), b"", extended=True))
    assert wire.axis.implausible is None
    assert wire.axis.host != host  # type: ignore[attr-defined]
    wire.advance(0.5)
    assert wire.says() == (MotorState.IDLE, None)
    wire.get_going()
