"""The faults that an emulated drive can be asked for, and the frame that asks for one. No real drive obeys it."""

import enum
import struct
from dataclasses import dataclass

from vrg.hal.can.frame import Frame, FrameError

_REQUEST = 0x1E5640_00
"""The 29-bit identifier of a request; its low byte is the id of the node."""
_ANSWER = 0x1E5641_00
"""The same of the answer."""
_ANSWER_PACKING = struct.Struct("<B?")
_PACKING = struct.Struct("<BHi")
_TICK = 0.01
"""The unit of a duration on the wire, s."""


FaultKind = enum.IntEnum("FaultKind", {
    "END": 0, "SILENCE": 1, "FREEZE": 2, "REBOOT": 3, "ESTOP": 4, "ERROR": 5, "NAN": 6, "JUMP": 7, "GARBAGE": 8,
    "LENGTH": 9, "REVERSE": 10, "BLOCK": 11, "RUNAWAY": 12, "SCALE": 13, "STUCK": 14,
})  # fmt: skip
"""The faults. Those that last end by their duration, or by `END`."""

WHAT = {
    FaultKind.END: "ends all lasting faults",
    FaultKind.SILENCE: "sends nothing, but keeps running",
    FaultKind.FREEZE: "hears nothing, sends nothing, does nothing; its motor is off",
    FaultKind.REBOOT: "starts again: a gap, idle, position zero",
    FaultKind.ESTOP: "its own emergency stop is pressed",
    FaultKind.ERROR: "latches an error: --value gives its bits (default: the driver chip's)",
    FaultKind.NAN: "its encoder reports NaN",
    FaultKind.JUMP: "its encoder jumps by --value turns (default 1000)",
    FaultKind.GARBAGE: "its frames carry random bytes",
    FaultKind.LENGTH: "its frames are too short",
    FaultKind.REVERSE: "its encoder counts backwards",
    FaultKind.BLOCK: "its wheel is blocked",
    FaultKind.RUNAWAY: "it turns --value times as fast as asked (default 3)",
    FaultKind.SCALE: "its encoder reports --value times its speed (default 60)",
    FaultKind.STUCK: "its motor turns on when it is switched off, though it says that it is off",
}


@dataclass(frozen=True, slots=True)
class FaultRequest:
    """One request.

    Args:
        kind: what is to go wrong.
        duration: s for which it lasts, 0.01 to 655; 0 = until END.
        value: error bits, turns, or how many times; 0 = the default.
    """

    kind: FaultKind
    duration: float = 0.0
    value: int = 0


def encode_fault(node: int, request: FaultRequest) -> Frame:
    """The frame that asks a node for a fault.

    Raises:
        ValueError: a duration or value that does not fit.
    """
    ticks = round(request.duration / _TICK)
    if not 0 <= ticks <= 0xFFFF:
        raise ValueError(f"duration: expected 0 to 655 s, got {request.duration}")
    if not -(1 << 31) <= request.value < 1 << 31:
        raise ValueError(f"value: expected 32 bits, got {request.value}")
    return Frame(_REQUEST | node, _PACKING.pack(request.kind, ticks, request.value), extended=True)


def is_fault_request(frame: Frame, node: int) -> bool:
    """True if a frame asks this node for a fault."""
    return frame.extended and frame.id == _REQUEST | node


def decode_fault(frame: Frame) -> FaultRequest:
    """The request that a frame carries.

    Raises:
        FrameError: it is of another length, or asks for an unknown fault.
    """
    if len(frame.data) != _PACKING.size:
        raise FrameError(f"fault request: expected {_PACKING.size} bytes, got {len(frame.data)}")
    kind, ticks, value = _PACKING.unpack(frame.data)
    try:
        return FaultRequest(FaultKind(kind), ticks * _TICK, value)
    except ValueError:
        raise FrameError(f"fault request: expected one of {list(map(int, FaultKind))}, got {kind}") from None


def encode_answer(node: int, kind: FaultKind, *, done: bool) -> Frame:
    """The frame in which an emulated drive reports that a request has arrived, and whether it can do that."""
    return Frame(_ANSWER | node, _ANSWER_PACKING.pack(kind, done), extended=True)


def decode_answer(frame: Frame, node: int, kind: FaultKind) -> bool | None:
    """Return True if a node has done what was asked, False if it cannot, None if the frame shows neither."""
    if not frame.extended or frame.id != _ANSWER | node or len(frame.data) != _ANSWER_PACKING.size:
        return None
    answered, done = _ANSWER_PACKING.unpack(frame.data)
    return done if answered == kind else None
