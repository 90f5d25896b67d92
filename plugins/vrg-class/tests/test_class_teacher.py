"""Who is in a class: names, tokens, rosters, and what the teacher changes."""

from pathlib import Path
from typing import Any

from served_class import GOOD, Class, serve, wait_until

from vrg_class.command import opened


def test_tokens_and_names(of_class: Class) -> None:
    about = of_class.folder.about
    assert of_class.ask("/join", "wrong", name="Ada", word="")[0] == 401
    for name in ("", " ", "../../etc", "a" * 61, "<b>", "\u202eevil"):
        status, words = of_class.ask("/join", about.joining, name=name, word="")
        assert (status, '"name"' in words) == (400, True), name
    token = of_class.join("Zoë")
    assert "taken" in of_class.ask("/join", about.joining, name="zoë", word="")[1]
    for path in ("/me", "/save", "/try", "/hand-in"):
        assert of_class.ask(path, about.joining, code="x", base="", step="", against=0)[0] == 401, path
    for path in ("/teacher", "/teacher/decide", "/teacher/code"):
        assert of_class.ask(path, token)[0] == 401, path
    assert of_class.ask("/board", "")[0] == 401
    assert of_class.ask("/teacher/code", about.teacher, student="zoe")[1]["code"] == ""


def test_a_roster_lets_only_those_in_who_know_their_word(tmp_path: Path) -> None:
    roster = tmp_path / "names.csv"
    roster.write_text("Ada,apple\nBo, pear \n", encoding="utf-8")
    found = serve(opened(tmp_path / "class", None, None, None, roster))
    try:
        token = found.join("Ada", "apple")
        assert found.join("Ada", "apple") == token, "on another device"
        joining = found.folder.about.joining
        for name, word in (("Ada", "pear"), ("Cy", ""), ("Bo", "")):
            assert found.ask("/join", joining, name=name, word=word, device="hers")[0] == 400
        assert found.ask("/join", joining, name="ADA", word="Apple", device="another")[1]["token"] == token
    finally:
        found.site.stop()


def test_wrong_words_of_one_pupil_keep_nobody_else_out(tmp_path: Path) -> None:
    roster = tmp_path / "names.csv"
    roster.write_text("Ada,apple\nBo,pear\n", encoding="utf-8")
    found = serve(opened(tmp_path / "class", None, None, None, roster))
    try:
        joining = found.folder.about.joining
        told = [
            found.ask("/join", joining, name=("Bo", "Ada")[n % 2], word="guess", device="hers")[1] for n in range(12)
        ]
        assert "guesses" in told[-1]
        assert "guesses" in found.ask("/join", joining, name="Bo", word="pear", device="hers")[1]
        assert found.ask("/join", joining, name="Bo", word="pear", device="his")[0] == 200
    finally:
        found.site.stop()


def test_the_roster_can_be_changed_while_the_class_runs(tmp_path: Path) -> None:
    roster = tmp_path / "names.csv"
    roster.write_text("Ada,apple\n", encoding="utf-8")
    found = serve(opened(tmp_path / "class", None, None, None, roster))
    try:
        joining, teacher = found.folder.about.joining, found.folder.about.teacher
        found.join("Ada", "apple")
        assert found.ask("/join", joining, name="Bo", word="pear", device="b")[0] == 400
        roster.write_text("Bo,\n", encoding="utf-8")
        wait_until(lambda: bool(found.ask("/teacher", teacher)[1]["roster"]), "the teacher to be told")
        found.join("Ada", "apple")
        roster.write_text("Bo,pear\n", encoding="utf-8")
        wait_until(lambda: "Bo" in found.folder.about.roster, "the new one")
        assert found.join("Bo", "pear")
        assert found.ask("/teacher", teacher)[1]["roster"] == ""
    finally:
        found.site.stop()
    roster.write_text("Cy,plum\n", encoding="utf-8")
    assert opened(tmp_path / "class", None, None, None, None).about.roster == {"Bo": "pear"}
    assert opened(tmp_path / "class", None, None, None, roster).about.roster == {"Cy": "plum"}


def test_nobody_joins_a_class_that_is_closed_but_whom_the_teacher_adds(of_class: Class) -> None:
    teacher, joining = of_class.folder.about.teacher, of_class.folder.about.joining
    of_class.join("Ada")
    assert of_class.ask("/teacher/decide", teacher, closed=True)[0] == 200
    assert "closed" in of_class.ask("/join", joining, name="Bo", word="")[1]
    assert of_class.ask("/teacher/change", teacher, act="add", name="Bo")[0] == 200
    assert of_class.ask("/teacher/decide", teacher, closed=False)[0] == 200
    of_class.join("Cy")


def test_no_name_of_the_roster_is_given_to_somebody_else(tmp_path: Path) -> None:
    roster = tmp_path / "names.csv"
    roster.write_text("Ada,apple\nAda L.,pear\n", encoding="utf-8")
    found = serve(opened(tmp_path / "class", None, None, None, roster))
    try:
        token, teacher = found.join("Ada", "apple"), found.folder.about.teacher
        status, told = found.ask("/teacher/change", teacher, act="rename", student="ada", name="Ada L.")
        assert (status, "taken" in told) == (400, True)
        assert found.ask("/teacher/change", teacher, act="rename", student="ada", name="Ada B.")[0] == 200
        assert found.join("Ada L.", "pear") != token
        assert found.join("Ada", "apple") == token
    finally:
        found.site.stop()
    # What was changed while nobody served it counts as well.
    roster.write_text("Bo,plum\n", encoding="utf-8")
    again = serve(opened(tmp_path / "class", None, None, None, None))
    try:
        wait_until(lambda: "Bo" in again.folder.about.roster, "the new name")
        assert again.join("Bo", "plum")
    finally:
        again.site.stop()


