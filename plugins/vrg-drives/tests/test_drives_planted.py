"""Frames that are planted beside a CiA 402 drive, a moteus or a VESC that drives."""

import math
import struct

import pytest

from vrg.hal.can.frame import Frame
from vrg.testing.can.planted import ANOTHER, NODE, Planted, check_filters, check_planted
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


PLANTED: list[Planted] = [
    ("cia402", "a setpoint", raw(Function.RPDO2 | NODE, bytes(4)), ANOTHER),
    ("cia402", "a controlword", raw(Function.RPDO1 | NODE, b"\x0f\0"), ANOTHER),
    ("cia402", "a third PDO", raw(Function.RPDO3 | NODE, b"\0"), ANOTHER),
    ("cia402", "a fourth PDO", raw(Function.RPDO4 | NODE, b"\0"), ANOTHER),
    ("cia402", "a setpoint for another node", raw(Function.RPDO2 | NODE + 1, bytes(4)), None),
    ("cia402", "a start", nmt(NODE, NmtCommand.START), "another program commands its network state"),
    ("cia402", "an object written", download(NODE, Object.CONTROLWORD, 0, 2), "another program sets it up too"),
    ("cia402", "an object read", upload(NODE, Object.VOLTAGE), None),
    ("cia402", "pre-operational", nmt(NODE, NmtCommand.PRE_OPERATIONAL), "another program commands its network state"),
    ("cia402", "all stopped", nmt(0, NmtCommand.STOP), "another program commands its network state"),
    ("cia402", "another node stopped", nmt(NODE + 1, NmtCommand.STOP), None),
    ("cia402", "a block", raw(Function.SDO_REQUEST | NODE, b"\xc6\x60\x60\0\x01\0\0\0"), "another program sets it up"),
    ("cia402", "a segment written", raw(Function.SDO_REQUEST | NODE, b"\x01abcdefg"), "another program sets it up too"),
    ("cia402", "a block read", raw(Function.SDO_REQUEST | NODE, b"\xa4\x08\x10\0\x7f\0\0\0"), None),
    ("cia402", "other ids", raw(0x7E5, b"\x11\x09" + bytes(6)), "another program gives nodes other ids"),
    ("cia402", "other bit rates", raw(0x7E5, b"\x13\0\x02" + bytes(5)), "another program gives nodes other ids or bit"),
    ("cia402", "who is there", raw(0x7E5, b"\x4c" + bytes(7)), None),
    ("cia402", "a long heartbeat", raw(Function.HEARTBEAT | NODE, bytes(2)), "a malformed frame: heartbeat"),
    ("cia402", "an odd heartbeat", raw(Function.HEARTBEAT | NODE, b"\x22"), "a malformed frame: heartbeat"),
    ("cia402", "a boot-up", raw(Function.HEARTBEAT | NODE, b"\0"), "it was started again"),
    ("cia402", "a short status", raw(Function.TPDO1 | NODE, b"\0"), "a malformed frame"),
    ("moteus", "a setpoint", mo(*setpoint(3.0, 0.2)), f"{ANOTHER}: it writes register 0x000"),
    ("moteus", "a stop for all", mo(*STOP_SUBFRAMES, to=moteus.BROADCAST), f"{ANOTHER}: it writes register 0x000"),
    ("moteus", "a stop by a third one", mo(*STOP_SUBFRAMES, source=99), f"{ANOTHER}: it writes register 0x000"),
    ("moteus", "a text", raw(0x8000 | NODE, b"\x40\x01\x06d stop", extended=True), f"{ANOTHER}, by its diagnostic"),
    ("moteus", "a question for text", raw(0x8000 | NODE, b"\x42\x01\x30", extended=True), None),
    ("moteus", "a question", mo(moteus.read(Register.MODE)), None),
    ("moteus", "a speed of NaN", told(Register.POSITION, 0.0, math.nan), "its encoder says 0.0 turn, nan turn/s"),
    ("moteus", "a voltage of -1", told(Register.VOLTAGE, -1.0), "its supply says -1 V"),
    ("moteus", "a cut answer", raw(NODE << 8, b"\x2e\x01\0", extended=True), "a malformed frame"),
    ("vesc", "a setpoint", vesc.setpoint(Packet.SET_RPM, NODE, 100), f"{ANOTHER}: SET_RPM"),
    ("vesc", "a brake for all", vesc.setpoint(Packet.SET_CURRENT_BRAKE, 255, 100), f"{ANOTHER}: SET_CURRENT_BRAKE"),
    ("vesc", "a handbrake", vesc.setpoint(Packet.SET_CURRENT_HANDBRAKE, NODE, 1), f"{ANOTHER}: SET_CURRENT_HANDBRAKE"),
    ("vesc", "a short status", ve(Packet.STATUS, bytes(3)), "a malformed frame: STATUS"),
    ("vesc", "a negative voltage", ve(Packet.STATUS_5, struct.pack(">ihh", 0, -10, 0)), "its supply says -1 V"),
    ("vesc", "an answer to two", ve(Packet.PROCESS_RX_BUFFER, bytes([NODE, 1, 0, 9, 1, 2]), vesc.HOSTS[0]), None),
    ("vesc", "a payload that sets the speed", ve(Packet.PROCESS_SHORT_BUFFER, bytes([7, 0, 8, 0, 0, 3, 132])), ANOTHER),
    ("vesc", "other limits", ve(Packet.CONF_CURRENT_LIMITS, bytes(8)), ANOTHER),
    ("vesc", "a shutdown", ve(Packet.SHUTDOWN, b""), ANOTHER),
    ("vesc", "a ping", ve(Packet.PING, bytes([200])), None),
]  # fmt: skip


@pytest.mark.parametrize(
    ("protocol", "frame", "words"),
    [pytest.param(p, frame, words, id=f"{p}: {what}") for p, what, frame, words in PLANTED],
)
def test_what_a_planted_frame_causes(protocol: str, frame: Frame, words: str | None) -> None:
    check_planted(protocol, frame, words)


@pytest.mark.parametrize("protocol", ["cia402", "moteus", "vesc"])
def test_each_passes_the_filters_of_the_interface(protocol: str) -> None:
    check_filters(protocol, PLANTED)
