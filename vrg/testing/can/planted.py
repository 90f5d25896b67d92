"""Frames that should not be on the bus while a motor drives, each with what it causes: words, or nothing."""

from functools import cache

from vrg.hal.can.axis import MotorState
from vrg.hal.can.frame import Frame
from vrg.hal.can.protocols import PROTOCOLS
from vrg.testing.wire import ProtocolWire

NODE = 5
ANOTHER = "another program commands it too"
Planted = tuple[str, str, Frame, str | None]
"""A protocol, what is planted, its frame, and the beginning of what the axis reports."""


@cache
def driving(protocol: str) -> ProtocolWire:
    """A drive of this protocol whose motor drives; all frames are planted into the same one."""
    found = PROTOCOLS.get(protocol)
    options = found.axis_type.options_type.model_validate(found.drive_type.wiring)
    return ProtocolWire(found, NODE, options=options).running()


def check_planted(protocol: str, frame: Frame, words: str | None) -> None:
    """The axis of a motor that drives reports these words when it receives the frame, or nothing for None."""
    axis = driving(protocol).axis
    axis.forget_implausible()
    assert axis.state is not MotorState.SILENT
    axis.receive(Frame(frame.id, frame.data, frame.remote, frame.extended, axis.heard, frame.fd))
    assert (axis.implausible is None) == (words is None)
    assert (words or "") in (axis.implausible or "")


def check_filters(protocol: str, planted: list[Planted]) -> None:
    """Each frame that the axis must notice passes the filters that it sets."""
    filters = driving(protocol).axis.filters
    for spoken, what, frame, words in planted:
        if spoken == protocol and words is not None:
            assert any(wanted.passes(frame) for wanted in filters), what
