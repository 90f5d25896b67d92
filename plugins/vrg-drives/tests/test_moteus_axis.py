"""One moteus axis whose drive's answers come late, as over an adapter with a queue.

An answer tells how the drive was before the order that came in the same frame.
"""

import math
import random
from collections import deque

import pytest
from msgspec.structs import replace

from vrg.errors import RobotError
from vrg.hal.can.axis import MotorState
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.emulated import DriveOptions
from vrg.hal.simulated_clock import SimulatedClock
from vrg_drives.moteus import codec, drive
from vrg_drives.moteus.axis import MoteusAxis
from vrg_drives.moteus.codec import Console, Resolution, Subframe, SubframeKind
from vrg_drives.moteus.drive import MoteusDrive
from vrg_drives.moteus.registers import Mode, Register

NODE = 4
NOW = 100.0


class LateWire:
    """An axis and its drive. The drive hears at once; its answers wait until they are delivered."""

    def __init__(self) -> None:
        self.drive = MoteusDrive(NODE, DriveOptions(serial=7, watchdog=0.2), NOW, random.Random(7))
        self.answers: deque[Frame] = deque()
        self.axis = MoteusAxis(NODE, self.send, SimulatedClock())

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        self.answers.extend(self.drive.receive(frame, NOW))

    def deliver(self, number: int = 1) -> None:
        """The oldest answers arrive."""
        for _ in range(number):
            self.axis.receive(replace(self.answers.popleft(), at=NOW))

    def deliver_all(self) -> None:
        self.deliver(len(self.answers))


@pytest.fixture
def wire() -> LateWire:
    """An axis whose drive is known, and runs."""
    wire = LateWire()
    wire.axis.identify(0.0)
    wire.deliver_all()
    wire.axis.start()
    wire.axis.command(1.0)
    wire.deliver_all()
    assert wire.axis.state is MotorState.CLOSED_LOOP
    return wire


def test_what_was_said_before_a_stop_does_not_make_it_run_again(wire: LateWire) -> None:
    wire.axis.command(1.0)
    wire.axis.idle()
    wire.deliver_all()
    assert wire.axis.on, "that was so when it was asked"
    assert wire.axis.state is MotorState.IDLE
    wire.axis.poll(NOW + 0.05)
    wire.deliver_all()
    assert wire.axis.on is False
    assert wire.axis.state is MotorState.IDLE


def test_a_start_waits_until_the_stop_before_has_been_answered(wire: LateWire) -> None:
    wire.axis.command(1.0)
    wire.axis.idle()
    wire.axis.start()
    for _ in range(3):
        wire.deliver()
        assert wire.axis.state is MotorState.STARTING, (
            "it said what it did before the stop, and then that it has stopped"
        )
    assert not wire.answers
    wire.axis.command(0.0)
    wire.axis.command(0.0)
    wire.deliver_all()
    assert wire.axis.state is MotorState.CLOSED_LOOP


def test_a_stop_that_was_lost_is_sent_again_by_the_next_start(wire: LateWire) -> None:
    wire.axis.command(1.0)
    drive = wire.drive.node
    wire.drive.node = 99  # whatever is sent now does not reach it
    wire.axis.idle()
    wire.drive.node = drive
    wire.axis.start()
    wire.deliver_all()
    assert wire.axis.state is MotorState.STARTING
    for _ in range(3):
        wire.axis.command(0.0)
        wire.deliver_all()
    assert wire.axis.state is MotorState.CLOSED_LOOP


def test_a_watchdog_of_before_a_stop_proves_nothing(wire: LateWire) -> None:
    wire.drive.step(NOW + 1.0)  # its watchdog stops it
    wire.axis.poll(NOW + 1.0)
    wire.axis.clear()
    wire.axis.start()
    wire.deliver()
    assert not wire.axis.expiry_reported
    assert not wire.axis.watchdog_expired
    wire.deliver_all()
    assert wire.axis.state is MotorState.STARTING


@pytest.mark.parametrize("register", [Register.MODE, Register.FAULT, Register.MILLISECONDS])
def test_a_register_that_is_no_whole_number_is_odd(wire: LateWire, register: Register) -> None:
    told = Subframe(SubframeKind.REPLY, register, Resolution.F32, (math.nan,))
    wire.axis.receive(replace(codec.encode(NODE, 0, [told]), at=NOW))
    assert wire.axis.implausible == f"register 0x{register:03X}: expected a whole number, it says nan"


def told(milliseconds: int, velocity: float = 0.0, mode: int = 10) -> list[Subframe]:
    """What a drive answers some time after it was switched on."""
    return [
        Subframe(SubframeKind.REPLY, Register.MODE, Resolution.INT8, (mode,)),
        Subframe(SubframeKind.REPLY, Register.POSITION, Resolution.F32, (0.0, velocity)),
        Subframe(SubframeKind.REPLY, Register.MILLISECONDS, Resolution.INT32, (milliseconds,)),
    ]


def test_an_answer_that_a_gateway_repeats_or_delays_is_no_restart(wire: LateWire) -> None:
    for after, uptime, velocity in ((0.0, 5000, 1.0), (0.02, 5020, 2.0), (0.03, 5000, 1.0), (0.04, 4900, 0.5)):
        wire.axis.receive(replace(codec.encode(NODE, 0, told(uptime, velocity)), at=NOW + after))
    assert wire.axis.implausible is None
    assert wire.axis.velocity == 2.0, "what is older than what was heard is dropped"
    assert wire.axis.heard == NOW + 0.02


@pytest.mark.parametrize("uptime", [0, 100, 380])
def test_a_drive_that_was_started_again_has_run_for_no_longer_than_it_was_away(wire: LateWire, uptime: int) -> None:
    for after, since in ((0.0, 5000), (0.4, uptime)):
        wire.axis.receive(replace(codec.encode(NODE, 0, told(since)), at=NOW + after))
    assert wire.axis.implausible == "it was started again"


class Consoled:
    """An axis, and its drive whose console has been typed into by others."""

    def __init__(self, typed: bytes) -> None:
        self.drive = MoteusDrive(NODE, DriveOptions(serial=7, watchdog=0.2), NOW, random.Random(7))
        self.drive.receive(codec.console(0, NODE, Console.TYPE, typed), NOW)
        self.axis = MoteusAxis(NODE, self.send, SimulatedClock())
        self.lost = 0

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        if self.lost:
            self.lost -= 1
            return
        for answer in self.drive.receive(frame, NOW):
            self.axis.receive(answer)


@pytest.mark.parametrize("typed", [b"", b"nonsense\n", b"half a l", b"d stop\n", b"d stop\n" * 8])
@pytest.mark.parametrize("lost", range(8))
def test_its_watchdog_brakes_whatever_others_have_typed_and_whatever_gets_lost(typed: bytes, lost: int) -> None:
    wire = Consoled(typed)
    wire.lost = lost
    wire.axis.prepare()
    assert wire.drive._timeout_mode == Mode.BRAKE


def test_a_drive_whose_watchdog_cannot_brake_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    silent = MoteusAxis(NODE, lambda _frame, **_: None, SimulatedClock())
    with pytest.raises(RobotError, match=r"servo.timeout_mode 15`, so that its watchdog brakes, got no answer"):
        silent.prepare()
    monkeypatch.setattr(drive, "_TIMEOUT_MODES", frozenset())
    with pytest.raises(RobotError, match="got ERR unknown command"):
        Consoled(b"").axis.prepare()
