"""ODrive CANSimple, firmware 0.6: frames to and from messages. Pure.

An identifier is `node << 5 | command`; payloads are little-endian. Source: ODrive's documentation of the CAN protocol
and its DBC file for 0.6.10. Units are the protocol's: turns, turns per second, newton metres, amperes, volts.
"""

import enum
import struct
from typing import NamedTuple

from vrg.hal.can.frame import Frame, FrameError

BROADCAST = 0x3F
"""Node id of frames that are meant for everybody, and of drives that have none yet."""
NODES = range(BROADCAST)
"""Ids that a drive can have."""
PROTOCOL_VERSION = 2


class Command(enum.IntEnum):
    """The low five bits of an identifier."""

    VERSION = 0x00
    HEARTBEAT = 0x01
    ESTOP = 0x02
    ERROR = 0x03
    RX_SDO = 0x04
    TX_SDO = 0x05
    ADDRESS = 0x06
    SET_AXIS_STATE = 0x07
    ENCODER_ESTIMATES = 0x09
    SET_CONTROLLER_MODE = 0x0B
    SET_INPUT_POS = 0x0C
    SET_INPUT_VEL = 0x0D
    SET_INPUT_TORQUE = 0x0E
    SET_LIMITS = 0x0F
    IQ = 0x14
    TEMPERATURE = 0x15
    REBOOT = 0x16
    BUS_VOLTAGE_CURRENT = 0x17
    CLEAR_ERRORS = 0x18
    SET_ABSOLUTE_POSITION = 0x19
    TORQUES = 0x1C
    POWERS = 0x1D


class AxisState(enum.IntEnum):
    """What an axis does."""

    UNDEFINED = 0
    IDLE = 1
    STARTUP_SEQUENCE = 2
    FULL_CALIBRATION_SEQUENCE = 3
    MOTOR_CALIBRATION = 4
    ENCODER_INDEX_SEARCH = 6
    ENCODER_OFFSET_CALIBRATION = 7
    CLOSED_LOOP_CONTROL = 8
    LOCKIN_SPIN = 9
    ENCODER_DIR_FIND = 10
    HOMING = 11
    ENCODER_HALL_POLARITY_CALIBRATION = 12
    ENCODER_HALL_PHASE_CALIBRATION = 13
    ANTICOGGING_CALIBRATION = 14


class AxisError(enum.IntFlag):
    """Why an axis is disarmed."""

    INITIALIZING = 1 << 0
    SYSTEM_LEVEL = 1 << 1
    TIMING_ERROR = 1 << 2
    MISSING_ESTIMATE = 1 << 3
    BAD_CONFIG = 1 << 4
    DRV_FAULT = 1 << 5
    MISSING_INPUT = 1 << 6
    DC_BUS_OVER_VOLTAGE = 1 << 8
    DC_BUS_UNDER_VOLTAGE = 1 << 9
    DC_BUS_OVER_CURRENT = 1 << 10
    DC_BUS_OVER_REGEN_CURRENT = 1 << 11
    CURRENT_LIMIT_VIOLATION = 1 << 12
    MOTOR_OVER_TEMP = 1 << 13
    INVERTER_OVER_TEMP = 1 << 14
    VELOCITY_LIMIT_VIOLATION = 1 << 15
    POSITION_LIMIT_VIOLATION = 1 << 16
    WATCHDOG_TIMER_EXPIRED = 1 << 24
    ESTOP_REQUESTED = 1 << 25
    SPINOUT_DETECTED = 1 << 26
    BRAKE_RESISTOR_DISARMED = 1 << 27
    THERMISTOR_DISCONNECTED = 1 << 28
    CALIBRATION_ERROR = 1 << 30


class ControlMode(enum.IntEnum):
    """What a drive controls."""

    TORQUE = 1
    VELOCITY = 2
    POSITION = 3


PASSTHROUGH, VEL_RAMP = 1, 2
"""Input modes: the setpoint as it is, or along a ramp."""


