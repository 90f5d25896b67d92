"""The configurator without its page: what requests do to a match, and the recent matches that it lists."""

import json
import math
import os
from pathlib import Path
from typing import Any

import pytest

from vrg.hal.sim.maps import MAPS
from vrg.runs.run_folder import RunFolder
from vrg.testing.tiny import TINY
from vrg.types import Pose
from vrg_edit.checking import DraftCheck
from vrg_edit.choices import Choices
from vrg_edit.draft import Draft
from vrg_edit.editor import Editor, NextStep, path_of
from vrg_edit.folder import choices_in, recent_matches
from vrg_edit.requests import read_request
from vrg_edit.rules import rules_of

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


def test_recent_matches_are_told_with_their_results_the_newest_first(place: Path) -> None:
    found = recent_matches(place / "runs", place)
    assert [(r.name, r.game, r.ending, r.recorded) for r in found] == [
        ("courtyard", "sharks-and-minnows", "Sharks win (sharks 6, minnows 3, 93.1 s of play)", True),
        ("roboflag", "roboflag", "", False),
        ("courtyard", "sharks-and-minnows", "broken off", False),
    ]
    assert [r.where for r in found] == ["one", "mine.toml", "two"]
    assert recent_matches(place / "nothing", place / "nothing") == []


def test_maps_and_strategies_of_the_folder_can_be_chosen(place: Path) -> None:
    assert choices_in(place) == Choices(("yard.toml",), ("mine.py:Mine",))
    draft = Draft.of_game("sharks-and-minnows", place)
    assert choices_in(place).of(draft, "map") == (*MAPS.names(), "yard.toml")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_what_notepad_has_saved_is_listed(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "yard.toml").write_text('name = "yard"\nbounds = {}\n', encoding=encoding)
    (tmp_path / "m.toml").write_text(TINY, encoding=encoding)
    assert [recent.match.name for recent in recent_matches(tmp_path / "runs", tmp_path)] == ["m.toml"]
    assert choices_in(tmp_path).maps == ("yard.toml",)


class Page:
    """Asks a desk as the page does."""

    def __init__(self, desk: Editor) -> None:
        self.desk = desk
        self.told = self.ask("look")

    def ask(self, do: str, **more: object) -> dict[str, Any]:
        if do not in ("look", "check", "open", "watch", "leave"):
            more = {"seen": self.told["number"], **more}
        request = read_request(json.dumps({"do": do, **more}).encode())
        if do == "check":
            self.desk.check()
        self.told = self.desk.answer(request)
        return self.told

    def set(self, key: str, typed: str) -> dict[str, Any]:
        self.ask("set", key=key, typed=typed)
        return self.ask("check")

    def value(self, key: str) -> str:
        return self.desk.draft.shown(path_of(key))


def page_in(place: Path, draft: Draft | None = None) -> Page:
    page = Page(Editor(place, place / "runs", draft, CHECK))
    page.ask("check")
    return page


@pytest.fixture
def page(tmp_path: Path) -> Page:
    """The page with the match that a new configurator shows."""
    return page_in(tmp_path)


def test_what_is_wrong_is_told_beside_its_field_with_its_line(page: Page) -> None:
    assert (page.told["problems"], page.told["checked"]) == ([], True)
    page.ask("set", key="players.1.x", typed="near")
    assert not page.told["checked"]
    page.ask("check")
    line = 1 + page.desk.draft.text.split("\n").index('x = "near"')
    assert page.told["problems"] == [
        {"text": "player2 x: expected a number, got 'near'", "line": line, "fields": ["players.1.x"]}
    ]
    page.set("players.1.x", "99")
    assert page.told["problems"][0]["fields"] == ["players.1.x", "players.1.y"]
    assert page.set("players.1.x", "17")["problems"] == []


@pytest.mark.parametrize(
    "game",
    [
        "sharks-and-minnows",
        "practice",
        pytest.param("pursuit-evasion", marks=pytest.mark.thorough),
        pytest.param("roboflag", marks=pytest.mark.thorough),
    ],
)
def test_every_rule_of_a_game_has_words_and_can_be_set_to_its_own_value(page: Page, game: str) -> None:
    page.ask("open", game=game)
    rules = {rule["key"]: rule for rule in page.told["rules"]}
    assert len(rules) == len(rules_of(game)) >= 3
    assert [key for key, rule in rules.items() if not rule["help"] or ":" in rule["help"][:12]] == []
    for key, rule in rules.items():
        if rule["value"] or rule["default"]:
            page.set(key, "")
            page.set(key, rule["value"] or rule["default"])
            assert page.value(key) == (rule["value"] or rule["default"])
    assert page.told["problems"] == []


