"""The welcome page and the configurator in Chromium: a person makes a match, mends it, saves it and plays it."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from vrg.config.loading import load_match
from vrg.testing.views.browser import Visitor
from vrg_edit.draft import Draft
from vrg_edit.editor import Editor, NextStep
from vrg_edit.server import EditServer

SIZES = ((1280, 720), (390, 844))
LAYOUT = """() => {
    const cut = [...document.querySelectorAll("button, h1, h2, label, .card p, th")]
        .filter((e) => e.getClientRects().length && getComputedStyle(e).display !== "inline")
        .filter((e) => e.scrollWidth > e.clientWidth + 1 || e.getBoundingClientRect().right > innerWidth)
        .map((e) => e.textContent);
    return { cut, wide: document.documentElement.scrollWidth > innerWidth };
}"""
"""What is cut off, and whether the page is wider than the window."""


@pytest.fixture
def visit(browser: Browser, server: EditServer) -> Iterator[Callable[[], Visitor]]:
    """Opens the page with the ticket; a page that fails fails the test."""
    visitors: list[Visitor] = []

    def make() -> Visitor:
        visitors.append(Visitor(browser, server.ticket))
        visitors[-1].wait("vrg.told().checked")
        return visitors[-1]

    yield make
    for visitor in visitors:
        visitor.close()
    assert [visitor.errors for visitor in visitors] == [[] for _ in visitors]


def pixel(page: Visitor, player: int, ahead: float = 0.0) -> tuple[float, float]:
    """Where a player's robot is in the window, or something so many pixels before it."""
    found = page.page.evaluate(
        """async ([player, ahead]) => {
            const { angle, point } = await import(`${location.origin}/view.js`);
            const { plan, field: { view, canvas } } = vrg, box = canvas.getBoundingClientRect();
            const [x, y, heading] = plan.bodies[plan.numbers.indexOf(player)], [px, py] = point(view, x, y);
            const a = angle(view, heading);
            return [box.left + px + ahead * Math.cos(a), box.top + py - ahead * Math.sin(a)];
        }""",
        [player, ahead],
    )
    return found[0], found[1]


