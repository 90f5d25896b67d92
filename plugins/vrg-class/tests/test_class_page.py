"""The pages of a class in Chromium: a student joins, tries, mends an error, reaches the goal and hands in."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.chromium import Visitor, chromium
from vrg.launch.endpoints import free_port
from vrg.ui.web.admission import Admission
from vrg_class.folder import About, ClassFolder
from vrg_class.league import ClassLeague
from vrg_class.lesson import lesson_of
from vrg_class.links import Served
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
    tries, league = (lambda: Tries(1, GAME, "planar", sealed=False)), ClassLeague(folder, GAME)
    made = ClassSite(Served(Admission(HOST, port)), folder, lesson_of(lesson), tries, league)
    made.start()
    yield f"http://{HOST}:{port}"
    made.stop()


@pytest.fixture
def visit(browser: Browser, site: str) -> Iterator[Callable[..., Visitor]]:
    """Opens a page; one that fails fails the test."""
    visitors: list[Visitor] = []

    def make(path: str, size: tuple[int, int] = SIZES[0], **how: str) -> Visitor:
        visitors.append(Visitor(browser, site + path, size, **how))
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


def newest(folder: Path) -> str:
    """The code of Ada's as it is saved."""
    return (folder / "class" / "students" / "ada" / "code.py").read_text()


def versions(folder: Path) -> set[str]:
    """The code of all versions of Ada's."""
    return {file.read_text() for file in (folder / "class" / "students" / "ada" / "versions").glob("*/code.py")}


def asked_which(page: Visitor) -> None:
    """The page asks which code to go on with, as the server has told it."""
    page.page.wait_for_selector("#stale[open]")
    assert all("409" in error for error in page.errors)
    page.errors.clear()


def test_code_of_a_telephone_and_of_a_laptop_are_both_kept(
    visit: Callable[..., Visitor], site: str, tmp_path: Path
) -> None:
    telephone = visit(f"/#join={JOINING}", SIZES[1])
    join(telephone, "Ada")
    link = telephone.page.input_value("#own-link").removeprefix(site)
    telephone.page.context.route("**/save", lambda route: route.abort())
    write(telephone, "# typed on the telephone")
    telephone.page.close()
    telephone.errors.clear()
    laptop = visit(link)
    laptop.wait_text("#student", "Ada")
    write(laptop, "# gone on with the laptop")
    laptop.wait_text("#saved", "saved")
    telephone.page.context.unroute("**/save")
    telephone.page = telephone.page.context.new_page()
    telephone.page.goto(site)
    asked_which(telephone)
    assert "# typed on the telephone" in telephone.page.inner_text("#stale-here")
    assert "# gone on with the laptop" in telephone.page.inner_text("#stale-there")
    assert newest(tmp_path) == "# gone on with the laptop"
    telephone.page.click("#keep-here")
    telephone.wait_text("#saved", "saved")
    laptop.wait("vrg.editor.code === '# typed on the telephone'")
    assert newest(tmp_path) == "# typed on the telephone"
    assert "# gone on with the laptop" in versions(tmp_path)
    # What was there before can be taken back, and that, too.
    laptop.page.click("#tabs [data-told=more]")
    laptop.page.click("#versions button >> nth=0")
    laptop.wait_text("#former-text", "laptop")
    laptop.page.click("#former-take")
    laptop.wait("vrg.editor.code === '# gone on with the laptop'")
    telephone.wait("vrg.editor.code === '# gone on with the laptop'")
    assert "# typed on the telephone" in versions(tmp_path)


def test_two_tabs_show_the_same_code_or_ask(visit: Callable[..., Visitor], site: str, tmp_path: Path) -> None:
    first = visit(f"/#join={JOINING}")
    join(first, "Ada")
    other = Visitor.__new__(Visitor)
    other.page, other.errors = first.page.context.new_page(), []
    other.page.goto(site)
    other.wait("vrg.keeper")
    write(first, "# one")
    other.wait("vrg.editor.code === '# one'")
    other.page.evaluate("vrg.editor.insert('# two\\n')")
    first.wait("vrg.editor.code === '# two\\n# one'")
    # A tab that has slept through it asks.
    other.page.context.set_offline(True)
    other.page.evaluate("vrg.keeper.base = 'older'")
    other.page.context.set_offline(False)
    other.page.evaluate("vrg.editor.insert('# three\\n')")
    other.page.wait_for_selector("#stale[open]")
    assert newest(tmp_path) == "# two\n# one"
    other.page.click("#keep-there")
    other.wait("vrg.editor.code === '# two\\n# one' && !vrg.keeper.unsaved")
    assert any("# three" in text for text in versions(tmp_path))
    first.errors.clear()


