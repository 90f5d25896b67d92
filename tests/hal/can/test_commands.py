"""`vrg can` and what its commands look at, on a bus within this process."""

import json
import os
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from typer.testing import CliRunner

from tests.hal.can.bench import PATIENCE, CanBench, Drives
from tests.tiny import TINY_CAN
from vrg.commands.can import control as can_control
from vrg.commands.can.group import app
from vrg.commands.can.listening import listening, table_of
from vrg.commands.options import make_console
from vrg.errors import ConfigError, RobotError
from vrg.hal.can.axis import AxisReport
from vrg.hal.can.calibration import AxisCalibration, Calibration, calibration_text, load_calibration
from vrg.hal.can.cia402.codec import Function
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.odrive.messages import AxisState
from vrg.hal.can.train import DriveTrain
from vrg.hal.can.vesc import codec
from vrg.hal.can.vesc.codec import Packet
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.workshop.odrive.listener import Endpoint, read_endpoints
from vrg.hal.can.workshop.simulation import Port, Simulation
from vrg.hal.can.workshop.survey import BusState, Survey, all_listeners
from vrg.hal.simulated_clock import SimulatedClock
from vrg.testing.driver import arm

pytestmark = pytest.mark.usefixtures("simulated")

FILE = Path("examples/emulated_odrive_endpoints.json")
WATCHDOG = "axis0.config.watchdog_timeout"
MUTE = 9
UPLOAD = 2
"""The command of an SDO that asks for a value, in the upper three bits of its first byte (CiA 301)."""
LINK = Link(interface="virtual", channel="control")


def adapter(train: DriveTrain) -> Port:
    """The adapter of a drive train on the simulated bus."""
    assert isinstance(train._bus, Port)
    return train._bus


def run(command: str, *arguments: str) -> Result:
    """Run a command of `vrg can`."""
    return CliRunner().invoke(app, [command, *arguments, "--interface", LINK.interface, "--channel", LINK.channel])


def test_all_who_say_that_their_motors_are_off_are_named_and_nobody_is_no_success() -> None:
    done = run("stop")
    assert done.exit_code == 1
    assert "no drive reports that its motor is off: is it the right bus" in " ".join(done.output.split())
    with Drives("odrive", [3], link=LINK), Drives("vesc", [4], link=LINK):
        done = run("stop")
    assert done.exit_code == 0, done.output
    assert "Off by their own reports: odrive 3, vesc 4." in " ".join(done.output.split())


def test_a_drive_whose_motor_is_on_keeps_its_id(lab: Simulation) -> None:
    with Drives("odrive", watchdog=PATIENCE, link=LINK) as drives:
        with CanBench("odrive", link=LINK, watchdog="unsafe") as bench:
            bench.driver.connect()
            arm(bench)
            done = run("address", "--id", "1", "44")
        assert isinstance(done.exception, RobotError)
        assert "odrive 1: expected a motor that is off: `vrg can stop`" in str(done.exception)
        assert [drive.node for drive in drives.drives] == [0, 1]
        off = lab.clock.wait(lambda: not any(drive._energised for drive in drives.drives), PATIENCE)
        assert off, "closing the robot switches it off"


def test_a_motor_that_hardly_turns_is_told() -> None:
    with Drives("vesc", [4], watchdog=PATIENCE, link=LINK):
        done = run("jog", "--protocol", "vesc", "--option", "pole_pairs=7", "--unsafe", "--id", "4", "--for", "0.6")
    assert isinstance(done.exception, RobotError), done.output
    assert "asked for 1 turn/s for 0.6 s and has hardly turned" in str(done.exception)


