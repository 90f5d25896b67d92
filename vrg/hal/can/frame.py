"""A CAN frame as plain data: what codecs make and take."""

from typing import NamedTuple

from msgspec import Struct

STANDARD_MASK = 0x7FF
"""The bits of an 11-bit identifier."""
EXTENDED_MASK = 0x1FFF_FFFF
"""The bits of a 29-bit identifier."""
CLASSIC_BYTES, FD_BYTES = 8, 64
"""The most bytes of a classic frame and of a CAN FD frame."""
_FD_SIZES: tuple[int, ...] = (*range(9), 12, 16, 20, 24, 32, 48, 64)


class FrameError(Exception):
    """A frame whose content is not what its identifier promises."""


class Frame(Struct, frozen=True):
    """One frame.

    Args:
        id: the identifier, 11 bits, or 29 bits if `extended`.
        data: 0 to 8 bytes, or as many as `fd_size` allows if `fd`.
        remote: it asks for the frame of this identifier instead of carrying it.
        fd: it is a CAN FD frame, whose data is sent at the higher bit rate.
        at: monotonic time at which it was on the bus, s; 0 for a frame that is to be sent.
    """

    id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    at: float = 0.0
    fd: bool = False


class Filter(NamedTuple):
    """Lets frames through whose identifier has `id & mask == identifier & mask` and the same number of bits."""

    id: int
    mask: int
    extended: bool = False

    def passes(self, frame: Frame) -> bool:
        """True if this filter accepts a frame."""
        return frame.extended == self.extended and frame.id & self.mask == self.id & self.mask


def fd_size(size: int) -> int:
    """The smallest number of bytes, of those that a CAN FD frame can have, that has room for `size` bytes.

    Raises:
        ValueError: no frame has room for them.
    """
    for candidate in _FD_SIZES:
        if candidate >= size:
            return candidate
    raise ValueError(f"expected at most {FD_BYTES} bytes, got {size}")
