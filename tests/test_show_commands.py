"""Which window `vrg show` opens. Nothing is opened, and no match runs."""

from pathlib import Path

import pytest

from vrg.kinds import COMMANDER, SPECTATOR, Kind
from vrg.testing.command_line import RUN, Opened, Vrg, showing, windows


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vrg:
    return showing(monkeypatch, capsys)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    return windows(monkeypatch)


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
    windows(monkeypatch, refused=True)
    done = vrg("show", "commander", "red")
    assert done.status == 1
    assert "the team red has such a window already" in done.err
