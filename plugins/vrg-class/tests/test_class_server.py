"""The server of a class, as pages and hostile programs use it."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from served_class import GOOD, PATIENCE, Class, post, serve, wait_until

from tests.command_line import invoke
from tests.planted import check_unknown
from vrg.errors import LaunchError
from vrg.launch.folder_lock import owned
from vrg.launch.sandbox.seal import missing
from vrg_class import folder as class_folder
from vrg_class import tries
from vrg_class.classroom import ASKED_AT_ONCE
from vrg_class.command import opened
from vrg_class.folder import CODE_SIZE, ClassFolder, revision

SEALED = pytest.mark.skipif(missing() is not None, reason="this machine cannot seal")


@pytest.fixture
def of_class(tmp_path: Path) -> Iterator[Class]:
    """A class of Sharks and Minnows."""
    found = serve(opened(tmp_path / "class", "sharks-and-minnows", None, None, None))
    yield found
    found.site.stop()


def kinds(found: list[dict[str, object]], kind: str) -> list[dict[str, object]]:
    return [one for one in found if one["t"] == kind]


def test_a_student_joins_tries_reaches_the_goal_and_finds_it_done(of_class: Class) -> None:
    token = of_class.join("Ada")
    _, me = of_class.ask("/me", token)
    assert (me["name"], me["steps"][0]["title"], me["steps"][0]["done"]) == ("Ada", "Drive", False)
    assert "class" in me["code"]
    slow = of_class.tried(token, me["code"])
    assert kinds(slow, "end")[0]["goal"] == {"reached": None, "spoiled": "time", "rule": None, "within": 15.0}
    assert {"about", "at", "view", "call"} <= {one["t"] for one in slow}
    _, start = of_class.ask("/start", token, step="02-print")
    assert [one["t"] for one in start if one["t"] in ("about", "end")] == ["about", "end"]
    assert of_class.ask("/start", token, step="02-print")[1] == start
    good = of_class.tried(token, GOOD)
    (end,) = kinds(good, "end")
    assert 5.0 < end["goal"]["reached"] < 15.0  # type: ignore[index]
    _, me = of_class.ask("/me", token)
    assert me["steps"][0]["done"]
    assert me["code"] == GOOD
    views = kinds(good, "view")
    assert {"view.position", "view.me.role"} <= {expression for expression, _ in views[5]["values"]}  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("body", "line", "words"),
    [
        ("return Twist(speed, 0.0)", 6, "name 'speed' is not defined"),
        ("return view.poses", 6, "no attribute 'poses'"),
        ("return 'fast'", 5, "expected a Twist(v, w)"),
        ("return Twist(float('nan'), 0.0)", None, "finite"),
        ("x = = 3", 6, "invalid syntax"),
        ("while True: pass", 6, "act took more than 2 s"),
        ("raise SystemExit", 6, "SystemExit"),
        ("open('/etc/shadow')", 6, "PermissionError"),
    ],
)
@SEALED
def test_what_goes_wrong_is_shown_at_its_line(of_class: Class, body: str, line: int | None, words: str) -> None:
    code = f"from vrg.agents import *\n\n\nclass Mine(Strategy):\n    def act(self, view):\n        {body}\n"
    (first, *_) = kinds(of_class.tried(of_class.join("Bo"), code), "error")
    assert first["line"] == line
    assert words in str(first["text"])
    assert str(of_class.folder.path) not in str(first)


def test_what_is_printed_appears_with_its_time(of_class: Class) -> None:
    code = GOOD.replace("        return", "        print('now', round(view.time, 1))\n        return")
    lines = kinds(of_class.tried(of_class.join("Cy"), code), "print")
    assert len(lines) > 20
    assert all(one["text"] == f"now {round(float(one['time']), 1)}" for one in lines)  # type: ignore[arg-type]


def test_what_is_printed_before_an_error_is_shown_and_much_printing_is_bounded(of_class: Class) -> None:
    token = of_class.join("Cy")
    code = GOOD.replace("        return", "        print('before')\n        y = speed\n        return")
    assert {line["text"] for line in kinds(of_class.tried(token, code), "print")} == {"before"}
    code = GOOD.replace("        return", "        for _ in range(200): print()\n        return")
    assert len(kinds(of_class.tried(token, code), "print")) <= 2000


def test_no_failure_of_the_disk_or_of_the_league_ends_what_serves_all(
    of_class: Class, monkeypatch: pytest.MonkeyPatch
) -> None:
    token = of_class.join("Ada")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("vrg_class.tries.tempfile.TemporaryDirectory", full)
        patched.setattr("vrg_class.league.ClassLeague.rest", full)
        for _ in range(3):  # more than there are at a time
            assert kinds(of_class.tried(token, GOOD), "end")[0]["why"] == "failed"
        wait_until(lambda: of_class.ask("/board", token)[0] == 200, "an answer")
    again = of_class.tried(token, f"{GOOD}\n# again\n")
    assert kinds(again, "end")[0]["goal"]["reached"]  # type: ignore[index]
    assert not of_class.site._ticking.done()


def test_what_was_handed_in_while_a_request_was_still_coming_stays(of_class: Class) -> None:
    token = of_class.join("Ada")

    base = of_class.base(token)

    async def slowly(session: aiohttp.ClientSession) -> int:
        async def body() -> AsyncIterator[bytes]:
            yield b'{"code": "# later", "base": "' + revision(GOOD).encode() + b'", '
            assert (await post(session, f"{of_class.at}/hand-in", token, {"code": GOOD, "base": base}))[0] == 200
            yield b'"step": "", "against": 0}'

        headers = {"Authorization": f"Bearer {token}"}
        await asyncio.sleep(0.6)
        async with session.post(f"{of_class.at}/try", headers=headers, data=body()) as answer:
            return answer.status

    assert of_class.run(slowly) in (200, 400), "400 if it was too quick"
    assert of_class.folder.students["ada"].handed == 1
    assert (of_class.folder.entries / "ada.py").read_text() == GOOD


def test_the_league_plays_what_was_handed_in_and_the_board_shows_it(of_class: Class) -> None:
    wrong = of_class.join("Cy")
    assert of_class.send("/hand-in", wrong, code="def")[0] == 200
    tokens = [of_class.join(name) for name in ("Ada", "Bo")]
    for token, speed in zip(tokens, ("0.7", "0.3"), strict=True):
        status, found = of_class.send("/hand-in", token, code=GOOD.replace("0.7", speed))
        assert (status, found["version"]) == (200, 1)
    wait_until(lambda: of_class.ask("/board", tokens[0])[1]["games"] > 0, "the league to play")
    _, board = of_class.ask("/board", of_class.folder.about.joining)
    assert {row["name"] for row in board["rows"][:2]} == {"Ada", "Bo"}
    assert (board["rows"][2]["name"], board["rows"][2]["rating"]) == ("Cy", None), "not rated yet"
    assert "cannot be read" in of_class.ask("/board", wrong)[1]["problem"]
    assert of_class.ask("/board", tokens[0])[1]["problem"] == ""
    status, page = of_class.get(f"/{board['pages']}")
    assert (status, "Ada" in page or "ada" in page) == (200, True)
    assert of_class.get(f"/league/{tokens[0]}/index.html")[0] == 404
    key = board["pages"].split("/")[1]
    assert of_class.folder.about.joining not in board["pages"]
    assert of_class.get(f"/league/{key}/..%2Fexperiment.html")[0] == 404


def test_everything_survives_a_restart(tmp_path: Path) -> None:
    first = serve(opened(tmp_path / "class", None, None, None, None))
    try:
        token = first.join("Ada")
        first.tried(token, GOOD)
        first.tried(token, GOOD.replace("0.7", "fast"))
        first.send("/save", token, code="# half a thought")
    finally:
        first.site.stop()
    again = serve(opened(tmp_path / "class", None, None, None, None))
    try:
        _, me = again.ask("/me", token)
        assert (me["name"], me["code"], me["steps"][0]["done"], me["versions"]) == ("Ada", "# half a thought", True, 2)
        (ada,) = again.ask("/teacher", again.folder.about.teacher)[1]["students"]
        assert (ada["tries"], ada["line"], "fast" in ada["error"], ada["stuck"] < 1000) == (2, 6, True, True)
    finally:
        again.site.stop()


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
        wait_until(lambda: bool(found.ask("/teacher", teacher)[1]["problems"]), "the teacher to be told")
        found.join("Ada", "apple")
        roster.write_text("Bo,pear\n", encoding="utf-8")
        wait_until(lambda: found.ask("/join", joining, name="Bo", word="pear", device="c")[0] == 200, "the new one")
        assert found.ask("/teacher", teacher)[1]["problems"] == []
    finally:
        found.site.stop()
    roster.write_text("Cy,plum\n", encoding="utf-8")
    assert opened(tmp_path / "class", None, None, None, None).about.roster == {"Bo": "pear"}
    assert opened(tmp_path / "class", None, None, None, roster).about.roster == {"Cy": "plum"}


def test_a_save_of_older_code_keeps_both_and_asks(of_class: Class) -> None:
    token = of_class.join("Ada")
    first = of_class.base(token)
    status, answer = of_class.ask("/save", token, code="# on the laptop", base=first)
    assert status == 200
    for path in ("/save", "/try", "/hand-in"):
        status, refused = of_class.ask(path, token, code=f"# on the telephone {path}", base=first)
        assert status == 409
        refused = json.loads(refused)
        assert (refused["why"], refused["code"]) == ("stale", "# on the laptop")
        assert refused["revision"] == answer["revision"]
        threading.Event().wait(0.6)  # as long as a student takes
    assert of_class.ask("/me", token)[1]["code"] == "# on the laptop"
    assert of_class.folder.students[token_folder(of_class, token)].handed == 0
    kept = [
        of_class.ask("/version", token, number=one["number"])[1]["code"] for one in of_class.ask("/versions", token)[1]
    ]
    assert {f"# on the telephone {path}" for path in ("/save", "/try", "/hand-in")} <= set(kept)
    assert of_class.ask("/save", token, code="# on the laptop", base=first)[0] == 200, "the same code is no conflict"
    status, _ = of_class.ask("/save", token, code="# chosen", base=answer["revision"], apart=True)
    assert status == 200
    newest = of_class.ask("/versions", token)[1][0]
    assert of_class.ask("/version", token, number=newest["number"])[1]["code"] == "# on the laptop"
    assert of_class.ask("/version", token, number=999)[0] == 400


def test_a_student_who_saves_without_end_keeps_nobody_from_saving(
    of_class: Class, monkeypatch: pytest.MonkeyPatch
) -> None:
    bad, ada = of_class.join("Bad"), of_class.join("Ada")
    base, write, slow = of_class.base(ada), class_folder.write_whole, 0.05
    monkeypatch.setattr(class_folder, "write_whole", lambda *a, **k: (threading.Event().wait(slow), write(*a, **k)))

    async def work(session: aiohttp.ClientSession) -> tuple[int, Counter[int]]:
        async def flood(number: int) -> int:
            body = {"code": f"# {number}", "base": "", "apart": True}
            return (await post(session, f"{of_class.at}/save", bad, body))[0]

        flooding = [asyncio.create_task(flood(number)) for number in range(60)]
        await asyncio.sleep(0.1)
        status, _ = await post(session, f"{of_class.at}/save", ada, {"code": "# mine", "base": base})
        late = sum(not task.done() for task in flooding)
        assert late <= ASKED_AT_ONCE
        return status, Counter(await asyncio.gather(*flooding))

    status, told = of_class.run(work)
    assert status == 200
    assert told[400] > 50, "the others were too many"


def token_folder(of_class: Class, token: str) -> str:
    student = of_class.folder.of_token(token)
    assert student is not None
    return student.folder


def test_other_pages_of_a_student_are_told_of_new_code(of_class: Class) -> None:
    token = of_class.join("Ada")
    base = of_class.base(token)

    async def work(session: aiohttp.ClientSession) -> Any:
        async with session.ws_connect(f"{of_class.at}/feed") as feed:
            await feed.send_str(token)
            await feed.receive()
            await post(session, f"{of_class.at}/save", token, {"code": "# new", "base": base})
            return json.loads((await feed.receive()).data)

    (told,) = of_class.run(work)
    assert (told["t"], told["code"], told["revision"]) == ("saved", "# new", revision("# new"))


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
    assert of_class.send("/hand-in", revoked["link"], code=GOOD)[0] == 200
    assert change("remove", student="ada")[0] == 200
    assert of_class.ask("/me", revoked["link"])[0] == 401
    assert not (of_class.folder.entries / "ada.py").exists()
    assert [file.read_text() for file in of_class.folder.path.glob("removed/*-ada/code.py")] == [GOOD]
    assert change("remove", student="ada")[0] == 404
    assert of_class.ask("/me", of_class.join("Ada"))[1]["versions"] == 0


def test_one_broken_record_keeps_no_class_from_starting(tmp_path: Path) -> None:
    first = serve(opened(tmp_path / "class", None, None, None, None))
    try:
        ada, bo = first.join("Ada"), first.join("Bo")
        first.send("/try", ada, code=GOOD, step="")
        first.send("/save", bo, code="# kept")
    finally:
        first.site.stop()
    (tmp_path / "class" / "students" / "ada" / "student.json").write_bytes(b"")
    (tmp_path / "class" / "students" / "bo" / "code.py").write_bytes(b"\xff# kept")
    (tmp_path / "class" / "students" / "cy").mkdir()
    again = serve(opened(tmp_path / "class", None, None, None, None))
    try:
        _, found = again.ask("/teacher", again.folder.about.teacher)
        assert [name for name in ("ada", "cy") if not any(f"/{name}/" in line for line in found["problems"])] == []
        assert again.ask("/me", bo)[1]["code"] == "\ufffd# kept"
        assert again.ask("/me", ada)[0] == 401
        token = again.join("Ada")
        _, me = again.ask("/me", token)
        assert (me["code"], me["versions"]) == (GOOD, 1)
    finally:
        again.site.stop()


def test_the_teacher_halts_and_speaks_and_sees_who_is_stuck(of_class: Class) -> None:
    token, teacher = of_class.join("Ada"), of_class.folder.about.teacher
    of_class.tried(token, GOOD.replace("0.7, 0.0", "fast, 0.0"))
    _, console = of_class.ask("/teacher", teacher)
    (ada,) = console["students"]
    assert (ada["name"], ada["tries"], ada["line"], "fast" in ada["error"]) == ("Ada", 1, 6, True)
    wait_until(lambda: of_class.ask("/teacher", teacher)[1]["busy"] == 0, "its process to end")
    assert of_class.ask("/teacher/decide", teacher, halted=True, message="Look up, please")[0] == 200
    wait_until(lambda: of_class.send("/try", token, code=GOOD, step="", against=0)[0] == 200, "room for a try")
    _, me = of_class.ask("/me", token)
    assert (me["halted"], me["message"]) == (True, "Look up, please")
    assert of_class.ask("/teacher", teacher)[1]["busy"] == 1, "it waits"
    of_class.ask("/teacher/decide", teacher, halted=False)
    wait_until(lambda: of_class.ask("/teacher", teacher)[1]["busy"] == 0, "it to be played")


def test_bounds_on_what_is_sent(of_class: Class) -> None:
    token = of_class.join("Ada")
    assert of_class.send("/save", token, code="x" * (CODE_SIZE + 1))[0] == 400
    assert of_class.send("/save", token, code="x" * 5_000_000)[0] in (400, 413)
    assert of_class.send("/try", token, code=GOOD, step="99-nothing", against=0)[0] == 400
    assert of_class.send("/try", token, code=GOOD, step="01-drive", against=7)[0] == 400
    assert of_class.ask("/start", token, step="99-nothing")[0] == 400
    for body in (b"", b"[" * 100_000, b"\xff", b'{"code": 3}', b'{"code": "", "more": 1}'):

        async def sent(session: aiohttp.ClientSession, body: bytes = body) -> int:
            headers = {"Authorization": f"Bearer {token}"}
            async with session.post(f"{of_class.at}/save", headers=headers, data=body) as response:
                return response.status

        assert of_class.run(sent) == 400, body[:20]
    assert of_class.ask("/me", token)[0] == 200


@SEALED
def test_hostile_students_harm_nobody_else(of_class: Class) -> None:
    """They loop, flood, fork, fill memory and the disk, and look for the code of others, while one plays on."""
    ada = of_class.join("Ada")
    of_class.send("/save", ada, code="# a secret of Ada's")
    secret = of_class.folder.path / "students" / "ada" / "code.py"
    deeds = [
        "while True: pass", "print('x' * 10000)", "import os; os.fork()", "self.kept = bytearray(10**10)",
        f"open({str(secret)!r}).read()", "import os; os.kill(os.getppid(), 9)",
        "open('/tmp/vrg-class-filled', 'wb').write(bytes(10**8))",
        "import socket; socket.create_connection(('127.0.0.1', 80))",
    ]  # fmt: skip
    tokens = {deed: of_class.join(f"Bad {number}") for number, deed in enumerate(deeds)}

    async def all_at_once(session: aiohttp.ClientSession) -> None:
        for deed, token in tokens.items():
            code = f"from vrg.agents import *\n\n\nclass Mine(Strategy):\n    def act(self, view):\n        {deed}\n"
            await post(session, f"{of_class.at}/try", token, {"code": code, "step": "01-drive", "against": 0})

    of_class.run(all_at_once)
    (end,) = kinds(of_class.tried(ada, GOOD), "end")
    assert end["goal"]["reached"]  # type: ignore[index]
    _, teacher = of_class.ask("/teacher", of_class.folder.about.teacher)
    wait_until(lambda: of_class.ask("/teacher", of_class.folder.about.teacher)[1]["busy"] == 0, "all to have ended")
    assert secret.read_text() == GOOD
    assert not Path("/tmp/vrg-class-filled").exists() or Path("/tmp/vrg-class-filled").stat().st_size == 0
    assert len(teacher["students"]) == 1 + len(deeds)


def test_many_pages_of_one_student_and_pages_without_a_token(of_class: Class) -> None:
    token = of_class.join("Ada")

    async def work(session: aiohttp.ClientSession) -> list[int | None]:
        feeds = []
        for _ in range(6):
            feed = await session.ws_connect(f"{of_class.at}/feed")
            await feed.send_str(token)
            await feed.receive()
            feeds.append(feed)
        stranger = await session.ws_connect(f"{of_class.at}/feed")
        await stranger.send_str("nobody")
        closed = [(await feed.receive()).data for feed in (*feeds[:3], stranger)]
        assert not feeds[-1].closed
        return closed

    assert of_class.run(work) == [1008, 1008, 1008, 4001]


@pytest.mark.system
def test_the_command_serves_a_class_and_survives_being_killed(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "vrg", "class", "start", str(tmp_path / "class"), "--listen", "127.0.0.1:0"]

    def started() -> tuple["subprocess.Popen[str]", str]:
        process = subprocess.Popen([*command[:-1], "127.0.0.1:18090"], stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("students"), line
        return process, line.split()[1]

    async def joined(at: str, token: str) -> str:
        async with aiohttp.ClientSession() as session:
            status, found = await post(session, f"{at}/join", token, {"name": "Ada", "word": ""})
            assert status == 200, found
            await post(session, f"{at}/hand-in", found["token"], {"code": GOOD})
            return str(found["token"])

    process, link = started()
    try:
        at, _, joining = link.partition("/#join=")
        token = asyncio.run(joined(at, joining))
        os.kill(process.pid, signal.SIGKILL)
        process.wait(PATIENCE)
        process, again = started()
        assert again == link, "the links stay good"
        students = ClassFolder(tmp_path / "class").students
        assert (students[token].name, students[token].handed) == ("Ada", 1)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)
    entry = tmp_path / "class" / "entries" / "ada.py"
    assert entry.read_text() == GOOD
    assert json.loads((tmp_path / "class" / "class.json").read_text())["game"] == "sharks-and-minnows"


def test_code_of_a_student_does_not_find_variables_of_the_server(tmp_path: Path) -> None:
    code = """
