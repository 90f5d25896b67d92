"""Which window `vrg show` opens. Nothing is opened, and no match runs."""

from pathlib import Path
from typing import Any

import pytest

from vrg.commands import show
from vrg.commands.matches import Attached
from vrg.config.loading import load_match, match_path
from vrg.errors import DuplicateNodeError
from vrg.kinds import COMMANDER, SPECTATOR, Kind
from vrg.testing.command_line import Vrg, command_line

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
    ],
)
def test_one_command_opens_each_window_and_the_others_do_the_same(
    vrg: Vrg, opened: Opened, typed: str, kind: Kind, name: str
) -> None:
    assert vrg("show", *typed.split()).status == 0
    assert opened == [(kind, name, RUN)]


def test_a_typed_run_folder_is_that_of_every_window(vrg: Vrg, opened: Opened) -> None:
    for option in ((), ("--team", "red")):
        assert vrg("show", "window", "--run", "there", *option).status == 0
    assert [run for _, _, run in opened] == [Path("there")] * 2


def test_a_team_has_one_such_window(vrg: Vrg, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise DuplicateNodeError("match 'roboflag' already has such a node")

    monkeypatch.setattr(Attached, "serve", refuse)
    done = vrg("show", "commander", "red")
    assert done.status == 1
    assert "the team red has such a window already" in done.err
