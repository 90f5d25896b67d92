"""The CANSimple codec: what goes in comes out, and every short or odd frame is met with words."""

import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.messages import AxisError, AxisState, Command

f32 = st.floats(width=32, allow_nan=False)
u8, u16, u32 = (st.integers(0, (1 << bits) - 1) for bits in (8, 16, 32))
i16 = st.integers(-(1 << 15), (1 << 15) - 1)
nodes = st.integers(0, 62)

MESSAGES = st.one_of(
    st.builds(messages.Version, u8, u8, u8, u8, u8, u8, u8, u8),
    st.builds(messages.Heartbeat, u32, u8, u8, u8),
    st.builds(messages.Estop),
    st.builds(messages.RxSdo, u8, u16, u32),
    st.builds(messages.TxSdo, u8, u16, u32),
    st.builds(messages.Address, u8, st.integers(0, (1 << 48) - 1)),
    st.builds(messages.SetAxisState, u32),
    st.builds(messages.EncoderEstimates, f32, f32),
    st.builds(messages.SetControllerMode, u32, u32),
    st.builds(messages.SetInputVel, f32, f32),
    st.builds(messages.SetLimits, f32, f32),
    st.builds(messages.Reboot, u8),
    st.builds(messages.BusVoltageCurrent, f32, f32),
    st.builds(messages.ClearErrors, u8),
    st.builds(messages.SetAbsolutePosition, f32),
)


@given(nodes, MESSAGES)
def test_what_is_encoded_is_decoded(node: int, message: Any) -> None:
    frame = codec.encode(node, message)
    assert codec.node_of(frame.id) == node
    assert len(frame.data) <= 8
    assert not frame.extended
    assert codec.decode(frame) == message


@given(nodes, MESSAGES, st.binary(max_size=8))
def test_padding_is_ignored(node: int, message: Any, padding: bytes) -> None:
    frame = codec.encode(node, message)
    padded = Frame(frame.id, (frame.data + padding)[:8])
    assert codec.decode(padded) == message


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_any_bytes_are_a_message_or_a_frame_error(identifier: int, data: bytes) -> None:
    frame = Frame(identifier, data)
    try:
        message = codec.decode(frame)
    except FrameError:
        return
    if isinstance(message, messages.Other):
        assert codec.command_of(identifier) == message.command
        return
    again = codec.decode(codec.encode(codec.node_of(identifier), message))
    assert repr(again) == repr(message)  # NaN equals nothing, itself included


@pytest.mark.parametrize(
    ("message", "identifier", "data"),
    [
        (messages.Heartbeat(0x01000000, 1, 0, 0), 0x061, "0000000101000000"),
        (messages.SetAxisState(8), 0x067, "08000000"),
        (messages.SetInputVel(1.0, 0.0), 0x06D, "0000803f00000000"),
        (messages.EncoderEstimates(-2.0, 0.5), 0x069, "000000c00000003f"),
        (messages.Estop(), 0x062, ""),
        (messages.ClearErrors(), 0x078, "00"),
        (messages.SetControllerMode(2, 1), 0x06B, "0200000001000000"),
        (messages.Address(3, 0x123456789ABC), 0x066, "03bc9a78563412"),
    ],
)
def test_known_frames(message: Any, identifier: int, data: str) -> None:
    """Written down by hand from the protocol's table, node 3."""
    frame = codec.encode(3, message)
    assert (frame.id, frame.data.hex()) == (identifier, data)


@pytest.mark.parametrize(
    ("command", "data", "message"),
    [
        (Command.CLEAR_ERRORS, b"", messages.ClearErrors(0)),
        (Command.SET_AXIS_STATE, b"\x08", messages.SetAxisState(8)),
        (Command.SET_AXIS_STATE, b"\x08\0\0\0\0\0\0\0", messages.SetAxisState(8)),
        (Command.SET_INPUT_VEL, struct.pack("<f", 2.0), messages.SetInputVel(2.0, 0.0)),
        (Command.SET_INPUT_POS, struct.pack("<f", 2.0), messages.Other(Command.SET_INPUT_POS)),
        (Command.ENTER_DFU_MODE, b"", messages.Other(Command.ENTER_DFU_MODE)),
        (Command.REBOOT, b"", messages.Reboot(0)),
        (Command.ADDRESS, bytes(7) + b"\x05", messages.Address(0, 0)),
    ],
)
def test_short_and_long_forms_of_the_wild_are_accepted(command: int, data: bytes, message: Any) -> None:
    assert codec.decode(Frame(codec.frame_id(0, command), data)) == message


@pytest.mark.parametrize("command", [Command.HEARTBEAT, Command.ENCODER_ESTIMATES, Command.VERSION])
@pytest.mark.parametrize("size", range(8))
def test_what_a_drive_says_must_be_whole(command: Command, size: int) -> None:
    with pytest.raises(FrameError, match=f"expected 8 bytes, got {size}"):
        codec.decode(Frame(codec.frame_id(0, command), bytes(size)))


@pytest.mark.parametrize("command", [0x08, 0x0A, 0x10, 0x1E])
def test_unknown_commands_are_refused(command: int) -> None:
    with pytest.raises(FrameError, match="unknown"):
        codec.decode(Frame(command, bytes(8)))


def test_errors_in_words() -> None:
    assert messages.describe_errors(0) == ""
    assert messages.describe_errors(AxisError.ESTOP_REQUESTED | AxisError.DRV_FAULT) == "DRV_FAULT, ESTOP_REQUESTED"
    assert messages.describe_errors(1 << 31) == "unknown error 0x80000000"
    assert messages.describe_errors(0x200) == "DC_BUS_UNDER_VOLTAGE"


def test_states_in_words() -> None:
    assert messages.describe_state(AxisState.CLOSED_LOOP_CONTROL) == "CLOSED_LOOP_CONTROL"
    assert messages.describe_state(77) == "state 77"


def test_nan_travels_as_nan() -> None:
    estimate = codec.decode(codec.encode(0, messages.EncoderEstimates(math.nan, 1.0)))
    assert isinstance(estimate, messages.EncoderEstimates)
    assert math.isnan(estimate.position)
