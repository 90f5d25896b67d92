"""What somebody else's package shows of a match, and what it checks, stands among what comes with VRG."""

from dataclasses import replace

import pytest

from vrg.commands.groups import PlayOptions
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.kinds import KINDS, kind_shown
from vrg.launch.plan import planned
from vrg.launch.process import Process
from vrg.plugins import CHECKS, Option
from vrg.registry import load_object
from vrg.testing.command_line import command_line, play_options


def test_a_view_is_listed_found_and_opened(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    vrg = command_line(monkeypatch, capsys)
    assert "Prints every call" in vrg("show").out
    assert "--listen" in vrg("show", "crier", "--help").out
    kind, setup = kind_shown("crier", "opens"), load_match(match_path("race"))
    views = [Process(name=kind.process, kind=kind.name)]
    planned_kinds = {one.name: one.of for one in planned(setup, window=False, record=False, views=views)}
    assert planned_kinds["crier"] is kind
    opening = load_object(kind.opens)(setup, None, secured=False)
    assert opening.name == "hear ye"
    assert opening.words("tcp/lab:7447") == "the calls of race, by tcp/lab:7447"
    with pytest.raises(ConfigError, match=r"expected one of .*web, got 'crier', which shows running matches only"):
        kind_shown("crier", "replays")


def test_its_option_of_play_opens_it(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    vrg = command_line(monkeypatch, capsys)
    assert "Let a crier print every call." in vrg("play", "--help").out
    assert "--cry" not in vrg("run", "replay", "--help").out, "it shows running matches only"
    assert "--cry needs the bus" in vrg("play", "race", "--in-process", "--cry").err
    assert play_options("--cry").views == {"crier": None}
    assert play_options().views == {}


@pytest.mark.parametrize("name", ["--seed", "--no-record", "--show", "--tls", "--help"])
def test_an_option_that_vrg_has_is_not_replaced(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kind = replace(KINDS.get("crier"), option=Option(name, "Let a crier print every call."))
    monkeypatch.setitem(KINDS._found, "crier", kind)
    said = command_line(monkeypatch, capsys)("play", "--help").out
    assert name in said
    assert "Let a crier" not in said


@pytest.mark.parametrize("name", ["cry", "-c", "--", "--Cry", "--cry/--no-cry", "--cry out"])
def test_an_option_that_nobody_can_type_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="expected the name of an option, such as --scoreboard"):
        Option(name, "Let a crier print every call.")


def test_an_option_names_views_with_their_addresses() -> None:
    options = PlayOptions(show=["crier=oyez", "wall"])
    assert options.views == {"crier": "oyez", "wall": None}


def test_the_doctor_takes_its_check_in() -> None:
    assert CHECKS.get("crier")().text == "its voice is clear"
