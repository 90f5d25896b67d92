"""Folders of runs on a machine that ssh reaches: one agent each, and none is left for ever."""

import os
from pathlib import Path

from vrg.launch.remote.folder_lock import folder_lock, keys_folder, sweep, sweep_keys

NEW, OLD = 2000.0, 1000.0
BETWEEN = 1500.0


def folder(home: Path, name: str, written: float) -> Path:
    made = home / name
    made.mkdir()
    (made / "journal.jsonl").write_text("{}")
    os.utime(made, (written, written))
    return made


def test_runs_that_nobody_has_fetched_are_deleted_when_they_are_old(tmp_path: Path) -> None:
    old, new = folder(tmp_path, "old", OLD), folder(tmp_path, "new", NEW)
    sweep(tmp_path, BETWEEN)
    assert not old.exists()
    assert new.exists()


def test_a_run_that_an_agent_supervises_is_kept_however_old_it_is(tmp_path: Path) -> None:
    used = folder(tmp_path, "used", OLD)
    with folder_lock(used):
        os.utime(used, (OLD, OLD))
        sweep(tmp_path, BETWEEN)
        assert used.exists()


def test_a_link_is_not_followed(tmp_path: Path) -> None:
    home = tmp_path / "hosted"
    home.mkdir()
    kept = folder(tmp_path, "kept", OLD)
    (home / "link").symlink_to(kept)
    sweep(home, BETWEEN)
    assert (kept / "journal.jsonl").exists()


def test_nothing_is_there_yet(tmp_path: Path) -> None:
    sweep(tmp_path / "nowhere", BETWEEN)


def test_keys_that_a_killed_agent_has_left_are_deleted_by_the_next_one(tmp_path: Path) -> None:
    left, lost = folder(tmp_path, "left", NEW), tmp_path / "lost"
    for run in (left, lost):
        folder(tmp_path, keys_folder(run).name, NEW)
    sweep_keys(tmp_path)
    assert not keys_folder(left).exists()
    assert not keys_folder(lost).exists()
    assert (left / "journal.jsonl").exists(), "what was not fetched is kept"


def test_the_keys_of_a_run_that_an_agent_supervises_are_kept_however_old_they_are(tmp_path: Path) -> None:
    used = folder(tmp_path, "used", OLD)
    keys = folder(tmp_path, keys_folder(used).name, OLD)
    with folder_lock(used):
        sweep(tmp_path, BETWEEN)
        sweep_keys(tmp_path)
        assert keys.exists()
    sweep_keys(tmp_path)
    assert not keys.exists()
