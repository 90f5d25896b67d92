"""The protocol of an emulated Crazyflie: bytes that cflib makes and reads, and bytes that nobody should send."""

import math
import struct
from collections.abc import Iterator
from typing import Any

import pytest
from cflib.crazyflie.commander import Commander
from cflib.crazyflie.high_level_commander import HighLevelCommander
from cflib.crazyflie.log import LogTocElement
from cflib.crazyflie.param import ParamTocElement
from cflib.crtp.crtpstack import CRTPPacket
from hypothesis import given
from hypothesis import strategies as st

from vrg_crazyflie.emulated.firmware import BLOCK_BYTES, LOGGED, SETTINGS, Firmware
from vrg_crazyflie.emulated.vehicle import Vehicle
from vrg_crazyflie.emulated.wire import (
    GENERIC,
    LINK,
    LOG,
    LOG_FORMATS,
    MEM,
    MOST,
    OFF,
    PARAM,
    PARAM_FORMATS,
    PLATFORM,
    SUPERVISOR,
    Contents,
    Mode,
    packed,
    setpoint_of,
)

numbers = st.floats(-100.0, 100.0, width=32)


class Sent:
    """What stands for cflib's Crazyflie: it keeps the packets that are sent."""

    def __init__(self) -> None:
        self.packets: list[CRTPPacket] = []
        self.platform = self

    def send_packet(self, packet: CRTPPacket) -> None:
        self.packets.append(packet)

    def get_protocol_version(self) -> int:
        return 12

    @property
    def data(self) -> bytes:
        return bytes(self.packets[-1].data)


@pytest.fixture
def firmware() -> Firmware:
    """One that has just started, and is ready to fly."""
    made = Firmware(Vehicle())
    for _ in range(20):
        made.vehicle.step()
    return made


@given(numbers, numbers, numbers, numbers)
def test_set_points_are_what_cflib_means(x: float, y: float, z: float, yaw: float) -> None:
    sent = Sent()
    commander = Commander(sent)
    for send, mode in (
        (lambda: commander.send_hover_setpoint(x, y, yaw, z), Mode.HOVER),
        (lambda: commander.send_velocity_world_setpoint(x, y, z, yaw), Mode.VELOCITY),
        (lambda: commander.send_zdistance_setpoint(x, y, yaw, z), Mode.LEVEL),
        (lambda: commander.send_position_setpoint(x, y, z, yaw), Mode.POSITION),
    ):
        send()
        assert (sent.packets[-1].port, sent.packets[-1].channel) == (GENERIC, 0)
        told = setpoint_of(sent.data)
        assert told is not None
        assert (told.mode, told.x, told.y, told.z) == (mode, x, y, z)
        assert told.yaw == pytest.approx(math.radians(yaw))
    commander.send_stop_setpoint()
    assert setpoint_of(sent.data) == OFF


@given(st.binary(max_size=MOST))
def test_no_bytes_are_a_set_point_by_accident(data: bytes) -> None:
    told = setpoint_of(data)
    if told is not None and told != OFF:
        assert len(data) == 17
        assert all(map(math.isfinite, (told.x, told.y, told.z, told.yaw)))


@given(st.integers(0, 15), st.integers(0, 3), st.binary(max_size=MOST))
def test_no_packet_breaks_the_firmware_and_no_answer_is_too_long(port: int, channel: int, data: bytes) -> None:
    firmware = Firmware(Vehicle())
    for _ in range(2):
        for answered, on, answer in firmware.receive((port, channel, data)):
            assert (answered, on) == (port, channel)
            assert len(answer) <= MOST
        firmware.vehicle.step()
        assert all(len(values) <= MOST for _, _, values in firmware.due())


WHOLE = sorted({*LOG_FORMATS.values(), *PARAM_FORMATS.values()} - {"<e", "<f"})


