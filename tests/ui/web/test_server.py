"""The server of the page, over the loopback, with aiohttp's client in place of browsers."""

import asyncio
import functools
import json
import socket
import ssl
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from typing import Any
from unittest.mock import ANY

import aiohttp
import pytest

from vrg.commands.page import encrypted
from vrg.errors import LaunchError
from vrg.seats.authority import fingerprint
from vrg.ui.web import site
from vrg.ui.web.admission import admission
from vrg.ui.web.headers import foreign
from vrg.ui.web.requests import REQUEST_LIMIT, Inspect, PageButton, PageDrive, Wishes
from vrg.ui.web.server import IN_FLIGHT, WebServer

PATIENCE = 60.0
"""s of real time for anything to happen."""


@pytest.fixture
def server(port: int) -> Iterator[WebServer]:
    made = WebServer(admission("127.0.0.1", port, ["ann", "bob"]), "final")
    made.start()
    yield made
    made.stop()


def page_of(server: WebServer) -> str:
    return f"http://127.0.0.1:{server._admission.port}"


def token_of(server: WebServer, who: str) -> str:
    return server._admission.official if who == "official" else server._admission.seats.get(who, "")


class Browser:
    """One connection."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.heard: list[dict[str, Any]] = []
        self.batches = 0

    async def say(self, **request: object) -> None:
        await self.socket.send_str(json.dumps(request))

    async def hear(self, kind: str) -> dict[str, Any]:
        """Wait for a message of this kind, and take it out."""
        async with asyncio.timeout(PATIENCE):
            while True:
                for message in self.heard:
                    if message["t"] == kind:
                        self.heard.remove(message)
                        return message
                answer = await self.socket.receive()
                assert answer.type is aiohttp.WSMsgType.TEXT, f"expected {kind}, heard {answer}"
                self.batches += 1
                self.heard += json.loads(answer.data)

    async def closed(self) -> int | None:
        """Wait for the end of the connection, and return its code."""
        async with asyncio.timeout(PATIENCE):
            async for _ in self.socket:
                pass
        return self.socket.close_code


@asynccontextmanager
async def browser(
    server: WebServer, token: str = "", address: str = "127.0.0.1", **hello: object
) -> AsyncIterator[Browser]:
    connector = aiohttp.TCPConnector(local_addr=(address, 0))
    async with (
        aiohttp.ClientSession(connector=connector) as session,
        session.ws_connect(f"{page_of(server)}/socket") as socket,
    ):
        found = Browser(socket)
        await found.say(t="hello", token=token, **hello)
        yield found


@asynccontextmanager
async def guest(server: WebServer, token: str = "", **hello: Any) -> AsyncIterator[Browser]:
    """A connection that was welcomed."""
    async with browser(server, token, **hello) as found:
        await found.hear("welcome")
        yield found


def in_loop(test: Callable[..., Awaitable[None]]) -> Callable[..., None]:
    """A test that runs in an event loop, for a bounded time."""

    @functools.wraps(test)
    def run(**fixtures: Any) -> None:
        async def work() -> None:
            async with asyncio.timeout(3 * PATIENCE):
                await test(**fixtures)

        asyncio.run(work())

    return run


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.01)


@in_loop
async def test_the_page_is_static_and_loads_nothing_from_elsewhere(server):
    async with aiohttp.ClientSession() as session:
        async with session.get(page_of(server)) as answer:
            text = await answer.text()
            assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
            assert answer.content_type == "text/html"
        for name in ("style.css", "main.js", "field.js", "icon.svg"):
            async with session.get(f"{page_of(server)}/{name}") as answer:
                assert answer.status == 200
                text += await answer.text()
        async with session.get(f"{page_of(server)}/../server.py") as answer:
            assert answer.status == 404
    assert "https://" not in text
    assert "http://" not in text.replace("http://www.w3.org/2000/svg", "")


@pytest.fixture
def secured(port: int) -> Iterator[WebServer]:
    made = WebServer(encrypted(admission("127.0.0.1", port, ["ann"])), "final")
    made.start()
    yield made
    made.stop()


@in_loop
async def test_a_page_with_a_certificate_is_served_by_https_alone(secured):
    page = secured._admission
    async with aiohttp.ClientSession() as session:
        address = f"{page.links('127.0.0.1')[0][1]}socket"
        known = aiohttp.Fingerprint(bytes.fromhex(fingerprint(page.certificate).replace(":", "")))
        async with session.ws_connect(address, ssl=known) as socket:
            found = Browser(socket)
            await found.say(t="hello", token=page.seats["ann"])
            assert (await found.hear("welcome"))["player"] == "ann"
        with pytest.raises(aiohttp.ClientConnectorCertificateError):
            await session.get(address)
        with pytest.raises(aiohttp.ClientError):
            await session.get(address.replace("https", "http"))


def test_what_comes_with_the_end_of_the_handshake_is_answered(secured):
    """A browser may send its request in the same packet."""
    context, incoming, outgoing = ssl.create_default_context(), ssl.MemoryBIO(), ssl.MemoryBIO()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    inside = context.wrap_bio(incoming, outgoing)
    with raw(secured, b"") as connection:
        while True:
            try:
                inside.do_handshake()
                break
            except ssl.SSLWantReadError:
                connection.sendall(outgoing.read())
                incoming.write(connection.recv(65536))
        inside.write(b"GET /icon.svg HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n")
        connection.sendall(outgoing.read())
        while True:
            try:
                assert inside.read(100).startswith(b"HTTP/1.0 200")
                break
            except ssl.SSLWantReadError:
                incoming.write(connection.recv(65536))


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(site, "HANDSHAKE", 2 * PATIENCE)


def test_of_too_many_connections_whose_encryption_is_not_agreed_on_the_oldest_goes(patient, secured):
    secured._waiting._limit = 2
    with raw(secured, b"") as oldest, raw(secured, b""), raw(secured, b""), suppress(ConnectionResetError):
        assert oldest.recv(100) == b""


def test_a_connection_whose_encryption_is_not_agreed_on_does_not_stay(secured, monkeypatch):
    monkeypatch.setattr(site, "HANDSHAKE", 0.1)
    with raw(secured, b"") as silent, suppress(ConnectionResetError):
        assert silent.recv(100) == b""


@in_loop
async def test_a_viewer_is_welcomed_and_sees_what_is_shown_before_and_after(server):
    server.show({"frame": '{"t":"frame","n":1}'}, ['{"number":1}'])
    async with browser(server) as viewer:
        welcome = await viewer.hear("welcome")
        assert (welcome["match"], welcome["role"]) == ("final", "viewer")
        assert (await viewer.hear("frame"))["n"] == 1
        assert (await viewer.hear("calls"))["calls"] == [{"number": 1}]
        server.show({"frame": '{"t":"frame","n":2}'})
        assert (await viewer.hear("frame"))["n"] == 2


@in_loop
async def test_a_viewer_that_tries_to_drive_or_halt_is_refused_and_that_is_logged(server, caplog):
    async with guest(server) as viewer:
        acts = [{"t": "act", "what": what} for what in PageButton]
        for request in ({"t": "drive", "forward": 1.0, "turn": 0.0}, {"t": "give_back"}, *acts):
            await viewer.say(**request)
            assert "token" in (await viewer.hear("notice"))["text"]
    assert server.wishes() == Wishes()
    assert "viewer (web), connection 1, wanted to drive: refused" in caplog.text


@in_loop
async def test_a_driver_drives_its_own_player_and_leaving_gives_it_back(server):
    async with browser(server, token_of(server, "ann")) as driver:
        assert (await driver.hear("welcome"))["player"] == "ann"
        await driver.say(t="drive", forward=0.1, turn=0.0)
        await driver.say(t="drive", forward=0.5, turn=-0.5)
        await until(lambda: server._commands.get("ann") == PageDrive(ANY, "ann", 0.5, -0.5))
        assert server.wishes() == Wishes(commands=(PageDrive(ANY, "ann", 0.5, -0.5),))
        assert server.wishes() == Wishes()
    await until(lambda: server._given_back)
    assert server.wishes() == Wishes(given_back=("ann",))


@in_loop
async def test_a_driver_that_gives_back_and_drives_again_at_once_has_let_go_in_between(server):
    async with guest(server, token_of(server, "ann")) as driver:
        await driver.say(t="drive", forward=0.1, turn=0.0)
        await driver.say(t="give_back")
        await driver.say(t="drive", forward=0.5, turn=0.0)
        await until(lambda: server._commands.get("ann") == PageDrive(ANY, "ann", 0.5, 0.0))
        assert server.wishes() == Wishes(commands=(PageDrive(ANY, "ann", 0.5, 0.0),), given_back=("ann",))


@in_loop
async def test_an_official_decides_and_hears_the_answer(server):
    async with guest(server, token_of(server, "official")) as official:
        await official.say(t="act", what="halt")
        await until(lambda: server._decisions)
        [decision] = server.wishes().decisions
        assert (decision.what, decision.by) == (PageButton.HALT, "official (web)")
        server.tell(decision.guest, "play is halted already")
        assert (await official.hear("notice"))["text"] == "play is halted already"


@in_loop
async def test_what_a_drawer_shows_is_sent_to_officials_only_and_only_while_they_have_it_open(server):
    def show(number: int) -> None:
        frame = json.dumps({"t": "frame", "n": number})
        server.show({"frame": frame, "drawer/tally/ann": json.dumps({"t": "drawer", "n": number})})

    async def inspect(page: Browser, **what: str) -> None:
        await page.say(t="inspect", **what)
        await until(lambda: server.inspected == ({Inspect(**what)} if what else set()))

    official, seat = token_of(server, "official"), token_of(server, "ann")
    async with guest(server) as viewer, guest(server, seat) as driver, guest(server, official) as page:
        for other in (viewer, driver):
            await other.say(t="inspect", drawer="tally", player="ann")
            assert "official's link" in (await other.hear("notice"))["text"]
        assert server.inspected == frozenset()
        show(1)
        await page.hear("frame")
        await inspect(page, drawer="tally", player="ann")
        show(2)
        while (await page.hear("drawer"))["n"] != 2:
            pass  # what was drawn up before
        await inspect(page)
        show(3)
        for one in (viewer, driver, page):
            while (await one.hear("frame"))["n"] != 3:
                pass
            assert [message for message in one.heard if message["t"] == "drawer"] == []
        await inspect(page, drawer="tally", player="bob")
    await until(lambda: server.inspected == frozenset())


@in_loop
async def test_a_second_page_in_a_seat_is_refused_until_it_takes_over(server):
    token = token_of(server, "ann")
    async with guest(server, token, tab="1") as first:
        async with browser(server, token, tab="2") as second:
            refused = await second.hear("refused")
            assert refused["reason"] == "taken"
            assert "ann" in refused["why"]
        async with browser(server, token, tab="2", takeover=True) as second:
            assert (await second.hear("welcome"))["role"] == "seat"
            assert (await first.hear("displaced"))["player"] == "ann"
            await first.say(t="drive", forward=1.0, turn=0.0)
            assert "Refused" in (await first.hear("notice"))["text"]
            assert server.wishes().given_back == ("ann",)


@in_loop
async def test_a_wrong_token_is_refused_and_logged_without_it(server, caplog):
    async with browser(server, "guessed-token") as guest:
        assert (await guest.hear("refused"))["reason"] == "token"
        assert await guest.closed() == 1008
    assert "wrong token (number 1)" in caplog.text
    assert "guessed-token" not in caplog.text


@in_loop
async def test_the_log_has_no_token_of_anybody(server, caplog):
    caplog.set_level("DEBUG")
    for who in ("official", "ann"):
        async with guest(server, token_of(server, who)) as one:
            await one.say(t="hello", token=token_of(server, who))
            await one.say(t="hello", token=token_of(server, who) + "x" * 99)
            await one.hear("notice")
    assert all(token_of(server, who) not in caplog.text for who in ("official", "ann"))


@pytest.mark.parametrize("first", ["{", '{"t":"drive","forward":1,"turn":0}', '{"t":"hello","token":5}', "[]"])
@in_loop
async def test_whoever_does_not_say_who_it_is_is_turned_away(server, first):
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{page_of(server)}/socket") as socket:
        await socket.send_str(first)
        assert (await Browser(socket).hear("refused"))["reason"] == "request"


@in_loop
async def test_a_bad_request_is_answered_and_the_connection_stays(server):
    async with guest(server) as viewer:
        await viewer.socket.send_str("{]")
        assert "JSON" in (await viewer.hear("notice"))["text"]
        await viewer.socket.send_bytes(b"\xff\x00")
        assert "bytes" in (await viewer.hear("notice"))["text"]
        server.show({"frame": '{"t":"frame"}'})
        await viewer.hear("frame")


@in_loop
async def test_a_huge_request_ends_its_own_connection_only(server):
    async with guest(server) as other, browser(server) as viewer:
        await viewer.socket.send_str("x" * (REQUEST_LIMIT + 1))
        assert await viewer.closed() == 1009
        server.show({"frame": '{"t":"frame"}'})
        await other.hear("frame")


@pytest.mark.parametrize("pings", [False, True])
@in_loop
async def test_whoever_talks_too_fast_is_told_and_cut_off(server, pings):
    async with guest(server) as viewer:
        for _ in range(200):
            await (viewer.socket.ping() if pings else viewer.say(t="ack", count=0))
        assert "too fast" in (await viewer.hear("notice"))["text"]
        assert await viewer.closed() == 1008


@in_loop
async def test_a_viewer_that_shows_nothing_gets_no_more_until_it_does_and_then_the_newest(server):
    async with guest(server) as quick, guest(server) as slow:
        for number in range(3 * IN_FLIGHT):
            server.show({"frame": json.dumps({"t": "frame", "n": number})})
            assert (await quick.hear("frame"))["n"] == number
            await quick.say(t="ack", count=quick.batches)
        for number in range(IN_FLIGHT - 1):
            assert (await slow.hear("frame"))["n"] == number
        await slow.say(t="ack", count=slow.batches)
        assert (await slow.hear("frame"))["n"] == 3 * IN_FLIGHT - 1


@in_loop
async def test_at_the_end_every_page_is_told(server):
    async with guest(server) as viewer:
        server.show({"frame": '{"t":"frame","n":"last"}'})
        stopping = asyncio.create_task(asyncio.to_thread(server.stop))
        assert (await viewer.hear("frame"))["n"] == "last"
        await viewer.hear("bye")
        assert await viewer.closed() == 1001
        await stopping


@in_loop
async def test_no_more_viewers_are_let_in_than_there_is_room_for(server):
    server._lobby.limit = 1
    async with guest(server), browser(server) as another:
        refused = await another.hear("refused")
        assert (refused["reason"], "close one" in refused["why"]) == ("full", True)


@in_loop
async def test_a_page_of_another_site_is_not_let_in(server):
    async with aiohttp.ClientSession() as session:
        headers = {"Origin": "http://elsewhere.example"}
        with pytest.raises(aiohttp.WSServerHandshakeError) as error:
            await session.ws_connect(f"{page_of(server)}/socket", headers=headers)
        assert error.value.status == 403


@pytest.mark.parametrize(("name", "value"), [("Host", "["), ("Origin", "http://[")])
@in_loop
async def test_what_is_no_address_is_a_bad_request(server, caplog, name, value):
    async with aiohttp.ClientSession() as session:
        with pytest.raises(aiohttp.WSServerHandshakeError) as error:
            await session.ws_connect(f"{page_of(server)}/socket", headers={name: value})
        assert error.value.status == 400
    assert "Traceback" not in caplog.text


def raw(server: WebServer, sent: bytes) -> socket.socket:
    found = socket.create_connection((server._admission.host, server._admission.port), PATIENCE)
    found.sendall(sent)
    return found


def test_what_is_no_request_is_answered_and_not_logged(server, caplog):
    with raw(server, b"GET / HTTP/1.1\r\nContent-Length: -5\r\n\r\n") as stranger:
        assert b"400 Bad Request" in stranger.recv(100)
    assert caplog.text == ""


@in_loop
async def test_sockets_that_do_not_say_who_they_are_do_not_keep_the_official_out(server):
    crowd = aiohttp.TCPConnector(limit=0)
    async with aiohttp.ClientSession(connector=crowd) as session, AsyncExitStack() as stack:
        for _ in range(150):
            await stack.enter_async_context(session.ws_connect(f"{page_of(server)}/socket"))
        async with browser(server, token_of(server, "official")) as official:
            assert (await official.hear("welcome"))["role"] == "official"


def test_half_a_request_does_not_stay(server):
    server._waiting._patience = 0.1
    with raw(server, b"GET / HTTP/1.1\r\nHost") as stranger, suppress(ConnectionResetError):
        assert stranger.recv(100) == b""


def test_of_too_many_connections_the_oldest_goes(server):
    server._waiting._limit = 2
    with raw(server, b"") as oldest, raw(server, b""), raw(server, b""), suppress(ConnectionResetError):
        assert oldest.recv(100) == b""


@in_loop
async def test_a_viewer_of_a_crowd_makes_room_and_learns_why(server):
    server._lobby.limit = 2
    async with guest(server) as first, guest(server) as second, guest(server, address="127.0.0.2"):
        evicted = first if 1 not in server._lobby.roles else second
        assert (await evicted.hear("refused"))["reason"] == "full"
        assert await evicted.closed() == 1008


@pytest.mark.parametrize(
    ("origin", "host", "why"),
    [
        (None, "127.0.0.1:8080", ""),
        ("http://127.0.0.1:8080", "127.0.0.1:8080", ""),
        ("http://[::1]:8080", "[::1]:8080", ""),
        ("http://lab.local:8080", "lab.local:8080", ""),
        ("http://LAB:8080", "lab:8080", ""),
        ("http://127.0.0.1:9090", "127.0.0.1:8080", "expected a connection of the page"),
        ("null", "127.0.0.1:8080", "expected a connection of the page"),
        ("http://rebound.example:8080", "rebound.example:8080", "trick of another site"),
    ],
)
def test_where_a_connection_comes_from(origin, host, why):
    assert (why in foreign(origin, host, "0.0.0.0", "lab")) if why else foreign(origin, host, "0.0.0.0", "lab") == ""


def test_a_further_name_of_this_machine_is_no_trick():
    origin, host = "https://robots.school.example", "robots.school.example"
    assert "trick" in foreign(origin, host, "0.0.0.0", "lab")
    assert foreign(origin, host, "0.0.0.0", "lab", "Robots.School.example") == ""


def test_a_port_that_another_program_has_is_told(server):
    other = WebServer(server._admission, "final")
    with pytest.raises(LaunchError, match=f"port {server._admission.port}: .*in use"):
        other.start()
    other.stop()