DENIED = """for (const name of ["localStorage", "sessionStorage"])
    Object.defineProperty(window, name, { get() { throw new DOMException("denied", "SecurityError"); } });"""
FULL = """Storage.prototype.setItem = () => { throw new DOMException("full", "QuotaExceededError"); };"""


@pytest.mark.parametrize("script", [DENIED, FULL], ids=["denied", "full"])
def test_a_browser_that_keeps_nothing_does_all_the_same(
    visit: Callable[..., Visitor], tmp_path: Path, script: str
) -> None:
    page = visit(f"/#join={JOINING}", SIZES[0], script=script)
    page.page.fill("#name", "Ada")
    page.page.keyboard.press("Enter")
    page.page.wait_for_selector("#work:visible")
    page.wait_text("#notice", "keeps nothing")
    write(page, "mine = 1")
    page.wait_text("#saved", "saved")
    page.page.reload()
    page.wait("vrg.editor.code === 'mine = 1'")
    page.page.click("#try")
    page.wait_text("#result", "Error")
    assert newest(tmp_path) == "mine = 1"
    teacher = visit(f"/teacher.html#{TEACHER}", script=script)
    teacher.wait_text("#students", "Ada")
    teacher.page.reload()
    teacher.wait_text("#students", "Ada")
    visit(f"/projector.html#{JOINING}", script=script).wait_text("#students-here", "1 student")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("print(“fast”)", '“ in column 15 is a typographic quotation mark: type "'),
        ("print（1）", "（ in column 14 is a wide bracket: type ("),
        ("print(\u00a01)", "In column 15 is a special space"),
        ("x = 1 – 2", "– in column 15 is a dash: type -"),
        ("x ＝ 1", "＝ in column 11 is a sign that Python does not know: type ="),
    ],
)
def test_signs_of_texts_are_named_at_their_place(visit: Callable[..., Visitor], line: str, words: str) -> None:
    page = visit(f"/#join={JOINING}")
    join(page, "Ada")
    write(page, CODE.format("0.7").replace("        return", f"        {line}  # “fine”\n        return"))
    page.page.click("#try")
    page.wait_text(".cm-fault", words)
    assert page.page.inner_text(".cm-odd") == words.removeprefix("In ")[0] or "special space" in words


@pytest.mark.parametrize(
    ("locale", "button", "hint"),
    [("de-CH", "Ausprobieren", "Python kennt"), ("es", "Probar", "Python no"), ("fr-FR", "Essayer", "Python ne")],
)
def test_the_workshop_speaks_the_language_of_the_browser(
    visit: Callable[..., Visitor], locale: str, button: str, hint: str
) -> None:
    page = visit(f"/#join={JOINING}", SIZES[1], locale=locale)
    join(page, "Ada")
    assert button in page.page.inner_text("#try")
    page.page.click("#try")
    page.wait("vrg.player.recording.errors.length")
    page.page.click("#result-act")
    page.wait_text(".cm-fault", hint)


def test_the_teacher_changes_who_is_in_the_class(visit: Callable[..., Visitor], site: str) -> None:
    teacher = visit(f"/teacher.html#{TEACHER}")
    teacher.page.on("dialog", lambda dialog: dialog.accept())
    teacher.page.fill("#new-name", "Ada")
    teacher.page.keyboard.press("Enter")
    teacher.page.wait_for_selector("#person[open] svg")
    link = teacher.page.input_value("#person-link").removeprefix(site)
    student = visit(link)
    student.wait_text("#student", "Ada")
    teacher.page.fill("#another-name", "Ada L.")
    teacher.page.keyboard.press("Enter")
    student.wait_text("#student", "Ada L.")
    write(student, CODE.format("0.7"))
    student.page.click("#try")
    student.wait_text("#result", "Reached")
    teacher.page.click("#progress")
    teacher.wait_text("#done td.step", "✓")
    with teacher.page.expect_download() as download:
        teacher.page.click("#export")
    table = download.value.path().read_text(encoding="utf-8-sig").splitlines()
    assert table[0] == '"Name","01-drive","02-print","Tries","Handed in","Last error"'
    assert table[1] == '"Ada L.","1","0","1","0",""'
    teacher.page.click("#done button")
    teacher.page.click("[data-act=reset]")
    student.wait("vrg.editor.code.includes('spede')")
    teacher.page.click("#done button")
    teacher.page.click("[data-act=revoke]")
    student.wait_text("#join-problem, #lost", "link is not known")
    teacher.page.click("[data-act=remove]")
    teacher.wait_text("#summary", "Nobody has joined yet")
    student.errors.clear()
