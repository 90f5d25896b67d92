"""Events as pure objects: timetables, what is played next and when, what counts, what survives a restart."""

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import pytest
from event_cases import NOW, THREE, event, played, restarted, table, words

from vrg.api import play
from vrg.errors import ConfigError
from vrg.testing.tiny import TINY
from vrg_class.event.course import Live, Phase, Report
from vrg_class.event.field import report_of
from vrg_class.event.outcomes import Kept, read_kept
from vrg_class.event.plan import Game
from vrg_class.event.results import as_csv, as_json, harmless
from vrg_class.site import RefusalError


def test_a_match_counts_only_if_its_journal_says_that_play_began(tmp_path: Path) -> None:
    assert report_of(tmp_path, None).why == "no_result"
    (tmp_path / "tiny.toml").write_text(TINY)
    run = play(tmp_path / "tiny.toml", runs=tmp_path / "match-1" / "runs", record=False)
    report = report_of(tmp_path, run.path)
    assert (report.why, report.winner, report.score) == ("", run.winner, run.score)
    assert (tmp_path / report.run).samefile(run.path)
    journal = run.path / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    begun = next(number for number, line in enumerate(lines) if b"play_round" in line)
    journal.write_bytes(b"".join(lines[:begun]))
    assert report_of(tmp_path, run.path).why == "not_begun"
    (run.path / "result.json").unlink()
    assert report_of(tmp_path, run.path).why == "no_result"


def test_a_match_is_waited_for_played_reviewed_and_confirmed_before_the_next_pause() -> None:
    found = event()
    assert (found.state(NOW)["phase"], found.state(NOW)["left"]) == ("waiting", 0.0)
    fixture = found.step(NOW)
    assert fixture is not None
    assert fixture.title == "Ann against Bob"
    assert found.step(NOW + 1.0) is None
    found.hear(Live(stage="initialize", waiting=("ann is not at its mark",)))
    assert (found.phase, found.state(NOW)["live"]["waiting"]) == ("ready", ("ann is not at its mark",))
    found.hear(Live(stage="play_round"))
    assert found.phase is Phase.RUNNING
    found.ended(Report(words="Minnows win", score={"sharks": 1, "minnows": 2}, winner="minnows"), NOW + 100.0)
    state = found.state(NOW + 101.0)
    assert (state["phase"], state["n"], state["left"], state["live"]) == ("review", 1, 29.0, None)
    found.step(NOW + 129.9)
    assert found.phase is Phase.REVIEW
    found.step(NOW + 130.1)
    state = found.state(NOW + 130.1)
    assert (state["phase"], state["n"], state["left"]) == ("waiting", 2, 60.0)
    assert found.listing()["matches"][0]["state"] == "confirmed"
    assert found.step(NOW + 190.0) is None
    assert found.step(NOW + 190.2) is not None


def test_a_match_that_did_not_begin_is_held_and_played_again() -> None:
    found = event()
    found.step(NOW)
    found.ended(Report(why="not_begun", words="Interrupted"), NOW + 5.0)
    state = found.state(NOW + 5.0)
    assert (state["phase"], state["n"], state["held"]) == ("waiting", 1, {"why": "not_begun", "words": "Interrupted"})
    assert found.step(NOW + 1000.0) is None
    found.go_on(NOW + 1000.0)
    assert found.step(NOW + 1000.0) is not None


def test_a_match_that_was_broken_off_waits_for_an_official_unless_nobody_reviews() -> None:
    for review, phase in ((30.0, "review"), (0.0, "waiting")):
        found = event(table(review=review))
        found.step(NOW)
        found.ended(Report(words="Interrupted", score={"sharks": 0, "minnows": 0}), NOW)
        found.step(NOW + 10_000.0)
        assert (found.phase, found.outcome(found.plan.fixtures[0]) is not None) == (phase, True)


def test_holding_the_timetable_holds_a_review_and_the_next_match() -> None:
    found = event()
    played(found, NOW, confirm=False)
    found.hold(NOW + 10.0, "official")
    assert found.step(NOW + 5000.0) is None
    assert found.phase is Phase.REVIEW
    found.go_on(NOW + 5000.0)
    assert found.state(NOW + 5000.0)["left"] == 20.0
    found.confirm(NOW + 5000.0)
    found.hold(NOW + 5000.0, "official")
    assert found.step(NOW + 9000.0) is None
    found.begin(NOW + 9000.0)
    assert found.held is None
    assert found.step(NOW + 9000.0) is not None


