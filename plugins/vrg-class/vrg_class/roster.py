"""The roster of a class: names and words, as spreadsheets write them."""

import csv
import io
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from vrg.errors import ConfigError
from vrg.files import read_bytes
from vrg.ui.web.admission import is_token
from vrg_class.folder import MOST_STUDENTS, alike, checked_name, same

SEPARATORS: Final = ",;\t"
OF_DEVICE: Final = 5
OF_NAME: Final = 60
"""The wrong words in a minute."""
_NAMES: Final = ("name", "names", "student", "pupil", "schüler", "schülerin", "nombre", "alumno", "nom", "élève")
_FIRST: Final = ("first name", "given name", "vorname", "prénom", "nombre de pila")
_LAST: Final = (
    "last name",
    "surname",
    "family name",
    "nachname",
    "familienname",
    "apellido",
    "apellidos",
    "nom de famille",
)
_WORDS: Final = ("word", "password", "code", "wort", "kennwort", "passwort", "palabra", "contraseña", "clave", "mot",
                 "mot de passe")  # fmt: skip
"""What the head of a column says, in small letters."""


def read_roster(path: Path) -> dict[str, str]:
    """The word of each student by name.

    Raises:
        ConfigError: the file cannot be read, or a line of it is none of a roster; with all such lines.
    """
    try:
        data = read_bytes(path)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    return roster_of(data, str(path))


def roster_of(data: bytes, where: str) -> dict[str, str]:
    """The word of each student by name.

    Args:
        data: of a file in UTF-8, UTF-16 or Windows-1252, whose cells are separated by commas, semicolons or tabs. The
            first line may name the columns, such as `Name;Word`, or `First name,Last name,Password`.
        where: the name of the file.

    Raises:
        ConfigError: a line of it is none of a roster; with all such lines.
    """
    try:
        text = _text(data)
    except UnicodeDecodeError as error:
        raise ConfigError(f"{where}: expected a text in UTF-8: {error}") from None
    head = re.sub(r'"[^"]*"', "", text.lstrip().split("\n", 1)[0])
    separator = max(SEPARATORS, key=head.count)
    lines = csv.reader(io.StringIO(text, newline=""), delimiter=separator, skipinitialspace=True, strict=True)
    columns: tuple[Sequence[int], int] | None = None
    found: dict[str, str] = {}
    places: dict[str, int] = {}
    problems: list[str] = []
    before = 0
    try:
        for row in lines:
            number, before = before + 1, lines.line_num
            cells = [" ".join(cell.replace("\ufeff", "").split()) for cell in row]
            if not any(cells):
                continue
            if columns is None:
                columns = _columns(cells)
                if columns is not None:
                    continue
                columns = (0,), 1
            try:
                name, word = _student(cells, columns)
                key = alike(name)
                if key in places:
                    raise ValueError(f"line {places[key]} has a name much like {name}: add a letter")
                found[name], places[key] = word, number
            except ValueError as error:
                problems.append(f"{where}:{number}: {error}")
    except csv.Error as error:
        problems.append(f"{where}:{before + 1}: {error}: a quotation mark may be missing")
    if not problems and len(found) > MOST_STUDENTS:
        problems.append(
            f"{where}: {len(found)} names, and a class has room for {MOST_STUDENTS}: make two classes of them"
        )
    if problems or not found:
        raise ConfigError(problems or [f"{where}: expected a name and a word in each line, found none"])
    return found


def _text(data: bytes) -> str:
    """The text of a file as spreadsheets write it."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16")
    if b"\0" in data[:200]:  # UTF-16 without a byte order mark
        low = data[1:200:2].count(0) > data[:200:2].count(0)
        return data.decode("utf-16-le" if low else "utf-16-be")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252")


def _columns(cells: Sequence[str]) -> tuple[Sequence[int], int] | None:
    """The columns of the parts of a name, and that of the word; None if these cells are no head."""
    head = [cell.lower() for cell in cells]
    words = [n for n, cell in enumerate(head) if cell in _WORDS]
    first, last = ([n for n, cell in enumerate(head) if cell in kind] for kind in (_FIRST, _LAST))
    if first and not last:  # in French and Spanish the surname may be headed as a name is
        last = [n for n, cell in enumerate(head) if cell in _NAMES]
    name = [*first, *last] if first and last else [n for n, cell in enumerate(head) if cell in _NAMES][:1]
    return (name, words[0]) if name and words else None


def _student(cells: Sequence[str], columns: tuple[Sequence[int], int]) -> tuple[str, str]:
    """The name and the word of a line.

    Raises:
        ValueError: it has none, or more than these.
    """
    names, word = columns
    if names == (0,) and any(cells[2:]):
        raise ValueError(f"expected NAME,WORD, got {len(cells)} cells: put a name with a comma into quotation marks")
    if word >= len(cells) or not cells[word]:
        raise ValueError("expected NAME,WORD, found no word")
    return checked_name(" ".join(cells[n] for n in names if n < len(cells))), cells[word]


def listed(roster: Mapping[str, str], name: str, word: str) -> str | None:
    """The name in a roster of whoever knows its word, both in capitals or not; None if there is none."""
    for known, own in roster.items():
        if alike(known) == alike(name) or _parts(known) == _parts(name):
            return known if is_token(same(word), same(own)) else None
    return None


def _parts(name: str) -> list[str]:
    """The parts of a name; some write the surname first."""
    return sorted(re.findall(r"\w+", same(name)))


class Guesses:
    """Wrong words: a device has few in a minute, and so has whoever tries many of one name from many devices.

    A school's computers have one address, so addresses tell nothing.
    """

    def __init__(self) -> None:
        self._minute = 0
        self._wrong: Counter[tuple[str, ...]] = Counter()

    def are_over(self, name: str, device: str, now: float) -> bool:
        """Whether no further word is heard in this minute; `now` is a monotonic time, s."""
        if int(now // 60) != self._minute:
            self._minute = int(now // 60)
            self._wrong.clear()
        return self._wrong[device, ""] >= OF_DEVICE or self._wrong["", alike(name)] >= OF_NAME

    def add(self, name: str, device: str) -> None:
        """Take a wrong word in."""
        self._wrong[device, ""] += 1
        self._wrong["", alike(name)] += 1