import asyncio
from vrg_class.tries import Tries, Try

async def main():
    tries = Tries(1, "sharks-and-minnows", "planar", sealed=True)
    tries.ask(Try("ann", "sharks-and-minnows", {"sharks": "stuck.py"}, "sharks", None, 9.0, print))
    await asyncio.sleep(100)

asyncio.run(main())
"""
    check_unknown([sys.executable, "-c", code], tmp_path, "vrg strategy")


def test_a_class_and_its_final_are_run_once(tmp_path: Path) -> None:
    place = opened(tmp_path / "class", None, None, None, None).path
    for folder, command in ((place, "start"), (place / "final", "final")):
        with owned(folder):
            done = invoke("class", command, str(place), *(["--no-sandbox"] if command == "start" else []))
        assert isinstance(done.exception, LaunchError)
        assert f"{folder}: process {os.getpid()}, or what it has started, works here already" in str(done.exception)
    assert opened(tmp_path / "class", None, None, None, None).path == place


def test_a_slow_try_ends_while_others_wait(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tries, "FAIR", 1.0)
    head = "import time\nfrom vrg.agents import STILL, Strategy\n\n\nclass Mine(Strategy):\n    def act(self, view):\n"
    (tmp_path / "slow.py").write_text(f"{head}        time.sleep(0.8)\n        return STILL\n")
    (tmp_path / "quick.py").write_text(f"{head}        return STILL\n")
    said: dict[str, list[dict[str, Any]]] = {"slow": [], "quick": []}

    async def both() -> None:
        queue = tries.Tries(1, "sharks-and-minnows", "planar", sealed=missing() is None)
        for name, texts in said.items():
            players = {"sharks": str(tmp_path / f"{name}.py")}
            heard = lambda text, texts=texts: texts.append(json.loads(text))  # noqa: E731
            queue.ask(tries.Try(name, "sharks-and-minnows", players, "sharks", None, 5.0, heard))
        while not all(texts and texts[-1]["t"] == "end" for texts in said.values()):
            await asyncio.sleep(0.05)
        queue.close()

    asyncio.run(asyncio.wait_for(both(), PATIENCE))
    assert said["slow"][-1]["why"] == "slow"
    assert "why" not in said["quick"][-1]
