"""Run folders, and what is told of their results."""

from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path

import pytest

from vrg.files import write_json, write_whole
from vrg.runs.result import summary
from vrg.runs.run_folder import RunFolder

NOW = datetime(2026, 5, 17, 14, 3, 9)


def test_a_run_has_a_folder_of_its_own(tmp_path: Path) -> None:
    first = RunFolder.create(tmp_path / "runs", "final", NOW)
    second = RunFolder.create(tmp_path / "runs", "final", NOW)
    assert first.path.name == "final-20260517-140309"
    assert second.path.name == "final-20260517-140309-2"
    assert first.logs.is_dir()


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "f"
    write_whole(path, b"old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError, match="No space"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path], "nothing half-written is left"


def test_json_is_for_people_too(tmp_path: Path) -> None:
    write_json(tmp_path / "r.json", {"winner": "sharks"})
    assert (tmp_path / "r.json").read_text() == '{\n  "winner": "sharks"\n}\n'


def test_a_secret_is_drawn_once_and_anew_where_the_disk_was_full(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    folder.secret_file.touch(0o600)
    with ThreadPoolExecutor(8) as threads:
        found = set(threads.map(lambda _: folder.secret(), range(8)))
    assert [len(secret) for secret in found] == [32]
    assert folder.secret() in found


@pytest.mark.parametrize("name", ["without_evidence", "unproved"])
def test_calls_without_evidence_are_told_of_runs_of_earlier_releases_too(name: str) -> None:
    result = {"score": {}, "play_time": None, "radio": {"lost": 0}, name: 3}
    assert "3 calls cannot be judged again" in summary(result)
