"""Which matches the commands of officials reach, without any match that runs."""

import os
from contextlib import ExitStack
from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from vrg.bus.messages import Estop
from vrg.cli import make_app
from vrg.commands import official
from vrg.commands.options import whole_target
from vrg.errors import BusError, ConfigError
from vrg.launch.running import RunningMatch, registered


@pytest.fixture
def ordered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, bool]]:
    """The emergency stops that were ordered, by match. The router of match `dead` does not answer."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    orders: list[tuple[str, bool]] = []

    def order(name: str, _endpoint: str, estop: Estop) -> None:
        if name == "dead":
            raise BusError("nobody answers")
        orders.append((name, estop.engaged))

    monkeypatch.setattr(official, "_order_estop", order)
    return orders


def listed(stack: ExitStack, *names: str, folder: str | None = None) -> None:
    for name in names:
        where = os.getcwd() if folder is None else folder
        entry = RunningMatch(match=name, router=f"tcp/127.0.0.1:{len(name)}", run="x", pid=os.getpid(), folder=where)
        stack.enter_context(registered(entry))


def run(*arguments: str) -> Result:
    return CliRunner().invoke(make_app(arguments[0]), list(arguments))


def test_an_emergency_stop_reaches_every_match_and_says_which(ordered: list[tuple[str, bool]]) -> None:
    with ExitStack() as stack:
        listed(stack, "left", "right", folder="/somewhere/else")
        done = run("estop")
    assert done.exit_code == 0
    assert sorted(ordered) == [("left", True), ("right", True)]
    assert "left: emergency stop engaged" in done.output
    assert "right: emergency stop engaged" in done.output


def test_one_that_cannot_be_reached_keeps_the_others_from_nothing(ordered: list[tuple[str, bool]]) -> None:
    with ExitStack() as stack:
        listed(stack, "dead", "right")
        done = run("estop")
    assert done.exit_code == 1
    assert ordered == [("right", True)]
    assert "dead: nobody answers" in done.output


def test_a_release_must_say_which_of_several(ordered: list[tuple[str, bool]]) -> None:
    with ExitStack() as stack:
        listed(stack, "left", "right")
        done = run("estop", "--release")
        assert isinstance(done.exception, ConfigError)
        run("estop", "--release", "--match", "left")
    assert ordered == [("left", False)]


def test_somebody_elses_match_must_be_named(ordered: list[tuple[str, bool]]) -> None:
    with ExitStack() as stack:
        listed(stack, "theirs", folder="/somewhere/else")
        for command in (("estop", "--release"), ("official", "resume")):
            done = run(*command)
            assert isinstance(done.exception, ConfigError)
            assert "the only match that runs here is theirs, started in /somewhere/else" in str(done.exception)
        run("estop", "--release", "--match", "theirs")
    assert ordered == [("theirs", False)]


def test_a_module_in_the_working_folder_is_meant_by_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").touch()
    assert whole_target("mine:Mine") == whole_target("mine.py:Mine") == f"{tmp_path / 'mine.py'}:Mine"
    assert whole_target("elsewhere.players:Mine") == "elsewhere.players:Mine"
    assert whole_target("sharks-and-minnows") == "sharks-and-minnows"
