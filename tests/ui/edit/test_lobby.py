"""The welcome screen without its window, and the recent matches that it lists."""

import json
import os
from pathlib import Path

import pytest

from vrg.commands.checking import DraftCheck
from vrg.commands.drafts import choices_in, recent_matches
from vrg.launch.run_folder import RunFolder
from vrg.ui.edit.acts import Act
from vrg.ui.edit.choices import Choices
from vrg.ui.edit.draft import Draft
from vrg.ui.edit.lobby import List, Lobby, Wish

RESULT = {
    "match": "courtyard", "game": "sharks-and-minnows", "ended": "game over", "winner": "sharks",
    "score": {"sharks": 6, "minnows": 3}, "play_time": 93.1, "radio": {"lost": 0, "arrived": 0},
}  # fmt: skip
CHECK = DraftCheck(imports=False)


def run_in(runs: Path, name: str, result: dict[str, object] | None) -> Path:
    folder = RunFolder(runs / name)
    folder.prepare()
    folder.match_file.write_text(Draft.of_game("sharks-and-minnows", runs).text, encoding="utf-8")
    if result is not None:
        folder.result.write_text(json.dumps(result), encoding="utf-8")
        folder.setup.write_text("{}", encoding="utf-8")
        folder.recording.write_bytes(b"")
    return folder.path


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a run that is over, one that was broken off, a match file, and things that are neither."""
    over, broken = run_in(tmp_path / "runs", "one", RESULT), run_in(tmp_path / "runs", "two", None)
    (tmp_path / "runs" / "other").mkdir()
    match = tmp_path / "mine.toml"
    match.write_text(Draft.of_game("roboflag", tmp_path).text, encoding="utf-8")
    (tmp_path / "broken.toml").write_text("a =", encoding="utf-8")
    (tmp_path / "yard.toml").write_text('name = "yard"\nbounds = {}\n', encoding="utf-8")
    (tmp_path / "mine.py").write_text(
        "class Mine:\n    def act(self, view): ...\n\nclass Helper:\n    pass\n", encoding="utf-8"
    )
    (tmp_path / "wrong.py").write_text("class (", encoding="utf-8")
    for when, path in enumerate((tmp_path / "runs" / "other", broken, match, over)):
        os.utime(path, (1e9 + when, 1e9 + when))
    return tmp_path


def lobby_in(place: Path) -> Lobby:
    return Lobby(place, Choices(), lambda: recent_matches(place / "runs", place))


def checked(lobby: Lobby) -> None:
    assert lobby.draft is not None
    lobby.see(lobby.draft, CHECK(lobby.draft))


def test_recent_matches_are_told_with_their_results_the_newest_first(place: Path) -> None:
    found = recent_matches(place / "runs", place)
    assert [(r.name, r.game, r.told, r.recorded) for r in found] == [
        ("courtyard", "sharks-and-minnows", "Sharks win (sharks 6, minnows 3, 93.1 s of play)", True),
        ("roboflag", "roboflag", "", False),
        ("courtyard", "sharks-and-minnows", "broken off", False),
    ]
    assert recent_matches(place / "nothing", place / "nothing") == []


def test_maps_and_strategies_of_the_folder_can_be_chosen(place: Path) -> None:
    assert choices_in(place) == Choices(("yard.toml",), ("mine.py:Mine",))
    draft = Draft.of_game("sharks-and-minnows", place)
    assert choices_in(place).of(draft, "map") == ("courtyard", "marhes_lab", "open", "yard.toml")


def test_the_arrows_choose_a_game_and_enter_starts_it_once_it_is_checked(place: Path) -> None:
    lobby = lobby_in(place)
    assert lobby.game == "sharks-and-minnows"
    lobby.press(Act.DOWN)
    assert lobby.draft is not None
    assert lobby.draft.game == lobby.game == "pursuit-evasion"
    lobby.press(Act.TAKE)
    assert (lobby.wish, lobby.notice) == (None, "It is still being checked.")
    checked(lobby)
    lobby.press(Act.TAKE)
    assert lobby.wish is Wish.START


def test_a_map_on_which_the_game_has_no_room_is_told_and_not_started(place: Path) -> None:
    lobby = lobby_in(place)
    lobby.press(Act.NEXT)
    assert lobby.active is List.MAPS
    lobby.press(Act.DOWN)
    lobby.press(Act.DOWN)
    assert lobby.draft is not None
    assert lobby.draft.shown("map") == "marhes_lab"
    checked(lobby)
    lobby.press(Act.TAKE)
    assert lobby.wish is None
    assert lobby.notice.startswith("It cannot start: ")
    lobby.press(Act.CHANGE)
    assert lobby.wish is Wish.CHANGE


def test_a_recent_match_is_watched_again_by_a_second_click(place: Path) -> None:
    lobby = lobby_in(place)
    lobby.click(List.RECENT, 0)
    assert lobby.wish is None
    assert lobby.chosen is not None
    lobby.click(List.RECENT, 0)
    assert lobby.wish is Wish.WATCH


def test_a_match_without_a_recording_cannot_be_watched(place: Path) -> None:
    lobby = lobby_in(place)
    lobby.click(List.RECENT, 2)
    lobby.press(Act.WATCH)
    assert (lobby.wish, lobby.notice) == (None, "There is no recording of this match. ENTER plays it, C changes it.")


def test_a_recent_match_that_is_gone_is_told_and_leaves_the_list(place: Path) -> None:
    lobby = lobby_in(place)
    lobby.click(List.RECENT, 1)
    checked(lobby)
    (place / "mine.toml").unlink()
    lobby.press(Act.TAKE)
    assert lobby.wish is None
    assert lobby.notice == f"roboflag is gone: {place / 'mine.toml'}"
    assert [r.name for r in lobby.recent] == ["courtyard", "courtyard"]


def test_a_file_that_cannot_be_read_is_told(place: Path) -> None:
    lobby = lobby_in(place)
    (place / "mine.toml").write_bytes(b"\xff")
    lobby.click(List.RECENT, 1)
    assert lobby.draft is None
    assert "mine.toml cannot be read" in lobby.notice
    lobby.press(Act.CHANGE)
    assert lobby.wish is None
