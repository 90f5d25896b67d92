"""The frames of a VESC: against its documentation, an independent checksum, and themselves."""

from contextlib import suppress

import pytest
from crccheck.crc import CrcXmodem
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.can.frame import Frame, FrameError
from vrg_drives.vesc import codec
from vrg_drives.vesc.codec import Assembler, Firmware, Packet, Status, Status5, describe_fault

i32 = st.integers(-(2**31), 2**31 - 1)


def test_the_example_of_the_documentation() -> None:
    """51 A for the drive of id 23."""
    frame = codec.setpoint(Packet.SET_CURRENT, 23, 51_000)
    assert (frame.id, frame.data.hex(), frame.extended) == (0x0117, "0000c738", True)
    assert codec.value_of(frame) == 51_000


@given(i32, st.integers(-3000, 3000), st.integers(-1000, 1000))
def test_a_status_comes_back(erpm: int, current: int, duty: int) -> None:
    status = Status(erpm, current / 10, duty / 1000)
    assert codec.decode_status(codec.status_frame(7, status).data) == status


@given(i32, st.integers(0, 3000))
def test_a_status_5_comes_back(tachometer: int, voltage: int) -> None:
    status = Status5(tachometer, voltage / 10)
    assert codec.decode_status_5(codec.status_5_frame(7, status).data) == status


@given(st.binary(min_size=1, max_size=512), st.integers(0, 253))
def test_a_payload_comes_back_in_one_piece(payload: bytes, sender: int) -> None:
    frames = codec.payload_frames(codec.HOSTS[0], sender, payload)
    assert all(frame.extended and len(frame.data) <= 8 for frame in frames)
    assembler = Assembler()
    *before, last = [assembler.take(frame) for frame in frames]
    assert before == [None] * len(before)
    assert last == (sender, payload)
    if len(payload) > 6:
        assert int.from_bytes(frames[-1].data[4:6], "big") == CrcXmodem.calc(payload)


@given(st.binary(min_size=7, max_size=60), st.data())
def test_a_payload_that_was_damaged_is_noticed(payload: bytes, data: st.DataObject) -> None:
    frames = codec.payload_frames(codec.HOSTS[0], 3, payload)
    at = data.draw(st.integers(0, len(frames) - 2))
    byte = data.draw(st.integers(1, len(frames[at].data) - 1))
    hurt = bytearray(frames[at].data)
    hurt[byte] ^= 1 << data.draw(st.integers(0, 7))
    frames[at] = Frame(frames[at].id, bytes(hurt), extended=True)
    assembler = Assembler()
    for frame in frames[:-1]:
        assembler.take(frame)
    with pytest.raises(FrameError, match="checksum"):
        assembler.take(frames[-1])


@given(st.lists(st.tuples(st.sampled_from([5, 6, 7, 8]), st.binary(max_size=8)), max_size=20))
def test_no_pieces_are_too_strange(pieces: list[tuple[int, bytes]]) -> None:
    assembler = Assembler()
    for packet, data in pieces:
        with suppress(FrameError):
            taken = assembler.take(Frame(codec.frame_id(packet, codec.HOSTS[0]), data, extended=True))
            assert taken is None or len(taken[1]) <= 512


@given(st.integers(0, 255), st.integers(0, 255), st.integers(1, 2**96 - 1))
def test_a_firmware_comes_back(major: int, minor: int, serial: int) -> None:
    firmware = Firmware(major, minor, "HW 60", f"{serial:X}")
    assert codec.decode_firmware(codec.firmware_payload(firmware)) == firmware


@given(st.sampled_from([codec.FAULT_BIT, codec.FLAGS_BIT]), st.integers(0, 255))
def test_a_value_comes_back_in_one_frame(bits: int, value: int) -> None:
    (frame,) = codec.payload_frames(codec.HOSTS[0], 3, codec.values_payload(bits, value))
    taken = Assembler().take(frame)
    assert taken is not None
    assert codec.decode_values(taken[1]) == (bits, value)


def test_a_firmware_that_has_no_such_value_tells_none() -> None:
    assert codec.decode_values(codec.values_payload(codec.FLAGS_BIT, 0)[:5]) == (codec.FLAGS_BIT, None)


def test_every_fault_has_words() -> None:
    assert describe_fault(0) == ""
    assert describe_fault(3) == "DRV"
    assert describe_fault(200) == "fault 200"
    assert all(describe_fault(code) for code in range(1, 256))
