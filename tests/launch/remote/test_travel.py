import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.errors import LaunchError
from vrg.launch.remote.travel import LogReader, files_in, parts_of, take_in
from vrg.launch.remote.wire import PART, FilePart


def test_files_arrive_as_they_are_in_folders_of_the_same_names(tmp_path: Path) -> None:
    there, here = tmp_path / "there", tmp_path / "here"
    content = {"match.toml": b"name", "deep/er/a b.py": b"x" * (2 * PART + 7), "empty": b"", "logs/ann.log": b"no"}
    for name, data in content.items():
        (there / name).parent.mkdir(parents=True, exist_ok=True)
        (there / name).write_bytes(data)
    here.mkdir()
    (here / "empty").write_bytes(b"what was there before")
    parts = list(parts_of(there, {"logs/ann.log"}))
    assert max(len(part.data) for part in parts) == PART
    for part in parts:
        take_in(here, part)
    del content["logs/ann.log"]
    assert {p.relative_to(here).as_posix(): p.read_bytes() for p in here.rglob("*") if p.is_file()} == content


@pytest.mark.parametrize("path", ["/etc/passwd", "../x", "a/../../x", "", ".", "link/x", "link", "a\0b"])
def test_no_file_gets_out_of_the_folder(tmp_path: Path, path: str) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    with pytest.raises(LaunchError, match="expected a file of the run folder"):
        take_in(folder, FilePart(path, b"evil", begins=True))
    assert sorted(tmp_path.iterdir()) == [folder]


def test_links_do_not_travel(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path / "secret")
    assert list(parts_of(folder)) == []


@given(lines=st.lists(st.binary(max_size=50), max_size=10))
def test_a_log_comes_in_pieces_and_whole(lines: list[bytes], tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("logs")
    reader = LogReader(folder, {})
    got = b""
    for line in lines:
        with (folder / "ann.log").open("ab") as log:
            log.write(line)
        got += b"".join(text.text for text in reader.new_text())
    assert got == b"".join(lines)


def test_of_a_flood_the_end_comes_and_how_much_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "ann.log").write_bytes(b"a" * 10 * PART + b"z")
    (text,) = LogReader(tmp_path, {}).new_text()
    assert text.text.startswith(f"\n[{9 * PART + 1} bytes are left out here]\n".encode())
    assert text.text.endswith(b"z")
    assert len(text.text) < PART + 100


def test_a_reader_that_is_made_anew_goes_on_and_a_log_that_begins_anew_is_read_from_its_beginning(
    tmp_path: Path,
) -> None:
    log = tmp_path / "ann.log"
    log.write_bytes(b"one\n")
    (first,) = LogReader(tmp_path, {}).new_text()
    log.write_bytes(b"one\ntwo\n")
    reader = LogReader(tmp_path, {first.name: first.end})
    (second,) = reader.new_text()
    assert (second.text, second.end) == (b"two\n", 8)
    log.write_bytes(b"new")
    assert [text.text for text in reader.new_text()] == [b"new"]


def test_a_file_that_cannot_be_read_or_named_does_not_keep_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b", "c", os.fsdecode(b"\xff")):
        (tmp_path / name).write_text("whole")
    opened = Path.open

    def refuse(path: Path, *arguments: str) -> object:
        if path.name == "b":
            raise PermissionError(13, "Permission denied")
        return opened(path, *arguments)

    monkeypatch.setattr(Path, "open", refuse)
    failed: list[str] = []
    parts = list(parts_of(tmp_path, (), lambda name, error: failed.append(f"{name}: {error.strerror}")))
    assert [part.path for part in parts] == ["a", "c"]
    assert sorted(failed) == ["'\\udcff': its name is not UTF-8", "b: Permission denied"]
    with pytest.raises(PermissionError):
        list(parts_of(tmp_path))


def test_what_python_and_vrg_make_for_themselves_does_not_travel(tmp_path: Path) -> None:
    for name in ("ann.py", "__pycache__/ann.pyc", ".agent", ".world.snapshot.partial"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    assert files_in(tmp_path) == ["ann.py"]
