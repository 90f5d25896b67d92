"""`vrg can configure`, with emulated drives on a bus within this process."""

import json
from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from tests.hal.can.bench import Drives
from vrg.commands.can import app
from vrg.errors import ConfigError, RobotError
from vrg.hal.can.link import Link
from vrg.hal.can.odrive.messages import AxisState
from vrg.hal.can.workshop.odrive.listener import Endpoint, read_endpoints

LINK = Link(interface="virtual", channel="configure")
FILE = Path("examples/emulated_odrive_endpoints.json")
WATCHDOG = "axis0.config.watchdog_timeout"


pytestmark = pytest.mark.usefixtures("simulated")


def configure(*arguments: str) -> Result:
    """Run the command."""
    where = ["--interface", LINK.interface, "--channel", LINK.channel]
    return CliRunner().invoke(app, ["configure", *where, *arguments])


def test_an_odrive_is_asked_and_changed_by_the_names_of_its_firmware() -> None:
    with Drives("odrive", [3], link=LINK) as drives:
        done = configure("--id", "3", "--endpoints", str(FILE), WATCHDOG, f"{WATCHDOG}=0.5")
        assert done.exit_code == 0, done.output
        assert f"{WATCHDOG}: 0.25" in done.output
        assert f"{WATCHDOG}: 0.25 -> 0.5" in done.output
        assert "--save keeps it" in done.output
        assert drives.drives[0]._watchdog == 0.5
        done = configure("--id", "3", "--endpoints", str(FILE), "axis0.controller.config.vel_limit=40", "--save")
        assert "Saved." in done.output
        assert drives.drives[0].motor.velocity_limit == 40.0


def test_an_object_of_a_canopen_drive_is_asked_and_changed() -> None:
    with Drives("cia402", [5], link=LINK) as drives:
        done = configure("--id", "5", "0x6084=20000", "0x1018:04", "--save")
        assert done.exit_code == 0, done.output
        assert "0x6084: 2000000 -> 20000" in done.output
        assert "0x1018:04: 4096" in done.output
        assert drives.drives[0]._stored[0x6084, 0] == 20000  # type: ignore[attr-defined]


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
        done = configure(*arguments)
    assert done.exit_code != 0
    assert isinstance(done.exception, ConfigError | RobotError)
    assert words in str(done.exception)


def test_nothing_is_changed_while_the_motor_is_on() -> None:
    with Drives("odrive", [3], link=LINK, watchdog=0.0) as drives:
        drives.drives[0]._state = AxisState.CLOSED_LOOP_CONTROL  # type: ignore[attr-defined]
        done = configure("--id", "3", "--endpoints", str(FILE), f"{WATCHDOG}=0.5")
        assert "expected a motor that is off" in str(done.exception)
        assert configure("--id", "3", "--endpoints", str(FILE), WATCHDOG).exit_code == 0


def test_another_firmware_has_other_numbers(tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    other.write_text(json.dumps({**json.loads(FILE.read_text()), "fw_version": "0.6.10"}))
    with Drives("odrive", [3], link=LINK):
        done = configure("--id", "3", "--endpoints", str(other), f"{WATCHDOG}=0.5")
    assert "expected firmware 0.6.10, as in the file of the endpoints, got 0.6.11" in str(done.exception)


def test_texts_of_a_canopen_drive_are_read_as_texts() -> None:
    with Drives("cia402", [5], link=LINK):
        done = configure("--id", "5", "0x1008", "0x100A", "0x1017")
    assert "0x1008: VRG emulated drive\n0x100A: 1.0.0\n0x1017: 100\n" in done.output


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
