"""How an emulated drive is asked for a fault, and says that it has heard."""

import time

from vrg.hal.can.bus import frame_of, message_of
from vrg.hal.can.emulator.faults import FaultRequest, decode_answer, encode_fault
from vrg.hal.can.link import Link
from vrg.hal.can.opening import open_bus

PATIENCE = 2.0
"""s for a drive to answer."""


def ask_for(link: Link, node: int, request: FaultRequest) -> bool | None:
    """Ask a drive for a fault.

    Returns:
        whether it can have this fault; None if nobody answers within PATIENCE.

    Raises:
        RobotError: the bus cannot be opened. ValueError: the request does not fit into a frame.
    """
    frame = encode_fault(node, request)
    bus = open_bus(link)
    try:
        bus.send(message_of(frame))
        deadline = time.monotonic() + PATIENCE
        while (left := deadline - time.monotonic()) > 0:
            heard = bus.recv(left)
            if heard is not None and (done := decode_answer(frame_of(heard), node, request.kind)) is not None:
                return done
        return None
    finally:
        bus.shutdown()