def test_officials_can_do_only_what_makes_sense_now() -> None:
    found = event()
    for act in (lambda: found.confirm(NOW), found.stop):
        with pytest.raises(RefusalError, match="not_now"):
            act()
    for number in (-1, 0, 1, 99):
        with pytest.raises(RefusalError, match="unknown_match"):
            found.again(number, NOW)
    found.step(NOW)
    with pytest.raises(RefusalError, match="not_now"):
        found.begin(NOW)
    found.stop()
    assert found.stopping
    with pytest.raises(RefusalError, match="unknown_match"):
        found.rename(99, "x")


def test_a_score_is_corrected_with_a_reason_and_what_it_was_is_kept() -> None:
    found = event()
    played(found, NOW, confirm=False)
    for score, winner, reason, why in (
        ({"sharks": 5}, "sharks", "a", "score"),
        ({"sharks": 5, "minnows": 5, "red": 1}, "sharks", "a", "score"),
        ({"sharks": 5, "minnows": 10**9}, "sharks", "a", "score"),
        ({"sharks": 5, "minnows": 1}, "red", "a", "score"),
        ({"sharks": 5, "minnows": 1}, "sharks", "  ", "reason"),
    ):
        with pytest.raises(RefusalError, match=why):
            found.correct(1, score, winner, reason)
    found.correct(1, {"minnows": 4, "sharks": 3}, "minnows", "Not seen")
    found.confirm(NOW)
    found.correct(1, {"sharks": 3, "minnows": 3}, "draw", "Seen")
    row = restarted(found).listing()["matches"][0]
    assert (row["score"], row["winner"]) == ([("sharks", 3), ("minnows", 3)], "draw")
    assert [(one["reason"], one["score"], one["winner"]) for one in row["corrections"]] == [
        ("Not seen", {"sharks": 2, "minnows": 1}, "sharks"),
        ("Seen", {"sharks": 3, "minnows": 4}, "minnows"),
    ]


def test_a_match_is_played_again_before_all_others_also_from_its_review() -> None:
    found = event()
    played(found, NOW)
    played(found, NOW, confirm=False)
    found.again(2, NOW)
    assert (found.phase, found.state(NOW)["n"], found.state(NOW)["left"]) == ("waiting", 2, 60.0)
    assert played(found, NOW) == 2
    assert played(found, NOW) == 3
    assert (found.state(NOW)["phase"], found.next) == ("over", None)
    found.again(3, NOW)
    found.again(1, NOW)
    assert [played(found, NOW), played(found, NOW)] == [1, 3]


def test_results_survive_a_restart_and_an_unconfirmed_one_is_reviewed_again() -> None:
    found = event()
    played(found, NOW)
    played(found, NOW, confirm=False)
    again = restarted(found, now=NOW + 500.0)
    assert (again.phase, again.on, again.state(NOW + 500.0)["left"]) == ("review", "Cid against Dee", 30.0)
    assert [one["state"] for one in again.listing()["matches"]] == ["confirmed", "review", "waiting"]
    again.hold(NOW + 510.0, "official")
    assert restarted(again, now=NOW + 900.0).step(NOW + 2000.0) is None
    assert restarted(again).held == {"why": "official"}, "what was held begins nothing by itself"


def test_results_stay_with_their_matches_if_the_timetable_changes() -> None:
    found = event()
    played(found, NOW, 1, 0)
    played(found, NOW, 2, 0)
    first, second, third = THREE

    def scores(*matches: Mapping[str, Any]) -> list[Any]:
        return [one.get("score", [("", "")])[0][1] for one in restarted(found, table(*matches)).listing()["matches"]]

    new = {"match": "other.toml", "title": "New"}
    assert scores(third, second, new, first) == ["", 2, "", 1], "by title"
    changed = {**first, "title": "Ann against Bert"}
    assert scores(changed, second, third) == [1, 2, ""], "a title was changed"
    assert scores(changed, second) == [1, 2], "and a match was left out"
    with pytest.raises(ConfigError, match="found those of 'Ann against Bob'"):
        scores(second, new)
    with pytest.raises(ConfigError, match="'Ann against Bob', 'Cid against Dee'"):
        scores(new)


def test_a_changed_title_is_found_by_what_was_played_wherever_it_stands() -> None:
    ann = {"match": "tiny.toml", "title": "A", "strategies": {"sharks": "ann.py"}}
    bob = {"match": "tiny.toml", "title": "B", "strategies": {"sharks": "bob.py"}, "seed": 7}
    found = event(table(ann, bob))
    played(found, NOW)
    again = restarted(found, table({**bob, "title": "Bob"}, {**ann, "title": "Ann"}))
    assert words(again) == [None, "the end"]
    reseeded = restarted(found, table({**ann, "title": "Ann", "seed": 9}, bob))
    assert words(reseeded) == ["the end", None], "by its number, as the game is the same"


