"""Which window `vrg show` opens. Nothing is opened, and no match runs."""

from pathlib import Path
from typing import Any

import pytest

from tests.command_line import Vrg, command_line
from vrg.commands import show
from vrg.commands.matches import Attached
from vrg.config.loading import load_match, match_path
from vrg.config.setup import unknown_match
from vrg.errors import DuplicateNodeError
from vrg.kinds import COMMANDER, HUD, SPECTATOR, Kind

Opened = list[tuple[Kind, str, Path | None]]
RUN = Path("runs/here")


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vrg:
    monkeypatch.setattr(show, "need_display", lambda: None)
    setup = load_match(match_path("roboflag"))
    monkeypatch.setattr(show, "attached", lambda on: Attached(setup.name, "tcp/127.0.0.1:1", on.keys, setup, RUN))
    return command_line(monkeypatch, capsys)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    """The windows that were opened."""
    found: Opened = []

    def serve(_self: Attached, kind: Kind, name: str = "", *, run: Path | None) -> None:
        found.append((kind, name, run))

    monkeypatch.setattr(Attached, "serve", serve)
    return found


@pytest.mark.parametrize(
    ("typed", "kind", "name"),
    [
        ("window", SPECTATOR, ""),
        ("window --team red", COMMANDER, "red"),
        ("commander red", COMMANDER, "red"),
        ("window --hud red1", HUD, "red1"),
        ("hud red1 roboflag", HUD, "red1"),
    ],
)
def test_one_command_opens_each_window_and_the_others_do_the_same(
    vrg: Vrg, opened: Opened, typed: str, kind: Kind, name: str
) -> None:
    assert vrg("show", *typed.split()).status == 0
    assert opened == [(kind, name, RUN)]


def test_a_typed_run_folder_is_that_of_every_window(vrg: Vrg, opened: Opened) -> None:
    for option in ((), ("--team", "red"), ("--hud", "red1")):
        assert vrg("show", "window", "--run", "there", *option).status == 0
    assert [run for _, _, run in opened] == [Path("there")] * 3


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ("--team red --hud red1", "--team and --hud: expected one of them, got both"),
        ("--hud red9", "expected the name of a player of this match (red1"),
    ],
)
def test_what_no_window_can_be_is_told(vrg: Vrg, opened: Opened, typed: str, told: str) -> None:
    done = vrg("show", "window", *typed.split())
    assert done.status == 1
    assert told in done.err
    assert opened == []


def test_a_display_needs_the_match_file_of_a_match_elsewhere(vrg: Vrg, monkeypatch: pytest.MonkeyPatch) -> None:
    far = Attached("far", "tcp/10.0.0.1:1", None, unknown_match("far"))
    monkeypatch.setattr(show, "attached", lambda _: far)
    assert "type its match file in place of its name" in vrg("show", "window", "--hud", "red1").err


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ("commander red", "the team red has such a window already"),
        ("window --hud red1", "the player red1 has such a window already"),
    ],
)
def test_a_team_and_a_player_have_one_such_window(
    vrg: Vrg, monkeypatch: pytest.MonkeyPatch, typed: str, told: str
) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise DuplicateNodeError("match 'roboflag' already has such a node")

    monkeypatch.setattr(Attached, "serve", refuse)
    done = vrg("show", *typed.split())
    assert done.status == 1
    assert told in done.err
