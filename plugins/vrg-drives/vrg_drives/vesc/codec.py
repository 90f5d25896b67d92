"""The frames of a VESC, to messages and back, as pure functions; all numbers are big-endian.

An identifier has 29 bits, `packet << 8 | id`. A setpoint is sent to the id of a drive, and a status is sent with the id
of the drive that tells it. What does not fit into one frame, and every question, is a payload for the drive's command
interpreter: up to six bytes in one short frame, longer ones in pieces.
"""

import binascii
import enum
import struct
from typing import NamedTuple

from vrg.hal.can.frame import Frame, FrameError

BROADCAST = 0xFF
"""The id that means every drive."""
HOSTS = range(0xE0, BROADCAST)
"""The ids of those who ask: answers are sent to them. No drive may have one: it would take an answer for an order."""
NODE_IDS = range(HOSTS[0])
"""The ids that a drive can have."""
TACHO_STEPS = 6
"""Steps of the tachometer for one electrical revolution."""
_SHORT = 6
"""The most bytes of a payload that fits into one frame."""
_LONGEST = 512
"""The most bytes of a payload."""


Packet = enum.IntEnum("Packet", {
    "SET_DUTY": 0, "SET_CURRENT": 1, "SET_CURRENT_BRAKE": 2, "SET_RPM": 3, "SET_POS": 4, "FILL_RX_BUFFER": 5,
    "FILL_RX_BUFFER_LONG": 6, "PROCESS_RX_BUFFER": 7, "PROCESS_SHORT_BUFFER": 8, "STATUS": 9, "SET_CURRENT_REL": 10,
    "SET_CURRENT_BRAKE_REL": 11, "SET_CURRENT_HANDBRAKE": 12, "SET_CURRENT_HANDBRAKE_REL": 13, "STATUS_2": 14,
    "STATUS_3": 15, "STATUS_4": 16, "PING": 17, "PONG": 18, "DETECT_APPLY_ALL_FOC": 19, "CONF_CURRENT_LIMITS": 21,
    "CONF_STORE_CURRENT_LIMITS": 22, "CONF_CURRENT_LIMITS_IN": 23, "CONF_STORE_CURRENT_LIMITS_IN": 24,
    "CONF_FOC_ERPMS": 25, "CONF_STORE_FOC_ERPMS": 26, "STATUS_5": 27, "CONF_BATTERY_CUT": 29,
    "CONF_STORE_BATTERY_CUT": 30, "SHUTDOWN": 31, "UPDATE_PID_POS_OFFSET": 55, "STATUS_6": 58, "UPDATE_BAUD": 63,
})  # fmt: skip
"""The purpose of a frame."""


SETPOINTS = frozenset(
    {
        Packet.SET_DUTY, Packet.SET_CURRENT, Packet.SET_CURRENT_BRAKE, Packet.SET_RPM, Packet.SET_POS,
        Packet.SET_CURRENT_REL, Packet.SET_CURRENT_BRAKE_REL, Packet.SET_CURRENT_HANDBRAKE,
        Packet.SET_CURRENT_HANDBRAKE_REL,
    }
)  # fmt: skip
"""The packets that make a motor turn."""
MOTOR_COMMANDS = SETPOINTS | {
    Packet.DETECT_APPLY_ALL_FOC, Packet.CONF_CURRENT_LIMITS, Packet.CONF_STORE_CURRENT_LIMITS,
    Packet.CONF_CURRENT_LIMITS_IN, Packet.CONF_STORE_CURRENT_LIMITS_IN, Packet.CONF_FOC_ERPMS,
    Packet.CONF_STORE_FOC_ERPMS, Packet.CONF_BATTERY_CUT, Packet.CONF_STORE_BATTERY_CUT, Packet.SHUTDOWN,
    Packet.UPDATE_PID_POS_OFFSET, Packet.UPDATE_BAUD,
}  # fmt: skip
"""The packets that change what a motor does, now or later."""
PAYLOADS = frozenset(
    {Packet.FILL_RX_BUFFER, Packet.FILL_RX_BUFFER_LONG, Packet.PROCESS_RX_BUFFER, Packet.PROCESS_SHORT_BUFFER}
)
"""The packets that carry a payload for the command interpreter, or a part of one."""


class Comm(enum.IntEnum):
    """The first byte of a payload."""

    FW_VERSION = 0
    GET_VALUES_SELECTIVE = 50


QUESTIONS = frozenset(
    {
        Comm.FW_VERSION, Comm.GET_VALUES_SELECTIVE, 4, 14, 15, 17, 18, 31, 32, 33, 47, 51, 62, 65, 79, 91, 92, 93, 94,
        96, 111, 115, 117, 118, 122, 127, 128, 130, 134, 137, 150,
    }
)  # fmt: skip
"""The first bytes of payloads that only ask: values, settings, statistics, and who is there. Every other one changes
something, starts something, or keeps the time-out away (the maker's datatypes.h, COMM_PACKET_ID)."""


