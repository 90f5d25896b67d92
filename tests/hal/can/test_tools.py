"""What `vrg can scan` and `vrg can monitor` look at, on a bus within this process."""

import pytest

from tests.hal.can.bench import Drives
from vrg.commands.can_listening import BusState, listening
from vrg.hal.can.cia402.codec import Function
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.workshop.listener import Found
from vrg.hal.can.workshop.simulation import Simulation

LINK = Link(interface="virtual", channel="tools")
MUTE = 9
UPLOAD = 2
"""The command of an SDO that asks for a value, in the upper three bits of its first byte (CiA 301)."""


pytestmark = pytest.mark.usefixtures("simulated")


def mute_node(lab: Simulation) -> list[Frame]:
    """A CANopen node that sends heartbeats and answers nothing: the questions that it is asked."""
    asked: list[Frame] = []

    def hear(frame: Frame) -> None:
        if frame.id == Function.SDO_REQUEST | MUTE and frame.data[0] >> 5 == UPLOAD:
            asked.append(frame)

    def beat() -> None:
        bus.send(Frame(Function.HEARTBEAT | MUTE, b"\x05"))
        lab.clock.at(lab.clock.now() + 0.1, beat)

    bus = lab.bus(LINK, hear)
    bus.start()
    beat()
    return asked


def looks(lab: Simulation, seconds: float) -> tuple[BusState, int]:
    """Look again and again; what was heard at last, and how many looks that were."""
    count = 0
    with listening(LINK) as bus:
        end = lab.clock.now() + seconds
        while lab.clock.now() < end:
            heard = bus.look(ask=True)
            count += 1
            lab.clock.sleep(0.1)
    return heard, count


def node(heard: BusState, number: int) -> Found:
    """The node of this id."""
    (found,) = (found for found in heard.nodes if found.node == number)
    return found


def test_a_drive_is_told_of_in_full(lab: Simulation) -> None:
    with Drives("cia402", [5], link=LINK, serial=0xABC):
        heard, _ = looks(lab, 1.0)
    (found,) = heard.nodes
    assert (found.protocol, found.node, found.serials, found.firmware) == ("canopen", 5, ("ABC",), "1.0.0")
    assert (found.state, found.voltage, found.position) == ("pre-operational, switch on disabled", 24.0, 0.0)
    assert not heard.troubles


def test_two_drives_with_one_id_show_both_serial_numbers(lab: Simulation) -> None:
    with Drives("cia402", [5], link=LINK, serial=0xA), Drives("cia402", [5], link=LINK, serial=0xB):
        heard, _ = looks(lab, 1.5)
    assert node(heard, 5).serials == ("A", "B")


def test_a_node_that_answers_nothing_holds_up_nobody(lab: Simulation) -> None:
    asked = mute_node(lab)
    with Drives("cia402", [5], link=LINK, serial=0xABC), Drives("odrive", [20], link=LINK):
        heard, count = looks(lab, 2.0)
    assert node(heard, MUTE).state == "operational"
    assert not node(heard, MUTE).serials
    assert node(heard, 5).serials == ("ABC",)
    assert 0 < len(asked) <= count, "a look waits for one answer that does not come, not for all"
