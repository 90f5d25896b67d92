"""The view in three dimensions on the command line, and in a match of real processes."""

import re
from importlib.metadata import version
from pathlib import Path

import pytest
import zstandard
from websockets.sync.client import connect

from vrg.kinds import KINDS, kind_shown
from vrg.testing.command_line import Vrg
from vrg.testing.processes.match import LiveMatch, long_match, short_match
from vrg.testing.waiting import wait_until
from vrg.ui.timeline import Timeline
from vrg_views.three import KIND, command


def test_it_is_a_kind_of_process_that_prefers_the_seat_that_decides_nothing() -> None:
    assert KINDS.get("three") is kind_shown("3d", "opens") is KIND
    assert [str(seat) for seat in KIND.seats_of("127.0.0.1:8090")] == ["window", "official"]


def test_the_command_line_has_it_all(vrg: Vrg) -> None:
    for typed in ("show 3d --help", "node three --help"):
        done = vrg(*typed.split())
        assert done.status == 0
        assert "three dimensions" in done.out
    assert "3d" in vrg("show").out
    done = vrg("play", "sharks-and-minnows", "--in-process", "--3d")
    assert done.status == 2
    assert "--3d needs the bus" in done.err


def test_a_recorded_match_is_shown(vrg: Vrg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "match.toml").write_text(short_match("short"), encoding="utf-8")
    assert vrg("play", "match.toml", "--in-process", "--headless", "--engine", "planar").status == 0
    shown: list[tuple[float, float | None, str | None]] = []

    def show(timeline: Timeline, _setup: object, since: float | None, listen: str | None) -> None:
        shown.append((timeline.begin, since, listen))

    monkeypatch.setattr(command, "show_replay", show)
    assert vrg("run", "replay", "--3d", "--at", "1").status == 0
    assert vrg("run", "replay", "--show", "3d", "--listen", "127.0.0.1:8099").status == 0
    assert [each[1:] for each in shown] == [(1.0, None), (None, "127.0.0.1:8099")]
    done = vrg("run", "replay", "--3d", "--web")
    assert done.status == 1
    assert "expected one of --json, --3d, --web and --show" in done.err


@pytest.mark.system
def test_with_the_seat_of_a_window_it_hears_a_match(tmp_path: Path) -> None:
    """Its pictures are tested where they are made."""
    with LiveMatch(tmp_path, long_match("three"), options=["--3d"], seats=True) as match:
        where = r"in three dimensions: http://(\S+)"
        wait_until(lambda: re.search(where, match.output.read_text()), "the launcher to print the link")
        found = re.search(where, match.output.read_text())
        assert found is not None
        with connect(f"ws://{found[1]}", subprotocols=[f"viser-v{version('viser')}"], proxy=None) as page:
            assert any(b"/robots/P2AT/paint" in zstandard.decompress(_inner(page.recv(timeout=60))) for _ in range(50))


def _inner(data: str | bytes) -> bytes:
    """What is compressed in a message of viser: two lengths of eight bytes stand before it."""
    assert isinstance(data, bytes)
    return data[16 : 16 + int.from_bytes(data[8:16], "little")]
