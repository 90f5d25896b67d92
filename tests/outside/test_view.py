"""What somebody else's package shows of a match, and what it checks, stands among what comes with VRG."""

import pytest

from tests.command_line import command_line
from vrg.commands.groups import PlayOptions
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.kinds import kind_shown
from vrg.launch.specs import kind_of
from vrg.plugins import CHECKS
from vrg.registry import load_object


def test_a_view_is_listed_found_and_opened(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    vrg = command_line(monkeypatch, capsys)
    assert "Prints every call" in vrg("show").out
    assert "--listen" in vrg("show", "crier", "--help").out
    kind, setup = kind_shown("crier", "opens"), load_match(match_path("race"))
    assert kind_of(setup, "crier") is kind
    opening = load_object(kind.opens)(setup, None, secured=False)
    assert opening.name == "hear ye"
    assert opening.words("tcp/lab:7447") == "the calls of race, by tcp/lab:7447"
    with pytest.raises(ConfigError, match=r"expected one of .*web, got 'crier', which shows running matches only"):
        kind_shown("crier", "replays")


def test_an_option_names_views_with_their_addresses() -> None:
    options = PlayOptions(foxglove=True, show=["crier=oyez", "3d"])
    assert options.views == {"foxglove": None, "crier": "oyez", "3d": None}


def test_the_doctor_takes_its_check_in() -> None:
    assert CHECKS.get("crier")().text == "its voice is clear"
