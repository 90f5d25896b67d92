"""Frames that are planted beside a CiA 402 drive, a moteus or a VESC that drives."""

import math
import struct
from typing import ClassVar

from vrg.hal.can.frame import Frame
from vrg.testing.can.planted import ANOTHER, NODE, PlantedFrames
from vrg_drives.cia402.codec import Function, NmtCommand, Object, download, nmt, upload
from vrg_drives.moteus import codec as moteus
from vrg_drives.moteus.axis import HOST, STOP_SUBFRAMES, setpoint
from vrg_drives.moteus.codec import Resolution, Subframe, SubframeKind
from vrg_drives.moteus.registers import Register
from vrg_drives.vesc import codec as vesc
from vrg_drives.vesc.codec import Packet


def raw(identifier: int, data: bytes, *, extended: bool = False, remote: bool = False) -> Frame:
    return Frame(identifier, data, remote, extended)


def mo(*subframes: Subframe, source: int = HOST, to: int = NODE) -> Frame:
    return moteus.encode(source, to, subframes)


def told(register: int, *values: float) -> Frame:
    """What a moteus drive would say of registers."""
    return mo(Subframe(SubframeKind.REPLY, register, Resolution.F32, values), source=NODE, to=HOST)


def ve(packet: Packet, data: bytes, node: int = NODE) -> Frame:
    return raw(vesc.frame_id(packet, node), data, extended=True)


class TestCia402(PlantedFrames):
    protocol = "cia402"
    planted: ClassVar[dict[str, tuple[Frame, str | None]]] = {
        "a setpoint": (raw(Function.RPDO2 | NODE, bytes(4)), ANOTHER),
        "a controlword": (raw(Function.RPDO1 | NODE, b"\x0f\0"), ANOTHER),
        "a third PDO": (raw(Function.RPDO3 | NODE, b"\0"), ANOTHER),
        "a fourth PDO": (raw(Function.RPDO4 | NODE, b"\0"), ANOTHER),
        "a setpoint for another node": (raw(Function.RPDO2 | NODE + 1, bytes(4)), None),
        "a start": (nmt(NODE, NmtCommand.START), "another program commands its network state"),
        "an object written": (download(NODE, Object.CONTROLWORD, 0, 2), "another program sets it up too"),
        "an object read": (upload(NODE, Object.VOLTAGE), None),
        "pre-operational": (nmt(NODE, NmtCommand.PRE_OPERATIONAL), "another program commands its network state"),
        "all stopped": (nmt(0, NmtCommand.STOP), "another program commands its network state"),
        "another node stopped": (nmt(NODE + 1, NmtCommand.STOP), None),
        "a block": (raw(Function.SDO_REQUEST | NODE, b"\xc6\x60\x60\0\x01\0\0\0"), "another program sets it up"),
        "a segment written": (raw(Function.SDO_REQUEST | NODE, b"\x01abcdefg"), "another program sets it up too"),
        "a block read": (raw(Function.SDO_REQUEST | NODE, b"\xa4\x08\x10\0\x7f\0\0\0"), None),
        "other ids": (raw(0x7E5, b"\x11\x09" + bytes(6)), "another program gives nodes other ids"),
        "other bit rates": (raw(0x7E5, b"\x13\0\x02" + bytes(5)), "another program gives nodes other ids or bit"),
        "who is there": (raw(0x7E5, b"\x4c" + bytes(7)), None),
        "a long heartbeat": (raw(Function.HEARTBEAT | NODE, bytes(2)), "a malformed frame: heartbeat"),
        "an odd heartbeat": (raw(Function.HEARTBEAT | NODE, b"\x22"), "a malformed frame: heartbeat"),
        "a boot-up": (raw(Function.HEARTBEAT | NODE, b"\0"), "it was started again"),
        "a short status": (raw(Function.TPDO1 | NODE, b"\0"), "a malformed frame"),
    }  # fmt: skip


class TestMoteus(PlantedFrames):
    protocol = "moteus"
    planted: ClassVar[dict[str, tuple[Frame, str | None]]] = {
        "a setpoint": (mo(*setpoint(3.0, 0.2)), f"{ANOTHER}: it writes register 0x000"),
        "a stop for all": (mo(*STOP_SUBFRAMES, to=moteus.BROADCAST), f"{ANOTHER}: it writes register 0x000"),
        "a stop by a third one": (mo(*STOP_SUBFRAMES, source=99), f"{ANOTHER}: it writes register 0x000"),
        "a text": (raw(0x8000 | NODE, b"\x40\x01\x06d stop", extended=True), f"{ANOTHER}, by its diagnostic"),
        "a question for text": (raw(0x8000 | NODE, b"\x42\x01\x30", extended=True), None),
        "a question": (mo(moteus.read(Register.MODE)), None),
        "a speed of NaN": (told(Register.POSITION, 0.0, math.nan), "its encoder says 0.0 turn, nan turn/s"),
        "a voltage of -1": (told(Register.VOLTAGE, -1.0), "its supply says -1 V"),
        "a cut answer": (raw(NODE << 8, b"\x2e\x01\0", extended=True), "a malformed frame"),
    }  # fmt: skip


class TestVesc(PlantedFrames):
    protocol = "vesc"
    planted: ClassVar[dict[str, tuple[Frame, str | None]]] = {
        "a setpoint": (vesc.setpoint(Packet.SET_RPM, NODE, 100), f"{ANOTHER}: SET_RPM"),
        "a brake for all": (vesc.setpoint(Packet.SET_CURRENT_BRAKE, 255, 100), f"{ANOTHER}: SET_CURRENT_BRAKE"),
        "a handbrake": (vesc.setpoint(Packet.SET_CURRENT_HANDBRAKE, NODE, 1), f"{ANOTHER}: SET_CURRENT_HANDBRAKE"),
        "a short status": (ve(Packet.STATUS, bytes(3)), "a malformed frame: STATUS"),
        "a negative voltage": (ve(Packet.STATUS_5, struct.pack(">ihh", 0, -10, 0)), "its supply says -1 V"),
        "an answer to two": (ve(Packet.PROCESS_RX_BUFFER, bytes([NODE, 1, 0, 9, 1, 2]), vesc.HOSTS[0]), None),
        "a payload that sets the speed": (ve(Packet.PROCESS_SHORT_BUFFER, bytes([7, 0, 8, 0, 0, 3, 132])), ANOTHER),
        "other limits": (ve(Packet.CONF_CURRENT_LIMITS, bytes(8)), ANOTHER),
        "a shutdown": (ve(Packet.SHUTDOWN, b""), ANOTHER),
        "a ping": (ve(Packet.PING, bytes([200])), None),
    }  # fmt: skip
