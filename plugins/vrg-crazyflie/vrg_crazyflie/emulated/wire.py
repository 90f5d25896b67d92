"""The bytes of CRTP, Bitcraze's protocol, as a Crazyflie reads and writes them.

Source: the pages of CRTP in the documentation of crazyflie-firmware, and its release 2026.08 (protocol version 12).
"""

import math
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

Packet = tuple[int, int, bytes]
"""A packet: its port, its channel, and up to MOST bytes."""
MOST: Final = 30
"""The most bytes of a packet."""
VERSION: Final = 12
"""The version of the protocol that the emulated Crazyflie speaks (crtp.h)."""
PARAM, COMMANDER, MEM, LOG, LOCALIZATION, GENERIC, HIGH_LEVEL, SUPERVISOR = range(2, 10)
PLATFORM, LINK = 0xD, 0xF
"""The ports (crtp.h)."""
LOG_FORMATS: Final = {1: "<B", 2: "<H", 3: "<I", 4: "<b", 5: "<h", 6: "<i", 7: "<f", 8: "<e"}
"""The formats of the types of log variables, by their codes (log.h)."""
PARAM_FORMATS: Final = {0x08: "<B", 0x09: "<H", 0x0A: "<I", 0x00: "<b", 0x01: "<h", 0x02: "<i", 0x06: "<f"}
"""The formats of the types of parameters, by their codes (param.h)."""
READ_ONLY: Final = 0x40
"""The bit of a parameter's type that makes it read-only (param.h)."""


def packed(form: str, value: float) -> bytes:
    """A number in a format. A whole number that does not fit keeps its lowest bits, as in C; NaN is 0 there."""
    if form[-1] in "fe":
        return struct.pack(form, value)
    size = struct.calcsize(form)
    whole = int(value) if math.isfinite(value) else 0
    return (whole & (1 << 8 * size) - 1).to_bytes(size, "little")


class Contents:
    """A table of contents of version 2: log variables or parameters by their numbers.

    Args:
        entries: the codes of their types, with flags, by their names: group and name, with a dot between.
    """

    INFO, ITEM = 3, 2
    """Its commands."""

    def __init__(self, entries: Mapping[str, int]) -> None:
        self.entries = tuple(entries.items())
        self.crc = 0
        """A checksum, by which clients know a table that they have kept."""
        for name, kind in self.entries:
            self.crc = zlib.crc32(struct.pack("<IB", self.crc, kind) + name.encode())

    def answer(self, request: bytes, limits: bytes = b"") -> bytes | None:
        """The answer to a request; None if it is none. `limits` follow the checksum."""
        command = request[0] if request else -1
        if command == self.INFO:
            return struct.pack("<BHI", command, len(self.entries), self.crc) + limits
        if command == self.ITEM and len(request) >= 3:
            (number,) = struct.unpack_from("<H", request, 1)
            if number >= len(self.entries):
                return bytes([command])
            name, kind = self.entries[number]
            return struct.pack("<BHB", command, number, kind) + f"{name}\0".replace(".", "\0").encode()
        return None


class Mode(Enum):
    """What the numbers of a set-point mean."""

    OFF = "the motors are off"
    HOVER = "velocity in the body's frame, and height"
    VELOCITY = "velocity in the estimator's frame"
    LEVEL = "level, at a height: it drifts"
    POSITION = "position in the estimator's frame, and heading"


@dataclass(frozen=True)
class Setpoint:
    """What the controller is told to do.

    Args:
        mode: what the others mean. x, y: velocity in m/s, or position in m. z: height in m, or velocity in m/s.
        yaw: turn rate in rad/s, counter-clockwise; in the mode POSITION the heading in rad.
    """

    mode: Mode
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0


OFF: Final = Setpoint(Mode.OFF)
_GENERIC: Final = {7: Mode.POSITION, 8: Mode.VELOCITY, 9: Mode.LEVEL, 10: Mode.HOVER}
"""The types of generic set-points of four numbers that are emulated (crtp_commander_generic.c). Those before protocol
version 8, whose yaw has the other sign, are not."""


def setpoint_of(data: bytes) -> Setpoint | None:
    """The generic set-point in a packet. None if it is of a kind that is not emulated, is cut short, or is not finite.

    Its x and y in the mode LEVEL are roll and pitch in degrees, which the vehicle takes to be 0.
    """
    if data[:1] == b"\0":
        return OFF
    if len(data) != 17 or data[0] not in _GENERIC:
        return None
    mode = _GENERIC[data[0]]
    numbers = struct.unpack("<ffff", data[1:])
    if not all(map(math.isfinite, numbers)):
        return None
    x, y, z, yaw = numbers
    if mode in (Mode.LEVEL, Mode.HOVER):
        yaw, z = z, yaw
    return Setpoint(mode, x, y, z, math.radians(yaw))