def drag(page: Visitor, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.page.mouse.move(*start)
    page.page.mouse.down()
    page.page.mouse.move(*end, steps=3)
    page.page.mouse.up()


def test_a_match_is_made_mended_saved_and_played(
    visit: Callable[[], Visitor], server: EditServer, desk: Editor, tmp_path: Path
) -> None:
    page = visit()
    assert "#" not in page.page.url
    page.page.click("#change")
    page.page.click("#more")
    page.wait("vrg.told().players.length === 8 && vrg.told().checked && vrg.told().problems.length === 0")

    # A robot is dragged into the safe zone, where no minnow may start, which is told beside its fields.
    x, y = pixel(page, 7)
    drag(page, (x, y), (x, y + 150) if not page.page.evaluate("vrg.field.view.turned") else (x - 150, y))
    page.wait_text("#problems", "player8")
    page.page.click("#play")
    page.wait_text("#notice", "It cannot be played yet.")
    page.page.click("#problems button")
    page.wait("document.activeElement.dataset.key === 'players.7.x'")
    page.page.keyboard.press("Control+z")
    page.wait("vrg.told().checked && vrg.told().problems.length === 0")

    # What is typed is checked while it is typed, and again once it is good.
    page.page.fill('[data-key="rules.slowest"]', "1.5")
    page.wait_text("#rules .why", "expected at most 1, got 1.5")
    page.page.fill('[data-key="rules.slowest"]', "0.75")
    page.wait("vrg.told().checked && vrg.told().problems.length === 0")

    # The ring before the robot turns it.
    page.page.focus('[data-key="players.7.name"]')
    x, y = pixel(page, 7)
    drag(page, pixel(page, 7, 38.0), (x + 80, y))
    page.wait("vrg.told().checked && vrg.told().players[7][7].value !== '-90'")

    page.page.keyboard.press("Control+s")
    page.page.fill("#answer", "final")
    page.page.keyboard.press("Enter")
    page.wait_text("#notice", "Saved as")
    setup = load_match(tmp_path / "final.toml")
    assert (setup.name, len(setup.players), setup.rules["slowest"]) == ("final", 8, 0.75)
    assert abs(setup.players[7].pose.theta + 1.571) > 0.1

    page.page.click("#play")
    page.wait_text("#end", "You can close this page.")
    assert server.wait(60.0) == NextStep(play=str(tmp_path / "final.toml"))
    assert server.rescue() == ""


def test_a_game_is_chosen_and_started_and_a_match_of_this_folder_is_changed(
    visit: Callable[[], Visitor], server: EditServer, tmp_path: Path
) -> None:
    (tmp_path / "mine.toml").write_text(Draft.of_game("pursuit-evasion", tmp_path).text, encoding="utf-8")
    page = visit()
    page.page.click('[data-match$="mine.toml"]')
    page.wait_text("#start .card[aria-checked=true]", "Pursuit Evasion")
    page.wait("vrg.told().file === 'mine.toml' && vrg.told().checked")
    page.page.click("#change")
    page.page.select_option('[data-key="engine"]', "planar")
    page.wait("vrg.told().changed")
    page.page.click("#back")
    page.wait_text("#ask", "not saved. Leave it anyway?")
    page.page.keyboard.press("Enter")
    page.wait("document.body.dataset.screen === 'start' && !vrg.told().changed")
    page.page.select_option("#map", "open") if page.page.is_enabled("#map") else None
    page.page.click('[data-game="practice"]')
    page.wait("vrg.told().title === 'Practice' && vrg.told().checked")
    page.page.click("#play")
    page.wait_text("#end", "The match is played")
    assert server.wait(60.0) == NextStep(play="practice")


def test_keys_alone_choose_move_and_turn_a_robot(visit: Callable[[], Visitor], desk: Editor) -> None:
    page = visit()
    page.page.click("#change")
    page.page.focus("#field")
    for key in ("n", "ArrowUp", "Shift+ArrowRight", "q"):
        page.page.keyboard.press(key)
    page.wait("vrg.told().checked && vrg.told().changed && vrg.told().players[0][7].value === '95'")
    pose = desk.draft.players[0].pose
    assert pose is not None
    assert sorted((abs(round(pose.x - 21.0, 3)), abs(round(pose.y + 33.0, 3)))) == [0.1, 1.0]


def test_what_is_typed_slowly_is_left_as_it_is_typed(visit: Callable[[], Visitor], desk: Editor) -> None:
    page = visit()
    page.page.click("#change")
    field = page.page.locator('[data-key="players.1.y"]')
    field.fill("")
    # Each sign is taken in and answered before the next one, and "-13." and "-13.0" are told as "-13".
    for sign in "-13.05":
        field.press_sequentially(sign)
        page.wait("vrg.told().checked && vrg.idle()")
    assert (field.input_value(), desk.draft.shown(("players", 1, "y"))) == ("-13.05", "-13.05")
    page.page.keyboard.press("Control+z")
    page.wait("document.querySelector('[data-key=\"players.1.y\"]').value === '-13'")


def test_a_field_that_is_left_at_once_is_checked(visit: Callable[[], Visitor], desk: Editor) -> None:
    page = visit()
    page.page.click("#change")
    name = page.page.locator('[data-key="players.1.name"]')
    name.fill("two words")
    name.press("Tab")
    page.wait_text("#table .why", "two words")
    page.wait("vrg.told().checked")
    name.fill("ann")
    name.press("Tab")
    page.wait("vrg.told().checked && vrg.told().players[1][0].value === 'ann'")
    page.wait_text("#problems-heading", "none, ready to play")


def test_everything_has_room(visit: Callable[[], Visitor]) -> None:
    page = visit()
    for screen in ("start", "edit"):
        if screen == "edit":
            page.page.click("#change")
        for width, height in SIZES:
            page.page.set_viewport_size({"width": width, "height": height})
            assert page.page.evaluate(LAYOUT) == {"cut": [], "wide": False}, f"{screen} at {width}x{height}"
