"""A match file as a value: its edits keep what they do not mean to change."""

import tomllib
from pathlib import Path

import pytest

from vrg.games import GAMES
from vrg.types import Pose
from vrg_edit.checking import DraftCheck
from vrg_edit.draft import Draft
from vrg_edit.placing import fewer, more, with_count

CHECK = DraftCheck()


def draft_of(game: str = "sharks-and-minnows") -> Draft:
    return Draft.of_game(game, Path.cwd())


@pytest.fixture
def draft() -> Draft:
    """The default match of Sharks and Minnows."""
    return draft_of()


@pytest.mark.parametrize("game", GAMES.names())
def test_the_default_match_of_every_game_is_a_good_draft(game: str) -> None:
    draft = draft_of(game)
    verdict = CHECK(draft)
    assert verdict.problems == ()
    assert verdict.bounds is not None
    assert len(draft.players) >= 1
    assert draft.text.startswith(f"# A match of {GAMES.get(game).title}.")


def test_a_typed_number_becomes_a_number_and_nonsense_is_told_by_the_check() -> None:
    draft = draft_of().set(("players", 1, "x"), "17.5")
    assert tomllib.loads(draft.text)["players"][1]["x"] == 17.5
    assert CHECK(draft).problems == ()
    wrong = draft.set(("players", 1, "x"), "seventeen")
    assert wrong.shown(("players", 1, "x")) == "seventeen"
    assert wrong.players[1].pose is None
    assert [p.text for p in CHECK(wrong).of(("players", 1, "x"))] == ["expected a number, got 'seventeen'"]


def test_the_same_value_typed_again_changes_nothing(draft: Draft) -> None:
    assert draft.set(("players", 0, "x"), "21") is draft
    assert draft.set(("players", 0, "role"), "shark") is draft


def test_an_empty_field_falls_back_to_its_default_where_there_is_one() -> None:
    draft = draft_of().set(("players", 0, "model"), "ATRV-Jr")
    assert draft.players[0].model == "ATRV-Jr"
    draft = draft.set(("players", 0, "model"), "").set(("players", 0, "heading"), "")
    assert draft.players[0].model == ""
    assert draft.players[0].pose == Pose(21.0, -33.0, 0.0)
    assert [p.path for p in CHECK(draft.set(("players", 0, "name"), "")).problems] == [("players", 0, "name")]


def test_the_default_strategy_is_that_of_the_team_of_the_role_or_of_the_game() -> None:
    strategy = ("players", 0, "strategy")
    draft = Draft.of_game("pursuit-evasion", Path())
    assert {draft.default(("players", n, "strategy")) for n in range(len(draft.players))} == {"pursuer", "intruder"}
    draft = Draft.of_game("roboflag", Path())
    assert draft.default(strategy) == "balanced"
    team = "blue" if draft.players[0].role.startswith("blue") else "red"
    assert draft.set(("teams", team, "strategy"), "mixed").default(strategy) == "mixed"
    assert draft.set(("players", 0, "role"), "nobody").default(strategy) == ""
    scout = draft.set(("players", 0, "role"), f"{team}-scout")
    assert scout.default(strategy) == "vrg.games.roboflag.scout:Scout", "not that of its team"


def test_a_position_outside_of_the_map_is_a_problem_of_its_fields_and_the_zones_stay(draft: Draft) -> None:
    zones = DraftCheck()(draft).zones
    verdict = DraftCheck()(draft.place(6, Pose(500.0, 0.0, 0.0)))
    assert len(zones) == 3
    assert verdict.zones == zones
    assert [p.path for p in verdict.of(("players", 6, "x"))] == [("players", 6)]
    assert verdict.of(("players", 6, "x")) == verdict.of(("players", 6, "y"))
    assert verdict.of(("players", 6, "name")) == verdict.of(("players", 5, "x")) == ()


def test_what_no_window_shows_is_kept() -> None:
    text = draft_of().text.replace("[rules]", "# mine\nrate = 2.0   # twice\n\n[rules]\n# about the rules")
    draft = (
        Draft(text, Path.cwd())
        .set(("seed",), "7")
        .set(("players", 0, "x"), "20")
        .set(("players", 3, "strategy"), "a.py:A")
        .remove([2])
    )
    assert "# mine\nrate = 2.0   # twice\n" in draft.text
    assert "[rules]\n# about the rules" in draft.text
    assert [p.name for p in draft.players] == ["player1", "player2", "player4", "player5", "player6", "player7"]


