"""The pages of a class in Chromium: a student joins, tries, mends an error, reaches the goal and hands in."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.chromium import Visitor, chromium
from vrg.launch.endpoints import free_port
from vrg_class.folder import About, ClassFolder
from vrg_class.league import ClassLeague
from vrg_class.lesson import lesson_of
from vrg_class.server import ClassSite
from vrg_class.tries import Tries

HOST = "127.0.0.1"
GAME = "sharks-and-minnows"
JOINING, TEACHER = "joining-token", "teacher-token"
SIZES = ((1366, 768), (390, 844))
STEPS = {
    "01-drive.md": 'title = "Drive"\ngoal = { zone = "safe" }\nhint = "Change **0.3**."\n+++\nReach the **safe** zone.',
    "02-print.md": 'title = "Print"\ngoal = { prints = true }\n+++\nPrint something.',
}
MATCH = """name = "lesson"
game = "sharks-and-minnows"
map = "open"
engine = "planar"
lasers = false
noise = false
[rules]
x = [-3.0, 3.0]
y = [-4.0, 4.0]
zone_depth = 2.0
passes = 1
lineup = "place"
[[players]]
name = "shark"
role = "shark"
x = 0.0
y = -3.0
heading = 90.0
[[players]]
name = "minnow"
role = "minnow"
x = 0.0
y = 3.0
heading = -90.0
"""
CODE = """from vrg.agents import *


class Minnow(Strategy):
    def act(self, view):
        return Twist({}, 0.0)
"""
CUT = """() => {
    const cut = [...document.querySelectorAll("button, h1, h2, label, #result-words")]
        .filter((e) => e.getClientRects().length && getComputedStyle(e).display !== "inline")
        .filter((e) => e.scrollWidth > e.clientWidth + 1 || e.getBoundingClientRect().right > innerWidth + 1)
        .map((e) => e.textContent);
    const root = document.documentElement, act = document.querySelector("#try").getBoundingClientRect();
    return { cut, wide: root.scrollWidth > innerWidth, reached: act.width > 0 && act.bottom <= innerHeight };
}"""
"""What is cut off, whether the page is wider than the window, and whether Try can be pressed."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture
def site(tmp_path: Path) -> Iterator[str]:
    """The address of a class with two short steps, whose code runs unsealed in this process's children."""
    lesson = tmp_path / "lesson"
    lesson.mkdir()
    for name, text in STEPS.items():
        head = 'match = "small.toml"\nteam = "minnows"\nseconds = 15\nother = "still.py"\n'
        (lesson / name).write_text(f"+++\n{head}{text}\n", encoding="utf-8")
    (lesson / "small.toml").write_text(MATCH, encoding="utf-8")
    (lesson / "still.py").write_text(CODE.format("0.0"), encoding="utf-8")
    (lesson / "first.py.txt").write_text(CODE.format("spede"), encoding="utf-8")
    about = About(game=GAME, match=GAME, lesson=str(lesson), teacher=TEACHER, joining=JOINING)
    folder = ClassFolder(tmp_path / "class", about)
    port = free_port(HOST, 18191, tries=200)
    made = ClassSite(
        HOST, port, folder, lesson_of(lesson), lambda: Tries(1, GAME, "planar", sealed=False), ClassLeague(folder, GAME)
    )
    made.start()
    yield f"http://{HOST}:{port}"
    made.stop()


@pytest.fixture
def visit(browser: Browser, site: str) -> Iterator[Callable[..., Visitor]]:
    """Opens a page; one that fails fails the test."""
    visitors: list[Visitor] = []

    def make(path: str, size: tuple[int, int] = SIZES[0]) -> Visitor:
        visitors.append(Visitor(browser, site + path, size))
        return visitors[-1]

    yield make
    for visitor in visitors:
        visitor.close()
    assert [visitor.errors for visitor in visitors] == [[] for _ in visitors]


def join(page: Visitor, name: str) -> None:
    page.page.fill("#name", name)
    page.page.keyboard.press("Enter")
    page.page.wait_for_selector("#work:visible")
    assert "#" not in page.page.url


def write(page: Visitor, code: str) -> None:
    """Replace the code, as it is pasted, and leave the cursor at its end."""
    page.page.evaluate(
        """(code) => {
            const { view } = vrg.editor, changes = { from: 0, to: view.state.doc.length, insert: code };
            view.dispatch({ changes, selection: { anchor: code.length } });
            view.focus();
        }""",
        code,
    )


