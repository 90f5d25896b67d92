"""The folder of a class: names, versions, what is lost when a disk is full or a file is broken."""

import os
import re
from pathlib import Path

import pytest

from vrg_class.folder import (
    APART,
    MOST_STUDENTS,
    MOST_VERSIONS,
    MUCH,
    NAME_SIZE,
    About,
    ClassFolder,
    Student,
    alike,
    checked_name,
    folder_name,
)

ABOUT = About(game="roboflag", match="roboflag", lesson="", teacher="t", joining="j")


@pytest.fixture
def folder(tmp_path: Path) -> ClassFolder:
    return ClassFolder(tmp_path / "class", ABOUT)


def texts(folder: ClassFolder, student: Student) -> list[str]:
    """The code of all versions, the newest first."""
    return [folder.file(student, version.number).read_text() for version in folder.versions(student)]


def let_stand(folder: ClassFolder, student: Student) -> None:
    """Let the newest version be older than code must be that is kept."""
    file = folder.file(student, student.versions)
    then = file.stat().st_mtime - APART - 1.0
    os.utime(file, (then, then))


@pytest.mark.parametrize(
    ("name", "folder"),
    [
        ("Ada", "ada"),
        ("Zoë K.", "zoe-k"),
        ("O’Neil", "o-neil"),
        ("Doe, Ann", "doe-ann"),
    ],
)
def test_names_have_folders_of_plain_letters(name: str, folder: str) -> None:
    assert folder_name(checked_name(name)) == folder


def test_names_in_other_letters_have_folders_of_a_hash() -> None:
    found = [folder_name(checked_name(name)) for name in ("李雷", "नमस्ते", "محمد")]
    assert all(re.search(r"x[0-9a-f]{8}$", one) for one in found)
    assert all(re.fullmatch(r"[a-z0-9-]+", one) for one in found)
    assert len(set(found)) == 3


def test_names_that_are_written_otherwise_are_alike_and_others_are_not() -> None:
    composed, decomposed = "Zoë", "Zoe\u0308"
    assert alike(composed) == alike(decomposed) == alike("ZOË")
    assert alike("Анна") == alike("АННА") != alike("Борис")
    assert checked_name(decomposed) == composed
    assert len(checked_name("W" * NAME_SIZE)) == NAME_SIZE
    for wrong in ("W" * (NAME_SIZE + 1), "", "=1", "<b>", "\u202eevil"):
        with pytest.raises(ValueError, match="expected a name"):
            checked_name(wrong)


def test_old_versions_go_but_not_the_one_that_was_handed_in(folder: ClassFolder) -> None:
    student = folder.hand_in(folder.version(folder.join("Ada"), "# 1"))
    first = folder.file(student, 1)
    for number in range(2, MOST_VERSIONS + 10):
        student = folder.version(student, f"# {number}")
    assert first.is_file()
    assert not folder.file(student, 2).exists()
    assert folder.file(student, student.versions).read_text() == f"# {MOST_VERSIONS + 9}"
    assert folder.version(student, f"# {MOST_VERSIONS + 9}") == student, "the same code is no other version"
    assert ClassFolder(folder.path).students == folder.students
    for file in (folder.path / "class.json", folder.of(student) / "student.json", first):
        assert file.stat().st_mode & 0o77 == 0


def test_what_stood_long_or_is_much_is_kept_when_it_is_replaced(folder: ClassFolder) -> None:
    student = folder.save(folder.join("Ada"), "# typed")
    assert texts(folder, student) == []
    student = folder.save(student, "# typed on")
    assert texts(folder, student) == ["# typed"], "nothing was kept before"
    student = folder.save(student, "# typed on and on")
    assert texts(folder, student) == ["# typed"], "a letter more is no version"
    let_stand(folder, student)
    student = folder.save(student, "#" * MUCH * 2)
    assert texts(folder, student) == ["# typed on and on", "# typed"]
    student = folder.save(student, "gone")
    assert texts(folder, student)[0] == "#" * MUCH * 2
    student = folder.save(student, "another", apart=True)
    assert texts(folder, student)[0] == "gone"
    assert folder.code(student) == "another"


def test_two_names_that_once_were_alike_have_folders_of_their_own(folder: ClassFolder) -> None:
    first = folder.join("Ada")
    folder.change(first.folder, name="Bea")
    second = folder.join("Ada")
    assert (first.folder, second.folder) == ("ada", "ada-2")
    assert {student.name for student in ClassFolder(folder.path).students.values()} == {"Ada", "Bea"}


def test_a_class_has_a_last_seat(folder: ClassFolder) -> None:
    for number in range(MOST_STUDENTS):
        folder.join(f"Student {number}")
    with pytest.raises(OverflowError, match="the class is full"):
        folder.join("Ada")


def test_what_cannot_be_written_is_known_and_written_later(
    folder: ClassFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    student = folder.join("Ada")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("vrg_class.folder.write_whole", full)
        folder.change(student.folder, done=("01-drive",))
        with pytest.raises(OSError, match="No space"):
            folder.save(student, "# not saved")
        with pytest.raises(OSError, match="No space"):
            folder.settle()
    assert folder.students["ada"].done == ("01-drive",)
    assert ClassFolder(folder.path).students["ada"].done == ()
    folder.settle()
    assert ClassFolder(folder.path).students["ada"].done == ("01-drive",)
    assert [file.name for file in folder.of(student).iterdir()] == ["student.json"], "no file that is a part of one"


def test_a_record_that_is_older_than_the_versions_overwrites_none(folder: ClassFolder) -> None:
    older = folder.join("Ada")
    folder.version(older, "# precious")
    folder.keep(older)
    student = ClassFolder(folder.path).students["ada"]
    again = folder.version(student, "# later")
    assert texts(folder, again) == ["# later", "# precious"]
