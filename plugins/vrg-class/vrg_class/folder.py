"""The folder of a class: one folder a student, with all versions of the code; everything survives a restart.

    class.json                    the game, the match, the lesson, and the tokens of the teacher's and the joining links
    students/NAME/student.json    what is known of a student
    students/NAME/code.py         the code as it was last saved
    students/NAME/versions/       each version that was tried, handed in, or replaced by another one
    entries/NAME.py               what was handed in, which `vrg league` and `vrg play` take
    removed/                      the folders of students that the teacher has removed
    league/                       the league of the class

Only its owner may look into it, as it has the code and the words of all.
"""

import contextlib
import hashlib
import re
import secrets
import time
import unicodedata
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
from msgspec import Struct, structs

from vrg.errors import ConfigError
from vrg.files import make_folder, read_bytes, write_whole
from vrg.ui.web.admission import TOKEN_BYTES, is_token

CODE_SIZE: Final = 100_000
"""The number of letters that a student's code may have."""
MOST_VERSIONS: Final = 200
"""The versions of a student that are kept; the oldest ones that were not handed in go first."""
MOST_STUDENTS: Final = 64
NAME_SIZE: Final = 60
"""The number of letters that a name may have."""
APART: Final = 60.0
"""The time in s for which code stands before it is kept as a version when it is replaced."""
MUCH: Final = 200
"""The number of letters of which code is shortened before it is kept as a version."""
CODE: Final = "code.py"
"""The name of the file with a student's code."""


class About(Struct, frozen=True, kw_only=True):
    """The class as it is kept.

    Args:
        game: the name of the game. match: the match of the league, a file or the name of a game.
        lesson: the folder with the steps; empty for none.
        teacher, joining: the tokens of the teacher's link, and of the link by which students join.
        roster: the word of each student by name; empty if everybody with the link may join.
        roster_file: from which it was read, and is read again when it has changed; empty for none.
    """

    game: str
    match: str
    lesson: str
    teacher: str
    joining: str
    roster: dict[str, str] = {}
    roster_file: str = ""


class Student(Struct, frozen=True, kw_only=True):
    """A student as it is kept.

    Args:
        name: as it was typed. token: of the student's link.
        folder: the name of the folder, which says who it is: names and tokens may change.
        device: from which the student has joined; empty if that is not known.
        known_as: the name by which the student has joined, where the teacher has given another one.
        done: the names of the steps whose goal was reached.
        handed: the number of the version that was handed in last; 0 for none. versions: how many there have been.
        tries: how many there have been. since: when the last goal was reached, or the student came, s of wall time.
        error, line: what went wrong last, in words, and where in the code; empty once a goal was reached.
    """

    name: str
    token: str
    folder: str
    device: str = ""
    known_as: str = ""
    done: tuple[str, ...] = ()
    handed: int = 0
    versions: int = 0
    tries: int = 0
    since: float = 0.0
    error: str = ""
    line: int | None = None


class Version(NamedTuple):
    """A version of a student's code: its number, when it was made, s of wall time, and its lines."""

    number: int
    made: float
    lines: int


def checked_name(typed: str) -> str:
    """A name as it is kept.

    Raises:
        ValueError: it cannot be the name of a student.
    """
    name = " ".join(unicodedata.normalize("NFC", typed).split())
    good = name[:1].isalnum() and all(unicodedata.category(c)[0] in "LMN" or c in " .,'’-_()\u200c\u200d" for c in name)
    if not good or len(name) > NAME_SIZE or not folder_name(name):
        raise ValueError(f"expected a name of 1 to {NAME_SIZE} letters and digits, got {typed[:NAME_SIZE]!r}")
    return name


