"""Requests for faults to emulated drives, and their answers."""

from vrg.hal.can.emulator.faults import FaultRequest, decode_answer, encode_fault
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.medium import Medium

PATIENCE = 2.0
"""s for a drive to answer."""


def ask_for(medium: Medium, link: Link, node: int, request: FaultRequest) -> bool | None:
    """Ask a drive for a fault.

    Returns:
        whether it can have this fault; None if nobody answers within PATIENCE.

    Raises:
        RobotError: the bus cannot be opened, or the request cannot be sent.
        ValueError: the request does not fit into a frame.
    """
    question = encode_fault(node, request)
    answers: list[bool] = []

    def hear(frame: Frame) -> None:
        done = decode_answer(frame, node, request.kind)
        if done is not None:
            answers.append(done)

    bus = medium.bus(link, hear)
    bus.start()
    try:
        bus.send(question)
        medium.clock.wait(lambda: answers, PATIENCE)
    finally:
        bus.stop()
    return answers[0] if answers else None
