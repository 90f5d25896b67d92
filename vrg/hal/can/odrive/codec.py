"""ODrive CANSimple, firmware 0.6: frames to messages and back, as pure functions.

An identifier is `node << 5 | command`; payloads are little-endian.
"""

import struct
from typing import NamedTuple

from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import messages
from vrg.hal.can.odrive.messages import Command, Message

BROADCAST = 0x3F
"""The node id of frames that are meant for everybody, and of drives that have no id yet."""
NODE_IDS = range(BROADCAST)
"""The ids that a drive can have."""


class _Layout(NamedTuple):
    """The layout of a message.

    `shortest` is the least number of bytes that a drive accepts: masters in the wild leave off trailing fields, which
    are zero then.
    """

    kind: type[Message]
    packing: struct.Struct
    shortest: int


def _layout(kind: type[Message], packing: str, shortest: int | None = None) -> _Layout:
    packed = struct.Struct("<" + packing)
    return _Layout(kind, packed, packed.size if shortest is None else shortest)


_LAYOUTS: dict[int, _Layout] = {
    Command.VERSION: _layout(messages.Version, "8B"),
    Command.HEARTBEAT: _layout(messages.Heartbeat, "IBBBx"),
    Command.ESTOP: _layout(messages.Estop, ""),
    Command.RX_SDO: _layout(messages.RxSdo, "BHxI", 4),
    Command.TX_SDO: _layout(messages.TxSdo, "BHxI", 4),
    Command.SET_AXIS_STATE: _layout(messages.SetAxisState, "I", 1),
    Command.ENCODER_ESTIMATES: _layout(messages.EncoderEstimates, "ff"),
    Command.SET_CONTROLLER_MODE: _layout(messages.SetControllerMode, "II"),
    Command.SET_INPUT_VEL: _layout(messages.SetInputVel, "ff", 4),
    Command.SET_LIMITS: _layout(messages.SetLimits, "ff"),
    Command.REBOOT: _layout(messages.Reboot, "B", 0),
    Command.BUS_VOLTAGE_CURRENT: _layout(messages.BusVoltageCurrent, "ff"),
    Command.CLEAR_ERRORS: _layout(messages.ClearErrors, "B", 0),
    Command.SET_ABSOLUTE_POSITION: _layout(messages.SetAbsolutePosition, "f"),
}
_COMMANDS: dict[type[Message], int] = {layout.kind: command for command, layout in _LAYOUTS.items()}
_NAMED = frozenset(Command)
_ADDRESS_BYTES = 7
"""The node and 48 bits of serial number; newer firmware appends a connection id."""


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
    """The frame of a message to or from a node, at its full length."""
    if isinstance(message, messages.Address):
        data = struct.pack("<BIH", message.node, message.serial & 0xFFFFFFFF, message.serial >> 32)
        return Frame(frame_id(node, Command.ADDRESS), data)
    command = _COMMANDS[type(message)]
    return Frame(frame_id(node, command), _LAYOUTS[command].packing.pack(*message))


def request(node: int, command: Command) -> Frame:
    """The frame that asks a node for a value."""
    return Frame(frame_id(node, command), remote=True)


def decode(frame: Frame) -> Message:
    """The message of a frame; bytes after its last field are ignored, as padding.

    Raises:
        FrameError: an unknown command, or too few bytes, with what was expected.
    """
    command = command_of(frame.id)
    data = frame.data
    if command == Command.ADDRESS:
        if len(data) < _ADDRESS_BYTES:
            raise FrameError(f"Address: expected {_ADDRESS_BYTES} bytes, got {len(data)}")
        node, low, high = struct.unpack_from("<BIH", data)
        return messages.Address(node, high << 32 | low)
    layout = _LAYOUTS.get(command)
    if layout is None:
        if command in _NAMED:
            return messages.Other(Command(command))
        raise FrameError(f"command 0x{command:02X}: expected one of CANSimple's, got an unknown one")
    if len(data) < layout.shortest:
        raise FrameError(f"{layout.kind.__name__}: expected {layout.packing.size} bytes, got {len(data)}")
    if len(data) < layout.packing.size:
        data = data.ljust(layout.packing.size, b"\0")
    return layout.kind(*layout.packing.unpack_from(data))