def same(text: str) -> str:
    """What names and words have in common that are typed in capitals, without them, or with spaces around them."""
    return " ".join(unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", text).casefold()).split())


def folder_name(name: str) -> str:
    """The name of the folder of a student: lower-case letters, digits and hyphens."""
    plain = unicodedata.normalize("NFKD", name.casefold())
    found = re.sub(r"[^a-z0-9]+", "-", plain).strip("-")
    if any(c.isalpha() and not c.isascii() for c in plain):  # other letters than these tell names apart, too
        found += "x" + hashlib.sha256(plain.encode()).hexdigest()[:8]
    return found


def alike(name: str) -> str:
    """What names have in common that are too much alike for one class."""
    return folder_name(name) or same(name)


def revision(code: str) -> str:
    """What tells code from other code."""
    return hashlib.sha256(code.encode(errors="surrogatepass")).hexdigest()[:16]


class ClassFolder:
    """The folder of a class. All methods are for one thread; what they read of its attributes is for any.

    Args:
        path: the folder. about: of a class that is new; None for one that is there.

    Attributes:
        students: all students, by their folders. problems: what could not be read, in words; all else goes on.

    Raises:
        ConfigError: the folder cannot be used, or is no class.
    """

    def __init__(self, path: Path, about: About | None = None) -> None:
        self.path = path
        self._file = path / "class.json"
        self.problems: list[str] = []
        self._unwritten: set[str] = set()
        try:
            if about is not None:
                self._write(self._file, about)
            self.about = msgspec.json.decode(read_bytes(self._file), type=About)
            (path / "students").mkdir(mode=0o700, exist_ok=True)
            self.entries.mkdir(mode=0o700, exist_ok=True)
        except (OSError, ValueError) as error:
            raise ConfigError(f"{path}: expected the folder of a class: {error}") from None
        self.students: Mapping[str, Student] = self._found()

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

    def join(self, name: str, device: str = "") -> Student:
        """Take in a new student, whose name is free: see `named`.

        Args:
            device: from which the student joins; empty if that is not known.

        Raises:
            OverflowError: the class is full. OSError: it cannot be written.
        """
        if len(self.students) >= MOST_STUDENTS:
            raise OverflowError(f"the class is full: it has {MOST_STUDENTS} students")
        plain, number = folder_name(name), 1
        while (folder := plain if number == 1 else f"{plain}-{number}") in self.students:
            number += 1
        token = secrets.token_urlsafe(TOKEN_BYTES)
        # Where the record of a student was lost, the code is still there.
        versions = self._newest(folder)
        student = Student(
            name=name, token=token, folder=folder, device=device, versions=versions, since=time.time()
        )  # fmt: skip
        return self.keep(student)

    def keep(self, student: Student) -> Student:
        """Write down what is known of a student. If it cannot be written, it is known as long as this runs.

        Raises:
            OSError: it cannot be written yet: see `settle`.
        """
        self.students = {**self.students, student.folder: student}
        self._unwritten.add(student.folder)
        self._write(self.of(student) / "student.json", student)
        self._unwritten.discard(student.folder)
        return student

    def change(self, folder: str, **changes: Any) -> None:
        """Take in news of a student, if there is such; written down at the latest by `settle`."""
        if (student := self.students.get(folder)) is not None:
            try:
                self.keep(structs.replace(student, **changes))
            except OSError:
                return

    def settle(self) -> None:
        """Write what could not be written when it became known.

        Raises:
            OSError: it still cannot be written.
        """
        for folder in sorted(self._unwritten & self.students.keys()):
            self.keep(self.students[folder])

    def keep_about(self, **changes: Any) -> None:
        """Change what is known of the class.

        Raises:
            OSError: it cannot be written.
        """
        self.about = structs.replace(self.about, **changes)
        self._write(self._file, self.about)

    def remove(self, student: Student) -> None:
        """Let a student go. The folder stays below `removed`.

        Raises:
            OSError: it cannot be written.
        """
        self.students = {folder: one for folder, one in self.students.items() if folder != student.folder}
        (self.entries / f"{student.folder}.py").unlink(missing_ok=True)
        place = self.path / "removed" / time.strftime(f"%Y-%m-%d-%H%M%S-{student.folder}")
        place.parent.mkdir(mode=0o700, exist_ok=True)
        self.of(student).rename(place)

    def named(self, name: str) -> Student | None:
        """The student who has a name much like this, or has joined by it; None if there is none."""
        wanted = alike(name)
        return next((s for s in self.students.values() if wanted in (alike(s.name), alike(s.known_as))), None)

    def of_token(self, token: str) -> Student | None:
        """The student with the link of a token; None if there is none."""
        return next((student for student in self.students.values() if is_token(token, student.token)), None)

    def code(self, student: Student) -> str:
        """The code as it was last saved; empty if it never was.

        Raises:
            OSError: it cannot be read.
        """
        path = self.of(student) / CODE
        return path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""

    def save(self, student: Student, code: str, *, apart: bool = False) -> Student:
        """Save the code of a student. What stood there long, or is much of it, is kept as a version.

        Args:
            apart: what stood there is a version in any case.

        Raises:
            OSError: it cannot be written.
        """
        before = self.code(student)
        if before == code:
            return student
        last = self.file(student, student.versions)
        stood = not last.exists() or time.time() - last.stat().st_mtime > APART
        if before and (apart or stood or len(before) - len(code) > MUCH):
            student = self.version(student, before)
        write_whole(self.of(student) / CODE, code.encode(errors="replace"), 0o600, synced=True)
        return student

    def version(self, student: Student, code: str) -> Student:
        """Keep code as a version, unless the newest one is the same.

        Raises:
            OSError: it cannot be written.
        """
        last, data = self.file(student, student.versions), code.encode(errors="replace")
        if not last.is_file() or last.read_bytes() != data:
            student = structs.replace(student, versions=student.versions + 1)
            last = self.file(student, student.versions)
            make_folder(last.parent, 0o700)
            write_whole(last, data, 0o600, synced=True)
            self._drop_old(student)
            student = self.keep(student)
        return student

    def hand_in(self, student: Student) -> Student:
        """Let the newest version take part in the league.

        Raises:
            OSError: it cannot be written.
        """
        data = self.file(student, student.versions).read_bytes()
        write_whole(self.entries / f"{student.folder}.py", data, 0o600, synced=True)
        return self.keep(structs.replace(student, handed=student.versions))

    def file(self, student: Student, number: int) -> Path:
        """The file of a version of a student."""
        return self._versions(student.folder) / f"{number:04}" / CODE

    def versions(self, student: Student) -> list[Version]:
        """The versions of a student that are kept, the newest first."""
        found = []
        for file in sorted(self._versions(student.folder).glob(f"[0-9]*/{CODE}"), reverse=True):
            with contextlib.suppress(OSError):
                found.append(Version(int(file.parent.name), file.stat().st_mtime, file.read_bytes().count(b"\n") + 1))
        return found

    def _versions(self, folder: str) -> Path:
        return self.path / "students" / folder / "versions"

    def _newest(self, folder: str) -> int:
        """The number of the newest version in a folder; 0 for none."""
        return max(
            (int(file.name) for file in self._versions(folder).glob("[0-9]*") if file.name.isdecimal()), default=0
        )

    def _drop_old(self, student: Student) -> None:
        number = student.versions - MOST_VERSIONS
        file = self.file(student, number)
        if number > 0 and number != student.handed and file.is_file():
            file.unlink()
            file.parent.rmdir()

    def _found(self) -> dict[str, Student]:
        found = {}
        for place in sorted((self.path / "students").glob("*/")):
            file = place / "student.json"
            try:
                student = msgspec.json.decode(read_bytes(file), type=Student)
                versions = max(student.versions, self._newest(place.name))
                found[place.name] = structs.replace(student, folder=place.name, versions=versions)
            except (OSError, ValueError) as error:
                self.problems.append(f"{file}: cannot be read: {error}: joining with this name gives the code again")
        return found

    @staticmethod
    def _write(path: Path, what: Struct) -> None:
        make_folder(path.parent, 0o700)
        write_whole(path, msgspec.json.format(msgspec.json.encode(what)) + b"\n", 0o600, synced=True)
