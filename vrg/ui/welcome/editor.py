"""The state of the configurator: a draft, what is being typed, and what the keys do. This needs no window."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from vrg.bus.names import NAME_RULE, is_name
from vrg.errors import Problem
from vrg.games import GAMES, game_of
from vrg.types import Pose, Vector
from vrg.ui.typed import Typed
from vrg.ui.welcome import words
from vrg.ui.welcome.acts import Act
from vrg.ui.welcome.checking import Check, Verdict
from vrg.ui.welcome.choices import Choices
from vrg.ui.welcome.dialogs import Dialog, Offer, Question
from vrg.ui.welcome.draft import COLUMNS, Draft
from vrg.ui.welcome.placing import MOST, fewer, more, with_count
from vrg.ui.welcome.telling import said

SETTINGS: Final = ("name", "game", "players", "map", "engine", "seed")
"""The fields above the table of players."""
LONGEST: Final = 200
"""The number of characters that can be typed into a field."""
NUDGE, TURN = 0.1, math.radians(5.0)
"""By how much keys move and turn a robot: m and rad."""

Save = Callable[[Draft, str | None], None]
"""Writes a draft to its file, and replaces the file only if it holds a certain text; any text if that is None. It
raises FileExistsError if the file holds another text, and OSError if it cannot be written."""


@dataclass(frozen=True)
class Cell:
    """One field: of a player, or of the match where `player` is None."""

    field: str
    player: int | None = None


@dataclass(frozen=True)
class Hold:
    """A robot that is dragged or turned.

    Args:
        player: its number. pose: where it is now. turning: it is turned, not moved.
        grip: where it was taken hold of, from its centre, m.
    """

    player: int
    pose: Pose
    turning: bool
    grip: Vector


class Editor:
    """Takes keys, clicks and drags in, and changes the draft.

    Args:
        draft: the match to change. choices: what can be chosen.
        check: the check by which places for new players are found; it should import no strategies.
        save: writes the match file.

    Attributes:
        draft: as it is now. verdict: on the newest draft that was checked; None before the first verdict.
        cell: the field with the cursor. typed: what is being typed into it; None while nothing is.
        offer: the names that are offered for the field. dialog: what is asked.
        hold: the robot that is dragged. notice: what the person must be told.
        first: the number of the first player in the table, where there is no room for all.
        saved: the draft as it is in its file; None if it is in none.
        play: the file to play, once the person wants that. left: the person leaves the configurator.
    """

    def __init__(self, draft: Draft, choices: Choices, check: Check, save: Save) -> None:
        self.draft = draft
        self.verdict: Verdict | None = None
        self.cell = Cell("x", 0) if draft.players else Cell("name")
        self.typed: Typed | None = None
        self.offer: Offer | None = None
        self.dialog: Dialog | None = None
        self.hold: Hold | None = None
        self.notice = ""
        self.first = 0
        self.saved: Draft | None = draft if draft.file is not None else None
        self.play: Path | None = None
        self.left = False
        self._checked: Draft | None = None
        self._choices = choices
        self._check = check
        self._save = save
        self._past: list[Draft] = []
        self._future: list[Draft] = []
        self._asked: Sequence[str] = ()

    @property
    def changed(self) -> bool:
        """Whether there is something that would be lost."""
        return self.draft.text != (self._begin if self.saved is None else self.saved.text)

    @property
    def _begin(self) -> str:
        """The text of a new match before its first change."""
        return (self._past[0] if self._past else self.draft).text

    @property
    def checked(self) -> bool:
        """Whether the verdict is on the draft as it is now."""
        return self._checked is self.draft

    @property
    def problems(self) -> tuple[Problem, ...]:
        """What is wrong with the newest draft that was checked."""
        return () if self.verdict is None else self.verdict.problems

    @property
    def poses(self) -> tuple[Pose | None, ...]:
        """Where the robots are shown: the one that is dragged is where it is dragged to."""
        poses = [entry.pose for entry in self.draft.players]
        if self.hold is not None and self.hold.player < len(poses):
            poses[self.hold.player] = self.hold.pose
        return tuple(poses)

    def see(self, draft: Draft, verdict: Verdict) -> None:
        """Take in what the check of a draft has found."""
        self.verdict, self._checked = verdict, draft

    def shown(self, cell: Cell) -> str:
        """What stands in a field."""
        if cell == self.cell and self.typed is not None:
            return self.typed.text
        if cell.field == "players":
            return str(len(self.draft.players))
        return self.draft.shown(cell.field, cell.player)

    def choices(self, cell: Cell) -> tuple[str, ...]:
        """The names that a field can have; empty where anything can be typed."""
        return self._choices.of(self.draft, cell.field) if cell.player is not None or cell.field != "name" else ()

    # -- fields

    def go(self, cell: Cell) -> None:
        """Put the cursor into a field, and take in what was typed into the one before."""
        self.offer = None
        if self._finish() and self._exists(cell):
            self.cell = cell

    def click(self, cell: Cell) -> None:
        """Put the cursor into a field, and offer what it can be."""
        was_open = self.offer is not None and cell == self.cell
        self.go(cell)
        if self.cell == cell and not was_open:
            self._open()

    def type(self, sign: str) -> None:
        """Take in one character for the field with the cursor, or for what is asked."""
        if self.dialog is not None:
            if self.dialog.typed is not None:
                self.dialog = replace(self.dialog, typed=self.dialog.typed.type(sign, LONGEST), wrong="")
            return
        self.offer, self.notice = None, ""
        self.typed = (self.typed or Typed(self.shown(self.cell))).type(sign, LONGEST)

    def choose(self, index: int) -> None:
        """Take one of the names that are offered."""
        if self.offer is not None and index < len(self.offer.names):
            name, self.offer = self.offer.names[index], None
            self._set(name)

    def press(self, act: Act) -> None:  # noqa: PLR0912 - one line for each thing that a key can mean
        """Do what a key asks for."""
        if self.dialog is not None:
            self._answer(act)
            return
        self.notice = ""
        match act:
            case Act.UP | Act.DOWN if self.offer is not None:
                self.offer = self.offer.move(1 if act is Act.DOWN else -1)
            case Act.UP | Act.DOWN | Act.LEFT | Act.RIGHT:
                self._step(act)
            case Act.NEXT | Act.PREVIOUS:
                self._next(1 if act is Act.NEXT else -1)
            case Act.TAKE if self.offer is not None:
                self.choose(self.offer.at)
            case Act.TAKE if self.typed is not None:
                self._finish()
            case Act.TAKE:
                self._open()
            case Act.LEAVE if self.hold is not None or self.offer is not None or self.typed is not None:
                self.hold = self.offer = self.typed = None
            case Act.LEAVE:
                self.leave()
            case Act.ERASE:
                self.offer = None
                self.typed = (self.typed or Typed(self.shown(self.cell))).erase()
            case Act.REMOVE if self.typed is not None:
                self.typed = Typed("", fresh=False)
            case Act.REMOVE:
                self._remove()
            case Act.UNDO | Act.REDO:
                self._travel(undo=act is Act.UNDO)
            case Act.PROBLEM:
                self._next_problem()
            case Act.SAVE | Act.SAVE_AS | Act.PLAY:
                self._keep(act)
            case Act.MORE | Act.FEWER:
                if self._finish():
                    self._try(lambda: more(self.draft, self._check) if act is Act.MORE else fewer(self.draft))
            case _:
                self._nudge(act)

    def jump(self, problem: Problem) -> None:
        """Put the cursor into the field that a problem is about, if the window has it."""
        cell = cell_of(problem)
        if cell is not None:
            self.go(cell)

    # -- robots

    def take_hold(self, player: int, at: Vector, *, turning: bool) -> None:
        """Begin to drag or to turn a player's robot.

        Args:
            at: where on the field it is taken hold of, m.
        """
        self.go(Cell("x", player))
        pose = self.draft.players[player].pose
        if pose is not None and self.dialog is None and self.cell.player == player:
            self.hold = Hold(player, pose, turning, (at[0] - pose.x, at[1] - pose.y))

    def drag(self, at: Vector) -> None:
        """Move or turn the robot that is held to a point of the field, m."""
        hold = self.hold
        if hold is None:
            return
        if hold.turning:
            dx, dy = at[0] - hold.pose.x, at[1] - hold.pose.y
            if math.hypot(dx, dy) > 1e-6:
                self.hold = replace(hold, pose=Pose(hold.pose.x, hold.pose.y, math.atan2(dy, dx)))
        else:
            pose = Pose(at[0] - hold.grip[0], at[1] - hold.grip[1], hold.pose.theta)
            self.hold = replace(hold, pose=pose)

    def let_go(self) -> None:
        """Leave the robot that is held where it is."""
        hold, self.hold = self.hold, None
        if hold is not None and hold.pose != self.draft.players[hold.player].pose:
            self._try(lambda: self.draft.place(hold.player, hold.pose))

    def _nudge(self, act: Act) -> None:
        moves = {
            Act.MOVE_UP: (0.0, NUDGE, 0.0), Act.MOVE_DOWN: (0.0, -NUDGE, 0.0), Act.MOVE_LEFT: (-NUDGE, 0.0, 0.0),
            Act.MOVE_RIGHT: (NUDGE, 0.0, 0.0), Act.TURN_LEFT: (0.0, 0.0, TURN), Act.TURN_RIGHT: (0.0, 0.0, -TURN),
        }  # fmt: skip
        player = self.cell.player
        if act not in moves or player is None or not self._finish():
            return
        pose = self.draft.players[player].pose
        if pose is not None:
            dx, dy, turn = moves[act]
            self._try(lambda: self.draft.place(player, Pose(pose.x + dx, pose.y + dy, pose.theta + turn)))

    # -- leaving and saving

    def leave(self) -> None:
        """Leave the configurator; ask before that if something would be lost."""
        self.hold = self.offer = None
        if not self._finish() or self.changed:
            self.dialog = Dialog(Question.LEAVE, words.ASK_LEAVE)
        else:
            self.left = True

    def answer(self, *, yes: bool) -> None:
        """Answer what is asked."""
        dialog, self.dialog = self.dialog, None
        if dialog is None or not yes:
            if dialog is not None and dialog.question is Question.REPLACE:
                self._unname()
                self._ask_name(play=dialog.play)
            return
        match dialog.question:
            case Question.LEAVE:
                self.left = True
            case Question.REPLACE:
                self._write(None, play=dialog.play)
            case Question.NAME:
                assert dialog.typed is not None
                name = dialog.typed.text.strip().removesuffix(".toml")
                if not is_name(name):
                    self.dialog = replace(dialog, wrong=f"{NAME_RULE}, got {name!r}")
                    return
                self._change(self.draft.named(name, self.draft.base / f"{name}.toml"))
                self._write(self._known, play=dialog.play)

    def _answer(self, act: Act) -> None:
        if act in (Act.TAKE, Act.LEAVE):
            self.answer(yes=act is Act.TAKE)
        elif act is Act.ERASE and self.dialog is not None and self.dialog.typed is not None:
            self.dialog = replace(self.dialog, typed=self.dialog.typed.erase(), wrong="")

    def _keep(self, act: Act) -> None:
        """Save the match, and play it if that is wanted and it is good."""
        if not self._finish():
            return
        if act is Act.PLAY:
            if not self.checked:
                self.notice = words.NOT_CHECKED
                return
            if self.problems:
                self.notice = words.NOT_PLAYED.format(problem=said(self.problems[0], self.draft))
                self.jump(self.problems[0])
                return
        if self.draft.file is None or act is Act.SAVE_AS:
            self._ask_name(play=act is Act.PLAY)
        else:
            self._write(self._known, play=act is Act.PLAY)

    @property
    def _known(self) -> str:
        """What the file of the draft holds, as far as this person knows."""
        return self.saved.text if self.saved is not None and self.saved.file == self.draft.file else ""

    def _ask_name(self, *, play: bool) -> None:
        self.dialog = Dialog(Question.NAME, words.ASK_NAME, Typed(self.draft.shown("name") or "match"), play)

    def _unname(self) -> None:
        """Forget the file that was not written."""
        self.draft = replace(self.draft, file=None if self.saved is None else self.saved.file)

    def _write(self, known: str | None, *, play: bool) -> None:
        """Write the file, which may be replaced if it holds the text `known`, or any text if that is None."""
        draft = self.draft
        assert draft.file is not None
        try:
            self._save(draft, known)
        except FileExistsError:
            self.dialog = Dialog(Question.REPLACE, words.ASK_REPLACE.format(file=draft.file.name), play=play)
            return
        except OSError as error:
            self._unname()
            self.notice = words.NOT_SAVED.format(file=draft.file, why=error.strerror or error)
            return
        self.saved = draft
        told = words.SAVED_WITH if self.problems else words.SAVED
        self.notice = told.format(file=draft.file, count=len(self.problems))
        self.play = draft.file if play else None

    def rescue(self) -> str:
        """Write what is not saved into a file of its own; return what to tell, which is empty if all is saved."""
        self._finish()
        if not self.changed:
            return ""
        draft, name = self.draft, f"{self.draft.file.stem if self.draft.file else 'match'}-unsaved"
        for number in range(1, 100):
            file = draft.base / (f"{name}.toml" if number == 1 else f"{name}-{number}.toml")
            try:
                self._save(replace(draft, file=file), "")
            except FileExistsError:
                continue
            except OSError as error:
                return words.NOT_RESCUED.format(why=error)
            return words.RESCUED.format(file=file)
        return words.NOT_RESCUED.format(why=f"{draft.base} has a hundred such files")

    # -- what the keys have in common

    def _exists(self, cell: Cell) -> bool:
        return cell.player is None or cell.player < len(self.draft.players)

    def _open(self) -> None:
        """Offer what the field with the cursor can be, or begin to type."""
        names = self.choices(self.cell)
        now = self.shown(self.cell)
        if names:
            self.offer = Offer(names, names.index(now) if now in names else 0)
        else:
            self.typed = Typed(now)

    def _finish(self) -> bool:
        """Take in what was typed; return whether it was taken."""
        typed, self.typed = self.typed, None
        return typed is None or self._set(typed.text)

    def _set(self, text: str) -> bool:
        cell = self.cell
        if cell.field == "players":
            count = int(text) if text.strip().isascii() and text.strip().isdigit() else 0
            if not 1 <= count <= MOST:
                self.notice = words.NOT_A_COUNT.format(most=MOST, got=text)
                return False
            return self._try(lambda: with_count(self.draft, count, self._check))
        if cell.field == "game" and text != self.draft.game and text in GAMES:
            return self._new_game(text)
        return self._try(lambda: self.draft.set(cell.field, text, cell.player))

    def _new_game(self, game: str) -> bool:
        try:
            self._change(Draft.of_game(game, self.draft.base))
        except OSError as error:
            self.notice = words.UNREADABLE.format(path=game, why=error.strerror)
            return False
        self.notice = words.NEW_GAME.format(game=game_of(game).title)
        return True

    def _try(self, edit: Callable[[], Draft]) -> bool:
        if not self.draft.data:
            self.notice = words.BROKEN
            return False
        try:
            self._change(edit())
        except ValueError as error:
            self.notice = words.BY_HAND.format(why=error)
            return False
        return True

    def _change(self, draft: Draft) -> None:
        if draft.text == self.draft.text and draft.file == self.draft.file:
            return
        self._past.append(self.draft)
        self._future.clear()
        self._show(draft)

    def _show(self, draft: Draft) -> None:
        self.draft = draft
        if not self._exists(self.cell):
            self.cell = replace(self.cell, player=len(draft.players) - 1) if draft.players else Cell("name")

    def _travel(self, *, undo: bool) -> None:
        source, target = (self._past, self._future) if undo else (self._future, self._past)
        self.typed = self.offer = self.hold = None
        if source:
            target.append(self.draft)
            draft = source.pop()
            # What is saved stays the file of the match, also as it was before that.
            same = draft.file is None and draft.game == self.draft.game
            self._show(replace(draft, file=self.draft.file) if same else draft)

    def _remove(self) -> None:
        player = self.cell.player
        if player is not None and len(self.draft.players) > 1:
            self._try(lambda: self.draft.remove(player))

    def _step(self, act: Act) -> None:
        cell, last = self.cell, len(self.draft.players) - 1
        fields = SETTINGS if cell.player is None else COLUMNS
        index = fields.index(cell.field)
        match act:
            case Act.LEFT | Act.RIGHT:
                index = min(max(0, index + (1 if act is Act.RIGHT else -1)), len(fields) - 1)
                self.go(Cell(fields[index], cell.player))
            case Act.DOWN if cell.player is None:
                self.go(Cell(COLUMNS[index], 0))
            case Act.UP if cell.player == 0:
                self.go(Cell(SETTINGS[min(index, len(SETTINGS) - 1)]))
            case Act.UP | Act.DOWN if cell.player is not None:
                self.go(Cell(cell.field, min(max(0, cell.player + (1 if act is Act.DOWN else -1)), last)))

    def _next(self, by: int) -> None:
        cells = [Cell(field) for field in SETTINGS]
        cells += [Cell(field, player) for player in range(len(self.draft.players)) for field in COLUMNS]
        self.go(cells[(cells.index(self.cell) + by) % len(cells)])

    def _next_problem(self) -> None:
        cells = list(dict.fromkeys(cell for p in self.problems if (cell := cell_of(p)) is not None))
        if cells:
            self.go(cells[(cells.index(self.cell) + 1) % len(cells) if self.cell in cells else 0])


def cell_of(problem: Problem) -> Cell | None:
    """The field that a problem is about; None if the window does not have it."""
    match problem.path:
        case ("players", int(player), str(field)) if field in COLUMNS:
            return Cell(field, player)
        case ("players", int(player), *_):
            return Cell("x", player)
        case (str(field), *_) if field in SETTINGS:
            return Cell(field)
    return None
