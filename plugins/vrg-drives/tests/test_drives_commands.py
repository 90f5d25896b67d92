"""`vrg can` with drives that speak CiA 402, moteus or VESC, on a bus within this process."""

import os
import struct

import pytest
from test_can_commands import LINK, run

from vrg.commands.options import make_console
from vrg.errors import ConfigError, RobotError
from vrg.hal.can.axis import AxisReport
from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive.messages import Command
from vrg.hal.can.workshop.emulated import Cycle, EmulatedDrive
from vrg.hal.can.workshop.simulation import Simulation
from vrg.hal.can.workshop.survey import Survey, all_listeners
from vrg.hal.simulated_clock import SimulatedClock
from vrg.testing.can.bench import PATIENCE, CanBench, Drives
from vrg.testing.driver import arm
from vrg.types import Twist
from vrg_drives.bringup.listened_bus import BusState
from vrg_drives.bringup.listening_command import listening, table_of
from vrg_drives.cia402.codec import Function, NmtCommand, nmt
from vrg_drives.vesc import codec
from vrg_drives.vesc.codec import Packet

pytestmark = pytest.mark.usefixtures("simulated")

MUTE = 9
UPLOAD = 2
"""The command of an SDO that asks for a value, in the upper three bits of its first byte (CiA 301)."""


def test_all_who_say_that_their_motors_are_off_are_named() -> None:
    with Drives("odrive", [3], link=LINK), Drives("vesc", [4], link=LINK):
        done = run("stop")
    assert done.exit_code == 0, done.output
    assert "off by their own reports: odrive 3, vesc 4." in " ".join(done.output.split())


class OtherMaster:
    """Drives a CiA 402 drive of its own that has no heartbeat, and goes on without a master."""

    def __init__(self, lab: Simulation, drive: EmulatedDrive) -> None:
        self.lab, self.drive, self.wire = lab, drive, lab.wire(LINK)
        for key, value in {(0x1017, 0): 0, (0x6007, 0): 0, (0x6060, 0): 3, (0x60FF, 0): 300_000}.items():
            drive.objects.set_data(
                *key, struct.pack(f"<{'hhbi'[[0x1017, 0x6007, 0x6060, 0x60FF].index(key[0])]}", value)
            )  # type: ignore[attr-defined]
        self.wire.put(nmt(0, NmtCommand.START))
        for word in (6, 7, 15):
            lab.clock.sleep(0.05)
            self.wire.put(Frame(Function.RPDO1 | drive.node, struct.pack("<H", word)))
        lab.clock.sleep(1.0)


@pytest.mark.parametrize("node", [7, 100])
def test_a_drive_without_a_heartbeat_is_found_and_stopped(lab: Simulation, node: int) -> None:
    with Drives("odrive", [3], link=LINK), Drives("cia402", [node], watchdog=0.0, link=LINK) as drives:
        OtherMaster(lab, drives.drives[0])
        assert drives.drives[0].motor.velocity == pytest.approx(30.0, rel=0.1)
        assert f"cia402 {node} " in " ".join(run("scan").output.split())
        done = run("stop")
        assert abs(drives.drives[0].motor.velocity) < 0.1
    assert done.exit_code == 0, done.output
    assert f"off by their own reports: cia402 {node}, odrive 3." in " ".join(done.output.split())


@pytest.mark.parametrize("protocol", ["odrive", "cia402", "moteus", "vesc"])
def test_what_a_drive_does_not_confirm_is_not_claimed(protocol: str) -> None:
    with Drives(protocol, [5, 6], watchdog=PATIENCE, link=LINK) as drives:
        with CanBench(protocol, [5], [6], link=LINK, watchdog="unsafe") as bench:
            bench.driver.connect()
            arm(bench)
            for _ in range(10):
                bench.driver.drive(Twist(0.33, 0.0))
                bench.advance(0.1)
            bench.port.stop()
        deaf = drives.drives[0]
        deaf.receive = lambda _frame, now: (deaf._advance(now), [])[1]  # type: ignore[method-assign]
        done = run("stop")
        assert abs(drives.drives[1].motor.velocity) < 0.5
    assert f"off by their own reports: {protocol} 6." in " ".join(done.output.split()), done.output
    assert done.exit_code == (0 if protocol == "moteus" else 1), "a moteus says nothing of its own"