@pytest.mark.parametrize("fault", [False, True], ids=["", "with a fault"])
@pytest.mark.parametrize("seconds", [0.5, 2.5])
@pytest.mark.parametrize("at", [0, 1, 3], ids=["under way", "at the first order to arm", "at the third"])
def test_a_jog_that_was_frozen_moves_nothing_when_it_goes_on(
    lab: Simulation, monkeypatch: pytest.MonkeyPatch, seconds: float, at: int, fault: bool
) -> None:
    """Ctrl-Z or a closed lid, and then nobody may stand clear of the motor any more."""
    method = "arm" if at else "spin"
    act, turned, calls = getattr(DriveTrain, method), list[float](), [0]

    def freeze_once(train: DriveTrain, *arguments: Any) -> None:
        calls[0] += 1
        if not turned and (calls[0] == at if at else train.state().speeds[0]):
            turned.append(0.0)
            port = adapter(train)
            port.freeze()
            lab.clock.sleep(seconds + 0.1)
            turned.append(drives.drives[0].motor.position)
            if fault:
                error = FaultRequest(FaultKind.ERROR, 0.0, 0x1000)
                drives.drives[0].receive(encode_fault(3, error), lab.clock.now())
            port.thaw()
        act(train, *arguments)

    monkeypatch.setattr(DriveTrain, method, freeze_once)
    with Drives("odrive", [3], link=LINK) as drives:
        done = run("jog", "--id", "3", "--for", "3", "--speed", "20")
        assert turned, "it was never frozen"
        assert abs(drives.drives[0].motor.position - turned[-1]) < 0.5
    assert isinstance(done.exception, RobotError), done.output
    words = str(done.exception)
    assert re.search(r"this program did not run for \d\.\d s: its motors stay off", words), words
    assert not fault or "CURRENT_LIMIT_VIOLATION" in words, words


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.4, "was this program stopped"), (1.0, "did not run for 1.0 s"), (6.0, "for 6.0 s")]
)
def test_a_jog_that_was_frozen_past_its_end_has_not_turned_as_it_was_asked(
    lab: Simulation, monkeypatch: pytest.MonkeyPatch, seconds: float, words: str
) -> None:
    wait, began, frozen = type(lab.clock).wait, list[float](), list[float]()

    def freeze_once(clock: Any, condition: Any, patience: float) -> bool:
        if began and not frozen and clock.now() > began[0] + 0.8:
            frozen.append(clock.now())
            ports[0].freeze()
            clock.sleep(seconds - 0.05)
            ports[0].thaw()
        return wait(clock, condition, patience)

    spin, ports = DriveTrain.spin, list[Port]()

    def note(train: DriveTrain, *arguments: Any) -> None:
        ports.append(adapter(train))
        began.append(lab.clock.now())
        spin(train, *arguments)

    monkeypatch.setattr(DriveTrain, "spin", note)
    monkeypatch.setattr(type(lab.clock), "wait", freeze_once)
    with Drives("odrive", [3], link=LINK):
        done = run("jog", "--id", "3", "--for", "1", "--speed", "2")
    assert frozen, "it was never frozen"
    assert isinstance(done.exception, RobotError), done.output
    assert words in str(done.exception)


def test_a_robot_whose_drive_was_replaced_is_calibrated_to_the_new_one(tmp_path: Path) -> None:
    match, own = tmp_path / "match.toml", tmp_path / "ann.cal.toml"
    match.write_text(TINY_CAN.replace("ratio = 50.0", 'ratio = 50.0\ncalibration = "ann.cal.toml"'), encoding="utf-8")
    axis = AxisCalibration(direction=1, ratio=50.0, serial="DEAD")
    own.write_text(calibration_text(Calibration(robot="ann", track=0.6, axes={0: axis, 1: axis})), encoding="utf-8")
    with Drives("odrive", link=Link(interface="virtual", channel="tiny")):
        quick = ("--way", "0.4", "--turns", "0.25", "--speed", "0.3")
        answers = "\ny\ny\n\n\ny\n\n\ny\n"
        done = CliRunner().invoke(app, ["calibrate", "ann", str(match), *quick], input=answers)
    assert done.exit_code == 0, f"{done.output} {done.exception}"
    serials = {axis.serial for axis in load_calibration(own, [0, 1]).axes.values()}
    assert len(serials) == 2
    assert "DEAD" not in serials


@pytest.mark.parametrize(("protocol", "args"), [("odrive", ()), ("moteus", ("--protocol", "moteus"))])
def test_after_another_id_was_given_the_old_one_is_not_listed(protocol: str, args: tuple[str, ...]) -> None:
    with Drives(protocol, [3, 7], link=LINK):
        done = run("address", "--id", "3", "9", *args)
    assert done.exit_code == 0, done.exception
    rows = [line.split()[1] for line in done.output.splitlines() if line.startswith(protocol)]
    assert rows == ["7", "9"]
    assert "silent" not in done.output


def test_the_name_of_a_bus_is_no_picture() -> None:
    done = CliRunner().invoke(app, ["scan", "--interface", "virtual", "--channel", "x:", "--for", "0.3"])
    assert "virtual:x:: no drives" in done.output


def test_a_missing_watchdog_is_told_as_soon_as_it_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(can_control, "_JOG_START", 3600.0)
    with Drives("odrive", [3], watchdog=0.0, link=LINK):
        done = run("jog", "--id", "3")
    assert isinstance(done.exception, RobotError), done.output
    assert "its own watchdog has not stopped it" in str(done.exception)


def test_a_fault_is_asked_for_and_answered() -> None:
    with Drives("moteus", [5], link=LINK):
        assert run("fault", "block", "--id", "5").output == "node 5: block (its wheel is blocked)\n"
        refused = run("fault", "estop", "--id", "5")
        silent = run("fault", "silence", "--id", "6")
    assert refused.exit_code == silent.exit_code == 1
    assert "node 5: a drive of its protocol cannot have this fault" in refused.output
    assert "node 6: not emulated on virtual:control" in silent.output