def test_rules_have_defaults_bounds_and_choices_and_are_checked(page: Page) -> None:
    rules = {rule["key"]: rule for rule in page.told["rules"]}
    slowest = rules["rules.slowest"]
    assert (slowest["default"], slowest["bounds"]) == ("0.6", "more than 0, at most 1")
    assert slowest["help"].startswith("each player's top speed is drawn between")
    assert rules["rules.lineup"]["choices"] == ["drive", "place"]
    [problem] = page.set("rules.slowest", "2")["problems"]
    assert (problem["fields"], "at most 1, got 2" in problem["text"]) == (["rules.slowest"], True)
    assert page.set("rules.slowest", "0.5")["problems"] == []
    [problem] = page.set("rules.x", "[26, 16]")["problems"]
    assert "low border first" in problem["text"]
    page.ask("open", game="roboflag", sure=True)
    page.set("rules.red.flag", "[-2, 0.5]")
    assert page.desk.draft.data["rules"]["red"]["flag"] == [-2, 0.5]
    assert page.told["problems"] == []


def test_undo_and_redo_go_back_and_forth_and_typing_is_one_step(page: Page) -> None:
    first = page.desk.draft.text
    for typed in ("2", "20", "20.5"):
        page.set("players.0.x", typed)
    page.ask("count", players=9)
    last = page.desk.draft.text
    page.ask("undo")
    assert page.value("players.0.x") == "20.5"
    page.ask("undo")
    assert (page.desk.draft.text, page.told["changed"], page.told["undo"]) == (first, False, False)
    page.ask("redo")
    page.ask("redo")
    assert (page.desk.draft.text, page.told["redo"]) == (last, False)


def test_players_are_dragged_added_and_taken_out_several_at_once(page: Page) -> None:
    page.ask("place", player=0, x=20.123456, y=-32.98765, heading=math.radians(400.04))
    assert [page.value(f"players.0.{name}") for name in ("x", "y", "heading")] == ["20.12", "-32.99", "40"]
    placed = Pose(20.12, -32.99, math.radians(40.0))
    assert page.desk.draft.place(0, placed).text == page.desk.draft.text
    page.ask("count", players=12)
    assert page.ask("check")["problems"] == []
    page.ask("remove", players=[8, 7, 11])
    assert len(page.told["players"]) == 9
    assert page.ask("remove", players=list(range(9)))["notice"] == "A match needs at least one player."
    assert page.ask("count", players=99)["notice"] == "expected a number of players from 1 to 64, got 99"
    assert page.desk.draft.players[0].pose == placed


def test_new_players_come_without_a_check_of_their_own(tmp_path: Path) -> None:
    checks: list[Draft] = []

    def counted(draft: Draft) -> Any:
        checks.append(draft)
        return CHECK(draft)

    page = Page(Editor(tmp_path, tmp_path / "runs", check=counted))
    page.ask("check")
    page.ask("count", players=40)
    page.ask("check")
    assert len(checks) == 2
    assert [problem["text"] for problem in page.told["problems"] if problem["fields"][0].startswith("players.")] == []


def test_another_game_is_its_default_match(page: Page) -> None:
    told = page.ask("set", key="game", typed="roboflag")
    assert (page.desk.draft.game, len(told["players"])) == ("roboflag", 8)
    assert "default match of RoboFlag" in told["notice"]
    page.ask("undo")
    assert page.desk.draft.game == "sharks-and-minnows"


def test_a_page_that_shows_an_old_match_changes_nothing(page: Page) -> None:
    old = page.told["number"]
    page.set("seed", "5")
    told = page.ask("remove", players=[0], seen=old)
    assert told["notice"].startswith("Another page has changed this match")
    assert len(told["players"]) == 7


def test_the_default_match_is_played_as_it_is_and_on_another_map_it_is_saved_first(page: Page) -> None:
    page.ask("open", game="roboflag", map="open")
    page.ask("check")
    assert page.ask("save", play=True)["ask"]["kind"] == "name"
    page.ask("open", game="practice")
    assert page.ask("save", play=True)["ended"]
    assert page.desk.outcome == NextStep(play="practice")