def test_what_looks_like_a_drive_for_once_is_none_and_is_written_nothing(lab: Simulation) -> None:
    """A CANopen master polls node 7, which looks like ODrives 44 and 48; and an ODrive 16 would hear 0x207."""
    heard: list[Frame] = []
    port = lab.bus(LINK, heard.append)
    port.start()
    wire = lab.wire(LINK)

    def poll(number: int) -> None:
        for frame in (
            Frame(0x77F, b"\x05"), Frame(0x601, struct.pack("<BHB4x", 0x40, 0x6041 + number % 3, 0)),
            Frame(0x581, struct.pack("<BHBI", 0x4B, 0x6041 + number % 3, 0, 1)),
            Frame(0x201, bytes([number % 5, 0, 0, 0, number % 9, 0, 0, 0])),
            Frame(0x501, bytes([0, 0, 4, 0, number % 9, 0, 0, 0])),
        ):  # fmt: skip
            wire.put(frame)
        lab.clock.at(lab.clock.now() + 0.05, lambda: poll(number + 1))

    with Drives("cia402", [7], link=LINK):
        poll(0)
        shown = run("scan").output
        done = run("stop")
    assert "odrive" not in shown + done.output
    assert "cia402 7 " in " ".join(shown.split())
    assert not [f for f in heard if len(f.data) == 4 and f.id in {n << 5 | 7 for n in range(63)}], (
        "0x207 is RPDO1 of node 7"
    )


@pytest.mark.parametrize("heartbeat", [0.1, 0.25, 0.5, 1.0, 0.0])
def test_an_odrive_is_written_nothing_that_is_meant_for_canopen(lab: Simulation, heartbeat: float) -> None:
    """Of ODrive 48, 0x607 is the state of its axis, and 0x619 its position."""
    heard: list[Frame] = []
    port = lab.bus(LINK, heard.append)
    port.start()
    with Drives("odrive", [48], link=LINK) as drives:
        drives.drives[0]._own[Command.HEARTBEAT] = Cycle(heartbeat, lab.clock.now())  # type: ignore[attr-defined]
        lab.clock.sleep(0.05)
        assert run("scan").exit_code == 0
        assert run("stop").exit_code == 0
    sdo = [f for f in heard if f.id & ~0x7F == Function.SDO_REQUEST and len(f.data) == 8 and f.data[0] in (0x40, 0x2B)]
    assert {f.id >> 5 for f in sdo} == {49, 50, 51}, "CANopen's ids from 32 on"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--id", "5", "0x9999"), "it has no object 0x9999"),
        (("--id", "5", "0x1018:04=3"), "it refuses 0x1018:04"),
        (("--id", "5", "0x6084=-0x80000001"), "expected a number of 4 bytes"),
        (("--id", "5", "much"), "expected an object such as 0x6083"),
        (("--id", "7", "anything"), "moteus drives are configured with their maker's own tool"),
    ],
)
def test_what_cannot_be_is_said(arguments: tuple[str, ...], words: str) -> None:
    with Drives("odrive", [3], link=LINK), Drives("cia402", [5], link=LINK), Drives("moteus", [7], link=LINK):
        done = run("configure", *arguments)
    assert done.exit_code != 0
    assert isinstance(done.exception, ConfigError | RobotError)
    assert words in str(done.exception)


def looks(lab: Simulation, seconds: float) -> tuple[BusState, int]:
    """Look again and again; what was heard at last, and how many looks that were."""
    count = 0
    with listening(LINK) as bus:
        end = lab.clock.now() + seconds
        while lab.clock.now() < end:
            heard = bus.look(ask=True)
            count += 1
            lab.clock.sleep(0.1)
    return heard, count


def node(heard: BusState, number: int) -> AxisReport:
    """The node of this id."""
    (found,) = (found for found in heard.nodes if found.node == number)
    return found


