"""The configurator behind its page: a match that is being changed, and what requests do to it. It knows no network."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path as FilePath
from typing import Any, Final

from vrg.errors import FileError, Path, Problem, VrgError
from vrg.files import read_text
from vrg.games import GAMES, game_of
from vrg.names import NAME_RULE, is_name
from vrg.types import Pose
from vrg.ui.web.parts import colours
from vrg_edit.checking import CheckResult, DraftCheck, problem_text
from vrg_edit.draft import COLUMNS, SETTINGS, Draft
from vrg_edit.folder import Recent, choices_in, recent_matches, save_draft
from vrg_edit.placing import MAX_PLAYERS, with_count
from vrg_edit.requests import (
    Check,
    Count,
    Leave,
    Look,
    Open,
    Place,
    Redo,
    Remove,
    Request,
    Save,
    Set,
    Undo,
    Watch,
)
from vrg_edit.rules import rules_of
from vrg_edit.state import games, match_state

DEFAULT_GAME: Final = "sharks-and-minnows"
"""The game that is chosen first."""


@dataclass(frozen=True)
class NextStep:
    """The person's wish when the page is closed.

    Args:
        play: a match file or a game to play. watch: a run folder to watch again. Both None: nothing.
    """

    play: str | None = None
    watch: FilePath | None = None


@dataclass(frozen=True)
class _Ask:
    """A question that must be answered first: the page repeats its request with the answer.

    Args:
        kind: `name`, `replace` or `leave`. question: in words.
    """

    kind: str
    question: str


class Editor:
    """Holds the match, and does what the page asks for, one request after the other.

    Args:
        base: the folder in which new matches are made. runs: that of the run folders.
        draft: a match file that is opened; None begins with the default match of a game.
        check: checks a draft by the rules of `vrg check`.

    Attributes:
        draft: the match as it is now. verdict: on the newest draft that was checked.
        outcome: what the person wants; None while the page is open.
    """

    def __init__(
        self,
        base: FilePath,
        runs: FilePath,
        draft: Draft | None = None,
        check: Callable[[Draft], CheckResult] | None = None,
    ) -> None:
        self._base, self._runs = base, runs
        self._check_draft = check or DraftCheck()
        self._recent: Sequence[Recent] = ()
        self._begins = "start" if draft is None else "edit"
        self._number = 0
        self.outcome: NextStep | None = None
        self.verdict = CheckResult()
        self._checked: Draft | None = None
        found = draft or Draft.of_game(DEFAULT_GAME, base)
        self._take(found, DEFAULT_GAME if draft is None else str(found.file))

    def _take(self, draft: Draft, source: str | None) -> None:
        """Take up a match.

        Args:
            source: what is played while nothing is changed; None if it must be saved before.
        """
        self.draft, self._kept, self._source = draft, draft, source
        self._choices = choices_in(draft.base)
        self._past: list[Draft] = []
        self._future: list[Draft] = []
        self._last = ""
        self._number += 1
        self._record: FilePath | None = None

    @property
    def changed(self) -> bool:
        """True if there is something that would be lost."""
        return self.draft.text != self._kept.text

    # -- requests

    def answer(self, request: Request) -> dict[str, Any]:
        """Do what the page asks for, and return its new state. Nothing is checked but what is to be played."""
        try:
            reply = self._do(request)
        except (VrgError, ValueError, OSError, LookupError) as error:
            reply = f"This cannot be done here: {error}"
        ask = {"kind": reply.kind, "question": reply.question} if isinstance(reply, _Ask) else None
        more = self._everything() if isinstance(request, Look) else {}
        return self.state() | more | {"ask": ask, "notice": reply if isinstance(reply, str) else ""}

    def check(self) -> None:
        """Check the match as it is now; the newest verdict is kept. It may take a while and is no part of `answer`."""
        draft = self.draft
        try:
            verdict = self._check_draft(draft)
        except Exception as error:  # games of other packages are checked too, and their mistakes must not end the page
            verdict = replace(self.verdict, problems=(Problem(f"the check itself has failed: {error!r}"),))
        self.verdict, self._checked = verdict, draft

    def state(self) -> dict[str, Any]:
        """Return the state of the page."""
        draft = self.draft
        return {
            "number": self._number,
            "file": draft.file.name if draft.file is not None else "",
            "changed": self.changed,
            "checked": self._checked is draft,
            "undo": bool(self._past),
            "redo": bool(self._future),
            "ended": self.outcome is not None,
            **match_state(draft, self.verdict, self._choices),
        }

    def _everything(self) -> dict[str, Any]:
        self._recent = recent_matches(self._runs, self._base)
        listed = [
            {"name": r.name, "game": game_of(r.game).title or r.game, "when": r.when, "ending": r.ending}
            | {"match": str(r.match), "recorded": r.recorded, "where": r.where}
            for r in self._recent
        ]
        maps = choices_in(self._base).of(self.draft, "map")
        start = {"games": games(), "maps": maps, "recent": listed, "first": DEFAULT_GAME}
        return {"start": start, "begins": self._begins, "colours": colours(), "most": MAX_PLAYERS}

    def _do(self, request: Request) -> str | _Ask | None:
        if isinstance(request, Open | Watch | Leave) and self.changed and not request.sure:
            return _Ask("leave", "The match is not saved. Leave it anyway?")
        match request:
            case Open(match=""):
                self._open(request.game, request.map)
            case Open(match=match):
                self._reopen(match)
            case Watch(match=match):
                self.outcome = NextStep(watch=self._of(match).run)
            case Leave():
                self.outcome = NextStep()
        if isinstance(request, Look | Check | Open | Watch | Leave):
            return None
        return self._change(request)

    def _change(self, request: Set | Place | Count | Remove | Undo | Redo | Save) -> str | _Ask | None:
        if request.seen != self._number:
            return "Another page has changed this match: this is how it is now. Repeat your change if it still fits."
        if isinstance(request, Save):
            return self._save(request)
        if isinstance(request, Undo | Redo):
            self._travel(undo=isinstance(request, Undo))
            return None
        if not self.draft.data:
            return "The file is not TOML, so only a text editor can fix it."
        return self._edit(request)

    def _edit(self, request: Set | Place | Count | Remove) -> str | None:
        draft, last, notice = self.draft, "", None
        match request:
            case Set(key="game", typed=game) if game in GAMES and game != draft.game:
                draft = Draft.of_game(game, draft.base)
                notice = f"This is the default match of {game_of(game).title} now. Undo restores the previous one."
            case Set(key=key, typed=typed):
                draft, last = self._with_rules_beside(path_of(key)).set(path_of(key), typed), key
            case Place(player=player, x=x, y=y, heading=heading):
                draft, last = draft.place(player, Pose(x, y, heading)), str(player)
            case Count(players=count):
                if not 1 <= count <= MAX_PLAYERS:
                    return f"expected a number of players from 1 to {MAX_PLAYERS}, got {count}"
                draft = with_count(draft, count, self.verdict)
            case Remove(players=players):
                if len(set(players)) >= len(draft.players):
                    return "A match needs at least one player."
                draft = draft.remove(set(players))
        if draft.text != self.draft.text:
            # Letters that are typed one by one are one change.
            if not last or last != self._last:
                self._past.append(self.draft)
            self._future.clear()
            self._last = last
            self._show(draft)
        return notice

    def _with_rules_beside(self, path: Path) -> Draft:
        """The draft with the defaults of the rules beside one in a table of its own, if it has no such table yet."""
        draft = self.draft
        if len(path) > 2 and path[0] == "rules" and self.draft.value(path[:-1]) is None:
            for rule in rules_of(draft.game):
                if rule.path[:-1] == path[:-1]:
                    draft = draft.set(rule.path, rule.default)
        return draft

    def _travel(self, *, undo: bool) -> None:
        source, target = (self._past, self._future) if undo else (self._future, self._past)
        self._last = ""
        if source:
            target.append(self.draft)
            draft = source.pop()
            # What is saved stays the file of the match, also as it was before that.
            same = draft.file is None and draft.game == self.draft.game
            self._show(replace(draft, file=self.draft.file) if same else draft)

    def _show(self, draft: Draft) -> None:
        self.draft = draft
        self._number += 1

    # -- opening

    def _open(self, game: str, map_: str) -> None:
        draft = Draft.of_game(game, self._base)
        self._take(draft.set(("map",), map_) if map_ else draft, None if map_ else game)

    def _reopen(self, match: str) -> None:
        recent = self._of(match)
        try:
            text = read_text(recent.match)
        except (OSError, FileError) as error:
            raise ValueError(f"{recent.name}: {recent.match} cannot be read: {error}") from None
        file = recent.match if recent.run is None else None
        self._take(Draft(text, recent.base, file), str(recent.match))
        self._record = None if recent.run is None else recent.match.resolve()

    def _of(self, match: str) -> Recent:
        """The recent match of a file. Only those that are listed can be opened."""
        found = next((recent for recent in self._recent if str(recent.match) == match), None)
        if found is None:
            raise ValueError(f"expected one of the recent matches, got {match!r}: load the page again")
        return found

    # -- saving

    def _save(self, request: Save) -> str | _Ask | None:
        """Save the match, and play it if that is wanted and it is good."""
        if request.play:
            if self._checked is not self.draft:
                self.check()
            if self.verdict.problems:
                return f"It cannot be played yet. {problem_text(self.verdict.problems[0], self.draft)}"
            if not self.changed and self._source is not None and not request.name:
                self.outcome = NextStep(play=self._source)
                return None
        draft = self.draft
        if request.name:
            name = request.name.strip().removesuffix(".toml")
            if not is_name(name):
                return _Ask("name", f"{NAME_RULE}, got {name!r}")
            file = draft.base / f"{name}.toml"
            if file.resolve() == self._record:
                return _Ask("name", f"{file.name} here is the record of a match that was played: choose another name.")
            if (file, name) != (draft.file, draft.shown(("name",))):
                draft = draft.named(name, file)
        if draft.file is None:
            return _Ask("name", "Save under which name? The file gets this name, too.")
        known = None if request.replace else self._kept.text if self._kept.file == draft.file else ""
        reply = self._write(draft, known)
        if reply is None and request.play:
            self.outcome = NextStep(play=self._source)
        return reply or f"Saved as {draft.file}."

    def _write(self, draft: Draft, known: str | None) -> str | _Ask | None:
        """Write a draft to its file, which may hold the text `known`, or any text if that is None."""
        assert draft.file is not None
        try:
            save_draft(draft, known)
        except FileExistsError:
            return _Ask("replace", f"{draft.file.name} is already there, and holds something else. Replace it?")
        except OSError as error:
            return f"{draft.file} cannot be written: {error.strerror or error}"
        if draft.text != self.draft.text:
            self._past.append(self.draft)
            self._future.clear()
        self._last, self._kept, self._source = "", draft, str(draft.file)
        if draft != self.draft:
            self._show(draft)
        return None

    def rescue(self) -> str:
        """Write what is not saved into a file of its own; return what to tell, which is empty if all is saved."""
        if self.outcome is not None or not self.changed:
            return ""
        draft, name = self.draft, f"{self.draft.file.stem if self.draft.file else 'match'}-unsaved"
        for number in range(1, 100):
            file = draft.base / (f"{name}.toml" if number == 1 else f"{name}-{number}.toml")
            try:
                save_draft(replace(draft, file=file), "")
            except FileExistsError:
                continue
            except OSError as error:
                return f"vrg: what was not saved is lost: {error}"
            return f"vrg: what was not saved is in {file} now."
        return f"vrg: what was not saved is lost: {draft.base} has a hundred such files"


def path_of(key: str) -> Path:
    """The path of a field that the page names, such as `players.2.x`.

    Raises:
        ValueError: the page has no such field.
    """
    match key.split("."):
        case ["players", number, name] if number.isdecimal() and name in COLUMNS:
            return "players", int(number), name
        case ["rules", _, *_] as path:
            return tuple(path)
        case [name] if name in SETTINGS:
            return (name,)
    raise ValueError(f"expected a field of the configurator, got {key!r}")