FAULT_BIT, FLAGS_BIT = 1 << 15, 1 << 21
"""The bits of what is asked for by GET_VALUES_SELECTIVE: the fault, and the flags of the time-out."""
TIMED_OUT, KILL_SWITCH = 1, 2
"""The flags: no setpoint has arrived for the time-out, and the kill switch is pressed."""


class Status(NamedTuple):
    """The speed in electrical revolutions a minute, the motor's current in A and the duty cycle, -1 to 1."""

    erpm: int
    current: float
    duty: float


class Status5(NamedTuple):
    """The tachometer in steps, see TACHO_STEPS, and the voltage of the supply."""

    tachometer: int
    voltage: float


class Firmware(NamedTuple):
    """The version, the hardware's name and the drive's unique number."""

    major: int
    minor: int
    hardware: str
    serial: str


_STATUS, _STATUS_5 = struct.Struct(">ihh"), struct.Struct(">ih2x")
_STATUS_5_LEAST = 6


def frame_id(packet: int, node: int) -> int:
    """The identifier of a frame."""
    return packet << 8 | node


def packet_of(frame: Frame) -> int:
    """The purpose of a frame."""
    return frame.id >> 8


def node_of(frame: Frame) -> int:
    """The id of the drive that a frame is sent to, or that it is from."""
    return frame.id & 0xFF


def setpoint(packet: Packet, node: int, value: int) -> Frame:
    """A setpoint: the whole number of its packet's unit."""
    limited = max(-(2**31), min(2**31 - 1, value))
    return Frame(frame_id(packet, node), struct.pack(">i", limited), extended=True)


def value_of(frame: Frame) -> int:
    """The number of a setpoint.

    Raises:
        FrameError: it has too few bytes.
    """
    if len(frame.data) < 4:
        raise FrameError(f"setpoint: expected 4 bytes, got {len(frame.data)}")
    return int.from_bytes(frame.data[:4], "big", signed=True)


def status_frame(node: int, status: Status) -> Frame:
    """The frame of a Status."""
    data = _STATUS.pack(status.erpm, _int16(status.current * 10), _int16(status.duty * 1000))
    return Frame(frame_id(Packet.STATUS, node), data, extended=True)


def status_5_frame(node: int, status: Status5) -> Frame:
    """The frame of a Status5."""
    data = _STATUS_5.pack(status.tachometer, _int16(status.voltage * 10))
    return Frame(frame_id(Packet.STATUS_5, node), data, extended=True)


def decode_status(data: bytes) -> Status:
    """The Status of a frame's data.

    Raises:
        FrameError: it has too few bytes.
    """
    if len(data) < _STATUS.size:
        raise FrameError(f"STATUS: expected {_STATUS.size} bytes, got {len(data)}")
    erpm, current, duty = _STATUS.unpack_from(data)
    return Status(erpm, current / 10, duty / 1000)


def decode_status_5(data: bytes) -> Status5:
    """The Status5 of a frame's data.

    Raises:
        FrameError: it has too few bytes.
    """
    if len(data) < _STATUS_5_LEAST:
        raise FrameError(f"STATUS_5: expected {_STATUS_5_LEAST} bytes, got {len(data)}")
    tachometer, voltage = struct.unpack_from(">ih", data)
    return Status5(tachometer, voltage / 10)


def own_id(process: int) -> int:
    """The id by which a process asks, so that no other one on the bus takes its answers for its own.

    Answers of several frames do not name who is answered but by this id: those to two who share it get mixed up.
    """
    return HOSTS[process % len(HOSTS)]


def ask(host: int, node: int, payload: bytes) -> Frame:
    """The frame that gives a drive's interpreter a payload of up to six bytes; it answers to `host`."""
    return Frame(frame_id(Packet.PROCESS_SHORT_BUFFER, node), bytes([host, 0]) + payload, extended=True)


def ask_values(host: int, node: int, bits: int) -> Frame:
    """The frame that asks a drive for its fault or its flags, one at a time, so that the answer is one frame."""
    return ask(host, node, struct.pack(">BI", Comm.GET_VALUES_SELECTIVE, bits))


def payload_frames(receiver: int, sender: int, payload: bytes) -> list[Frame]:
    """The frames that carry a payload to a receiver."""
    if len(payload) <= _SHORT:
        head = bytes([sender, 1])
        return [Frame(frame_id(Packet.PROCESS_SHORT_BUFFER, receiver), head + payload, extended=True)]
    frames = []
    at = 0
    while at < len(payload):
        if at <= 0xFF:
            packet, head, size = Packet.FILL_RX_BUFFER, bytes([at]), 7
        else:
            packet, head, size = Packet.FILL_RX_BUFFER_LONG, struct.pack(">H", at), 6
        frames.append(Frame(frame_id(packet, receiver), head + payload[at : at + size], extended=True))
        at += size
    end = struct.pack(">BBHH", sender, 1, len(payload), binascii.crc_hqx(payload, 0))
    return [*frames, Frame(frame_id(Packet.PROCESS_RX_BUFFER, receiver), end, extended=True)]