class Version(NamedTuple):
    """`protocol` is 2; `unreleased` is 0 for an official build."""

    protocol: int
    hw_major: int
    hw_minor: int
    hw_variant: int
    fw_major: int
    fw_minor: int
    fw_revision: int
    unreleased: int

    @property
    def firmware(self) -> str:
        """As people write it."""
        return f"{self.fw_major}.{self.fw_minor}.{self.fw_revision}{'-dev' if self.unreleased else ''}"


class Heartbeat(NamedTuple):
    """`error`: active errors or, disarmed, the reason for it. `done`: of a trajectory."""

    error: int
    state: int
    result: int = 0
    done: int = 0


class Estop(NamedTuple):
    """Disarm, and latch ESTOP_REQUESTED."""


class Error(NamedTuple):
    """Errors that are there now, and why the axis was last disarmed."""

    active: int
    disarm_reason: int


class RxSdo(NamedTuple):
    """Read (0) or write (1) an endpoint."""

    opcode: int
    endpoint: int
    value: int = 0


class TxSdo(NamedTuple):
    """The answer to a RxSdo."""

    opcode: int
    endpoint: int
    value: int = 0


class Address(NamedTuple):
    """To a drive: take this id if this is your serial number. From a drive: who it is."""

    node: int
    serial: int


class SetAxisState(NamedTuple):
    """Ask for an AxisState."""

    state: int


class EncoderEstimates(NamedTuple):
    """turn, turn/s; float32, so the step grows with the position."""

    position: float
    velocity: float


class SetControllerMode(NamedTuple):
    """What setpoints mean."""

    control_mode: int
    input_mode: int


class SetInputPos(NamedTuple):
    """turn, 0.001 turn/s, 0.001 Nm."""

    position: float
    velocity: int = 0
    torque: int = 0


class SetInputVel(NamedTuple):
    """turn/s, Nm."""

    velocity: float
    torque: float = 0.0


class SetInputTorque(NamedTuple):
    """Nm."""

    torque: float


class SetLimits(NamedTuple):
    """turn/s, A."""

    velocity: float
    current: float


class Iq(NamedTuple):
    """A."""

    setpoint: float
    measured: float


class Temperature(NamedTuple):
    """degrees Celsius."""

    fet: float
    motor: float


class Reboot(NamedTuple):
    """0 reboot, 1 save, 2 erase, 3 firmware update."""

    action: int = 0


class BusVoltageCurrent(NamedTuple):
    """V, A."""

    voltage: float
    current: float


class ClearErrors(NamedTuple):
    """`identify` lets the drive blink."""

    identify: int = 0


class SetAbsolutePosition(NamedTuple):
    """turn: what the encoder is to say here."""

    position: float


class Torques(NamedTuple):
    """Nm."""

    target: float
    estimate: float


class Powers(NamedTuple):
    """W."""

    electrical: float
    mechanical: float


Message = (
    Version | Heartbeat | Estop | Error | RxSdo | TxSdo | Address | SetAxisState | EncoderEstimates | SetControllerMode
    | SetInputPos | SetInputVel | SetInputTorque | SetLimits | Iq | Temperature | Reboot | BusVoltageCurrent
    | ClearErrors | SetAbsolutePosition | Torques | Powers
)  # fmt: skip


class _Layout(NamedTuple):
    """`shortest`: what a drive accepts; masters in the wild leave off trailing fields, which are zero then."""

    kind: type[Message]
    packing: struct.Struct
    shortest: int


def _layout(kind: type[Message], packing: str, shortest: int | None = None) -> _Layout:
    packed = struct.Struct("<" + packing)
    return _Layout(kind, packed, packed.size if shortest is None else shortest)


