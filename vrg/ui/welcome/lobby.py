"""The state of the welcome screen: which game, map or recent match is chosen. This needs no window."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

from vrg.games import GAMES, game_of
from vrg.ui.welcome import words
from vrg.ui.welcome.acts import Act
from vrg.ui.welcome.checking import Verdict
from vrg.ui.welcome.choices import Choices
from vrg.ui.welcome.draft import Draft


class List(Enum):
    """The lists of the screen, in the order of TAB."""

    GAMES = "games"
    MAPS = "maps"
    RECENT = "recent"


@dataclass(frozen=True)
class Recent:
    """A match that was played lately, or a match file of this folder.

    Args:
        name: of the match. game: its name. when: the local time in words. told: how it ended, in words; empty for a
            file that only waits to be played.
        match: the match file. run: the run folder; None for a file. recorded: the run can be watched again.
        base: the folder that relative paths of the file start from.
    """

    name: str
    game: str
    when: str
    told: str
    match: Path
    base: Path
    run: Path | None = None
    recorded: bool = False


class Wish(Enum):
    """What a person can ask for at the welcome screen."""

    START = "start"
    CHANGE = "change"
    WATCH = "watch"
    CLOSE = "close"


BUTTONS: Final = {Wish.START: words.START, Wish.CHANGE: words.CHANGE, Wish.WATCH: words.WATCH}


class Lobby:
    """Takes keys and clicks in.

    Args:
        base: the folder in which new matches are made. choices: what can be chosen.
        recent: finds the recent matches, the newest first.

    Attributes:
        active: the list that the arrows move in. at: the number of the chosen row of each list.
        draft: the match that is shown; None if its file cannot be read.
        verdict: on the newest draft that was checked. notice: what the person must be told.
        wish: what the person asks for; None while nothing is.
    """

    def __init__(self, base: Path, choices: Choices, recent: Callable[[], Sequence[Recent]]) -> None:
        self.active = List.GAMES
        self.draft: Draft | None = None
        self.verdict: Verdict | None = None
        self.notice = ""
        self.wish: Wish | None = None
        self.choices = choices
        self._checked: Draft | None = None
        self._base = base
        self._find = recent
        self.recent: tuple[Recent, ...] = tuple(recent())
        # The games that are played come first, as one who looks for practice knows its name.
        names = sorted(GAMES.names(), key=lambda name: (not game_of(name).competitive, name != "sharks-and-minnows"))
        self.games: tuple[str, ...] = tuple(name for name in names if GAMES.find(name) is not None)
        self.maps: tuple[str, ...] = ("", *choices.of(Draft("", base), "map"))
        self.at: dict[List, int] = dict.fromkeys(List, 0)
        self._choose()

    @property
    def chosen(self) -> Recent | None:
        """The recent match that is chosen; None if a game is."""
        number = self.at[List.RECENT]
        return self.recent[number] if self.active is List.RECENT and number < len(self.recent) else None

    @property
    def game(self) -> str:
        """The game that is chosen."""
        return self.games[self.at[List.GAMES]]

    @property
    def checked(self) -> bool:
        """Whether the verdict is on the match that is shown."""
        return self.draft is not None and self._checked is self.draft

    def rows(self, which: List) -> int:
        """The number of rows of a list."""
        return len({List.GAMES: self.games, List.MAPS: self.maps, List.RECENT: self.recent}[which])

    def see(self, draft: Draft, verdict: Verdict) -> None:
        """Take in what the check of a match has found."""
        self.verdict, self._checked = verdict, draft

    def refresh(self) -> None:
        """Look for recent matches again."""
        self.recent = tuple(self._find())
        self.at[List.RECENT] = min(self.at[List.RECENT], max(0, len(self.recent) - 1))
        self._choose()

    def click(self, which: List, row: int) -> None:
        """Choose a row; one that is chosen already is started, or watched again."""
        again = self.active is which and self.at[which] == row
        if row < self.rows(which):
            self.active, self.at[which] = which, row
            self._choose()
            if again:
                self.ask(Wish.WATCH if self.chosen is not None and self.chosen.recorded else Wish.START)

    def press(self, act: Act) -> None:
        """Do what a key asks for."""
        match act:
            case Act.UP | Act.DOWN:
                self._move(1 if act is Act.DOWN else -1)
            case Act.NEXT | Act.RIGHT | Act.PREVIOUS | Act.LEFT:
                lists = [which for which in List if self.rows(which)]
                by = 1 if act in (Act.NEXT, Act.RIGHT) else -1
                self.active = lists[(lists.index(self.active) + by) % len(lists)]
                self._choose()
            case Act.TAKE:
                self.ask(Wish.START)
            case Act.CHANGE:
                self.ask(Wish.CHANGE)
            case Act.WATCH:
                self.ask(Wish.WATCH)
            case Act.LEAVE:
                self.ask(Wish.CLOSE)

    def ask(self, wish: Wish) -> None:
        """Ask for something, if it can be done."""
        self.notice = ""
        recent = self.chosen
        if recent is not None and wish is not Wish.CLOSE and not recent.match.exists():
            told = words.GONE.format(what=recent.name, path=recent.run or recent.match)
            self.refresh()
            self.notice = told
            return
        if wish is Wish.WATCH and (recent is None or not recent.recorded):
            self.notice = words.NOTHING_TO_WATCH
            return
        if wish is Wish.CHANGE and self.draft is None:
            return
        if wish is Wish.START:
            if not self.checked:
                self.notice = words.NOT_CHECKED
                return
            if self.verdict is not None and self.verdict.problems:
                self.notice = words.WRONG_CHOICE.format(problem=self.verdict.problems[0].text)
                return
        self.wish = wish

    def _move(self, by: int) -> None:
        count = self.rows(self.active)
        if count:
            self.at[self.active] = min(max(0, self.at[self.active] + by), count - 1)
            self._choose()

    def _choose(self) -> None:
        """Show the match that is chosen."""
        self.notice = ""
        recent = self.chosen
        try:
            if recent is not None:
                file = recent.match if recent.run is None else None
                self.draft = Draft(recent.match.read_text(encoding="utf-8"), recent.base, file)
            else:
                draft = Draft.of_game(self.game, self._base)
                map_ = self.maps[self.at[List.MAPS]]
                self.draft = draft.set("map", map_) if map_ else draft
        except (OSError, UnicodeDecodeError) as error:
            self.draft = self.verdict = None
            path = self.game if recent is None else recent.match
            gone = recent is not None and isinstance(error, FileNotFoundError)
            what = "" if recent is None else recent.name
            why = getattr(error, "strerror", None) or error
            self.notice = (words.GONE if gone else words.UNREADABLE).format(what=what, path=path, why=why)
