"""The configurator without its window: what keys, clicks and drags do to a draft."""

import math
from pathlib import Path

import pytest

from vrg.commands.checking import DraftCheck
from vrg.commands.drafts import save_draft
from vrg.errors import Problem
from vrg.types import Pose
from vrg.ui.welcome.acts import Act
from vrg.ui.welcome.choices import Choices
from vrg.ui.welcome.dialogs import Question
from vrg.ui.welcome.draft import Draft
from vrg.ui.welcome.editor import Cell, Editor, cell_of
from vrg.ui.welcome.telling import said

CHECK = DraftCheck(imports=False)


def editor_of(folder: Path, game: str = "sharks-and-minnows", file: Path | None = None) -> Editor:
    draft = Draft.of_game(game, folder)
    if file is not None:
        file.write_text(draft.text, encoding="utf-8")
        draft = Draft(draft.text, folder, file)
    editor = Editor(draft, Choices(strategies=("mine.py:Mine",)), CHECK, save_draft)
    checked(editor)
    return editor


def checked(editor: Editor) -> None:
    editor.see(editor.draft, CHECK(editor.draft))


def typed(editor: Editor, text: str) -> None:
    for sign in text:
        editor.type(sign)


@pytest.fixture
def editor(tmp_path: Path) -> Editor:
    return editor_of(tmp_path)


def test_a_number_is_typed_over_the_old_one(editor: Editor) -> None:
    editor.go(Cell("y", 0))
    typed(editor, "-31.25")
    assert editor.shown(Cell("y", 0)) == "-31.25"
    assert editor.draft.shown("y", 0) == "-30"
    editor.press(Act.TAKE)
    assert editor.draft.shown("y", 0) == "-31.25"


def test_escape_takes_back_what_is_typed_and_erase_shortens_it(editor: Editor) -> None:
    editor.go(Cell("y", 0))
    typed(editor, "5")
    editor.press(Act.LEAVE)
    assert editor.shown(Cell("y", 0)) == "-30"
    editor.press(Act.ERASE)
    assert editor.shown(Cell("y", 0)) == "-3"


def test_to_go_on_takes_in_what_is_typed(editor: Editor) -> None:
    editor.go(Cell("heading", 2))
    typed(editor, "45")
    editor.press(Act.NEXT)
    assert (editor.draft.shown("heading", 2), editor.cell) == ("45", Cell("name", 3))
    editor.press(Act.PREVIOUS)
    assert editor.cell == Cell("heading", 2)


def test_nonsense_is_kept_and_told_by_the_check(editor: Editor) -> None:
    editor.go(Cell("x", 1))
    typed(editor, "near")
    editor.press(Act.TAKE)
    checked(editor)
    assert editor.shown(Cell("x", 1)) == "near"
    assert editor.verdict is not None
    assert [said(p, editor.draft) for p in editor.verdict.of(1, "x")] == ["player2 x: expected a number, got 'near'"]


def test_arrows_go_from_field_to_field_and_to_the_fields_of_the_match(editor: Editor) -> None:
    editor.go(Cell("role", 1))
    for act in (Act.UP, Act.UP, Act.RIGHT):
        editor.press(act)
    assert editor.cell == Cell("players")
    for act in (Act.DOWN, Act.DOWN, Act.LEFT):
        editor.press(act)
    assert editor.cell == Cell("role", 1)


def test_a_field_offers_what_it_can_be(editor: Editor) -> None:
    editor.click(Cell("model", 0))
    assert editor.offer is not None
    assert editor.offer.names == ("ATRV-Jr", "P2AT")
    editor.press(Act.TAKE)
    assert editor.draft.players[0].model == "ATRV-Jr"
    editor.click(Cell("strategy", 0))
    assert editor.offer is not None
    assert editor.offer.names == ("", "sharks-and-minnows", "mine.py:Mine")
    editor.press(Act.UP)
    editor.press(Act.TAKE)
    assert editor.draft.players[0].strategy == "mine.py:Mine"
    editor.click(Cell("strategy", 0))
    editor.choose(0)
    assert editor.draft.players[0].strategy == ""