class Assembler:
    """Puts payloads together from the frames that are sent to one receiver. Its answerers must speak one at a time."""

    def __init__(self) -> None:
        self._buffer = bytearray(_LONGEST)

    def take(self, frame: Frame) -> tuple[int, bytes] | None:
        """Take in a frame to the receiver.

        Returns:
            the sender and the payload, where the frame has completed one; None otherwise.

        Raises:
            FrameError: it is too short, or the payload was damaged on its way.
        """
        data = frame.data
        match packet_of(frame):
            case Packet.FILL_RX_BUFFER:
                self._fill(data[0] if data else 0, data[1:])
            case Packet.FILL_RX_BUFFER_LONG:
                self._fill(int.from_bytes(data[:2], "big"), data[2:])
            case Packet.PROCESS_SHORT_BUFFER:
                if len(data) < 3:
                    raise FrameError(f"short buffer: expected 3 bytes at least, got {len(data)}")
                return data[0], data[2:]
            case Packet.PROCESS_RX_BUFFER:
                if len(data) < 6:
                    raise FrameError(f"end of a buffer: expected 6 bytes, got {len(data)}")
                sender, _, length, crc = struct.unpack_from(">BBHH", data)
                payload = bytes(self._buffer[:length])
                if length > _LONGEST or binascii.crc_hqx(payload, 0) != crc:
                    raise FrameError("a buffer whose checksum is wrong")
                return sender, payload
        return None

    def _fill(self, at: int, data: bytes) -> None:
        if at + len(data) <= _LONGEST:
            self._buffer[at : at + len(data)] = data


def firmware_payload(firmware: Firmware) -> bytes:
    """The answer to FW_VERSION."""
    head = bytes([Comm.FW_VERSION, firmware.major, firmware.minor])
    return head + firmware.hardware.encode() + b"\0" + bytes.fromhex(firmware.serial.zfill(24)) + b"\0\0"


def decode_firmware(payload: bytes) -> Firmware:
    """The Firmware in an answer to FW_VERSION.

    Raises:
        FrameError: it is cut short.
    """
    name, _, rest = payload[3:].partition(b"\0")
    if len(payload) < 4 or len(rest) < 12:
        raise FrameError(f"firmware: expected a version, a name and 12 bytes, got {len(payload)} bytes")
    return Firmware(payload[1], payload[2], name.decode("ascii", "replace"), rest[:12].hex().upper().lstrip("0"))


def values_payload(bits: int, value: int) -> bytes:
    """The answer to `ask_values`."""
    return struct.pack(">BIB", Comm.GET_VALUES_SELECTIVE, bits, value)


def decode_values(payload: bytes) -> tuple[int, int | None]:
    """Return the bits that `ask_values` asked for, and their value; None from a firmware that does not have it.

    Raises:
        FrameError: it is cut short.
    """
    if len(payload) < 5:
        raise FrameError(f"values: expected 5 bytes at least, got {len(payload)}")
    return int.from_bytes(payload[1:5], "big"), payload[5] if len(payload) > 5 else None


def _int16(value: float) -> int:
    return max(-(2**15), min(2**15 - 1, round(value)))


_FAULTS = (
    "", "OVER_VOLTAGE", "UNDER_VOLTAGE", "DRV", "ABS_OVER_CURRENT", "OVER_TEMP_FET", "OVER_TEMP_MOTOR",
    "GATE_DRIVER_OVER_VOLTAGE", "GATE_DRIVER_UNDER_VOLTAGE", "MCU_UNDER_VOLTAGE", "BOOTING_FROM_WATCHDOG_RESET",
    "ENCODER_SPI", "ENCODER_SINCOS_BELOW_MIN_AMPLITUDE", "ENCODER_SINCOS_ABOVE_MAX_AMPLITUDE", "FLASH_CORRUPTION",
    "HIGH_OFFSET_CURRENT_SENSOR_1", "HIGH_OFFSET_CURRENT_SENSOR_2", "HIGH_OFFSET_CURRENT_SENSOR_3",
    "UNBALANCED_CURRENTS", "BRK", "RESOLVER_LOT", "RESOLVER_DOS", "RESOLVER_LOS", "FLASH_CORRUPTION_APP_CFG",
    "FLASH_CORRUPTION_MC_CFG", "ENCODER_NO_MAGNET", "ENCODER_MAGNET_TOO_STRONG", "PHASE_FILTER", "ENCODER_FAULT",
    "LV_OUTPUT_FAULT", "ENCODER_SLIP", "OVERSPEED", "UNDERSPEED", "ABS_OVERSPEED",
)  # fmt: skip
DRV = 3
"""The fault of the motor driver chip."""


def describe_fault(code: int) -> str:
    """A fault as the VESC Tool writes it; empty where there is none."""
    return _FAULTS[code] if 0 <= code < len(_FAULTS) else f"fault {code}"
