"""CANopen's network: what an identifier is for, and the states of a node in the network (CiA 301)."""

import enum
import struct
from typing import NamedTuple

from vrg.hal.can.frame import Frame, FrameError

NODE_IDS = range(1, 128)
"""The ids that a node can have."""


Function = enum.IntEnum("Function", {
    "NMT": 0x000, "EMCY": 0x080, "TPDO1": 0x180, "RPDO1": 0x200, "TPDO2": 0x280, "RPDO2": 0x300, "TPDO3": 0x380,
    "RPDO3": 0x400, "TPDO4": 0x480, "RPDO4": 0x500, "SDO_ANSWER": 0x580, "SDO_REQUEST": 0x600, "HEARTBEAT": 0x700,
})  # fmt: skip
"""The function of an identifier: all its bits but the low seven, which are the node (pre-defined connection set)."""


SDO_DOWNLOADS = (0x00, 0x20, 0xC0)
"""The high bits of the first byte of an SDO request that writes: a segment, the beginning, and a block (CiA 301)."""
LSS = 0x7E5
"""The identifier of the layer setting services' master (CiA 305)."""
LSS_ORDERS = frozenset({0x04, 0x11, 0x13, 0x15, 0x17})
"""The first bytes of its frames that switch nodes over, set ids or bit rates, and store them; others only ask."""
NODE_MASK = 0x7F
"""The bits of an identifier that are the node."""


class Nmt(enum.IntEnum):
    """The state of a node in the network, as its heartbeat reports it."""

    BOOTED = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


NMT_WORDS: dict[int, str] = {
    Nmt.BOOTED: "booting",
    Nmt.STOPPED: "stopped",
    Nmt.OPERATIONAL: "operational",
    Nmt.PRE_OPERATIONAL: "pre-operational",
}


class NmtCommand(enum.IntEnum):
    """The first byte of a frame of identifier 0; the second byte is the node, 0 for all."""

    START = 1
    STOP = 2
    PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


def nmt(node: int, command: NmtCommand) -> Frame:
    """The frame of an NMT command to a node; 0 means all nodes."""
    return Frame(Function.NMT, bytes([command, node]))


PROFILE = 402
"""The low half of the device type, 0x1000."""
DEVICE_TYPE = 0x00020192
"""The device type of a servo drive of profile 402."""
PROFILE_VELOCITY = 3
"""The mode of operation, 0x6060."""
SUPPORTS_PROFILE_VELOCITY = 1 << (PROFILE_VELOCITY - 1)
"""The bit of that mode in the supported modes, 0x6502."""


Object = enum.IntEnum("Object", {
    "DEVICE_TYPE": 0x1000, "ERROR_REGISTER": 0x1001, "NAME": 0x1008, "FIRMWARE": 0x100A,
    "STORE": 0x1010, "CONSUMER_HEARTBEAT": 0x1016, "HEARTBEAT_TIME": 0x1017, "IDENTITY": 0x1018,
    "ERROR_BEHAVIOUR": 0x1029, "RPDO": 0x1400, "RPDO_MAPPING": 0x1600, "TPDO": 0x1800, "TPDO_MAPPING": 0x1A00,
    "ABORT_CONNECTION_OPTION": 0x6007,
    "ERROR_CODE": 0x603F, "CONTROLWORD": 0x6040, "STATUSWORD": 0x6041, "FAULT_REACTION": 0x605E, "MODE": 0x6060,
    "MODE_DISPLAY": 0x6061, "POSITION": 0x6064, "VELOCITY": 0x606C, "VOLTAGE": 0x6079, "ACCELERATION": 0x6083,
    "DECELERATION": 0x6084, "QUICK_STOP_DECELERATION": 0x6085, "ENCODER_RESOLUTION": 0x608F, "VELOCITY_UNIT": 0x60A9,
    "DIGITAL_OUTPUTS": 0x60FE, "TARGET_VELOCITY": 0x60FF, "SUPPORTED_MODES": 0x6502,
})  # fmt: skip
"""The index of each object."""


