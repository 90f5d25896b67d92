"""The server of an event: who may decide, what is passed on to the match, and that nothing ends it."""

import asyncio
import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import aiohttp
import psutil
import pytest
from event_day import LINING_UP, SCENE, SEAT, TOKEN, Day, day

from vrg.errors import ConfigError
from vrg.launch.folder_lock import owned
from vrg.testing.command_line import invoke
from vrg.testing.processes.match import long_match
from vrg.testing.tiny import TINY
from vrg_class.event.course import Live, Report
from vrg_class.event.outcomes import read_kept
from vrg_class.event.proxy import VIEWERS, Proxy
from vrg_class.event.watching import taken
from vrg_class.folder import About, ClassFolder
from vrg_class.site import RefusalError

PATIENCE = 20.0
MINE = """from vrg.agents import *


class Mine(Strategy):
    def act(self, view):
        return STILL
"""


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Day]:
    with day(tmp_path) as made:
        yield made


def until(holds: Callable[[], Any]) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        threading.Event().wait(0.02)


def ask(address: str, body: bytes | None = None, **headers: str) -> tuple[int, bytes, Any]:
    """The answer to a request: status, body, headers."""
    try:
        with urllib.request.urlopen(urllib.request.Request(address, body, headers), timeout=PATIENCE) as answer:
            return answer.status, answer.read(), answer.headers
    except urllib.error.HTTPError as error:
        return error.code, error.read(), error.headers


def act(running: Day, token: str = TOKEN, **wanted: Any) -> tuple[int, Any]:
    status, body, _ = ask(f"{running.base}act", json.dumps(wanted).encode(), Authorization=f"Bearer {token}")
    return status, json.loads(body)


def begin(running: Day) -> None:
    assert act(running, act="begin") == (200, {})
    until(lambda: running.field.page)


def test_only_officials_decide(running: Day) -> None:
    event = running.event
    assert act(running, "another", act="go on") == (401, {"why": "officials"})
    assert act(running, "", act="go on") == (401, {"why": "officials"})
    for wrong in (b"", b"{}", b'{"act": "sleep"}', b'{"act": "hold", "more": 1}', b"[" * 10_000, b"\xff"):
        status, body, _ = ask(f"{running.base}act", wrong, Authorization=f"Bearer {TOKEN}")
        assert (status, json.loads(body)["why"]) == (400, "request")
    assert event.held is not None
    assert act(running, act="confirm") == (409, {"why": "not_now"})
    assert act(running, act="title", n=2, title="Final") == (200, {})
    assert b'"Final"' in (running.field._folder / "event.json").read_bytes(), "it is written before the answer"
    begin(running)
    assert act(running, act="begin") == (409, {"why": "not_now"})
    running.field.report = Report(words="the end", score={"sharks": 1, "minnows": 2}, winner="minnows")
    until(lambda: event.phase == "review")
    assert act(running, act="correct", n=1, score={"sharks": 9}, winner="sharks", reason="x") == (400, {"why": "score"})
    assert act(running, act="hold")[0] == act(running, act="confirm")[0] == 200
    until(lambda: b'"confirmed"' in (running.field._folder / "results.json").read_bytes())
    state = json.loads(ask(f"{running.base}state?since=zz")[1])
    assert [(one["title"], one["state"]) for one in state["matches"]] == [
        ("Ann against Bob", "confirmed"), ("Final", "waiting"),
    ]  # fmt: skip


