"""A motor protocol of another package that has neither an emulated drive nor a listener drives a robot all the same."""

import struct
from pathlib import Path

import pytest
import typer.testing

from vrg.cli import make_app
from vrg.commands import drives
from vrg.errors import ConfigError
from vrg.hal.can.driver import CanDriver
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.settings import CanSettings
from vrg.hal.can.workshop.simulation import Simulation
from vrg.hal.can.workshop.survey import all_listeners, unheard
from vrg.hal.driver import DriverContext
from vrg.hal.models import robot_model
from vrg.types import Twist

LINK = Link(interface="virtual", channel="pulse")
TABLE = {
    "interface": "virtual",
    "channel": "pulse",
    "protocol": "pulse",
    "robots": {"r": {"left": [1], "right": [2], "watchdog": "unsafe"}},
}


def test_its_drives_obey() -> None:
    lab, heard = Simulation(strict=True), dict[int, bytes]()
    bus = lab.bus(LINK, lambda frame: heard.update({frame.id: frame.data}))
    bus.start()

    def report() -> None:
        for node in (1, 2):
            bus.send(Frame(0x300 + node, struct.pack("<?ee", bool(heard.get(0x200 + node)), 0.0, 0.0)))
        lab.clock.at(lab.clock.now() + 0.02, report)

    report()
    context = DriverContext(name="r", model=robot_model("P2AT"), options=TABLE, now=lab.clock.now)
    driver = CanDriver(context, lab)
    driver.connect()
    driver.arm()
    assert lab.clock.wait(lambda: driver.read().armed, 2.0)
    driver.drive(Twist(0.3, 0.0))
    lab.clock.sleep(0.01)
    assert struct.unpack("<f", heard[0x201])[0] > 0.1
    driver.close()
    lab.clock.sleep(0.01)
    assert heard[0x201] == b""
    lab.clock.close()


def test_a_match_that_asks_for_emulated_drives_is_told_that_there_are_none() -> None:
    asked = CanSettings.model_validate({**TABLE, "emulate": True})
    assert asked.problems({"r": robot_model("P2AT")}, Path()) == [
        "robots.r: pulse has no emulated drive: leave `emulate` out"
    ]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["node", "drives", "--protocol", "pulse", "--id", "3"], "--protocol pulse: it has no emulated drive"),
        (["can", "address", "4", "--protocol", "pulse", "--id", "3"], "--protocol pulse: it has no listener"),
    ],
)
def test_a_command_that_needs_what_it_has_not_says_so(arguments: list[str], words: str) -> None:
    if arguments[0] == "can":
        pytest.importorskip("vrg_drives")
    done = typer.testing.CliRunner().invoke(make_app(), arguments)
    assert isinstance(done.exception, ConfigError)
    assert words in str(done.exception)


@pytest.mark.parametrize("command", ["scan", "stop"])
def test_who_looks_at_a_bus_is_told_that_its_drives_are_not_found(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("vrg_drives")
    lab = Simulation()
    monkeypatch.setattr(drives, "medium", lambda: lab)
    assert unheard()["pulse"] == "it has no listener"
    assert "pulse" not in {listener.word for listener in all_listeners(lambda _: None, lab.clock)}
    done = typer.testing.CliRunner().invoke(
        make_app(), ["can", command, "--interface", "virtual", "--channel", "pulse"]
    )
    assert "Drives of the protocol pulse" in done.output
    assert "it has no listener" in done.output
    lab.clock.close()