OUTPUT_BITS = range(16, 32)
"""The bits of the digital outputs (0x60FE) that are the maker's own; bit 0 is the brake, the others are reserved."""
SERIAL_NUMBER = 4
"""The sub-index of the serial number in 0x1018."""
COB_ID, TRANSMISSION, INHIBIT, EVENT_TIMER = 1, 2, 3, 5
"""Sub-indices of 0x1400 and 0x1800. The inhibit time is in 0.1 ms, the event timer in ms."""
SAVE = int.from_bytes(b"save", "little")
"""The signature that must be written to 0x1010:01."""
PDOS = 4
"""The number of PDOs in each direction."""
NOT_VALID = 1 << 31
"""The bit of a COB-ID of a PDO that is switched off."""


def mapping_entry(index: int, bits: int, sub: int = 0) -> int:
    """The entry by which a PDO's mapping (0x1600, 0x1A00) names an object of so many bits."""
    return index << 16 | sub << 8 | bits


class Pdo(NamedTuple):
    """One PDO: the function of its identifier, the objects in it one after the other, and how those are packed.

    The objects are named by their index and one sub-index, which they have in common.
    """

    function: Function
    objects: tuple[Object, ...]
    packing: struct.Struct
    sub: int = 0

    def frame(self, node: int, *values: int) -> Frame:
        """The frame that carries these values."""
        return Frame(self.function | node, self.packing.pack(*values))

    def values(self, data: bytes) -> tuple[int, ...]:
        """The values that a frame carries.

        Raises:
            FrameError: it is of another length.
        """
        if len(data) != self.packing.size:
            raise FrameError(f"{self.function.name}: expected {self.packing.size} bytes, got {len(data)}")
        return self.packing.unpack(data)


# Of the two PDOs that the drive hears, only the second has a deadline (0x1401:05), and only the robot's own thread ever
# sends it: a step of the state machine, by the first, feeds no watchdog. For the same reason the controlword, which
# is in every RPDO that drives come with, is not in the second: a setpoint enables nothing, and enabling is no setpoint.
CONTROL_PDO = Pdo(Function.RPDO1, (Object.CONTROLWORD,), struct.Struct("<H"))
SETPOINT_PDO = Pdo(Function.RPDO2, (Object.TARGET_VELOCITY,), struct.Struct("<i"))
OUTPUT_PDO = Pdo(Function.RPDO3, (Object.DIGITAL_OUTPUTS,), struct.Struct("<I"), sub=1)
STATUS_PDO = Pdo(Function.TPDO1, (Object.STATUSWORD, Object.ERROR_CODE, Object.MODE_DISPLAY), struct.Struct("<HHb"))
MOTION_PDO = Pdo(Function.TPDO2, (Object.POSITION, Object.VELOCITY), struct.Struct("<ii"))
SUPPLY_PDO = Pdo(Function.TPDO3, (Object.VOLTAGE,), struct.Struct("<I"))


def upload(node: int, index: int, sub: int = 0) -> Frame:
    """The frame that asks a drive for an object."""
    return Frame(Function.SDO_REQUEST | node, struct.pack("<BHB4x", 0x40, index, sub))


def download(node: int, index: int, value: int, size: int, sub: int = 0) -> Frame:
    """The frame that writes an object of `size` bytes."""
    command = 0x23 | (4 - size) << 2
    data = value.to_bytes(size, "little").ljust(4, b"\0")
    return Frame(Function.SDO_REQUEST | node, struct.pack("<BHB", command, index, sub) + data)


def concerns(data: bytes, index: int, sub: int = 0) -> bool:
    """True if an SDO answer carries an object, or refuses it."""
    return len(data) == 8 and data[0] & 0xE0 in (0x40, 0x80) and data[1:4] == struct.pack("<HB", index, sub)


def uploaded(data: bytes) -> int | None:
    """The unsigned number in an SDO answer; None if it is a refusal."""
    if data[0] & 0xE2 != 0x42:
        return None
    unused = data[0] >> 2 & 3 if data[0] & 1 else 0
    return int.from_bytes(data[4 : 8 - unused], "little")


class DriveState(enum.Enum):
    """The states. A value is a pair: the bits of the statusword that count, and what they are in this state."""

    NOT_READY_TO_SWITCH_ON = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    @property
    def words(self) -> str:
        """The state in words."""
        return self.name.lower().replace("_", " ")


POWERED = (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
"""The states in which the motor has voltage."""


def drive_state(statusword: int) -> DriveState | None:
    """The state in a statusword; None for a combination of bits that stands for none."""
    return next((state for state in DriveState if statusword & state.value[0] == state.value[1]), None)


class Control(enum.IntEnum):
    """Controlwords; HALT is a bit that may be added."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80
    HALT = 0x100
