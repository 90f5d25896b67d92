"""SDO transfers of up to four bytes as single frames, for who does not wait for the answer (CiA 301, expedited)."""

import struct

from vrg.hal.can.cia402.network import Function
from vrg.hal.can.frame import Frame


def upload(node: int, index: int, sub: int = 0) -> Frame:
    """The frame that asks a drive for an object."""
    return Frame(Function.SDO_REQUEST | node, struct.pack("<BHB4x", 0x40, index, sub))


def download(node: int, index: int, value: int, size: int, sub: int = 0) -> Frame:
    """The frame that writes an object of `size` bytes."""
    command = 0x23 | (4 - size) << 2
    data = value.to_bytes(size, "little").ljust(4, b"\0")
    return Frame(Function.SDO_REQUEST | node, struct.pack("<BHB", command, index, sub) + data)


def concerns(data: bytes, index: int, sub: int = 0) -> bool:
    """Whether an SDO answer tells an object, or refuses it."""
    return len(data) == 8 and data[0] & 0xE0 in (0x40, 0x80) and data[1:4] == struct.pack("<HB", index, sub)


def uploaded(data: bytes) -> int | None:
    """The unsigned number that an SDO answer tells; None where it is a refusal."""
    if data[0] & 0xE2 != 0x42:
        return None
    unused = data[0] >> 2 & 3 if data[0] & 1 else 0
    return int.from_bytes(data[4 : 8 - unused], "little")