def test_the_teacher_adds_renames_removes_and_resets_students_and_revokes_links(of_class: Class) -> None:
    token, teacher = of_class.join("Ada"), of_class.folder.about.teacher

    def change(act: str, **body: str) -> tuple[int, Any]:
        return of_class.ask("/teacher/change", teacher, act=act, **body)

    assert of_class.ask("/teacher/change", token, act="remove", student="ada")[0] == 401
    _, added = change("add", name="Bo")
    assert of_class.ask("/me", added["link"])[1]["name"] == "Bo"
    assert "taken" in change("add", name="bo")[1]
    assert "name" in change("rename", student="bo", name="<b>")[1]
    assert "taken" in change("rename", student="bo", name="ADA")[1]
    assert change("rename", student="bo", name="Beatrix")[0] == 200
    assert of_class.ask("/me", added["link"])[1]["name"] == "Beatrix"
    assert "taken" in of_class.ask("/join", of_class.folder.about.joining, name="Bo", word="")[1], "she joined by it"
    of_class.tried(token, GOOD)
    assert of_class.ask("/me", token)[1]["steps"][0]["done"]
    assert change("reset", student="ada")[0] == 200
    _, me = of_class.ask("/me", token)
    assert (me["steps"][0]["done"], me["code"] == GOOD, "class" in me["code"]) == (False, False, True)
    newest = of_class.ask("/versions", token)[1][0]
    assert of_class.ask("/version", token, number=newest["number"])[1]["code"] == GOOD
    _, revoked = change("revoke", student="ada")
    assert of_class.ask("/me", token)[0] == 401
    assert of_class.ask("/me", revoked["link"])[1]["name"] == "Ada"
    # It is refused in the half second after the try.
    wait_until(lambda: of_class.send("/hand-in", revoked["link"], code=GOOD)[0] == 200, "the hand-in")
    assert change("remove", student="ada")[0] == 200
    assert of_class.ask("/me", revoked["link"])[0] == 401
    assert not (of_class.folder.entries / "ada.py").exists()
    assert [file.read_text() for file in of_class.folder.path.glob("removed/*-ada/code.py")] == [GOOD]
    assert change("remove", student="ada")[0] == 404
    assert of_class.ask("/me", of_class.join("Ada"))[1]["versions"] == 0


def test_the_teacher_halts_and_speaks_and_sees_who_is_stuck(of_class: Class) -> None:
    token, teacher = of_class.join("Ada"), of_class.folder.about.teacher
    of_class.tried(token, GOOD.replace("0.7, 0.0", "fast, 0.0"))

    def shown() -> tuple[str, int, int | None, bool]:
        (ada,) = of_class.ask("/teacher", teacher)[1]["students"]
        return ada["name"], ada["tries"], ada["line"], "fast" in ada["error"]

    # What went wrong is written to the disk after the student's page has it.
    wait_until(lambda: shown() == ("Ada", 1, 6, True), "the console to show the error")
    wait_until(lambda: of_class.ask("/teacher", teacher)[1]["busy"] == 0, "its process to end")
    assert of_class.ask("/teacher/decide", teacher, halted=True, message="Look up, please")[0] == 200
    wait_until(lambda: of_class.send("/try", token, code=GOOD, step="", against=0)[0] == 200, "room for a try")
    _, me = of_class.ask("/me", token)
    assert (me["halted"], me["message"]) == (True, "Look up, please")
    assert of_class.ask("/teacher", teacher)[1]["busy"] == 1, "it waits"
    of_class.ask("/teacher/decide", teacher, halted=False)
    wait_until(lambda: of_class.ask("/teacher", teacher)[1]["busy"] == 0, "it to be played")


def test_a_join_whose_answer_was_lost_may_be_said_again_from_the_same_device(of_class: Class) -> None:
    joining = of_class.folder.about.joining
    first = of_class.ask("/join", joining, name="Ada", word="", device="hers")[1]["token"]
    assert of_class.ask("/join", joining, name="ada", word="", device="hers")[1]["token"] == first
    assert "taken" in of_class.ask("/join", joining, name="Ada", word="", device="another")[1]
    assert "taken" in of_class.ask("/join", joining, name="Ada", word="")[1]
    base = of_class.ask("/me", first)[1]["revision"]
    assert of_class.ask("/hand-in", first, code=GOOD, base=base)[0] == 200
    assert "taken" in of_class.ask("/join", joining, name="Ada", word="", device="hers")[1], "there is code to lose"


def test_another_link_keeps_out_the_device_that_had_the_one_before(of_class: Class) -> None:
    about = of_class.folder.about
    first = of_class.ask("/join", about.joining, name="Eve", word="", device="a device")[1]["token"]
    assert of_class.ask("/teacher/change", about.teacher, act="revoke", student="eve")[0] == 200
    assert of_class.ask("/me", first)[0] == 401
    assert "taken" in of_class.ask("/join", about.joining, name="Eve", word="", device="a device")[1]