def test_a_student_mends_an_error_reaches_the_goal_and_hands_in(visit: Callable[..., Visitor], tmp_path: Path) -> None:
    page = visit(f"/#join={JOINING}")
    join(page, "Ada")
    page.wait_text("#text strong", "safe")
    page.page.locator(".cm-content").click()
    page.wait_text("#idle", "Press Try")
    page.page.keyboard.press("Control+Enter")
    page.wait_text(".cm-fault", "name 'spede' is not defined")
    page.wait_text("#output .error", "line 6")
    page.wait_text("#result", "Error in line 6")
    page.wait("vrg.player.recording.end && !vrg.match.motion.latest.flashes.length")
    assert page.page.is_hidden("#idle")
    page.page.click("#result-act")
    page.wait("vrg.editor.view.hasFocus && vrg.editor.line === 6")

    write(page, CODE.format("0.7"))
    page.wait("!vrg.editor.view.dom.querySelector('.cm-fault')")
    page.page.click("#try")
    page.wait("vrg.player.recording.version === 2 && vrg.player.recording.end")
    # The bar of time: an instant shows what its robot knew then.
    page.page.click("#tabs [data-told=view]")
    page.page.evaluate("vrg.player.to(1.0)")
    page.wait_text("#view tr", "view.position")
    page.wait("[...document.querySelectorAll('#view tr')].some((row) => row.innerText.match(/^view.time\\s+0.90$/))")
    page.page.click("[title='To the end']")
    page.wait_text("#result", "Reached after")
    assert page.page.inner_text("#steps .done") == "1 ✓"
    page.page.click("#result-act")
    page.wait_text("#step-title", "Print")
    # Nothing of the former step is left.
    page.wait_text("#idle", "Press Try")
    page.wait("!vrg.player.recording.version && !document.querySelector('#output .call')")

    page.page.click("#hand-in")
    page.wait_text("#version", "Version 2 is handed in.")
    assert (tmp_path / "class" / "entries" / "ada.py").read_text() == CODE.format("0.7")


def test_a_reload_keeps_all_and_the_own_link_opens_it_elsewhere(visit: Callable[..., Visitor], site: str) -> None:
    page = visit(f"/#join={JOINING}")
    join(page, "Ada")
    page.page.click("#steps button:nth-child(2)")
    write(page, "mine = 1")
    page.wait_text("#saved", "saved")
    page.page.keyboard.type("2")
    page.page.reload()
    page.wait("vrg.editor.code === 'mine = 12'")
    page.wait_text("#step-title", "Print")
    page.wait("!Object.keys(localStorage).some((key) => key.startsWith('vrg-class-code'))")
    link = page.page.input_value("#own-link")
    other = visit(link.removeprefix(site), SIZES[1])
    other.wait_text("#student", "Ada")
    other.wait("vrg.editor.code === 'mine = 12'")


def test_the_teacher_sees_the_error_and_speaks_to_all(visit: Callable[..., Visitor]) -> None:
    page, teacher = visit(f"/#join={JOINING}"), visit(f"/teacher.html#{TEACHER}")
    projector = visit(f"/projector.html#{JOINING}", (1920, 1080))
    join(page, "Ada")
    page.page.click("#try")
    teacher.wait_text("#students .error", "line 6: NameError")
    teacher.page.click("#students button")
    teacher.wait_text("#person-code .faulty", "spede")
    teacher.page.click("#close")
    teacher.page.fill("#message", "Look <b>here</b>")
    teacher.page.keyboard.press("Enter")
    page.wait_text("#news", "Look <b>here</b>")
    projector.wait_text("#saying", "Look <b>here</b>")
    projector.wait_text("#students-here", "1 student")
    teacher.page.click("#halt")
    page.wait_text("#news", "paused all tries")
    page.page.click("#try")
    page.wait_text("#result", "paused all tries")
    teacher.page.click("#halt")
    page.wait("vrg.player.recording.version === 1 && vrg.player.recording.end")


@pytest.mark.parametrize("size", SIZES)
def test_everything_has_room(visit: Callable[..., Visitor], size: tuple[int, int]) -> None:
    page = visit(f"/#join={JOINING}", size)
    join(page, "W" * 24)
    for act in (
        "#steps button:last-child",
        "#bar [data-tab=code]",
        "#bar [data-tab=more]",
        "#tabs [data-told=more]",
        "#try",
    ):
        if page.page.is_visible(act):
            page.page.click(act)
        assert page.page.evaluate(CUT) == {"cut": [], "wide": False, "reached": True}, act
    page.wait("vrg.player.recording.errors.length")
    assert page.page.evaluate(CUT) == {"cut": [], "wide": False, "reached": True}, "an error"
