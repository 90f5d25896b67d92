"""CANopen nodes on a bus are recognised, and asked."""

import pytest
from cia402_wire import NODE, Wire

from vrg.hal.can.axis import NEVER, AxisReport
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.faults import FaultKind
from vrg.hal.can.workshop.listener import ANSWER_TIMEOUT
from vrg.hal.can.workshop.survey import Survey, all_listeners
from vrg.hal.simulated_clock import SimulatedClock
from vrg.testing.wire import SERIAL_NUMBER
from vrg_drives.cia402.codec import Function, NmtCommand, Object, nmt


def asked(wire: Wire) -> AxisReport:
    """The one node on the wire, after it was asked for all that it tells."""
    wire.survey.greet()
    (found,) = wire.survey.nodes
    wire.survey.ask(found)
    return found


def test_a_drive_is_known_by_its_answers() -> None:
    wire = Wire().running(10.0)
    wire.advance(0.12)
    wire.axis.command(10.0)
    found = asked(wire)
    assert (found.protocol, found.node, found.serials) == ("cia402", NODE, {f"{SERIAL_NUMBER:X}"})
    assert found.words == "operational, operation enabled"
    assert found.errors == ""
    assert found.firmware == "1.0.0"
    assert found.voltage == 24.0
    assert found.position == pytest.approx(wire.drive.motor.position, abs=0.001)
    assert found.velocity == pytest.approx(wire.drive.motor.velocity, abs=0.001)
    assert str(wire.survey) == "CANopen node 5"


def test_its_error_is_told_in_words() -> None:
    wire = Wire().running()
    wire.fault(FaultKind.ERROR, value=0x7300)
    wire.advance(0.2)
    found = asked(wire)
    assert found.errors == "position sensor (0x7300)"
    assert found.words == "operational, fault"


def test_a_node_that_lacks_objects_is_shown_with_what_it_has() -> None:
    wire = Wire().meet()
    for index in (Object.FIRMWARE, Object.ENCODER_RESOLUTION, Object.STATUSWORD):
        del wire.drive.objects.object_dictionary[index]
    found = asked(wire)
    assert (found.words, found.measured, found.voltage) == ("pre-operational", NEVER, 24.0)
    assert found.firmware == "VRG emulated drive"


def test_a_stopped_node_is_asked_nothing() -> None:
    wire = Wire().meet()
    wire.inject(nmt(NODE, NmtCommand.STOP))
    wire.advance(0.2)
    assert asked(wire).words == "stopped"
    assert not wire.survey.nodes[0].serials


def test_a_node_that_does_not_answer_is_not_waited_for_long() -> None:
    sent: list[Frame] = []
    clock = SimulatedClock()
    survey = Survey(all_listeners(lambda frame, **_: sent.append(frame), clock))
    survey.hear(Frame(Function.HEARTBEAT | NODE, b"\x05"))
    survey.ask(survey.nodes[0])
    assert clock.now() == pytest.approx(ANSWER_TIMEOUT)
    assert [frame.id for frame in sent if frame.data[0] != 0x80] == [Function.SDO_REQUEST | NODE], "one question alone"


@pytest.mark.parametrize("late", [False, True])
def test_it_is_not_taken_for_an_odrive(late: bool) -> None:
    """Some of its telegrams have the identifier and the length of an ODrive's heartbeat."""
    wire = Wire(node=1).running()
    frames = sorted(wire.heard, key=lambda f: f.id & ~0x7F == Function.HEARTBEAT) if late else wire.heard
    survey = Survey(all_listeners(lambda _: None, SimulatedClock()))
    seen = set()
    for frame in frames:
        survey.hear(frame)
        seen |= {found.protocol for found in survey.nodes}
    assert [(found.protocol, found.node) for found in survey.nodes] == [("cia402", 1)]
    assert seen == {"cia402"}
