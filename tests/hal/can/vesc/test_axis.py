"""One VESC axis and its emulated drive, where they differ from the contract."""

import pytest

from vrg.hal.can.axis import State
from vrg.hal.can.emulator.faults import FaultKind
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.vesc.codec import Packet, setpoint
from vrg.hal.can.vesc.drive import MIN_ERPM
from vrg.hal.can.vesc.options import VescOptions
from vrg.testing.wire import ProtocolWire

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
    assert wire.axis.state is State.IDLE
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
    assert wire.axis.state is State.CLOSED_LOOP


def test_a_fault_that_the_drive_forgets_is_kept_here(wire: ProtocolWire) -> None:
    wire.running()
    wire.fault(FaultKind.ERROR, value=5)
    wire.until(lambda: wire.axis.fault)
    wire.drive_on(8.0, 2.0)
    assert wire.says() == (State.FAULT, "OVER_TEMP_FET")
    assert abs(wire.motor_speed) < 0.1


def test_the_kill_switch_is_an_emergency_stop_as_long_as_it_is_pressed(wire: ProtocolWire) -> None:
    wire.running()
    wire.fault(FaultKind.ESTOP)
    wire.until(lambda: wire.axis.state is State.ESTOP)
    wire.axis.clear()
    wire.advance(1.0)
    assert wire.axis.state is State.ESTOP


def test_without_pole_pairs_it_is_refused() -> None:
    wire = ProtocolWire(PROTOCOLS.get("vesc"), NODE)
    wire.meet()
    assert wire.axis.problem is not None
    assert "pole_pairs" in wire.axis.problem
