"""A protocol of another package: found by its entry point, it drives a robot, and the tools know it."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import ValidationError

from tests.hal.can import toy
from vrg import registry
from vrg.errors import RobotError
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.settings import CanSettings
from vrg.hal.can.workshop.emulation import Emulation
from vrg.hal.can.workshop.simulation import Simulation
from vrg.hal.can.workshop.survey import Survey, all_listeners
from vrg.hal.simulated_clock import SimulatedClock
from vrg.testing.can.bench import LINK, CanBench, Drives, settings
from vrg.testing.driver import DriverContract
from vrg.testing.protocol import ProtocolContract

NODES = ([3], [4])


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The package of the protocol is installed: a folder with its entry point is on the path."""
    info = tmp_path / "toy-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toy\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{PROTOCOLS.group}]\ntoy = {toy.__name__}:PROTOCOL\n")
    monkeypatch.syspath_prepend(tmp_path)
    registry.added.cache_clear()
    yield tmp_path
    registry.added.cache_clear()


class TestItself(ProtocolContract):
    protocol = toy.PROTOCOL
    nodes = (1, 8, 15)
    impossible_nodes = (-1, 0, 16)


class TestDriver(DriverContract):
    """A robot with such drives keeps the contract of all robots."""

    @pytest.fixture
    def bench(self) -> Iterator[CanBench]:
        with Drives("toy", [3, 4]), CanBench("toy", *NODES) as bench:
            yield bench


def test_it_is_found_by_its_name() -> None:
    assert {*PROTOCOLS.names()} >= {"odrive", "toy"}
    assert PROTOCOLS.get("toy") is toy.PROTOCOL


def test_a_match_file_may_name_it() -> None:
    table = settings("toy", *NODES)
    checked = CanSettings.model_validate({**table, "emulate": True})
    assert checked.protocol_of("r") is toy.PROTOCOL
    (companion,) = Emulation(checked).companions(["r"])
    assert "toy" in companion.arguments
    with pytest.raises(ValidationError, match="node id of toy: expected 1 to 15, got 0"):
        CanSettings.model_validate(settings("toy", [0], [1]))


def test_a_robot_that_expects_another_protocol_says_who_is_there() -> None:
    words = r"odrive nodes 3, 4 on .*heard there: Toy nodes 3, 4\."
    with Drives("toy", [3, 4]), CanBench("odrive", *NODES) as bench, pytest.raises(RobotError, match=words):
        bench.driver.connect()


def test_the_survey_of_a_bus_knows_it(lab: Simulation) -> None:
    with Drives("toy", [5]):
        survey = Survey(all_listeners(lambda _: None, lab.clock))
        bus = lab.bus(LINK, survey.hear)
        bus.start()
        lab.clock.sleep(0.5)
        bus.stop()
        (found,) = survey.nodes
        assert (found.protocol, found.node, found.words, found.serials) == ("toy", 5, "idle", {"1000"})


def test_one_that_cannot_be_imported_leaves_the_others_alone(installed: Path, caplog: pytest.LogCaptureFixture) -> None:
    (installed / "toy-1.0.dist-info" / "entry_points.txt").write_text(f"[{PROTOCOLS.group}]\nbroken = nowhere:P\n")
    registry.added.cache_clear()
    words = [listener.word for listener in all_listeners(lambda _: None, SimulatedClock())]
    assert "odrive" in words
    assert "protocol broken: cannot import" in caplog.text


class TestCommands:
    """`vrg node drives` as a user types it."""

    NODE = (sys.executable, "-m", "vrg", "node", "drives", "--interface", "virtual", "--channel", "alone")

    @pytest.fixture
    def env(self, installed: Path) -> dict[str, str]:
        path = os.pathsep.join([str(installed), str(Path(__file__).parents[3])])
        return {**os.environ, "PYTHONPATH": path}

    def test_its_drives_can_be_emulated(self, env: dict[str, str]) -> None:
        command = [*self.NODE, "--protocol", "toy", "--id", "3", "--serial", "171"]
        with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            try:
                assert process.stdout.readline() == "emulating toy on virtual:alone: 3 (serial number AB)\n"
            finally:
                process.terminate()
            assert process.wait(20) == 0

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (("--protocol", "toy", "--id", "0"), "--id: expected 1 to 15, got 0"),
            (
                ("--protocol", "toyy", "--id", "3"),
                "got 'toyy', did you mean 'toy'?",
            ),
        ],
    )
    def test_what_cannot_be_is_said(self, env: dict[str, str], arguments: tuple[str, ...], words: str) -> None:
        done = subprocess.run(
            [*self.NODE, *arguments], env=env, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == 1
        assert words in " ".join(done.stderr.split())
        assert "Traceback" not in done.stderr
