"""The developers' view as the window of a match."""

from pathlib import Path

import pytest

from tests.command_line import invoke
from vrg.bus.seats import Seat, SeatKind
from vrg.config.files import HERE
from vrg.config.loading import load_match, match_path
from vrg.config.setup import read_setup, write_setup
from vrg.kinds import DEVELOPER, SPECTATOR
from vrg.launch.child import Job, job_of
from vrg.launch.nodes.windows import developer_node
from vrg.launch.specs import seats_at, specs, window_of


def test_it_is_the_window_of_a_match_that_is_played_with_it(tmp_path: Path) -> None:
    setup = load_match(match_path("hud")).for_developers()
    write_setup(setup, tmp_path / "setup")
    assert window_of(read_setup(tmp_path / "setup")) == (DEVELOPER, "window")
    window = next(
        s for s in specs(setup, tmp_path, "tcp/h:1", window=True, record=False) if s.name == SPECTATOR.process
    )
    job = Job(kind="developer", router="tcp/h:1", run=str(tmp_path), name="window")
    assert job_of(window.arguments) == job
    assert window.pulse == "vrg/hud/pulse/spectator/window", "on the bus it is a spectator"
    assert Seat(SeatKind.WINDOW) in seats_at(setup, HERE, window=True, record=False)


def test_it_knows_the_robots_and_its_seat() -> None:
    node = developer_node(load_match(match_path("hud")), "window", None, official=False)
    assert (node.kind, node.name) == ("spectator", "window")
    assert not node.insight.official


@pytest.mark.parametrize(("command", "word"), [(["play"], "--developer"), (["show", "developer"], "developers' view")])
def test_the_command_line_has_it(command: list[str], word: str) -> None:
    told = invoke(*command, "--help")
    assert told.exit_code == 0
    assert word in told.output


def test_a_match_in_one_process_has_none() -> None:
    told = invoke("play", "hud", "--in-process", "--developer")
    assert told.exit_code == 2
    assert "--developer needs the bus" in told.output
