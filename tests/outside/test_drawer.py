"""A drawer that somebody else's package adds to the page of a match: its content, its files, and who may open it."""

import urllib.request
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.launch.nodes.web import web
from vrg.testing.views import synthetic
from vrg.testing.views.browser import Visitor
from vrg.ui.web import parts
from vrg.ui.web.admission import Admission
from vrg.ui.web.drawers import DRAWERS, Drawer
from vrg.ui.web.gallery import PRIVATE
from vrg.ui.web.node import WebNode
from vrg.ui.web.requests import Inspect, Wishes
from vrg.ui.web.server import WebServer

SCRIPTS = "performance.getEntriesByType('resource').filter(({ name }) => name.includes('drawer.js'))"
"""The scripts of drawers that a page has loaded."""


@pytest.fixture
def drawers(installed: None) -> Mapping[str, Drawer]:
    return {"tally": DRAWERS.get("tally")}


def context(page: Admission) -> Any:
    """The process of a page."""
    setup = load_match(match_path("race"))
    return SimpleNamespace(setup=setup, secret=page.encoded(), named=lambda usual: usual, official=True)


def opened(page: Visitor, server: WebServer, player: str) -> str:
    """Wait until a page has asked for a player, and show it what the drawer has of it; the name of the part."""
    wanted = Inspect(drawer="tally", player=player)
    for _ in range(1000):
        if wanted in server.inspected:
            break
        page.page.wait_for_timeout(20)
    assert wanted in server.inspected
    content = DRAWERS.get("tally").content(SimpleNamespace(setup=SimpleNamespace(name="final")))
    data = content.part(20.0, synthetic.scene_at(20.0), player)
    server.show({PRIVATE + wanted.part: parts.encode({"t": "drawer", "drawer": "tally", "data": data})})
    return wanted.part


def test_the_page_of_a_match_has_it_and_does_without_those_that_cannot_be_made(
    monkeypatch: pytest.MonkeyPatch, page_admission: Admission, caplog: pytest.LogCaptureFixture
) -> None:
    tally = DRAWERS.get("tally")
    broken = {
        "blank": replace(tally, package="toys.race"), "lost": replace(tally, package="nowhere"),
        "mute": replace(tally, makes="toys.tally:nothing"),
    }  # fmt: skip
    monkeypatch.setattr(DRAWERS, "_found", {"tally": tally, **broken})
    monkeypatch.setattr(DRAWERS, "names", lambda: ["blank", "lost", "mute", "tally"])
    node = web(context(page_admission)).node
    assert [*node._drawers] == ["tally"]  # type: ignore[attr-defined]
    assert "no drawer blank: expected drawer.js in the folder static of toys.race" in caplog.text
    assert "no drawer lost: cannot find the package nowhere" in caplog.text
    assert "no drawer mute: cannot make what it shows by toys.tally:nothing: AttributeError" in caplog.text


class Failing:
    """A drawer that fails at one of its methods."""

    def __init__(self, where: str) -> None:
        self.where = where

    def take(self, now: float) -> None:
        if self.where == "take":
            raise RuntimeError("broken")

    def close(self) -> None:
        if self.where == "close":
            raise RuntimeError("broken")

    def part(self, now: float, scene: Any, player: str) -> Any:
        return {1: object()} if self.where == "data" else 1 / 0


class Looking:
    """An audience in which an official has a drawer open, or has none."""

    watched = True

    def __init__(self, *drawers: str) -> None:
        self.inspected = frozenset(Inspect(drawer=name, player="") for name in drawers)
        self.shown: list[Mapping[str, str]] = []

    def check(self) -> None:
        pass

    def wishes(self) -> Wishes:
        return Wishes()

    def show(self, parts: Mapping[str, str], calls: Any = ()) -> None:
        self.shown.append(parts)


@pytest.mark.parametrize("where", ["take", "part", "data", "close"])
def test_one_that_fails_is_dropped_and_the_page_goes_on(where: str, caplog: pytest.LogCaptureFixture) -> None:
    audience = Looking() if where == "close" else Looking("bad")
    node = WebNode("web", Mailbox(), Keys("race"), audience, drawers={"bad": Failing(where)})  # type: ignore[arg-type]
    for number in range(200):
        node.tick(Tick(time=0.1 * number, live=True))
    assert not node._drawers
    assert "the page continues without the drawer bad" in caplog.text
    assert audience.shown


def test_a_name_that_no_package_adds_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"drawer: expected one of .*tally, got 'tallly', did you mean 'tally'\?"):
        DRAWERS.get("tallly")


def test_an_official_opens_it_and_selects_a_player_in_it(
    visit: Callable[..., Visitor], server: WebServer, page_admission: Admission
) -> None:
    server.show(parts.parts(synthetic.scene_at(20.0)))
    page = visit("official")
    page.wait("vrg.field.plates.length === 7")
    assert page.page.evaluate(SCRIPTS) == []
    page.page.click("#drawers button:text('Tally')")
    opened(page, server, "")
    page.wait_text("#tally", "final: 2 calls, nobody is selected")
    assert len(page.page.evaluate(SCRIPTS)) == 1
    name, x, y = page.page.evaluate("({ name, circle: { x, y } } = vrg.field.robots[1], [name, x, y])")
    page.page.mouse.click(x, y)
    opened(page, server, name)
    page.wait_text("#tally", f"final: 2 calls, {name} is selected")
    page.page.click("#drawers button:text('Tally')")
    page.wait("!vrg.drawers.open")
    assert page.page.locator("#tally").is_hidden()


@pytest.mark.parametrize("who", ["", "player2"], ids=["viewer", "driver"])
def test_others_have_no_button_and_are_refused_also_with_a_link_that_asks_for_it(
    visit: Callable[..., Visitor], server: WebServer, who: str
) -> None:
    page = visit(f"{who}&tally")
    page.wait("vrg.link.open")
    assert page.page.locator("#drawers button").count() == 0
    assert page.page.evaluate(SCRIPTS) == []
    page.page.evaluate("vrg.link.send({ t: 'inspect', drawer: 'tally', player: '' })")
    page.wait_text("#notice", "Refused: a drawer needs the official's link")
    assert server.inspected == frozenset()


def test_a_link_opens_it_and_no_other_name(visit: Callable[..., Visitor], server: WebServer) -> None:
    page = visit("official&tally")
    page.wait("vrg.drawers.open")
    assert page.page.locator("#tally").is_visible()
    other = visit("official&constructor")
    other.wait("vrg.match.role === 'official'")
    assert other.page.evaluate("vrg.drawers.name") == ""


def test_its_files_are_served_below_its_name(server: WebServer, page_admission: Admission) -> None:
    address = f"http://127.0.0.1:{page_admission.port}/drawers/tally/drawer.js"
    with urllib.request.urlopen(address) as answer:
        assert answer.headers["Content-Type"] == "text/javascript; charset=utf-8"
        assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