def test_players_in_one_line_can_be_changed_too() -> None:
    draft = Draft('players = [{name = "a", x = 1.0}]  # all', Path.cwd())
    changed = draft.set(("players", 0, "x"), "2").add(draft.players[0])
    assert [player.name for player in changed.players] == ["a", "a"]
    assert [changed.shown(("players", number, "x")) for number in (0, 1)] == ["2", "0"]
    assert changed.remove([0]).text.endswith("# all")


def test_a_player_that_is_no_table_is_left_to_a_text_editor() -> None:
    with pytest.raises(ValueError, match=r"expected a table players\.0, got 'a'"):
        Draft('players = ["a", {name = "b"}]', Path.cwd()).set(("players", 0, "x"), "2")


@pytest.mark.parametrize(
    ("game", "counts"),
    [
        ("sharks-and-minnows", {2: None, 7: {"shark": 1, "minnow": 6}, 16: {"shark": 2, "minnow": 14}}),
        ("roboflag", {2: {"red": 1, "blue": 1}, 7: None, 16: {"red": 8, "blue": 8}}),
        ("pursuit-evasion", {2: {"pursuer": 1, "intruder": 1}, 7: {"pursuer": 2, "intruder": 5}, 16: None}),
        ("practice", {1: {"player": 1}, 7: {"player": 7}}),
    ],
)
def test_new_players_stand_where_the_rules_allow_it_and_roles_are_balanced(
    game: str, counts: dict[int, dict[str, int] | None]
) -> None:
    for count, roles in counts.items():
        draft = with_count(draft_of(game), count, CHECK(draft_of(game)))
        assert len({player.name for player in draft.players}) == count
        found = {role: sum(p.role == role for p in draft.players) for role in {p.role for p in draft.players}}
        if roles is not None:
            assert found == roles
        where = [p for p in CHECK(draft).problems if len(p.path) > 1]
        assert where == []


def test_one_more_and_one_fewer_are_each_others_opposite() -> None:
    draft = draft_of("roboflag")
    assert [p.name for p in fewer(more(draft, CHECK(draft))).players] == [p.name for p in draft.players]
    alone = with_count(draft, 0, CHECK(draft))
    assert len(alone.players) == 1
    assert CHECK(alone).problems


def test_a_strategy_that_cannot_be_imported_is_told_and_harms_nobody(tmp_path: Path) -> None:
    (tmp_path / "deadly.py").write_text("import os\nos._exit(9)\n", encoding="utf-8")
    (tmp_path / "wrong.py").write_text("class Other:\n    pass\n", encoding="utf-8")
    draft = Draft(draft_of().text, tmp_path)
    [deadly] = CHECK(draft.set(("players", 1, "strategy"), "deadly.py:A")).problems
    assert "ends its program" in deadly.text
    [wrong] = CHECK(draft.set(("players", 1, "strategy"), "wrong.py:Mine")).problems
    assert wrong.path == ("players", 1, "strategy")
    assert "expected the name of a class in wrong.py (Other), got 'Mine'" in wrong.text
    [missing] = CHECK(draft.set(("players", 1, "strategy"), "none.py:Mine")).problems
    assert "no such file" in missing.text


def test_a_module_beside_a_strategy_that_was_edited_is_checked_anew(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from helper import SPEED\nfrom vrg.agents import Strategy, Twist\n\n\nclass Mine(Strategy):\n"
        "    def act(self, view):\n        return Twist(SPEED, 0.0)\n"
    )
    (tmp_path / "helper.py").write_text("SPEED = 1\n")
    check = DraftCheck()
    draft = Draft.of_game("sharks-and-minnows", tmp_path).set(("players", 1, "strategy"), "mine.py:Mine")
    assert check(draft).problems == ()
    (tmp_path / "helper.py").write_text("SPEED = 1 / 0\n")
    [problem] = check(draft).problems
    assert "division by zero (helper.py, line 1" in problem.text