def test_a_crowd_of_viewers_pushes_out_nobody_who_was_first_but_for_one_address_with_many() -> None:
    proxy = Proxy(None)  # type: ignore[arg-type] - it asks nobody

    class Connection(asyncio.Transport):
        gone = False

        def abort(self) -> None:
            self.gone = True

    stage = Connection()
    assert proxy.has_room(stage, "10.0.0.0")
    phones = [Connection() for _ in range(VIEWERS)]
    assert [proxy.has_room(phone, f"10.0.1.{n}") for n, phone in enumerate(phones)] == [True] * (VIEWERS - 1) + [False]
    assert not any(one.gone for one in (stage, *phones))
    del proxy._viewers[phones[0]], proxy._viewers[phones[1]]
    crowd = [Connection() for _ in range(9)]
    assert all(proxy.has_room(one, "10.0.9.9") for one in crowd)
    assert [one.gone for one in crowd] == [True] * 7 + [False] * 2
    assert proxy.has_room(phones[-1], "10.0.1.99")
    assert not stage.gone


def test_options_that_play_does_not_take_are_refused_before_the_first_match(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "day.toml").write_text('title = "x"\noptions = ["--enginee", "x"]\n[[matches]]\nmatch = "tiny.toml"\n')
    with pytest.raises(ConfigError, match="--enginee x` is refused"):
        raise_error(invoke("event", str(tmp_path / "day.toml")))
    with pytest.raises(ConfigError, match="cannot be read"):
        raise_error(invoke("event", str(tmp_path / "typo.toml")))
    assert not (tmp_path / "typo").exists()


def test_tokens_are_told_to_officials_alone(running: Day) -> None:
    begin(running)
    for path in ("state", "stage.html", "officials.html", "", "results.json", "match/"):
        _, body, headers = ask(running.base + path)
        assert TOKEN not in f"{body!r}{headers}"
        assert SEAT not in f"{body!r}{headers}"
    status, body, _ = ask(f"{running.base}state", Authorization=f"Bearer {TOKEN}")
    assert (status, json.loads(body)["seats"]) == (200, {"ann": SEAT})
    assert ask(f"{running.base}state", Authorization="Bearer x")[0] == 401


def test_the_page_of_the_match_is_passed_on_and_may_be_shown_by_the_stage_alone(running: Day) -> None:
    assert b"No match is on the field" in ask(f"{running.base}match/")[1]
    assert ask(f"{running.base}match/main.js")[0] == 404
    begin(running)
    assert b"No match is on the field" in ask(f"{running.base}match/")[1], "it does not answer yet"
    running.field.show()
    status, body, headers = ask(f"{running.base}match/?view=projector&name=Final")
    assert (status, b'id="field"' in body) == (200, True)
    assert "frame-ancestors 'self'" in headers["Content-Security-Policy"]
    assert ask(f"{running.base}match/main.js")[2]["Content-Type"] == "text/javascript; charset=utf-8"
    assert ask(f"{running.base}match/nothing.js")[0] == 404
    assert ask(f"{running.base}match/drawers/../../state")[0] == 404
    stage = ask(f"{running.base}stage.html")[2]["Content-Security-Policy"]
    assert ("frame-src 'self'" in stage, "frame-ancestors 'none'" in stage) == (True, True)
    for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
        for path in ("match/", "match/socket", "state", "results.csv"):
            assert ask(running.base + path, **headers)[0] == 403


