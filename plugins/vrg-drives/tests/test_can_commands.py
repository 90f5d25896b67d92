"""`vrg can` and what its commands look at, on a bus within this process."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from typer.testing import CliRunner

from vrg.cli import make_app
from vrg.errors import ConfigError, RobotError
from vrg.hal.can.calibration import AxisCalibration, Calibration, calibration_text, load_calibration
from vrg.hal.can.link import Link
from vrg.hal.can.odrive.messages import AxisState
from vrg.hal.can.train import DriveTrain
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.workshop.odrive.listener import Endpoint, read_endpoints
from vrg.hal.can.workshop.simulation import Port, Simulation
from vrg.testing.can.bench import PATIENCE, CanBench, Drives
from vrg.testing.driver import arm
from vrg.testing.tiny import TINY_CAN
from vrg_drives.bringup import control_command

pytestmark = pytest.mark.usefixtures("simulated")

FILE = Path("examples/emulated_odrive_endpoints.json")
WATCHDOG = "axis0.config.watchdog_timeout"
LINK = Link(interface="virtual", channel="control")


def adapter(train: DriveTrain) -> Port:
    """The adapter of a drive train on the simulated bus."""
    assert isinstance(train._bus, Port)
    return train._bus


def run(command: str, *arguments: str) -> Result:
    """Run a command of `vrg can`."""
    return CliRunner().invoke(
        make_app(), ["can", command, *arguments, "--interface", LINK.interface, "--channel", LINK.channel]
    )


def test_all_who_say_that_their_motors_are_off_are_named_and_nobody_is_no_success() -> None:
    done = run("stop")
    assert done.exit_code == 1
    assert "no drive reports that its motor is off: is it the right bus" in " ".join(done.output.split())
    with Drives("odrive", [3, 4], link=LINK):
        done = run("stop")
    assert done.exit_code == 0, done.output
    assert "off by their own reports: odrive 3, odrive 4." in " ".join(done.output.split())


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
        done = CliRunner().invoke(make_app(), ["can", "calibrate", "ann", str(match), *quick], input=answers)
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
    done = CliRunner().invoke(make_app(), ["can", "scan", "--interface", "virtual", "--channel", "x:", "--for", "0.3"])
    assert "virtual:x:: no drives" in done.output


def test_a_missing_watchdog_is_told_as_soon_as_it_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control_command, "_JOG_START", 3600.0)
    with Drives("odrive", [3], watchdog=0.0, link=LINK):
        done = run("jog", "--id", "3")
    assert isinstance(done.exception, RobotError), done.output
    assert "its own watchdog has not stopped it" in str(done.exception)


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


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--id", "3", WATCHDOG), "expected --endpoints with the file flat_endpoints.json"),
        (("--id", "3", "--endpoints", str(FILE), "watchdog"), f"did you mean {WATCHDOG}"),
        (("--id", "3", "--endpoints", str(FILE), f"{WATCHDOG}=soon"), "could not convert"),
        (("--id", "9", "anything"), "expected drives with ids 9"),
    ],
)
def test_what_cannot_be_is_said(arguments: tuple[str, ...], words: str) -> None:
    with Drives("odrive", [3], link=LINK):
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
