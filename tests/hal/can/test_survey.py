"""What is said to everybody reaches everybody who can hear it, whatever becomes of the rest."""

from collections.abc import Callable

import pytest

from vrg.errors import RobotError
from vrg.hal.can import bus as bus_module
from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.troubles import NoFdError
from vrg.hal.can.workshop.survey import Survey, all_listeners
from vrg.hal.simulated_clock import SimulatedClock

STOPS = {"odrive": 0x7E7, "cia402": 0x000, "vesc": 0x01FF}
"""The ids of the frames that stop all drives of a protocol."""


class Wire:
    """Keeps what is sent, and fails as it is told to."""

    def __init__(self, fails: Callable[[Frame], RobotError | None]) -> None:
        self.sent: list[Frame] = []
        self._fails = fails

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        error = self._fails(frame)
        if error is not None:
            raise error
        self.sent.append(frame)


def test_a_bus_without_can_fd_is_stopped_and_asked_all_the_same() -> None:
    wire = Wire(lambda frame: NoFdError("no CAN FD") if frame.fd else None)
    survey = Survey(all_listeners(wire.send, SimulatedClock()))
    survey.stop()
    survey.greet()
    assert {frame.id for frame in wire.sent} >= {STOPS[name] for name in STOPS.keys() & {*PROTOCOLS.names()}}


@pytest.mark.parametrize("protocol", STOPS)
def test_one_protocol_that_cannot_be_sent_keeps_none_of_the_others(protocol: str) -> None:
    wire = Wire(lambda frame: RobotError("full") if frame.id == STOPS[protocol] else None)
    with pytest.raises(RobotError, match="full"):
        Survey(all_listeners(wire.send, SimulatedClock())).stop()
    others = STOPS.keys() & {*PROTOCOLS.names()} - {protocol}
    assert {frame.id for frame in wire.sent} >= {STOPS[name] for name in others}


def test_no_can_fd_frame_is_put_on_a_bus_without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bus_module, "takes_fd", lambda _: False)
    bus = CanBus(Link(interface="virtual", channel="classic"), lambda _: None)
    bus.start()
    try:
        bus.send(Frame(1, b"classic"))
        with pytest.raises(NoFdError, match="CAN FD is switched off"):
            bus.send(Frame(1, b"new", fd=True))
    finally:
        bus.stop()