@given(st.sampled_from(WHOLE), st.integers(-(2**40), 2**40))
def test_whole_numbers_keep_their_lowest_bits(form: str, value: int) -> None:
    data = packed(form, value)
    assert len(data) == struct.calcsize(form)
    assert (struct.unpack(form, data)[0] - value) % 2 ** (8 * len(data)) == 0


@given(st.floats(width=32))
def test_other_numbers_are_what_they_were(value: float) -> None:
    back = struct.unpack("<f", packed("<f", value))[0]
    assert back == value or (math.isnan(back) and math.isnan(value))
    assert packed("<B", math.nan) == b"\0"


def items(contents: Contents) -> Iterator[bytes]:
    for number in range(len(contents.entries)):
        answer = contents.answer(struct.pack("<BH", Contents.ITEM, number))
        assert answer is not None
        assert answer[:3] == struct.pack("<BH", Contents.ITEM, number)
        yield answer[3:]


def test_cflib_reads_the_tables_of_contents(firmware: Firmware) -> None:
    logged = [LogTocElement(n, bytearray(data)) for n, data in enumerate(items(firmware.log_contents))]
    assert [f"{one.group}.{one.name}" for one in logged] == [*LOGGED]
    settings = [ParamTocElement(n, bytearray(data)) for n, data in enumerate(items(firmware.param_contents))]
    assert [f"{one.group}.{one.name}" for one in settings] == [*SETTINGS]
    by_name = {f"{one.group}.{one.name}": one for one in settings}
    assert by_name["deck.bcFlow2"].access == ParamTocElement.RO_ACCESS
    assert by_name["pm.lowVoltage"].pytype == "<f"


def test_a_checksum_tells_tables_of_contents_apart() -> None:
    one, other, longer = Contents({"a.b": 7}), Contents({"a.b": 1}), Contents({"a.b": 7, "a.c": 7})
    assert len({one.crc, other.crc, longer.crc}) == 3
    assert one.answer(b"\3") == struct.pack("<BHI", 3, 1, one.crc)
    assert one.answer(struct.pack("<BH", 2, 9)) == b"\2", "there is no such entry"


def ask(firmware: Firmware, port: int, channel: int, *data: Any) -> bytes:
    answers = firmware.receive((port, channel, bytes(data)))
    return answers[0][2] if answers else b""


def test_versions_echo_and_memories(firmware: Firmware) -> None:
    assert ask(firmware, LINK, 1, 0)[:18] == b"Bitcraze Crazyflie"
    assert ask(firmware, LINK, 0, 1, 2, 3) == bytes((1, 2, 3))
    assert ask(firmware, PLATFORM, 1, 0) == struct.pack("<Bi", 0, 12)
    assert ask(firmware, PLATFORM, 1, 1) == b"\x012026.08"
    assert ask(firmware, MEM, 0, 1) == bytes((1, 0))