def test_undo_and_redo_go_back_and_forth(editor: Editor) -> None:
    first = editor.draft
    editor.press(Act.MORE)
    editor.press(Act.REMOVE)
    third = editor.draft
    editor.press(Act.UNDO)
    assert len(editor.draft.players) == 8
    editor.press(Act.UNDO)
    editor.press(Act.UNDO)
    assert editor.draft.text == first.text
    assert not editor.changed
    editor.press(Act.REDO)
    editor.press(Act.REDO)
    assert editor.draft.text == third.text


def test_the_number_of_players_is_typed(editor: Editor) -> None:
    editor.go(Cell("players"))
    typed(editor, "9")
    editor.press(Act.TAKE)
    assert len(editor.draft.players) == 9
    typed(editor, "many")
    editor.press(Act.TAKE)
    assert editor.notice == "players: expected a whole number from 1 to 64, got 'many'"
    assert len(editor.draft.players) == 9


def test_the_cursor_stays_among_the_players_that_are_left(editor: Editor) -> None:
    editor.go(Cell("y", 6))
    editor.press(Act.REMOVE)
    assert editor.cell == Cell("y", 5)
    for _ in range(10):
        editor.press(Act.REMOVE)
    assert len(editor.draft.players) == 1


def test_another_game_is_its_default_match(editor: Editor) -> None:
    editor.click(Cell("game"))
    assert editor.offer is not None
    editor.choose(editor.offer.names.index("roboflag"))
    assert (editor.draft.game, len(editor.draft.players)) == ("roboflag", 8)
    editor.press(Act.UNDO)
    assert editor.draft.game == "sharks-and-minnows"


def test_a_robot_is_dragged_from_where_it_is_taken_hold_of(editor: Editor) -> None:
    editor.take_hold(0, (21.1, -29.9), turning=False)
    editor.drag((19.1, -30.9))
    assert editor.poses[0] is not None
    assert (round(editor.poses[0].x, 6), round(editor.poses[0].y, 6)) == (19.0, -31.0)
    assert editor.draft.shown("x", 0) == "21"
    editor.let_go()
    assert [editor.draft.shown(name, 0) for name in ("x", "y", "heading")] == ["19", "-31", "90"]
    editor.press(Act.UNDO)
    assert editor.draft.shown("x", 0) == "21"


def test_a_robot_is_turned_towards_the_mouse(editor: Editor) -> None:
    editor.take_hold(0, (21.0, -29.0), turning=True)
    editor.drag((22.0, -30.0))
    editor.let_go()
    assert editor.draft.players[0].pose == Pose(21.0, -30.0, 0.0)
    editor.take_hold(0, (22.0, -30.0), turning=True)
    editor.drag((20.0, -29.0))
    editor.press(Act.LEAVE)
    editor.let_go()
    assert editor.draft.players[0].pose == Pose(21.0, -30.0, 0.0)


def test_keys_move_and_turn_a_robot(editor: Editor) -> None:
    editor.go(Cell("name", 0))
    for act in (Act.MOVE_UP, Act.MOVE_RIGHT, Act.MOVE_RIGHT, Act.TURN_LEFT):
        editor.press(act)
    pose = editor.draft.players[0].pose
    assert pose is not None
    assert (pose.x, pose.y, round(math.degrees(pose.theta), 6)) == (21.2, -29.9, 95.0)


def test_problems_lead_to_their_fields(editor: Editor) -> None:
    editor.draft = editor.draft.set("x", "99", 3).set("role", "dolphin", 5)
    checked(editor)
    editor.press(Act.PROBLEM)
    assert editor.cell == Cell("x", 3)
    editor.press(Act.PROBLEM)
    assert editor.cell == Cell("role", 5)
    assert cell_of(Problem("", ("map",))) == Cell("map")
    assert cell_of(Problem("", ("rules", "x"))) is None


