"""The server of a class, as pages and hostile programs use it."""

import asyncio
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from served_class import GOOD, PATIENCE, SEALED, Class, kinds, post, wait_until

from vrg.errors import LaunchError
from vrg.launch.endpoints import free_port
from vrg.launch.folder_lock import owned
from vrg.launch.sandbox.seal import missing
from vrg.testing.command_line import invoke
from vrg.testing.processes.sealed import check_unknown
from vrg_class import tries
from vrg_class.command import opened
from vrg_class.folder import CODE_SIZE, ClassFolder, revision


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
        ("return Twist(float('nan'), 0.0)", 5, "finite"),
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
    assert board["rows"][2]["plays"] is False
    wait_until(lambda: of_class.site._room.desks["cy"].problem != "", "its student to be told")
    problem = of_class.ask("/me", wrong)[1]["problem"]
    assert (problem["kind"], problem["line"], "cy.py" in problem["text"]) == ("SyntaxError", 1, False)
    assert of_class.ask("/me", tokens[0])[1]["problem"] is None
    status, page = of_class.get(f"/{board['pages']}")
    assert (status, "Ada" in page or "ada" in page) == (200, True)
    assert of_class.get(f"/league/{tokens[0]}/index.html")[0] == 404
    key = board["pages"].split("/")[1]
    assert of_class.folder.about.joining not in board["pages"]
    assert of_class.get(f"/league/{key}/..%2Fexperiment.html")[0] == 404


def test_a_page_that_reads_nothing_holds_up_neither_the_class_nor_the_teacher(
    of_class: Class, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrg_class.page.HELLO", 0.5)
    token, teacher = of_class.join("Ada"), of_class.folder.about.teacher
    desk = of_class.site._room.desks["ada"]

    async def silent() -> asyncio.StreamWriter:
        reader, writer = await asyncio.open_connection("127.0.0.1", of_class.port, limit=1000)
        await aiohttp_hello(reader, writer, of_class.port, token)
        return writer

    async def work() -> None:
        writer = await silent()
        while not desk.pages:
            await asyncio.sleep(0.01)
        (page,) = desk.pages
        loop = of_class.site._loop
        assert loop is not None
        for _ in range(300):
            loop.call_soon_threadsafe(page.send, '"' + "x" * 100_000 + '"')
        async with aiohttp.ClientSession() as session:
            body = {"act": "reset", "student": "ada"}
            assert (await post(session, f"{of_class.at}/teacher/change", teacher, body))[0] == 200
        while desk.pages:
            await asyncio.sleep(0.05)
        writer.close()

    asyncio.run(asyncio.wait_for(work(), PATIENCE))


async def aiohttp_hello(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, port: int, token: str) -> None:
    """Open a feed by hand, and read nothing of it."""
    key = "dGhlIHNhbXBsZSBub25jZQ=="
    head = f"GET /feed HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    writer.write(f"{head}Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
    await reader.readuntil(b"\r\n\r\n")
    data = token.encode()
    writer.write(bytes([0x81, 0x80 | len(data), 0, 0, 0, 0]) + data)
    await writer.drain()


def test_bounds_on_what_is_sent(of_class: Class) -> None:
    token = of_class.join("Ada")
    assert of_class.send("/save", token, code="x" * (CODE_SIZE + 1))[0] == 413
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
            body = {"code": code, "base": revision(""), "step": "01-drive", "against": 0}
            assert (await post(session, f"{of_class.at}/try", token, body))[0] == 200, deed

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
    listen = f"127.0.0.1:{free_port('127.0.0.1', 18700, tries=200)}"
    command = [sys.executable, "-m", "vrg", "class", "start", str(tmp_path / "class"), "--listen", listen]

    def started() -> tuple["subprocess.Popen[str]", str]:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("students"), line
        return process, line.split()[1]

    async def joined(at: str, token: str) -> str:
        async with aiohttp.ClientSession() as session:
            status, found = await post(session, f"{at}/join", token, {"name": "Ada", "word": ""})
            assert status == 200, found
            body = {"code": GOOD, "base": revision("")}
            assert (await post(session, f"{at}/hand-in", found["token"], body))[0] == 200
            return str(found["token"])

    process, link = started()
    try:
        at, _, joining = link.partition("/#join=")
        asyncio.run(joined(at, joining))
        os.kill(process.pid, signal.SIGKILL)
        process.wait(PATIENCE)
        process, again = started()
        assert again == link, "the links stay good"
        ada = ClassFolder(tmp_path / "class").students["ada"]
        assert (ada.name, ada.handed) == ("Ada", 1)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)
    entry = tmp_path / "class" / "entries" / "ada.py"
    assert entry.read_text() == GOOD
    assert json.loads((tmp_path / "class" / "class.json").read_text())["game"] == "sharks-and-minnows"


def test_students_whose_tries_are_long_leave_a_place_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    async def work() -> list[str]:
        queue = tries.Tries(2, "sharks-and-minnows", "planar", sealed=False)
        began: list[str] = []
        monkeypatch.setattr(queue, "_played", lambda one: _never(began, one.owner))
        queue._long |= {"bad", "worse"}
        for owner in ("bad", "worse", "ada", "bo"):
            queue.ask(tries.Try(owner, "x", {}, "x", None, 1.0, lambda _: None))
        await asyncio.sleep(0.05)
        queue.close()
        return began

    assert asyncio.run(work()) == ["bad", "ada"]


def test_a_try_that_waits_is_soon_played_beside_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    async def work() -> list[str]:
        queue = tries.Tries(1, "sharks-and-minnows", "planar", sealed=False)
        began: list[str] = []
        monkeypatch.setattr(queue, "_played", lambda one: _never(began, one.owner))
        for owner in ("ada", "bo", "cy"):
            queue.ask(tries.Try(owner, "x", {}, "x", None, 1.0, lambda _: None))
        await asyncio.sleep(0.05)
        assert began == ["ada"]
        monkeypatch.setattr(tries, "SOON", 0.0)
        queue.halt(halted=False)
        await asyncio.sleep(0.05)
        queue.close()
        return began

    assert asyncio.run(work()) == ["ada", "bo"], "and no more than as many again"


async def _never(began: list[str], owner: str) -> None:
    began.append(owner)


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
    monkeypatch.setattr(tries, "SOON", 1e9)
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
