"""The page of a match, a port for each test's server, and its visitors: fixtures for a `conftest.py` to import."""

import socket
from collections.abc import Callable, Iterator, Mapping

import pytest
from playwright.sync_api import Browser

from vrg.testing.views.browser import SIZES, Visitor
from vrg.ui.web.admission import Admission, admission
from vrg.ui.web.drawers import Drawer
from vrg.ui.web.server import WebServer


@pytest.fixture
def port() -> int:
    """A port that the system has chosen: tests that run at the same time get different ones."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        found: int = probe.getsockname()[1]
        return found


@pytest.fixture
def page_admission(port: int) -> Admission:
    """Who is admitted: an official, and who drives `player1` and `player2`."""
    return admission("127.0.0.1", port, ["player1", "player2"])


@pytest.fixture
def drawers() -> Mapping[str, Drawer]:
    """The drawers of the page, by name: none."""
    return {}


@pytest.fixture
def server(page_admission: Admission, drawers: Mapping[str, Drawer]) -> Iterator[WebServer]:
    """The server of the page of a match, which runs."""
    made = WebServer(page_admission, "final", drawers)
    made.start()
    yield made
    made.stop()


@pytest.fixture
def visit(browser: Browser, server: WebServer, page_admission: Admission) -> Iterator[Callable[..., Visitor]]:
    """Opens the page as a viewer, the `official`, or the driver of a player; a page that fails fails the test."""
    visitors: list[Visitor] = []

    def make(who: str = "", size: tuple[int, int] = SIZES[0]) -> Visitor:
        who, _, more = who.partition("&")
        token = page_admission.official if who == "official" else page_admission.seats.get(who, "")
        link = f"http://127.0.0.1:{page_admission.port}/#{token}"
        visitors.append(Visitor(browser, f"{link}&{more}" if more else link, size))
        return visitors[-1]

    yield make
    for visitor in visitors:
        visitor.close()
    assert [visitor.errors for visitor in visitors] == [[] for _ in visitors]
