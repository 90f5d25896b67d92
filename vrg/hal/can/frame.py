"""A CAN frame as plain data: what codecs make and take."""

from dataclasses import dataclass

STANDARD_MASK = 0x7FF
"""Of an 11-bit identifier."""


class FrameError(Exception):
    """A frame whose content is not what its identifier promises."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame.

    Args:
        id: identifier, 11 bits; 29 if `extended`.
        data: 0 to 8 bytes.
        remote: asks for the frame of this id instead of carrying it.
        at: s of monotonic time at which it was on the bus; of a frame to send, 0.
    """

    id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    at: float = 0.0
