"""The makers' own library as the master of an emulated drive, in memory."""

import math
import random
from types import SimpleNamespace

import moteus
import pytest

from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.emulated import DriveOptions
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, encode_fault
from vrg_drives.moteus import codec
from vrg_drives.moteus.drive import MoteusDrive
from vrg_drives.moteus.registers import Mode

NODE = 5


class Master:
    """Sends the library's commands to a drive, and lets it read the answers."""

    def __init__(self) -> None:
        self.now = 10.0
        self.drive = MoteusDrive(NODE, DriveOptions(serial=0xABC), self.now, random.Random(1))
        self.controller = moteus.Controller(NODE)

    def send(self, command: moteus.Command) -> dict[int, float]:
        """What the drive answers, by register, as the library reads it."""
        identifier = codec.frame_id(command.source, command.destination, reply=command.reply_required)
        frame = Frame(identifier, bytes(command.data), extended=identifier > 0x7FF, fd=True)
        answers = self.drive.receive(frame, self.now)
        if not command.reply_required:
            assert answers == []
            return {}
        (answer,) = answers
        message = SimpleNamespace(arbitration_id=answer.id, data=answer.data)
        values: dict[int, float] = command.parse(message).values
        return values

    def run(self, seconds: float, velocity: float) -> dict[int, float]:
        """Drive at a velocity for a while; the last answer."""
        told: dict[int, float] = {}
        for _ in range(round(seconds / 0.02)):
            told = self.send(
                self.controller.make_position(position=math.nan, velocity=velocity, watchdog_timeout=0.2, query=True)
            )
            self.now += 0.02
            self.drive.step(self.now)
        return told


@pytest.fixture
def master() -> Master:
    return Master()


def test_it_reads_what_the_drive_says(master: Master) -> None:
    told = master.send(master.controller.make_query())
    assert told[moteus.Register.MODE] == Mode.STOPPED
    assert told[moteus.Register.POSITION] == pytest.approx(0.0)
    assert told[moteus.Register.VOLTAGE] == pytest.approx(24.0)
    assert told[moteus.Register.FAULT] == 0


def test_it_drives_both_ways_and_stops(master: Master) -> None:
    assert master.run(1.0, 6.0)[moteus.Register.VELOCITY] == pytest.approx(6.0, rel=0.1)
    assert master.run(1.0, -3.0)[moteus.Register.VELOCITY] == pytest.approx(-3.0, rel=0.1)
    told = master.send(master.controller.make_stop(query=True))
    assert told[moteus.Register.MODE] == Mode.POSITION, "what is asked with an order is told as it was before it"
    told = master.send(master.controller.make_query())
    assert told[moteus.Register.MODE] == Mode.STOPPED
    assert master.drive.motor.velocity == pytest.approx(-3.0, rel=0.1)
    master.now += 1.0
    master.drive.step(master.now)
    assert abs(master.drive.motor.velocity) < 0.01


def test_its_watchdog_holds_the_motor_until_it_is_stopped(master: Master) -> None:
    master.run(1.0, 6.0)
    master.now += 1.0
    told = master.send(master.controller.make_query())
    assert told[moteus.Register.MODE] == Mode.TIMEOUT
    assert told[moteus.Register.VELOCITY] == pytest.approx(0.0, abs=0.1)
    assert master.run(0.1, 6.0)[moteus.Register.MODE] == Mode.TIMEOUT
    master.send(master.controller.make_stop())
    assert master.run(0.5, 6.0)[moteus.Register.MODE] == Mode.POSITION


def test_it_goes_to_a_position(master: Master) -> None:
    for _ in range(200):
        master.send(master.controller.make_position(position=2.0, velocity=0.0, query=False))
        master.now += 0.02
        master.drive.step(master.now)
    assert master.drive.motor.position == pytest.approx(2.0, abs=0.05)


def test_a_fault_is_read_and_ended_by_a_stop(master: Master) -> None:
    master.run(0.5, 6.0)
    master.drive.receive(encode_fault(NODE, FaultRequest(FaultKind.ERROR, value=38)), master.now)
    told = master.send(master.controller.make_query())
    assert (told[moteus.Register.MODE], told[moteus.Register.FAULT]) == (Mode.FAULT, 38)
    assert master.run(0.2, 6.0)[moteus.Register.MODE] == Mode.FAULT
    master.send(master.controller.make_stop())
    assert master.send(master.controller.make_query())[moteus.Register.FAULT] == 0


class TestConsole:
    """The diagnostic channel, which `moteus_tool` types into."""

    def console(self, master: Master, text: bytes) -> bytes:
        """What the drive prints after this was typed."""
        for part in (text[:4], text[4:]):
            assert master.send(master.controller.make_diagnostic_write(part)) == {}
        command = master.controller.make_diagnostic_read()
        frame = Frame(codec.frame_id(0, NODE, reply=True), bytes(command.data), extended=True, fd=True)
        (answer,) = master.drive.receive(frame, master.now)
        told: bytes = command.parse(SimpleNamespace(arbitration_id=answer.id, data=answer.data)).data
        return told

    def test_its_stop_stops(self, master: Master) -> None:
        master.run(1.0, 6.0)
        assert self.console(master, b"d stop\n") == b"OK\r\n"
        assert master.send(master.controller.make_query())[moteus.Register.MODE] == Mode.STOPPED
        master.now += 0.3
        master.drive.step(master.now)
        assert abs(master.drive.motor.velocity) < 0.1
        assert self.console(master, b"") == b"", "what was told is not told again"

    @pytest.mark.parametrize(("mode", "longest"), [(12, 1.0), (15, 0.35)])
    def test_it_says_what_the_drive_does_on_a_time_out(self, master: Master, mode: int, longest: float) -> None:
        assert self.console(master, b"conf set servo.timeout_mode %d\n" % mode) == b"OK\r\n"
        master.run(2.0, 50.0)
        began = master.now
        while abs(master.drive.motor.velocity) > 0.5:
            master.now += 0.01
            master.drive.step(master.now)
            assert master.now - began < longest
        assert (master.now - began > 0.35) == (mode == 12), "the current of its drive is limited"
        assert master.send(master.controller.make_query())[moteus.Register.MODE] == Mode.TIMEOUT

    @pytest.mark.parametrize("text", [b"conf set servo.timeout_mode 3\n", b"conf set id.id 7\n", b"nonsense\n"])
    def test_it_refuses_what_it_does_not_know(self, master: Master, text: bytes) -> None:
        assert self.console(master, text).startswith(b"ERR")
