"""Folders of runs on a machine that ssh reaches: one agent each, and none is left for ever."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from vrg.errors import LaunchError
from vrg.launch import folder_lock as locks
from vrg.launch.folder_lock import delete_abandoned_keys, folder_lock, keys_folder, keys_lock, owned, sweep

NEW, OLD = 2000.0, 1000.0
BETWEEN = 1500.0


def folder(home: Path, name: str, written: float) -> Path:
    made = home / name
    made.mkdir()
    (made / "journal.jsonl").write_text("{}")
    os.utime(made, (written, written))
    return made


def test_runs_that_nobody_has_fetched_are_deleted_when_they_are_old_unless_an_agent_supervises_them(
    tmp_path: Path,
) -> None:
    sweep(tmp_path / "nowhere", BETWEEN)
    old, new, used = folder(tmp_path, "old", OLD), folder(tmp_path, "new", NEW), folder(tmp_path, "used", OLD)
    with folder_lock(used):
        os.utime(used, (OLD, OLD))
        sweep(tmp_path, BETWEEN)
    assert [each.exists() for each in (old, new, used)] == [False, True, True]


def test_a_link_is_not_followed(tmp_path: Path) -> None:
    home = tmp_path / "hosted"
    home.mkdir()
    kept = folder(tmp_path, "kept", OLD)
    (home / "link").symlink_to(kept)
    sweep(home, BETWEEN)
    assert (kept / "journal.jsonl").exists()


def test_keys_that_a_killed_agent_has_left_are_deleted_by_the_next_one(tmp_path: Path) -> None:
    left, lost = folder(tmp_path, "left", NEW), tmp_path / "lost"
    for run in (left, lost):
        with keys_lock(folder(tmp_path, keys_folder(run).name, NEW)):
            pass
    sweep(tmp_path, BETWEEN)
    assert not keys_folder(left).exists()
    assert not keys_folder(lost).exists()
    assert (left / "journal.jsonl").exists(), "what was not fetched is kept"


def test_the_keys_of_a_run_that_an_agent_supervises_are_kept_however_old_they_are(tmp_path: Path) -> None:
    used = folder(tmp_path, "used", OLD)
    keys = folder(tmp_path, keys_folder(used).name, OLD)
    with folder_lock(used), keys_lock(keys):
        os.utime(used, (NEW, NEW))
        sweep(tmp_path, BETWEEN)
        assert keys.exists()
    sweep(tmp_path, BETWEEN)
    assert not keys.exists()


def test_keys_that_are_being_made_are_not_deleted(tmp_path: Path) -> None:
    """Between the making of a folder and that of its lock, another launcher may look for abandoned ones."""
    keys = folder(tmp_path, "keys", OLD)
    delete_abandoned_keys([keys])
    rename = Path.rename

    def look(path: Path, target: Path) -> Path:
        delete_abandoned_keys([keys])
        return rename(path, target)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "rename", look)
        with keys_lock(keys):
            delete_abandoned_keys([keys])
            assert (keys / "journal.jsonl").exists()
    delete_abandoned_keys([keys])
    assert not keys.exists()


def test_an_agent_of_another_machine_is_not_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with folder_lock(tmp_path):
        monkeypatch.setattr(locks, "this_machine", lambda: "lab2 other-boot")
        monkeypatch.setattr(os, "kill", lambda *_: pytest.fail("killed by number"))
        with pytest.raises(LaunchError, match=r"an agent of .* uses this folder, which both machines share"):
            folder_lock(tmp_path).__enter__()


@pytest.mark.skipif(sys.platform == "win32", reason="locks are not inherited there")
def test_a_folder_belongs_to_its_owner_and_to_what_that_has_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = f"""
import subprocess, sys
from pathlib import Path
from vrg.launch.folder_lock import owned

with owned(Path({str(tmp_path)!r})):
    print(subprocess.Popen([sys.executable, "-c", "input()"], close_fds=False).pid, flush=True)
    input()
"""
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as owner:
        assert owner.stdout is not None
        assert owner.stdout.readline().strip().isdigit()
        with pytest.raises(LaunchError, match=f"process {owner.pid}, .* works here already"), owned(tmp_path):
            pass
        owner.kill()
        owner.wait()
        monkeypatch.setattr(locks, "ENDING_TIMEOUT", 0.0)
        with pytest.raises(LaunchError, match="what it has started"), owned(tmp_path):
            pass
        monkeypatch.undo()
        assert owner.stdin is not None
        owner.stdin.close()  # then that ends, too
        with owned(tmp_path):
            assert (tmp_path / locks.OWNER).read_text() == str(os.getpid())


def test_a_file_system_without_locks_is_told_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(_: object) -> bool:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(locks.system, "lock", no_locks)
    with pytest.raises(LaunchError, match="cannot be locked: No locks available: choose another"), owned(tmp_path):
        pass


def test_rubbish_in_a_lock_names_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / locks.OWNER).write_text("rubbish")
    monkeypatch.setattr(locks, "ENDING_TIMEOUT", 0.0)
    monkeypatch.setattr(locks.system, "lock", lambda _: False)
    with pytest.raises(LaunchError, match="another process works here already"), owned(tmp_path):
        pass
