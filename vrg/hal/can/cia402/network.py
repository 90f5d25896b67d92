"""CANopen's network: what an identifier is for, and the states of a node in the network (CiA 301)."""

import enum

from vrg.hal.can.frame import Frame

NODES = range(1, 128)
"""The ids that a node can have."""


class Function(enum.IntEnum):
    """What an identifier is for: all its bits but the low seven, which are the node (pre-defined connection set)."""

    NMT = 0x000
    EMCY = 0x080
    TPDO1 = 0x180
    RPDO1 = 0x200
    TPDO2 = 0x280
    RPDO2 = 0x300
    TPDO3 = 0x380
    RPDO3 = 0x400
    TPDO4 = 0x480
    RPDO4 = 0x500
    SDO_ANSWER = 0x580
    SDO_REQUEST = 0x600
    HEARTBEAT = 0x700


SYNC = 0x080
"""The identifier of SYNC; it would be the EMCY of node 0, which is nobody."""
SDO_DOWNLOADS = (0x00, 0x20, 0xC0)
"""The high bits of the first byte of an SDO request that writes: a segment, the beginning, and a block (CiA 301)."""
LSS = 0x7E5
"""The identifier of the layer setting services' master (CiA 305)."""
LSS_ORDERS = frozenset({0x04, 0x11, 0x13, 0x15, 0x17})
"""The first bytes of its frames that switch nodes over, set ids or bit rates, and store them; others only ask."""
NODE_MASK = 0x7F
"""The bits of an identifier that are the node."""


class Nmt(enum.IntEnum):
    """The state of a node in the network, as its heartbeat tells it."""

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
