"""Texts of people in any encoding that their editors write, and records of which a part is damaged."""

import codecs
import os
from pathlib import Path

import msgspec
import pytest

from vrg.errors import FileError
from vrg.files import read_text, records_of, text_of, write_whole
from vrg.system import POSIX
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY

TEXT = "name = \"café 小明\"\nmap = 'open'\n"


@pytest.mark.parametrize(
    "data",
    [
        TEXT.encode(),
        TEXT.encode("utf-8-sig"),
        TEXT.encode("utf-16"),
        codecs.BOM_UTF16_BE + TEXT.encode("utf-16-be"),
        TEXT.replace("\n", "\r\n").encode("utf-8-sig"),
        TEXT.replace("\n", "\r").encode(),
    ],
)
def test_a_text_is_read_as_any_editor_writes_it(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "text").write_bytes(data)
    assert read_text(tmp_path / "text") == TEXT


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"a = 1\nname = 'caf\xe9'\n", "found the byte 0xe9 in line 2: save it as UTF-8"),
        (b"\xff\xfea", "found half a character"),
        ("a = 1\n".encode("utf-16-le"), "found a zero byte in line 1: save it as UTF-8"),
    ],
)
def test_what_is_no_text_is_refused_with_its_line(data: bytes, words: str) -> None:
    with pytest.raises(FileError, match=words):
        text_of(data)


def test_a_match_that_notepad_has_saved_is_good(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    yard = 'name = "yard"\nbounds = { x_min = -9.0, y_min = -9.0, x_max = 9.0, y_max = 9.0 }\n'
    for encoding in ("utf-8-sig", "utf-16"):
        Path("yard.toml").write_text(yard, encoding=encoding)
        Path("m.toml").write_text(TINY.replace('"open"', '"yard.toml"'), encoding=encoding)
        done = invoke("check", "m.toml")
        assert "m.toml: can be played" in done.output, done.exception


class Row(msgspec.Struct, forbid_unknown_fields=True):
    n: int


def test_what_is_whole_in_a_file_of_records_counts_and_what_is_not_is_named() -> None:
    found = records_of(b'{"n":1}\n{"n":"x"}\n\xff\n{"n":4}\n{}\n{"n":', msgspec.json.Decoder(Row))
    assert [row.n for row in found] == [1, 4]
    assert [number for number, _ in found.damaged] == [2, 3, 5]
    assert (found.end, found.torn) == (28, 5)
    assert found.damage(Path("x.jsonl"), "a row")[-1] == "x.jsonl: left out a torn last line of 5 bytes"


def test_why_a_record_is_left_out_steers_no_terminal() -> None:
    [(number, why)] = records_of(b'{"\\u001b[2J":1}\n', msgspec.json.Decoder(Row)).damaged
    assert number == 1
    assert "unknown field `\\x1b[2J`" in why


def test_what_is_synced_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    replace, fsync = os.replace, os.fsync
    monkeypatch.setattr(os, "replace", lambda *paths: (done.append("named"), replace(*paths)))
    monkeypatch.setattr(os, "fsync", lambda descriptor: (done.append("synced"), fsync(descriptor)))
    write_whole(tmp_path / "file", b"new", synced=True)
    assert done == (["synced", "named", "synced"] if POSIX else ["synced", "named"])
    done.clear()
    write_whole(tmp_path / "file", b"new")
    assert done == ["named"]


def test_a_file_that_cannot_be_written_stays_and_a_link_is_replaced(tmp_path: Path) -> None:
    other, file = tmp_path / "other", tmp_path / "file"
    other.write_text("other")
    file.symlink_to(other)
    write_whole(file, b"new", 0o600)
    assert (file.read_text(), file.is_symlink(), other.read_text()) == ("new", False, "other")
    assert file.stat().st_mode & 0o777 == 0o600
    (tmp_path / "folder" / "x").mkdir(parents=True)
    with pytest.raises(OSError, match="directory"):
        write_whole(tmp_path / "folder", b"new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder", "other"]