def test_a_match_is_saved_under_a_name_and_played(editor: Editor, tmp_path: Path) -> None:
    editor.press(Act.PLAY)
    assert editor.dialog is not None
    typed(editor, "a/b")
    editor.press(Act.TAKE)
    assert "got 'a/b'" in editor.dialog.wrong
    for _ in range(3):
        editor.press(Act.ERASE)
    typed(editor, "final")
    editor.press(Act.TAKE)
    assert editor.play == tmp_path / "final.toml"
    assert editor.play.read_text(encoding="utf-8") == editor.draft.text
    assert 'name = "final"' in editor.draft.text
    assert not editor.changed


def test_what_has_problems_is_saved_but_not_played(editor: Editor, tmp_path: Path) -> None:
    editor.draft = editor.draft.set("x", "99", 3)
    editor.press(Act.PLAY)
    assert editor.notice == "It is still being checked."
    checked(editor)
    editor.press(Act.PLAY)
    assert editor.notice.startswith("It cannot be played yet. player4: expected a pose inside map courtyard")
    assert (editor.cell, editor.play, editor.dialog) == (Cell("x", 3), None, None)
    editor.press(Act.SAVE)
    editor.press(Act.TAKE)
    assert (tmp_path / "courtyard.toml").exists()
    assert "cannot be played yet: 1 problems" in editor.notice


def test_another_file_is_only_replaced_if_that_is_wanted(editor: Editor, tmp_path: Path) -> None:
    other = tmp_path / "courtyard.toml"
    other.write_text("mine", encoding="utf-8")
    editor.press(Act.SAVE)
    editor.press(Act.TAKE)
    assert editor.dialog is not None
    assert (editor.dialog.question, editor.dialog.says) == (
        Question.REPLACE, "courtyard.toml is already there. Replace it?"
    )  # fmt: skip
    editor.press(Act.LEAVE)
    assert other.read_text(encoding="utf-8") == "mine"
    assert editor.dialog is not None
    assert editor.dialog.question is Question.NAME
    editor.press(Act.TAKE)
    editor.press(Act.TAKE)
    assert other.read_text(encoding="utf-8") == editor.draft.text


def test_an_open_file_is_saved_at_once_unless_somebody_else_has_changed_it(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    editor = editor_of(tmp_path, file=file)
    editor.press(Act.MOVE_UP)
    editor.press(Act.SAVE)
    assert file.read_text(encoding="utf-8") == editor.draft.text
    assert editor.notice == f"Saved as {file}."
    file.write_text("somebody else", encoding="utf-8")
    editor.press(Act.MOVE_UP)
    editor.press(Act.SAVE)
    assert editor.dialog is not None
    assert editor.dialog.question is Question.REPLACE
    assert file.read_text(encoding="utf-8") == "somebody else"


def test_a_file_that_cannot_be_written_is_told_and_nothing_is_lost(editor: Editor, tmp_path: Path) -> None:
    (tmp_path / "courtyard.toml").mkdir()
    editor.press(Act.MOVE_UP)
    editor.press(Act.SAVE)
    editor.press(Act.TAKE)
    if editor.dialog is not None:
        editor.press(Act.TAKE)
    assert "cannot be written" in editor.notice
    assert editor.changed
    assert editor.draft.file is None


def test_whoever_leaves_is_asked_if_something_would_be_lost(editor: Editor) -> None:
    editor.press(Act.MOVE_UP)
    editor.press(Act.LEAVE)
    assert editor.dialog is not None
    editor.press(Act.LEAVE)
    assert not editor.left
    editor.press(Act.LEAVE)
    editor.press(Act.TAKE)
    assert editor.left


def test_nobody_is_asked_where_nothing_has_changed(editor: Editor) -> None:
    editor.press(Act.LEAVE)
    assert editor.left


def test_a_player_that_is_no_table_is_left_to_a_text_editor(tmp_path: Path) -> None:
    draft = Draft('game = "hud"\nplayers = ["a", {role = "player", x = 1.0, y = 0.0}]\n', tmp_path)
    editor = Editor(draft, Choices(), CHECK, save_draft)
    editor.go(Cell("x", 0))
    typed(editor, "2")
    editor.press(Act.TAKE)
    assert editor.notice.startswith("Only a text editor can change this: expected a table players.0")
    assert editor.draft is draft
