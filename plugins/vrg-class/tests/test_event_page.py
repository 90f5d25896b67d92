"""The pages of an event in Chromium: the stage never leaves its page, whatever dies, and everything has room."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from event_day import LINING_UP, SCENE, TOKEN, Day, day
from playwright.sync_api import Browser, Route

from vrg.testing.views.browser import Visitor
from vrg_class.event.course import Report

STAGE, OFFICIALS, TELEPHONE = (1280, 720), (1024, 768), (390, 844)
END = Report(words="the end", score={"sharks": 2, "minnows": 5}, winner="minnows")
ROOM = """() => {
    const shown = [...document.querySelectorAll("h1, p, td, th, button, a, .pair .name, svg")];
    const cut = shown.filter((e) => e.getClientRects().length).filter((e) => {
        const { right, bottom } = e.getBoundingClientRect(), stage = document.body.classList.contains("stage");
        return (right > innerWidth + 1 && !e.closest("#bracket")) || (stage && bottom > innerHeight + 1);
    });
    return { cut: cut.map((e) => e.outerHTML), wide: document.documentElement.scrollWidth > innerWidth };
}"""
"""What is cut off, and whether the page is wider than the window."""
DENIED = """for (const name of ["sessionStorage", "localStorage"]) {
    Object.defineProperty(window, name, { get() { throw new DOMException("denied", "SecurityError"); } });
}"""
"""A browser that keeps nothing."""
MATCH = "document.querySelector('#field.seen iframe')?.contentWindow"


Visit = Callable[[str, tuple[int, int]], Visitor]


@contextmanager
def visits(browser: Browser, found: Day) -> Iterator[Visit]:
    """Opens pages of an event."""
    visitors: list[Visitor] = []

    def visit(path: str, size: tuple[int, int]) -> Visitor:
        visitors.append(Visitor(browser, found.base + path, size))
        return visitors[-1]

    yield visit
    for visitor in visitors:
        visitor.close()


def wait(visitor: Visitor, expression: str) -> None:
    visitor.page.wait_for_function(f"() => Boolean({expression})")


def test_an_event_on_its_stage_on_telephones_and_in_the_hands_of_officials(browser: Browser, tmp_path: Path) -> None:
    with day(tmp_path, tls=True) as found, visits(browser, found) as visit:
        stage, telephone = visit("stage.html?turn=90", STAGE), visit("", TELEPHONE)
        official = visit(f"officials.html#{TOKEN}", OFFICIALS)
        pages = [stage, telephone, official]
        for page in pages:
            page.wait_text("#status", "The officials hold the timetable")
            page.wait_text("#who", "Ann against Bob")
        stage.page.wait_for_selector("#code svg")
        assert stage.text("#address").startswith("https://robots.example:"), "not the name of this computer for itself"
        assert TOKEN not in official.page.url
        official.page.click("#begin")
        official.wait_text("#waiting", "The match is starting")
        found.field.show(LINING_UP)
        official.wait_text("#waiting", "ann is not at its mark")
        telephone.wait_text("#waiting", "ann is not at its mark")
        found.field.show(SCENE)
        wait(stage, f"{MATCH}?.vrg?.match.state?.stage === 'play_round'")
        frame = stage.page.evaluate(f"{MATCH}.location.search")
        assert frame == "?view=projector&name=Ann+against+Bob&turn=90"
        telephone.wait_text("#countdown", "2 : 1")
        with telephone.page.expect_navigation():
            telephone.page.click("#watch")
        telephone.wait("vrg.match.role === 'viewer' && vrg.match.state")
        with official.page.context.expect_page() as opened:
            official.page.click("#open")
        opened.value.wait_for_function("() => window.vrg?.match.role === 'official'")
        official.page.click("#seats summary")
        with official.page.context.expect_page() as opened:
            official.page.click("#links a")
        opened.value.wait_for_function("() => window.vrg?.match.player === 'ann'")

        found.field.report = END
        stage.wait_text("#score", "Sharks 2 : 5 Minnows")
        wait(stage, "!document.querySelector('iframe')")
        official.page.click("#matches button:has-text('Correct')")
        official.page.fill("#fields input >> nth=0", "3")
        official.page.click("#save")
        assert official.page.is_visible("#dialog"), "a reason is needed"
        official.page.fill("#fields input >> nth=2", "Seen <b>twice</b>")
        official.page.click("#save")
        stage.wait_text("#waiting", "Seen <b>twice</b> (before: Sharks 2 : 5 Minnows)")
        official.page.click("#confirm")
        stage.wait_text("#what", "Next match")
        stage.page.wait_for_function("() => /^[34]:/.test(document.querySelector('#countdown').textContent)")
        telephone.page.goto(found.base)
        telephone.wait_text("#matches", "Sharks 3 : 5 Minnows")
        for page in (stage, telephone, official):
            assert page.page.evaluate(ROOM) == {"cut": [], "wide": False}
        assert not [error for error in stage.errors + official.errors if "WebSocket" not in error]


def test_the_stage_stays_whatever_dies(browser: Browser, tmp_path: Path) -> None:
    with day(tmp_path) as found, visits(browser, found) as visit:
        stage = visit("stage.html", STAGE)
        stage.page.add_init_script(DENIED)
        stage.page.reload()
        stage.wait_text("#who", "Ann against Bob")
        address = stage.page.url
        found.event.go_on(0.0)
        broken = [True]

        def fail_once(route: Route) -> None:
            route.abort() if broken and broken.pop() else route.continue_()

        stage.page.route("**/match/?*", fail_once)
        wait(stage, "document.querySelector('#what').textContent === 'Getting ready'")
        found.field.show()
        wait(stage, f"{MATCH}?.vrg?.match.state")
        assert not broken, "the first picture was the browser's error, and was not shown"
        found.field.hide()
        wait(stage, "!document.querySelector('#field.seen')")
        stage.wait_text("#who", "Ann against Bob")
        found.field.show()
        wait(stage, f"{MATCH}?.vrg?.link.open")
        stage.page.route("**/state*", lambda _: None)  # it hangs while a match is shown
        wait(stage, "!document.querySelector('#field.seen')")
        stage.wait_text("#status", "No connection")
        stage.page.unroute("**/state*")
        wait(stage, f"{MATCH}?.vrg?.link.open")
        found.field.report = END
        stage.wait_text("#what", "under review")
        found.event.confirm(found.running.now())
        stage.page.wait_for_function("() => /^[34]:/.test(document.querySelector('#countdown').textContent)")

        stage.page.route("**/state*", lambda _: None)  # it hangs
        stage.wait_text("#status", "No connection")
        assert stage.text("#countdown") == ""
        stage.page.unroute("**/state*")
        stage.page.wait_for_function("() => /^[34]:/.test(document.querySelector('#countdown').textContent)")
        found.site.stop()
        stage.wait_text("#status", "No connection")
        assert (stage.page.url, stage.text("#countdown"), stage.text("#title")) == (address, "", "Open day")


def test_officials_without_their_link_or_with_a_wrong_one_are_told_so(browser: Browser, tmp_path: Path) -> None:
    with day(tmp_path) as found, visits(browser, found) as visit:
        visit("officials.html", OFFICIALS).wait_text("#status", "Open the officials' link")
        visit("officials.html#wrong", OFFICIALS).wait_text("#status", "needs the officials' link")


@pytest.mark.parametrize(
    ("path", "size"), [("stage.html", STAGE), ("", TELEPHONE), (f"officials.html#{TOKEN}", OFFICIALS)]
)
def test_long_names_and_a_large_bracket_have_room(
    path: str, size: tuple[int, int], browser: Browser, tmp_path: Path
) -> None:
    teams = [{"name": f"{'W' * 24} {number}", "strategy": "x"} for number in range(16)]
    bracket = {"match": "x", "kind": "bracket", "elimination": "double", "title": "Finals"}
    more = {"teams": teams, "matches": [bracket, {"match": "x", "title": "W" * 100}]}
    with day(tmp_path, **more) as found, visits(browser, found) as visit:
        page = visit(path, size)
        page.wait_text("#who", "WWW")
        page.page.wait_for_selector("#code svg" if "stage" in path else "#matches tr")
        page.page.wait_for_function(f"() => {{ const {{ cut, wide }} = ({ROOM})(); return !cut.length && !wide; }}")