def test_viewers_officials_and_drivers_talk_to_the_match_through_the_event(running: Day) -> None:
    begin(running)
    running.field.show()

    async def talk() -> None:
        async with aiohttp.ClientSession() as session:

            async def hello(token: str) -> tuple[aiohttp.ClientWebSocketResponse, Any]:
                socket = await session.ws_connect(f"{running.base}match/socket")
                await socket.send_str(json.dumps({"t": "hello", "token": token}))
                return socket, json.loads((await socket.receive(PATIENCE)).data)[0]

            official, welcome = await hello(TOKEN)
            assert (welcome["t"], welcome["role"]) == ("welcome", "official")
            seat, welcome = await hello(SEAT)
            assert (welcome["role"], welcome["player"]) == ("seat", "ann")
            _, refused = await hello("wrong")
            assert refused["reason"] == "token"
            viewers = [await hello("") for _ in range(70)]
            assert all(welcome["role"] == "viewer" for _, welcome in viewers)

            async def stays(socket: aiohttp.ClientWebSocketResponse) -> bool:
                with contextlib.suppress(TimeoutError):
                    while (await socket.receive(1.0)).type is aiohttp.WSMsgType.TEXT:
                        pass
                    return False
                return True

            open_ = sum(await asyncio.gather(*(stays(socket) for socket, _ in viewers)))
            assert open_ == 60, "those who watch take no places of those who decide"
            await official.send_str('{"t":"act","what":"halt"}')
            await seat.send_str('{"t":"drive","forward":1.0,"turn":0.0}')
            shown = running.field.shown
            assert shown is not None
            decided, driven = False, False
            async with asyncio.timeout(PATIENCE):
                while not (decided and driven):
                    wishes = shown.wishes()
                    decided |= any(one.what == "halt" for one in wishes.decisions)
                    driven |= any(one.player == "ann" for one in wishes.commands)
                    await asyncio.sleep(0.02)
            running.field.hide()
            while (await official.receive(PATIENCE)).type is aiohttp.WSMsgType.TEXT:
                pass
            assert official.closed

    asyncio.run(talk())


def test_what_is_known_of_a_match_comes_from_its_own_page(running: Day) -> None:
    event = running.event
    begin(running)
    running.field.show(LINING_UP)
    until(lambda: event.live and event.live.waiting)
    assert event.live == Live(
        "initialize", "Lining up, pass 1 of 3", "0:00.0", (("Sharks", 2), ("Minnows", 1)), LINING_UP.waiting
    )
    assert event.phase == "ready"
    running.field.show(SCENE)
    until(lambda: event.phase == "running")
    running.field.hide()
    until(lambda: event.live is None)
    running.field.report = Report(why="no_result")
    until(lambda: event.phase == "waiting")
    assert event.held == {"why": "no_result", "words": ""}
    for wrong in ("", "{}", "[1]", '[{"t": "state", "scores": [{}]}]', '[{"t": 1}]'):
        with pytest.raises((ValueError, LookupError)):
            taken(Live(), wrong)