def test_officials_correct_a_title_while_the_event_runs() -> None:
    found = event()
    played(found, NOW)
    found.rename(1, "  Ann against Bert ")
    again = restarted(found)
    assert (again.listing()["matches"][0]["title"], words(again)[0]) == ("Ann against Bert", "the end")
    again.rename(1, "")
    assert again.listing()["matches"][0]["title"] == "Ann against Bob"


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b'{"outcomes": 3}', b"[" * 100_000, b"\xff", b'{"seeds": {"x": 3}}']
)
def test_what_was_kept_and_is_damaged_gives_words(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "event.json"
    assert read_kept(file) == Kept()
    file.write_bytes(content)
    with pytest.raises(ConfigError, match="move it away"):
        read_kept(file)


def test_names_of_matches_never_collide() -> None:
    found = event(table(*({"match": "tiny.toml", "title": title} for title in ("A", "A", "A (2)"))))
    assert len({one.of.name for one in found.plan.fixtures}) == 3
    assert [played(found, NOW) for _ in range(3)] == [1, 2, 3]


def test_a_hold_from_before_a_review_does_not_prolong_it() -> None:
    found = event()
    found.step(NOW)
    found.hold(NOW + 1.0, "official")
    found.hear(Live(stage="play_round"))
    found.ended(Report(words="the end", score={"sharks": 1, "minnows": 0}, winner="sharks"), NOW + 300.0)
    found.go_on(NOW + 310.0)
    assert found.state(NOW + 310.0)["left"] == 30.0


def test_nothing_begins_at_once_when_a_match_is_to_be_played_again_or_the_event_is_started_again() -> None:
    found = event(table(THREE[0]))
    played(found, NOW)
    found.again(1, NOW + 5000.0)
    assert found.state(NOW + 5000.0)["left"] == 60.0
    found = event()
    played(found, NOW)
    assert restarted(found, now=NOW + 10.0).state(NOW + 10.0)["left"] == 50.0
    assert restarted(found, now=NOW - 9000.0).state(NOW - 9000.0)["left"] == 60.0, "a clock that was wrong"


def test_what_is_to_be_played_again_is_so_after_a_restart() -> None:
    found = event()
    for _ in range(3):
        played(found, NOW)
    found.again(3, NOW)
    found.again(2, NOW)
    again = restarted(found)
    assert [played(again, NOW), played(again, NOW)] == [2, 3]


def test_results_are_files_for_spreadsheets_and_programs() -> None:
    found = event(table({"match": "tiny.toml", "title": '=HYPERLINK("x")'}, {"match": "tiny.toml", "title": "Änn"}))
    played(found, NOW)
    found.correct(1, {"sharks": -1, "minnows": 4}, "minnows", "@home")
    data = as_csv(found)
    assert data.startswith(b"\xef\xbb\xbf")
    first, second = csv.DictReader(io.StringIO(data.decode("utf-8-sig")))
    assert first["title"] == """'=HYPERLINK("x")"""
    assert (first["points of first"], first["winner"], first["corrected because"]) == ("-1", "minnows", "'@home")
    assert (first["score"], first["score before"]) == ("sharks -1, minnows 4", "sharks 2, minnows 1")
    assert (second["title"], second["state"]) == ("Änn", "waiting")
    assert [harmless(text) for text in ("+1", "-1", "@x", "a=1", "")] == ["'+1", "'-1", "'@x", "a=1", ""]
    told, waits = msgspec.json.decode(as_json(found))["matches"]
    assert (told["title"], told["points of first"], told["run"]) == ('=HYPERLINK("x")', -1, None)
    unknown = {name for name, value in waits.items() if value is None}
    assert unknown >= {"points of first", "points of second", "winner", "score", "words", "corrected because", "run"}
    assert "" not in waits.values(), "what is not known is null"
    assert second["points of first"] == second["winner"] == ""


def test_a_match_of_more_than_two_sides_or_of_one_has_results_too() -> None:
    for sides in (("red",), ("red", "blue", "green")):
        found = event(table({"match": "x"}), game=Game(sides, 1))
        found.step(NOW)
        found.ended(Report(words="the end", score=dict.fromkeys(sides, 1), winner="red"), NOW)
        assert b"the end" in as_csv(found)
