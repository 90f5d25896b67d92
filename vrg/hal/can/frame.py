"""A CAN frame as plain data: what codecs make and take."""

from dataclasses import dataclass

STANDARD_MASK = 0x7FF
"""The bits of an 11-bit identifier."""


class FrameError(Exception):
    """A frame whose content is not what its identifier promises."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame.

    Args:
        id: the identifier, 11 bits, or 29 bits if `extended`.
        data: 0 to 8 bytes.
        remote: it asks for the frame of this identifier instead of carrying it.
        at: monotonic time at which it was on the bus, s; 0 for a frame that is to be sent.
    """

    id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    at: float = 0.0