_LAYOUTS: dict[int, _Layout] = {
    Command.VERSION: _layout(Version, "8B"),
    Command.HEARTBEAT: _layout(Heartbeat, "IBBBx"),
    Command.ESTOP: _layout(Estop, ""),
    Command.ERROR: _layout(Error, "II"),
    Command.RX_SDO: _layout(RxSdo, "BHxI", 4),
    Command.TX_SDO: _layout(TxSdo, "BHxI", 4),
    Command.SET_AXIS_STATE: _layout(SetAxisState, "I", 1),
    Command.ENCODER_ESTIMATES: _layout(EncoderEstimates, "ff"),
    Command.SET_CONTROLLER_MODE: _layout(SetControllerMode, "II"),
    Command.SET_INPUT_POS: _layout(SetInputPos, "fhh", 4),
    Command.SET_INPUT_VEL: _layout(SetInputVel, "ff", 4),
    Command.SET_INPUT_TORQUE: _layout(SetInputTorque, "f"),
    Command.SET_LIMITS: _layout(SetLimits, "ff"),
    Command.IQ: _layout(Iq, "ff"),
    Command.TEMPERATURE: _layout(Temperature, "ff"),
    Command.REBOOT: _layout(Reboot, "B", 0),
    Command.BUS_VOLTAGE_CURRENT: _layout(BusVoltageCurrent, "ff"),
    Command.CLEAR_ERRORS: _layout(ClearErrors, "B", 0),
    Command.SET_ABSOLUTE_POSITION: _layout(SetAbsolutePosition, "f"),
    Command.TORQUES: _layout(Torques, "ff"),
    Command.POWERS: _layout(Powers, "ff"),
}
_COMMANDS: dict[type[Message], int] = {layout.kind: command for command, layout in _LAYOUTS.items()}
_ADDRESS_BYTES = 7
"""Node and 48 bits of serial number; newer firmware appends a connection id."""


def frame_id(node: int, command: int) -> int:
    """The identifier of a command of a node."""
    return node << 5 | command


def node_of(identifier: int) -> int:
    """The node of an identifier."""
    return identifier >> 5


def command_of(identifier: int) -> int:
    """The command of an identifier."""
    return identifier & 0x1F


def encode(node: int, message: Message) -> Frame:
    """A message to or from a node, at its full length."""
    if isinstance(message, Address):
        data = struct.pack("<BIH", message.node, message.serial & 0xFFFFFFFF, message.serial >> 32)
        return Frame(frame_id(node, Command.ADDRESS), data)
    command = _COMMANDS[type(message)]
    return Frame(frame_id(node, command), _LAYOUTS[command].packing.pack(*message))


def request(node: int, command: Command) -> Frame:
    """Ask a node for a value."""
    return Frame(frame_id(node, command), remote=True)


def decode(frame: Frame) -> Message:
    """The message of a frame; bytes after its last field are ignored, as padding.

    Raises:
        FrameError: an unknown command, or too few bytes; says what was expected.
    """
    command = command_of(frame.id)
    data = frame.data
    if command == Command.ADDRESS:
        if len(data) < _ADDRESS_BYTES:
            raise FrameError(f"Address: expected {_ADDRESS_BYTES} bytes, got {len(data)}")
        node, low, high = struct.unpack_from("<BIH", data)
        return Address(node, high << 32 | low)
    layout = _LAYOUTS.get(command)
    if layout is None:
        raise FrameError(f"command 0x{command:02X}: expected one of CANSimple's, got an unknown one")
    if len(data) < layout.shortest:
        raise FrameError(f"{layout.kind.__name__}: expected {layout.packing.size} bytes, got {len(data)}")
    if len(data) < layout.packing.size:
        data = data.ljust(layout.packing.size, b"\0")
    return layout.kind(*layout.packing.unpack_from(data))


def describe_errors(bits: int) -> str:
    """Error bits in words, as ODrive writes them, joined by commas; empty for none."""
    names = [error.name for error in AxisError if error & bits and error.name]
    unknown = bits & ~sum(AxisError)
    if unknown:
        names.append(f"unknown error 0x{unknown:X}")
    return ", ".join(names)


def describe_state(state: int) -> str:
    """An axis state in words."""
    try:
        return AxisState(state).name
    except ValueError:
        return f"state {state}"
