"""What students save: versions, conflicts, a full disk, broken files, a restart."""

import asyncio
import json
import threading
from collections import Counter
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from served_class import GOOD, Class, kinds, post, serve, wait_until

from vrg_class import folder as class_folder
from vrg_class.classroom import ASKED_AT_ONCE
from vrg_class.command import opened
from vrg_class.folder import CODE_SIZE, revision


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
    assert of_class.folder.students["ada"].handed == 0
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


def test_where_two_have_changed_the_code_the_newer_one_is_a_version_too(of_class: Class) -> None:
    token = of_class.join("Ada")
    first = of_class.base(token)
    of_class.ask("/save", token, code="# laptop", base=first)
    assert of_class.ask("/save", token, code="# telephone", base=first)[0] == 409
    # Whoever chooses may lose the connection, and saves as usual later.
    assert of_class.ask("/save", token, code="# telephone", base=of_class.base(token))[0] == 200
    kept = [
        of_class.ask("/version", token, number=one["number"])[1]["code"] for one in of_class.ask("/versions", token)[1]
    ]
    assert kept == ["# telephone", "# laptop"]


def test_too_much_code_is_told_so(of_class: Class) -> None:
    token = of_class.join("Ada")
    status, told = of_class.send("/save", token, "x" * (CODE_SIZE + 1))
    assert (status, json.loads(told)) == (413, {"why": "long", "most": CODE_SIZE})
    assert json.loads(of_class.send("/save", token, "x" * 2_000_000)[1])["why"] == "long"


def test_a_full_disk_burns_no_name(of_class: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(class_folder, "write_whole", full)
        token = of_class.join("Ada")
        assert of_class.send("/save", token, "# not saved")[0] == 507
    assert of_class.ask("/me", token)[1]["name"] == "Ada"
    record = of_class.folder.path / "students" / "ada" / "student.json"
    wait_until(record.is_file, "it to be written")


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