def test_an_odrive_is_asked_and_changed_by_the_names_of_its_firmware() -> None:
    with Drives("odrive", [3], link=LINK) as drives:
        done = run("configure", "--id", "3", "--endpoints", str(FILE), WATCHDOG, f"{WATCHDOG}=0.5")
        assert done.exit_code == 0, done.output
        assert f"{WATCHDOG}: 0.25" in done.output
        assert f"{WATCHDOG}: 0.25 -> 0.5" in done.output
        assert "--save keeps it" in done.output
        assert drives.drives[0]._watchdog == 0.5
        done = run("configure", "--id", "3", "--endpoints", str(FILE), "axis0.controller.config.vel_limit=40", "--save")
        assert "Saved." in done.output
        assert drives.drives[0].motor.velocity_limit == 40.0


def test_an_object_of_a_canopen_drive_is_asked_and_changed() -> None:
    with Drives("cia402", [5], link=LINK) as drives:
        done = run("configure", "--id", "5", "0x6084=20000", "0x1018:04", "--save")
        assert done.exit_code == 0, done.output
        assert "0x6084: 2000000 -> 20000" in done.output
        assert "0x1018:04: 4096" in done.output
        assert drives.drives[0]._stored[0x6084, 0] == 20000  # type: ignore[attr-defined]
        texts = "0x1008: VRG emulated drive\n0x100A: 1.0.0\n0x1017: 100\n"
        assert texts in run("configure", "--id", "5", "0x1008", "0x100A", "0x1017").output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--id", "3", WATCHDOG), "expected --endpoints with the file flat_endpoints.json"),
        (("--id", "3", "--endpoints", str(FILE), "watchdog"), f"did you mean {WATCHDOG}"),
        (("--id", "3", "--endpoints", str(FILE), f"{WATCHDOG}=soon"), "could not convert"),
        (("--id", "5", "0x9999"), "it has no object 0x9999"),
        (("--id", "5", "0x1018:04=3"), "it refuses 0x1018:04"),
        (("--id", "5", "0x6084=-0x80000001"), "expected a number of 4 bytes"),
        (("--id", "5", "much"), "expected an object such as 0x6083"),
        (("--id", "7", "anything"), "moteus drives are configured by their maker's own tool"),
        (("--id", "9", "anything"), "expected drives with ids 9"),
    ],
)
def test_what_cannot_be_is_said(arguments: tuple[str, ...], words: str) -> None:
    with Drives("odrive", [3], link=LINK), Drives("cia402", [5], link=LINK), Drives("moteus", [7], link=LINK):
        done = run("configure", *arguments)
    assert done.exit_code != 0
    assert isinstance(done.exception, ConfigError | RobotError)
    assert words in str(done.exception)


def test_nothing_is_changed_while_the_motor_is_on() -> None:
    with Drives("odrive", [3], link=LINK, watchdog=0.0) as drives:
        drives.drives[0]._state = AxisState.CLOSED_LOOP_CONTROL  # type: ignore[attr-defined]
        done = run("configure", "--id", "3", "--endpoints", str(FILE), f"{WATCHDOG}=0.5")
        assert "expected a motor that is off" in str(done.exception)
        assert run("configure", "--id", "3", "--endpoints", str(FILE), WATCHDOG).exit_code == 0


def test_another_firmware_has_other_numbers(tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    other.write_text(json.dumps({**json.loads(FILE.read_text()), "fw_version": "0.6.10"}))
    with Drives("odrive", [3], link=LINK):
        done = run("configure", "--id", "3", "--endpoints", str(other), f"{WATCHDOG}=0.5")
    assert "expected firmware 0.6.10, as in the file of the endpoints, got 0.6.11" in str(done.exception)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"endpoints": 3, "fw_version": "1"}', '{"endpoints": {"a": 1}}'])
def test_a_file_that_is_none_is_said(tmp_path: Path, text: str) -> None:
    (tmp_path / "bad.json").write_text(text)
    with pytest.raises(ConfigError, match=r"expected a file flat_endpoints\.json"):
        read_endpoints(tmp_path / "bad.json")


@pytest.mark.parametrize(
    ("kind", "text", "raw", "words"),
    [
        ("bool", "true", 1, "true"), ("uint8", "0x10", 16, "16"), ("int16", "-2", 0xFFFE, "-2"),
        ("uint32", "4000000000", 4000000000, "4000000000"), ("float", "0.2", 0x3E4CCCCD, "0.2"),
    ],
)  # fmt: skip
def test_a_value_goes_there_and_back(kind: str, text: str, raw: int, words: str) -> None:
    endpoint = Endpoint(1, kind)
    assert endpoint.raw(text) == raw
    assert endpoint.words(raw) == words


@pytest.mark.parametrize(("kind", "text"), [("bool", "1"), ("uint8", "256"), ("int16", "x"), ("float", "x")])
def test_a_value_of_another_type_is_said(kind: str, text: str) -> None:
    with pytest.raises(ValueError, match=r"expected|invalid|could not"):
        Endpoint(1, kind).raw(text)


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
    assert 0 < len(asked) <= count, "a look waits for one answer that does not come, not for all"


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
