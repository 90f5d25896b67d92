"""The frames of moteus: ours against those of its maker's library, and against themselves."""

import math
from contextlib import suppress

import moteus
import moteus.multiplex as mp
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.can.frame import Frame, FrameError
from vrg_drives.moteus import codec
from vrg_drives.moteus.axis import setpoint
from vrg_drives.moteus.codec import Resolution, Subframe, SubframeKind
from vrg_drives.moteus.registers import Mode, Register, describe_fault, scale_of

resolutions = st.sampled_from(Resolution)


@st.composite
def subframes(draw: st.DrawFn) -> Subframe:
    kind, resolution = draw(st.sampled_from(SubframeKind)), draw(resolutions)
    count = draw(st.integers(1, 5))
    value = st.floats(width=32, allow_nan=False) if resolution is Resolution.F32 else st.integers(-128, 127).map(float)
    values = [0.0] * count if kind is SubframeKind.READ else draw(st.lists(value, min_size=count, max_size=count))
    return Subframe(kind, draw(st.integers(0, 0x7FFF)), resolution, tuple(values))


@given(st.lists(subframes(), max_size=2), st.integers(0, 0x7F), st.integers(1, 0x7F), st.booleans())
def test_what_is_encoded_comes_back(parts: list[Subframe], source: int, destination: int, reply: bool) -> None:
    frame = codec.encode(source, destination, parts, reply=reply)
    assert codec.decode(frame) == parts
    assert codec.address_of(frame.id) == (source, destination, reply)
    assert frame.fd
    assert frame.extended == (frame.id > 0x7FF)


@given(st.binary(max_size=64))
def test_no_bytes_are_too_strange(data: bytes) -> None:
    with suppress(FrameError):
        assert len(codec.decode(Frame(0x100, data, fd=True))) <= len(data)


@given(st.floats(-1000, 1000), st.sampled_from([r for r in Register if r != Register.MODE]), resolutions)
def test_a_value_comes_back_to_the_nearest_step(value: float, register: Register, resolution: Resolution) -> None:
    scale = scale_of(register)
    back = scale.value(scale.raw(value, resolution), resolution)
    if resolution is Resolution.F32:
        assert back == value
    else:
        most = (2 ** (8 << resolution) / 2 - 1) * scale[resolution]
        expected = max(-most, min(most, value))
        assert back == pytest.approx(expected, abs=scale[resolution] / 2 * 1.0001)


@given(resolutions)
def test_the_least_integer_is_not_a_number(resolution: Resolution) -> None:
    scale = scale_of(Register.POSITION)
    assert math.isnan(scale.value(scale.raw(math.nan, resolution), resolution))


def test_the_makers_library_reads_our_setpoint() -> None:
    frame = codec.encode(0, 5, setpoint(-3.25, 0.2), reply=True)
    assert frame.id == 0x8005
    told = {}
    for subframe in mp.parse_frame(frame.data):
        told[subframe.register] = moteus.scale_register(subframe.register, subframe.resolution, subframe.value)
    assert told.pop(Register.COMMAND_TIMEOUT) == pytest.approx(0.2)
    assert math.isnan(told.pop(Register.COMMAND_POSITION))
    assert told == {Register.MODE: Mode.POSITION, Register.COMMAND_VELOCITY: -3.25}


@pytest.mark.parametrize("code", range(32, 51))
def test_every_fault_has_words(code: int) -> None:
    assert describe_fault(code) not in ("", f"fault {code}")