def test_a_match_is_saved_under_a_name_and_played(page: Page, tmp_path: Path) -> None:
    page.set("seed", "7")
    assert page.ask("save", play=True)["ask"]["kind"] == "name"
    assert "got 'a/b'" in page.ask("save", play=True, name="a/b")["ask"]["question"]
    assert page.ask("save", name="final")["notice"] == f"Saved as {tmp_path / 'final.toml'}."
    assert 'name = "final"' in page.desk.draft.text
    assert not page.told["changed"]
    page.set("seed", "8")
    page.ask("save", play=True)
    assert page.desk.outcome == NextStep(play=str(tmp_path / "final.toml"))
    assert (tmp_path / "final.toml").read_text(encoding="utf-8") == page.desk.draft.text


def test_what_has_problems_is_saved_but_not_played(page: Page, tmp_path: Path) -> None:
    page.ask("set", key="players.3.x", typed="99")
    told = page.ask("save", play=True)
    assert told["notice"].startswith("It cannot be played yet. player4: expected a pose inside map courtyard")
    assert page.desk.outcome is None
    page.ask("save", name="bad")
    assert (tmp_path / "bad.toml").exists()


def test_another_file_is_only_replaced_if_that_is_wanted(page: Page, tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    other.write_text("mine", encoding="utf-8")
    assert page.ask("save", name="other")["ask"]["kind"] == "replace"
    assert other.read_text(encoding="utf-8") == "mine"
    page.ask("save", name="other", replace=True)
    assert other.read_text(encoding="utf-8") == page.desk.draft.text
    page.set("seed", "3")
    other.write_text("somebody else's", encoding="utf-8")
    assert page.ask("save")["ask"]["kind"] == "replace"


def test_what_is_not_saved_is_asked_for_before_it_is_left_and_kept_at_the_end(page: Page, tmp_path: Path) -> None:
    assert page.desk.rescue() == ""
    page.set("seed", "9")
    for request in ({"do": "open", "game": "practice"}, {"do": "leave"}):
        assert page.ask(**request)["ask"]["kind"] == "leave"
    assert (page.desk.outcome, page.value("seed")) == (None, "9")
    assert page.desk.rescue() == f"vrg: what was not saved is in {tmp_path / 'match-unsaved.toml'} now."
    assert (tmp_path / "match-unsaved.toml").read_text(encoding="utf-8") == page.desk.draft.text
    assert "match-unsaved-2.toml" in page.desk.rescue()
    page.ask("leave", sure=True)
    assert page.desk.outcome == NextStep()
    assert page.desk.rescue() == ""


def test_recent_matches_are_opened_watched_and_told_when_they_are_gone(place: Path) -> None:
    page = page_in(place)
    over, file, _ = page.ask("look")["start"]["recent"]
    page.ask("open", match=over["match"])
    record = Path(over["match"]).read_text(encoding="utf-8")
    page.ask("set", key="seed", typed="9")
    assert page.ask("save", name="match")["ask"]["kind"] == "name"
    assert Path(over["match"]).read_text(encoding="utf-8") == record
    page.ask("undo")
    page.ask("watch", match=over["match"])
    assert page.desk.outcome == NextStep(watch=place / "runs" / "one")
    page.ask("open", match=file["match"])
    assert (page.desk.draft.file, page.desk.draft.game) == (place / "mine.toml", "roboflag")
    (place / "mine.toml").unlink()
    assert "mine.toml cannot be read" in page.ask("open", match=file["match"])["notice"]
    assert "expected one of the recent matches" in page.ask("open", match="/etc/passwd")["notice"]


def test_a_file_that_is_no_toml_is_shown_and_told(tmp_path: Path) -> None:
    page = page_in(tmp_path, Draft("seed = 1\nname =\n", tmp_path, tmp_path / "broken.toml"))
    assert [(problem["line"], problem["fields"]) for problem in page.told["problems"]] == [(2, [])]
    for request in ({"do": "set", "key": "seed", "typed": "1"}, {"do": "count", "players": 3}):
        assert "only a text editor can fix it" in page.ask(**request)["notice"]


def test_a_check_that_fails_is_told(tmp_path: Path) -> None:
    def check(draft: Draft) -> Any:
        raise RuntimeError("broken")

    desk = Editor(tmp_path, tmp_path / "runs", check=check)
    desk.check()
    assert desk.state()["problems"][0]["text"] == "the check itself has failed: RuntimeError('broken')"


@pytest.mark.parametrize("key", ["players.0.secret", "players.x.y", "secret", "machines.lab.host", ""])
def test_only_fields_of_the_configurator_can_be_set(page: Page, key: str) -> None:
    before = page.desk.draft.text
    assert "expected a field of the configurator" in page.ask("set", key=key, typed="1")["notice"]
    assert page.desk.draft.text == before
