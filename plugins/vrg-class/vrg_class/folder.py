"""The folder of a class: one folder a student, with all versions of the code; everything survives a restart.

    class.json                    the game, the match, the lesson, and the tokens of the teacher's and the joining links
    students/NAME/student.json    what is known of a student
    students/NAME/code.py         the code as it was last saved
    students/NAME/versions/       each version that was tried or handed in
    entries/NAME.py               what was handed in, which `vrg league` and `vrg play` take
    league/                       the league of the class

Only its owner may look into it, as it has the code and the words of all.
"""

import hashlib
import re
import secrets
import time
import unicodedata
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec
from msgspec import Struct, structs

from vrg.errors import ConfigError
from vrg.files import read_bytes, write_whole

CODE_SIZE: Final = 100_000
"""The number of letters that a student's code may have."""
MOST_VERSIONS: Final = 200
"""The versions of a student that are kept; the oldest ones that were not handed in go first."""
MOST_STUDENTS: Final = 64
NAME_SIZE: Final = 24
"""The number of letters that a name may have."""
TOKEN_BYTES: Final = 16
CODE: Final = "code.py"
"""The name of the file with a student's code."""


class About(Struct, frozen=True, kw_only=True):
    """The class as it is kept.

    Args:
        game: the name of the game. match: the match of the league, a file or the name of a game.
        lesson: the folder with the steps; empty for none.
        teacher, joining: the tokens of the teacher's link, and of the link by which students join.
        roster: the word of each student by name; empty if everybody with the link may join.
    """

    game: str
    match: str
    lesson: str
    teacher: str
    joining: str
    roster: dict[str, str] = {}


class Student(Struct, frozen=True, kw_only=True):
    """A student as it is kept.

    Args:
        name: as it was typed. token: of the student's link. folder: the name of the folder.
        done: the names of the steps whose goal was reached.
        handed: the number of the version that was handed in last; 0 for none. versions: how many there have been.
        tries: how many there have been. since: when the last goal was reached, or the student came, s of wall time.
        error, line: what went wrong last, in words, and where in the code; empty once a goal was reached.
    """

    name: str
    token: str
    folder: str
    done: tuple[str, ...] = ()
    handed: int = 0
    versions: int = 0
    tries: int = 0
    since: float = 0.0
    error: str = ""
    line: int | None = None


def checked_name(typed: str) -> str:
    """A name as it is kept.

    Raises:
        ValueError: it cannot be the name of a student.
    """
    name = " ".join(unicodedata.normalize("NFC", typed).split())
    good = name[:1].isalnum() and all(unicodedata.category(c)[0] in "LMN" or c in " .'’-_" for c in name)
    if not good or len(name) > NAME_SIZE or not folder_name(name):
        raise ValueError(f"expected a name of 1 to {NAME_SIZE} letters and digits, got {typed[:40]!r}")
    return name


def folder_name(name: str) -> str:
    """The name of the folder of a student: lower-case letters, digits and hyphens."""
    plain = unicodedata.normalize("NFKD", name.casefold())
    found = re.sub(r"[^a-z0-9]+", "-", plain).strip("-")
    if any(c.isalpha() and not c.isascii() for c in plain):  # other letters than these tell names apart, too
        found += "x" + hashlib.sha256(name.encode()).hexdigest()[:8]
    return found


class ClassFolder:
    """The folder of a class. All methods are quick, and called by one thread.

    Args:
        path: the folder. about: of a class that is new; None for one that is there.

    Attributes:
        students: all students, by token.

    Raises:
        ConfigError: the folder cannot be used, or is no class.
    """

    def __init__(self, path: Path, about: About | None = None) -> None:
        self.path = path
        self._file = path / "class.json"
        try:
            if about is not None:
                path.mkdir(mode=0o700, parents=True, exist_ok=True)
                self._write(self._file, about)
            self.about = msgspec.json.decode(read_bytes(self._file), type=About)
            (path / "students").mkdir(mode=0o700, exist_ok=True)
            self.entries.mkdir(mode=0o700, exist_ok=True)
            self.students = {student.token: student for student in self._found()}
        except (OSError, ValueError) as error:
            raise ConfigError(f"{path}: expected the folder of a class: {error}") from None

    @property
    def entries(self) -> Path:
        """The folder with what was handed in."""
        return self.path / "entries"

    @property
    def league(self) -> Path:
        """The folder of the league."""
        return self.path / "league"

    def of(self, student: Student) -> Path:
        """The folder of a student."""
        return self.path / "students" / student.folder

    def join(self, name: str) -> Student:
        """Take in a new student.

        Raises:
            ValueError: the name is taken, or the class is full.
        """
        folder = folder_name(name)
        if any(student.folder == folder for student in self.students.values()):
            raise ValueError(f"{name} has joined already: choose another name, or open your own link")
        if len(self.students) >= MOST_STUDENTS:
            raise ValueError(f"the class has {MOST_STUDENTS} students, and room for no more")
        student = Student(name=name, token=secrets.token_urlsafe(TOKEN_BYTES), folder=folder, since=time.time())
        place = self.of(student)
        (place / "versions").mkdir(mode=0o700, parents=True, exist_ok=True)
        self.keep(student)
        return student

    def keep(self, student: Student) -> Student:
        """Write down what is known of a student."""
        self._write(self.of(student) / "student.json", student)
        self.students[student.token] = student
        return student

    def named(self, name: str) -> Student | None:
        """The student of a name; None if there is none."""
        folder = folder_name(name)
        return next((student for student in self.students.values() if student.folder == folder), None)

    def code(self, student: Student) -> str:
        """The code as it was last saved; empty if it never was.

        Raises:
            OSError: it cannot be read.
        """
        path = self.of(student) / CODE
        return path.read_text(encoding="utf-8") if path.exists() else ""

    def save(self, student: Student, code: str) -> None:
        """Save the code of a student.

        Raises:
            OSError: it cannot be written.
        """
        write_whole(self.of(student) / CODE, code.encode())

    def version(self, student: Student, code: str, *, handed: bool = False) -> tuple[Student, Path]:
        """Keep a version of the code, if it is another one than the last; the student, and the file of the version.

        Args:
            handed: True hands it in, so that it plays in the league.

        Raises:
            OSError: it cannot be written.
        """
        self.save(student, code)
        last = self.file(student, student.versions)
        if not last.is_file() or last.read_bytes() != code.encode():
            student = structs.replace(student, versions=student.versions + 1)
            last = self.file(student, student.versions)
            last.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(last, code.encode())
            self._drop_old(student)
        if handed:
            write_whole(self.entries / f"{student.folder}.py", code.encode())
            student = structs.replace(student, handed=student.versions)
        return self.keep(student), last

    def file(self, student: Student, number: int) -> Path:
        """The file of a version of a student."""
        return self.of(student) / "versions" / f"{number:04}" / CODE

    def _drop_old(self, student: Student) -> None:
        for number in range(1, student.versions - MOST_VERSIONS + 1):
            file = self.file(student, number)
            if number != student.handed and file.is_file():
                file.unlink()
                file.parent.rmdir()

    def _found(self) -> Iterator[Student]:
        for file in sorted((self.path / "students").glob("*/student.json")):
            yield msgspec.json.decode(read_bytes(file), type=Student)

    @staticmethod
    def _write(path: Path, what: Struct) -> None:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_whole(path, msgspec.json.format(msgspec.json.encode(what)) + b"\n")
        path.chmod(0o600)
