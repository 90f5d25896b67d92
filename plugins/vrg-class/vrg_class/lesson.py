"""The steps of a lesson: files of Markdown, each with what a try of it plays and the goal that it must reach.

A file begins with a table in TOML between two lines `+++`, and goes on with the text that the student reads:

    +++
    title = "Drive"
    match = "alone.toml"
    seconds = 20
    goal = { zone = "safe" }
    +++
    Change the number in ...

The number before the name of a file is its place in the lesson, such as `03-turn.md`. A file of the same name in a
folder of a language, such as `de/03-turn.md`, has the words in this language: in its table `title` and `hint` alone.
"""

from collections.abc import Collection, Sequence
from importlib.resources import as_file, files
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

from pydantic import Field, ValidationError

from vrg.errors import ConfigError
from vrg.files import read_text, toml_of
from vrg.tables import Table, problems_of
from vrg_class.languages import ENGLISH

FENCE: Final = "+++\n"
"""What stands before and behind the table of a step."""
TEXT_SIZE: Final = 100_000
"""The number of characters that a step may have."""
FIRST: Final = "first.py.txt"
"""The code with which a student begins, beside the steps or in a folder of a language."""
T = TypeVar("T", bound=Table)


class Goal(Table):
    """What a try must reach. All that is named must hold at the same instant, but for `never`.

    Args:
        call: the rule of a call of the referee that names a player of the own team; `against` of one that names a
            player of the other team. never: the rule of a call that must not name a player of the own team before.
        zone: the kind of a zone in which the centre of a robot of the own team is.
        way: the length of the way of a robot of the own team, m.
        turned: the angle by which a robot of the own team has turned in all, degrees.
        points: of the own team. ahead: by which the own team leads. wins: the own team wins the game.
        prints: whether the code has printed something.
        within: the match time of play in s in which the goal must be reached; None for the whole try.
    """

    call: str | None = None
    against: str | None = None
    never: str | None = None
    zone: str | None = None
    way: float | None = Field(None, gt=0.0)
    turned: float | None = Field(None, gt=0.0)
    points: int | None = None
    ahead: int | None = None
    wins: bool = False
    prints: bool = False
    within: float | None = Field(None, gt=0.0)


class Words(Table):
    """The table of a step in another language.

    Args:
        title: of the step. hint: what helps a student whose tries have failed a few times.
    """

    title: str = Field(min_length=1, max_length=60)
    hint: str = ""


class Head(Words):
    """The table of a step.

    Args:
        goal: what a try must reach.
        match: the match file of its tries, beside the step, or the name of a game.
        team: the own team; empty for the first one of the match. seconds: the match time after which a try ends.
        other: the strategy of the other team; empty leaves it to the match.
    """

    goal: Goal
    match: str
    team: str = ""
    seconds: float = Field(60.0, gt=0.0, le=600.0)
    other: str = ""


class Told(NamedTuple):
    """What a student reads of a step: the title, the text and the hint, both in Markdown."""

    title: str
    text: str
    hint: str


class Step:
    """One step of a lesson.

    Args:
        path: its file.

    Attributes:
        name: that of the file without its ending. head: its table.

    Raises:
        ConfigError: the file cannot be read, or its table has problems.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, path.stem
        self.head, text = _read(path, Head)
        self._told = {ENGLISH: Told(self.head.title, text, self.head.hint)}
        for language in languages(path.parent):
            if (file := path.parent / language / path.name).is_file():
                words, text = _read(file, Words)
                self._told[language] = Told(words.title, text, words.hint)

    @property
    def languages(self) -> Collection[str]:
        """The languages that it has, besides that of the step itself."""
        return self._told.keys() - {ENGLISH}

    def told(self, language: str) -> Told:
        """What a student reads, in a language; as the step itself has it where there is no other file."""
        return self._told.get(language, self._told[ENGLISH])

    @property
    def match(self) -> str:
        """The match of its tries: the path of a file, or the name of a game."""
        beside = self.path.parent / self.head.match
        return str(beside) if beside.is_file() else self.head.match

    @property
    def other(self) -> str:
        """The strategy of the other team: a file beside the step, or a name; empty leaves it to the match."""
        beside = self.path.parent / self.head.other
        return str(beside) if self.head.other and beside.is_file() else self.head.other


def _read(path: Path, kind: type[T]) -> tuple[T, str]:
    """The table and the text of a file.

    Raises:
        ConfigError: it cannot be read, or its table has problems.
    """
    try:
        whole = read_text(path)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    before, _, rest = whole.partition(FENCE)
    table, fence, text = rest.partition(FENCE)
    if before.strip() or not fence or len(whole) > TEXT_SIZE:
        raise ConfigError(f"{path}: expected a table between two lines +++, and a text of at most {TEXT_SIZE} letters")
    try:
        return kind.model_validate(toml_of(table)), text
    except ValidationError as error:
        raise ConfigError([f"{path}: {problem}" for problem in problems_of(error)]) from None
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None


def languages(folder: Path) -> Collection[str]:
    """The languages in which a lesson has words, besides that of its steps, by their tags such as `de`."""
    return frozenset(place.name for place in folder.glob("[a-z][a-z]/") if any(place.glob("*.md")))


def lesson_of(folder: Path) -> Sequence[Step]:
    """The steps of a lesson, in the order of their files.

    Raises:
        ConfigError: there are none, or one of them cannot be used.
    """
    found = [Step(path) for path in sorted(folder.glob("*.md"))]
    if not found:
        raise ConfigError([f"{folder}: expected the steps of a lesson, such as 01-drive.md, found none"])
    return found


def shipped(game: str) -> Path | None:
    """The folder of the lesson that comes with the package for a game; None if there is none."""
    with as_file(files("vrg_class.lessons") / game) as folder:
        return folder if folder.is_dir() else None


def first_code(folder: Path, language: str) -> str:
    """The code with which a student begins, in a language or else as it lies beside the steps of a lesson.

    Raises:
        ConfigError: it cannot be read.
    """
    path = next((file for file in (folder / language / FIRST, folder / FIRST) if file.is_file()), folder / FIRST)
    try:
        return read_text(path)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
