"""A recorded match as a page: what its server answers, and what a browser shows."""

import asyncio
import socket
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import aiohttp
import pytest

from tests.recording.recordings import record
from vrg.recording.recorded import read_recorded
from vrg.testing.views.browser import SIZES, Visitor, chromium
from vrg.ui.timeline import Timeline
from vrg.ui.web.replay import ReplaySite


@pytest.fixture
def page(port: int, tmp_path: Path) -> Iterator[str]:
    """The address of the made-up match, recorded for 30 s."""
    record(tmp_path / "match.mcap", 30.0).stop()
    site = ReplaySite("127.0.0.1", port, Timeline(read_recorded(tmp_path / "match.mcap")), "final")
    site.start()
    yield f"http://127.0.0.1:{port}/"
    site.stop()


def asked(address: str, **headers: str) -> tuple[int, Any]:
    """The status and the answer to a request."""

    async def ask() -> tuple[int, Any]:
        async with aiohttp.ClientSession() as session, session.get(address, headers=headers) as answer:
            kind = answer.content_type
            return answer.status, await (answer.json() if kind == "application/json" else answer.text())

    return asyncio.run(ask())


def test_an_instant_is_whole_and_then_what_is_new_since(page: str) -> None:
    _, whole = asked(f"{page}at?t=12.3")
    parts = {part["t"]: part for part in whole}
    assert list(parts) == ["ground", "looks", "state", "strokes", "frame", "calls", "have"]
    assert parts["frame"]["time"] == 12.3
    assert [call["number"] for call in parts["calls"]["calls"]] == [1]
    _, again = asked(f"{page}at?t=12.4&have={','.join(parts['have']['marks'])}")
    assert [part["t"] for part in again] == ["frame", "have"], "only robots have moved"
    _, early = asked(f"{page}at?t=1&have={','.join(parts['have']['marks'])}")
    assert next(part["calls"] for part in early if part["t"] == "calls") == [], "nothing was called by then"
    assert asked(f"{page}at?t=1e9")[1][4]["time"] == 29.9, "beyond the end is the end"


@pytest.mark.parametrize("query", ["", "t=", "t=nan", "t=1&rate=-1", "t=1&rate=1e9", "t=1;2"])
def test_what_is_no_instant_is_refused_in_words(page: str, query: str) -> None:
    status, words = asked(f"{page}at?{query}")
    assert (status, "expected a match time" in words) == (400, True)


def test_another_site_gets_nothing(page: str) -> None:
    for path in ("match", "at?t=1"):
        status, words = asked(f"{page}{path}", Origin="http://elsewhere")
        assert (status, "expected a connection of the page" in words) == (403, True)


@pytest.mark.parametrize("size", [SIZES[0], SIZES[-1]])
def test_a_link_to_an_instant_shows_it_and_the_bar_goes_on_from_there(page: str, size: tuple[int, int]) -> None:
    with chromium() as browser:
        visitor = Visitor(browser, f"{page}#t=12.3", size)
        visitor.wait("vrg.match.motion.latest?.time === 12.3 && vrg.field.view")
        assert not visitor.page.evaluate("vrg.replay.playing")
        assert len(visitor.page.locator("#replay .ticks i").all()) == 2, "the calls"
        visitor.page.keyboard.press("PageUp")
        visitor.wait("vrg.match.calls.length === 1 && vrg.match.motion.latest.time === 9")
        visitor.page.keyboard.press("Home")
        visitor.wait("vrg.match.motion.latest.time === 0 && vrg.match.calls.length === 0")
        visitor.page.keyboard.press("k")
        visitor.wait("vrg.match.motion.latest.time > 0.5 && vrg.replay.playing")
        visitor.page.evaluate("location.hash = '#t=29'")
        visitor.wait("vrg.match.motion.latest.time === 29 && !vrg.replay.playing")
        assert visitor.errors == []


def test_idle_connections_of_a_crowd_give_way(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrg.ui.web.site.VISITORS", 8)
    line: Any = SimpleNamespace(begin=0.0, end=1.0, calls=[])
    site = ReplaySite("127.0.0.1", port, line, "final")
    site.start()
    with ExitStack() as stack:
        stack.callback(site.stop)
        idle = [stack.enter_context(socket.create_connection(("127.0.0.1", port), 60.0)) for _ in range(20)]
        for one in idle:
            one.sendall(b"GET /match HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert b"200 OK" in one.recv(100_000)
        for one in idle[:12]:
            with suppress(ConnectionResetError):
                while one.recv(100_000):
                    pass  # the rest of the answer, and the end
        assert asked(f"http://127.0.0.1:{port}/match")[0] == 200


def test_what_goes_wrong_again_and_again_is_logged_ever_more_rarely() -> None:
    line: Any = SimpleNamespace(begin=0.0, end=1.0, calls=[])
    site, logged = ReplaySite("127.0.0.1", 1, line, "final"), list[dict[str, Any]]()
    loop: Any = SimpleNamespace(default_exception_handler=logged.append)
    for _ in range(1000):
        site._log_trouble(loop, {"message": "socket.accept() out of system resource"})
    assert len(logged) == 4