def test_a_disk_that_is_full_holds_the_event_in_words_and_ends_nothing(
    running: Day, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    until((running.field._folder / "event.json").exists)
    with monkeypatch.context() as patched:
        patched.setattr("vrg_class.event.running.write_whole", full)
        act(running, act="title", n=1, title="x")
        until(lambda: running.event.held and running.event.held["why"] == "disk")
    assert running.event.held == {"why": "disk", "words": "No space left on device"}
    until(lambda: b'"x"' in (running.field._folder / "event.json").read_bytes())


def test_no_error_ends_the_event(running: Day, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(running.event, "step", lambda now: 1 / 0)
        until(lambda: running.event.held and running.event.held["why"] == "failed")
    assert ask(f"{running.base}state")[0] == 200

    async def fails(*_: object) -> Report:
        raise ZeroDivisionError

    with monkeypatch.context() as patched:
        patched.setattr(running.field, "play", fails)
        act(running, act="begin")
        until(lambda: running.event.phase == "waiting" and running.event.held)
    assert running.event.held == {"why": "failed", "words": "ZeroDivisionError: "}
    begin(running)


def test_a_match_is_broken_off_when_an_official_or_the_end_of_the_event_wants_it(running: Day) -> None:
    begin(running)
    assert act(running, act="stop")[0] == 200
    until(lambda: running.event.phase == "waiting" and running.event.held)
    begin(running)
    running.running.close()
    assert running.event.phase == "ready", "it is played anew when the event goes on"
    with pytest.raises(RefusalError):
        running.event.begin(0.0)


@pytest.mark.system
def test_all_that_an_event_has_started_ends_when_it_is_killed_and_what_was_played_is_kept(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "long.toml").write_text(long_match("long"))
    (tmp_path / "day.toml").write_text(
        'title = "Open day"\nreview = 0.0\npause = 0.0\n'
        '[[matches]]\nmatch = "tiny.toml"\n[[matches]]\nmatch = "long.toml"\n'
    )
    command = [sys.executable, "-m", "vrg", "event", "day.toml"]
    kept = tmp_path / "day" / "event.json"
    with (tmp_path / "out.txt").open("wb") as out:
        process = subprocess.Popen(command, cwd=tmp_path, stdout=out, stderr=subprocess.STDOUT)
    started: list[psutil.Process] = []
    try:
        end = time.monotonic() + 120.0
        while not [*tmp_path.glob("day/match-2/runs/*/journal.jsonl")]:
            assert process.poll() is None, (tmp_path / "out.txt").read_text()
            assert time.monotonic() < end, (tmp_path / "out.txt").read_text()
            threading.Event().wait(0.1)
        link = re.search(r"spectators +(\S+)", (tmp_path / "out.txt").read_text())
        assert link is not None
        until(lambda: json.loads(ask(f"{link[1]}state")[1])["phase"] == "running")
        assert b'id="field"' in ask(f"{link[1]}match/")[1]
        started = psutil.Process(process.pid).children(recursive=True)
        process.kill()
        process.wait()
        assert len(started) > 5
        _, alive = psutil.wait_procs(started, 60.0)
        assert not alive, "what it has started ends with it"
        (outcome,) = read_kept(kept).outcomes
        assert (outcome.of.name, outcome.confirmed) == ("tiny", True)
        assert (tmp_path / "day" / outcome.run / "result.json").is_file()
    finally:
        process.kill()
        process.wait()
        for one in psutil.wait_procs(started, 0.0)[1]:
            one.kill()


@pytest.mark.system
def test_the_final_of_a_class_is_a_bracket_that_ends_by_itself_and_goes_on(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "tiny.toml").write_text(TINY.replace("passes = 1", "passes = 1\npass_limit = 2.0"))
    about = About(game="sharks-and-minnows", match="x", lesson="x", teacher="t", joining="j")
    place = ClassFolder(tmp_path / "class", about)
    with pytest.raises(ConfigError, match="expected two in the leaderboard"):
        raise_error(invoke("class", "final", str(place.path), "--lockstep"))
    teams = [{"name": name, "strategy": f"{tmp_path / 'mine.py'}:Mine"} for name in ("Ann", "Bob")]
    entry = {"match": str(tmp_path / "tiny.toml"), "kind": "bracket", "title": "Final"}
    (place.path / "final" / "timetable.json").write_text(
        json.dumps({"title": "Final of the class", "teams": teams, "matches": [entry]})
    )
    (tmp_path / "mine.py").write_text(MINE.replace("Mine", "Other"))
    done = invoke("class", "final", str(place.path), "--lockstep", "--no-sandbox")
    assert "the final is held: " in str(done.exception)
    assert "expected the name of a class" in str(done.exception)
    shutil.rmtree(place.path / "final" / "match-1")
    (tmp_path / "mine.py").write_text(MINE)
    (place.path / "final" / "event.json").write_text('{"held": {"why": "no_result"}}')
    for _ in range(2):
        done = invoke("class", "final", str(place.path), "--lockstep", "--no-sandbox")
        assert done.output.rstrip().endswith("Ann wins the class"), (done.output, done.exception)
    assert len([*place.path.glob("final/match-*")]) == 2


def raise_error(done: Any) -> None:
    raise done.exception


def test_an_event_is_run_once_and_its_timetable_is_checked_before_it_begins(tmp_path: Path) -> None:
    (tmp_path / "day.toml").write_text('title = "Open day"\n[[matches]]\nmatch = "nothing.toml"\n')
    done = invoke("event", str(tmp_path / "day.toml"))
    assert "entry 1 of the timetable" in str(done.exception)
    with owned(tmp_path / "day"):
        done = invoke("event", str(tmp_path / "day.toml"))
    assert f"process {os.getpid()}, or what it has started, works here already" in str(done.exception)