def test_log_blocks_are_created_started_stopped_and_deleted(firmware: Firmware) -> None:
    volts, *_ = (n for n, (name, _) in enumerate(firmware.log_contents.entries) if name == "pm.vbat")
    assert ask(firmware, LOG, 1, 6, 1, 7, volts, 0) == bytes((6, 1, 0))
    assert ask(firmware, LOG, 1, 6, 1, 7, volts, 0)[2] == 17, "it exists already"
    assert ask(firmware, LOG, 1, 7, 2, 7, volts, 0)[2] == 2, "there is no such block"
    assert ask(firmware, LOG, 1, 6, 3, 7, 99, 0)[2] == 2, "there is no such variable"
    assert ask(firmware, LOG, 1, 6, 4, *(7, volts, 0) * (BLOCK_BYTES // 4 + 1))[2] == 7, "it is too large"
    assert ask(firmware, LOG, 1, 3, 1, 2) == bytes((3, 1, 0))
    found = []
    for _ in range(10):
        firmware.vehicle.step()
        found += firmware.due()
    assert len(found) == 5, "each 20 ms"
    port, channel, data = found[-1]
    assert (port, channel, data[0]) == (LOG, 2, 1)
    assert int.from_bytes(data[1:4], "little") == round(firmware.vehicle.now * 1000)
    assert struct.unpack("<f", data[4:])[0] == pytest.approx(firmware.vehicle.volts, abs=1e-4)
    assert ask(firmware, LOG, 1, 4, 1)[2] == 0
    for _ in range(5):
        firmware.vehicle.step()
        assert firmware.due() == []
    assert ask(firmware, LOG, 1, 2, 1)[2] == 0
    assert ask(firmware, LOG, 1, 4, 1)[2] == 2
    assert ask(firmware, LOG, 1, 5, 0)[2] == 0


def test_parameters_are_read_and_written_but_not_those_that_are_read_only(firmware: Firmware) -> None:
    number = {name: n for n, (name, _) in enumerate(firmware.param_contents.entries)}
    low, deck, stop = number["pm.lowVoltage"], number["deck.bcFlow2"], number["stabilizer.stop"]
    assert ask(firmware, PARAM, 2, low, 0, *struct.pack("<f", 3.5)) == struct.pack("<Hf", low, 3.5)
    assert ask(firmware, PARAM, 1, low, 0) == struct.pack("<HBf", low, 0, 3.5)
    assert firmware.vehicle.low_voltage == 3.5
    assert ask(firmware, PARAM, 2, deck, 0, 0) == b""
    assert ask(firmware, PARAM, 1, deck, 0) == struct.pack("<HBB", deck, 0, 1)
    assert ask(firmware, PARAM, 1, 99, 0) == struct.pack("<HB", 99, 2)
    ask(firmware, PARAM, 2, stop, 0, 1)
    assert firmware.vehicle.supervisor.emergency


def test_the_supervisor_answers_one_bit_and_all(firmware: Firmware) -> None:
    info = firmware.vehicle.info
    assert ask(firmware, SUPERVISOR, 0, 0x0C) == struct.pack("<BH", 0x8C, info)
    for bit in range(11):
        assert ask(firmware, SUPERVISOR, 0, bit + 1) == bytes((0x80 | bit + 1, info >> bit & 1))
    assert ask(firmware, SUPERVISOR, 1, 1, 0) == bytes((0x81, 1, 0)), "it is disarmed"
    assert ask(firmware, SUPERVISOR, 1, 3) == b""
    assert firmware.vehicle.supervisor.emergency


def test_the_high_level_commander_obeys_cflib(firmware: Firmware) -> None:
    sent = Sent()
    commander = HighLevelCommander(sent)

    def done() -> int:
        packet = sent.packets[-1]
        return firmware.receive((packet.port, packet.channel, bytes(packet.data)))[0][2][3]

    def wait(seconds: float) -> tuple[float, float, float]:
        for _ in range(round(seconds * 100)):
            firmware.vehicle.step()
        return firmware.vehicle.estimate

    commander.takeoff(0.5, 1.0)
    assert done() == 0
    assert wait(4.0)[2] == pytest.approx(0.5, abs=0.01)
    commander.go_to(0.5, 0.25, 0.0, 0.0, 2.0, relative=True)
    assert done() == 0
    assert wait(5.0) == pytest.approx((0.5, 0.25, 0.5), abs=0.01)
    commander.go_to(0.0, 0.0, 0.5, 1.0, 2.0)
    assert done() == 0
    assert wait(5.0) == pytest.approx((0.0, 0.0, 0.5), abs=0.01)
    assert firmware.vehicle.yaw == pytest.approx(1.0, abs=0.01)
    commander.land(0.0, 2.0)
    assert done() == 0
    commander.land(0.0, 2.0)
    assert done() != 0, "it lands already"
    assert wait(4.0)[2] == 0.0
    assert firmware.vehicle.thrust == 0.0
    sent.packets[-1].data = b"\x63\0\0"
    assert done() == 8, "an unknown command"
