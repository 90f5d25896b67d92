"""`vrg show hud` opens the display of a player, and `vrg play` that of the first in the game of the display."""

from pathlib import Path

import pytest

from vrg.commands import show
from vrg.commands.matches import Attached
from vrg.config.files import HERE
from vrg.config.loading import load_match, match_path
from vrg.config.setup import unknown_match
from vrg.kinds import KINDS, SPECTATOR
from vrg.launch.plan import processes_at, seats_at
from vrg.seats.seat import Seat, SeatKind
from vrg.testing.command_line import RUN, Opened, Vrg, showing, windows
from vrg_views.hud import KIND


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vrg:
    return showing(monkeypatch, capsys)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    return windows(monkeypatch)


def test_it_is_a_kind_of_process_with_a_seat_of_its_own() -> None:
    assert KINDS.get("hud") is KIND
    assert [str(seat) for seat in KIND.seats_of("ann")] == ["hud.ann"]


@pytest.mark.parametrize("command", ["show", "node"])
@pytest.mark.parametrize(("option", "run"), [((), RUN), (("--run", "there"), Path("there"))])
def test_it_opens_the_display_of_a_player(
    vrg: Vrg, opened: Opened, command: str, option: tuple[str, ...], run: Path
) -> None:
    assert vrg(command, "hud", "red1", "roboflag", *option).status == 0
    assert opened == [(KIND, "red1", run)]


def test_a_player_that_does_not_play_has_none(vrg: Vrg, opened: Opened) -> None:
    done = vrg("show", "hud", "red9")
    assert done.status == 1
    assert "expected the name of a player of this match (red1" in done.err
    assert opened == []


def test_a_display_needs_the_match_file_of_a_match_elsewhere(vrg: Vrg, monkeypatch: pytest.MonkeyPatch) -> None:
    far = Attached("far", "tcp/10.0.0.1:1", None, unknown_match("far"))
    monkeypatch.setattr(show, "attached", lambda _: far)
    assert "type its match file in place of its name" in vrg("show", "hud", "red1").err


def test_a_player_has_one_display(vrg: Vrg, monkeypatch: pytest.MonkeyPatch) -> None:
    windows(monkeypatch, refused=True)
    done = vrg("show", "hud", "red1")
    assert done.status == 1
    assert "the player red1 has such a window already" in done.err


def test_the_game_opens_the_display_of_its_first_player(tmp_path: Path) -> None:
    setup = load_match(match_path("hud"))
    found = {s.name: s for s in processes_at(setup, tmp_path, "tcp/h:1", window=True, record=False)}
    window = found[SPECTATOR.process]
    assert (window.kind, window.node, window.router, window.run) == ("hud", "robot1", "tcp/h:1", str(tmp_path))
    assert window.pulse == "vrg/hud/pulse/hud/robot1"
    assert not window.essential
    assert Seat(SeatKind.HUD, "robot1") in seats_at(setup, HERE, window=True, record=False)
