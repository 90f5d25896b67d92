"""`vrg run replay`: the match of a run folder, and what is said of a folder that cannot be shown."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["SDL_AUDIODRIVER"] = "dummy"

import pygame
import pytest

from vrg.config.setup import read_setup
from vrg.coordinator.journal import read_journal
from vrg.errors import LaunchError
from vrg.playing.replay import replay_window
from vrg.recording.foxglove import Time
from vrg.recording.mcap_file import McapFile
from vrg.registry import Registry
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.testing.processes.match import short_match
from vrg.ui.window.replay import ReplayWindow


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of a short match."""
    folder = tmp_path_factory.mktemp("replay")
    (folder / "match.toml").write_text(short_match("short"), encoding="utf-8")
    command = ["play", str(folder / "match.toml"), "--in-process", "--engine", "planar", "--runs", str(folder / "runs")]
    done = invoke(*command)
    assert done.exit_code == 0, done.output
    return next((folder / "runs").iterdir())


@pytest.fixture
def run(played: Path, tmp_path: Path) -> Path:
    """A copy of it, which a test may change."""
    return Path(shutil.copytree(played, tmp_path / "run"))


def window_in(run: Path) -> ReplayWindow:
    folder = RunFolder(run)
    return replay_window(folder, read_setup(folder.setup))


def change_setup(run: Path, **fields: object) -> None:
    path = run / "setup.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **fields}))


def test_the_calls_of_the_journal_are_the_marks_of_the_time_bar(run: Path) -> None:
    window = window_in(run)
    _, records = read_journal(run / "journal.jsonl")
    assert list(window.playback.calls) == pytest.approx([r.time for r in records for _ in r.calls], abs=0.11)
    assert window.note == ""


def test_the_match_ends_as_its_result_says(run: Path) -> None:
    window = window_in(run)
    result = json.loads((run / "result.json").read_text())
    window.open()
    window.playback = window.playback.to_end()
    window.frame(0.0)
    window.close()
    assert window.scene.stage == "game_over"
    assert window.scene.winner == result["winner"]
    assert dict(window.scene.score) == result["score"]


def test_the_command_shows_what_is_whole_of_a_recording_until_the_window_is_closed(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = window_in(run).playback.end
    file = run / "recording.mcap"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    window = window_in(run)
    assert 0.2 * whole < window.playback.end < 0.9 * whole
    assert "recording.mcap ends in the middle: the match is shown as far as it goes, to 0:" in window.note
    shown = []

    def frame(window: ReplayWindow, seconds: float) -> None:
        shown.append(pygame.display.get_caption()[0])
        window.close()

    monkeypatch.setattr("vrg.commands.runs.replay.need_display", lambda: None)
    monkeypatch.setattr(ReplayWindow, "frame", frame)
    done = invoke("run", "replay", str(run))
    assert (done.exit_code, shown) == (0, ["VRG: short, recorded"])
    assert window.note in done.output


def test_a_part_that_is_torn_before_another_part_is_told(run: Path) -> None:
    whole = (run / "recording.mcap").read_bytes()
    (run / "recording-2.mcap").write_bytes(whole)
    (run / "recording.mcap").write_bytes(whole[: len(whole) // 2])
    assert window_in(run).note == "recording.mcap ends in the middle: something is missing before the next part."


def of_another_version(run: Path) -> None:
    (run / "recording.mcap").unlink()
    file = McapFile(run / "recording.mcap")
    file.write("/referee/state", Time(0, 0), 0.0, 0)
    file.finish()


def without_anything_to_show(run: Path) -> None:
    (run / "recording.mcap").unlink()
    (run / "evidence.bin").unlink()


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (without_anything_to_show,
         "expected a recording (recording.mcap), found none: was --no-record given?"),
        (lambda run: (run / "setup.json").unlink(), "expected a run folder with a setup.json"),
        (lambda run: (run / "recording.mcap").write_bytes(b""), "of where the robots were, found none in it"),
        (lambda run: (run / "recording.mcap").write_bytes(b"a letter to my grandmother"),
         "recording.mcap: expected an MCAP recording"),
        (of_another_version, "if another version of VRG has recorded it, use that one"),
        (lambda run: change_setup(run, players=3), "setup.json: expected the set-up of a match of this release"),
        (lambda run: change_setup(run, players=3), "use the VRG that played the match"),
        (lambda run: None, "expected a display to open a window on, found none"),
    ],
    ids=["no recording", "no run", "nothing", "another file", "another version", "set-up", "its version", "no display"],
)  # fmt: skip
def test_what_cannot_be_shown_is_said(
    run: Path, monkeypatch: pytest.MonkeyPatch, damage: Callable[[Path], object], said: str
) -> None:
    damage(run)
    if "display" not in said:
        monkeypatch.setattr("vrg.commands.runs.replay.need_display", lambda: None)
    done = invoke("run", "replay", str(run))
    assert isinstance(done.exception, LaunchError), done.output
    assert said in str(done.exception)


def test_a_run_without_a_recording_is_shown_by_its_evidence(run: Path) -> None:
    (run / "recording.mcap").unlink()
    assert window_in(run).note == "Nothing was recorded: the match is shown as the referee saw it, from its evidence."


def test_a_game_that_is_not_installed_is_shown_and_told(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Registry, "find", lambda *_: None)
    window = window_in(run)
    assert window.note.startswith("The game sharks-and-minnows is not installed here")
    window.open()
    window.frame(1.0)
    window.close()
    assert len(window.scene.bodies) == 4


def test_a_robot_model_that_is_not_installed_is_shown_and_told(run: Path) -> None:
    players = json.loads((run / "setup.json").read_text())["players"]
    change_setup(run, players=[{**player, "model": "R2D2"} for player in players])
    window = window_in(run)
    assert window.note == "The robot model R2D2 is not installed here: its robots are shown 0.5 m long."
    window.open()
    window.frame(1.0)
    window.close()
    assert {body.length for body in window.scene.bodies} == {0.5}