def test_a_motor_that_hardly_turns_is_told() -> None:
    with Drives("vesc", [4], watchdog=PATIENCE, link=LINK):
        done = run("jog", "--protocol", "vesc", "--option", "pole_pairs=7", "--unsafe", "--id", "4", "--for", "0.6")
    assert isinstance(done.exception, RobotError), done.output
    assert "asked for 1 turn/s for 0.6 s and has hardly turned" in str(done.exception)


def test_a_fault_is_asked_for_and_answered() -> None:
    with Drives("moteus", [5], link=LINK):
        assert run("fault", "block", "--id", "5").output == "node 5: block (its wheel is blocked)\n"
        refused = run("fault", "estop", "--id", "5")
        silent = run("fault", "silence", "--id", "6")
    assert refused.exit_code == silent.exit_code == 1
    assert "node 5: a drive of its protocol cannot have this fault" in refused.output
    assert "node 6: not emulated on virtual:control" in silent.output


def test_an_object_of_a_canopen_drive_is_asked_and_changed() -> None:
    with Drives("cia402", [5], link=LINK) as drives:
        done = run("configure", "--id", "5", "0x6084=20000", "0x1018:04", "--save")
        assert done.exit_code == 0, done.output
        assert "0x6084: 2000000 -> 20000" in done.output
        assert "0x1018:04: 4096" in done.output
        assert drives.drives[0]._stored[0x6084, 0] == 20000  # type: ignore[attr-defined]
        texts = "0x1008: VRG emulated drive\n0x100A: 1.0.0\n0x1017: 100\n"
        assert texts in run("configure", "--id", "5", "0x1008", "0x100A", "0x1017").output


def mute_node(lab: Simulation) -> list[Frame]:
    """A CANopen node that sends heartbeats and answers nothing: the questions that it is asked."""
    asked: list[Frame] = []

    def hear(frame: Frame) -> None:
        if frame.id == Function.SDO_REQUEST | MUTE and frame.data[0] >> 5 == UPLOAD:
            asked.append(frame)

    def beat() -> None:
        bus.send(Frame(Function.HEARTBEAT | MUTE, b"\x05"))
        lab.clock.at(lab.clock.now() + 0.1, beat)

    bus = lab.bus(LINK, hear)
    bus.start()
    beat()
    return asked


def test_two_drives_with_one_id_show_both_serial_numbers(lab: Simulation) -> None:
    with Drives("cia402", [5], link=LINK, serial=0xA), Drives("cia402", [5], link=LINK, serial=0xB):
        heard, _ = looks(lab, 1.5)
    assert node(heard, 5).serials == {"A", "B"}


def test_a_node_that_answers_nothing_holds_up_nobody(lab: Simulation) -> None:
    asked = mute_node(lab)
    with Drives("cia402", [5], link=LINK, serial=0xABC), Drives("odrive", [20], link=LINK):
        heard, count = looks(lab, 2.0)
    assert node(heard, MUTE).words == "operational"
    assert not node(heard, MUTE).serials
    assert node(heard, 5).serials == {"ABC"}
    assert not heard.troubles
    assert 0 < len(asked) <= count + 2, (
        "all ids are asked twice; besides, a look waits for one answer that does not come, not for all"
    )


def test_a_drive_that_has_only_answered_a_greeting_is_silent_and_its_values_are_unknown(
    capsys: pytest.CaptureFixture[str],
) -> None:
    survey = Survey(all_listeners(lambda _: None, SimulatedClock()))  # type: ignore[arg-type]
    host = codec.own_id(os.getpid())
    survey.hear(Frame(codec.frame_id(Packet.PONG, host), b"\x07\x00", extended=True, at=5.0))
    make_console().print(table_of(BusState(survey.nodes, [], 6.0)))
    row, *problems = capsys.readouterr().out.splitlines()[1:]
    assert row.split() == ["vesc", "7", "?", "?", "silent", "?", "?", "?"]
    assert problems == ["vesc 7: no heartbeat yet"]
