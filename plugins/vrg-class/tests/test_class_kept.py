"""Nobody's code is lost: two devices, two tabs, browsers that store nothing, slow networks, links that change."""

from collections.abc import Callable
from pathlib import Path

import pytest
from class_browser import JOINING, SIZES, TEACHER, join, write
from playwright.sync_api import Route

from vrg.testing.views.browser import Visitor

pytest_plugins = ["class_browser"]


def newest(folder: Path) -> str:
    """The code of Ada's as it is saved."""
    return (folder / "class" / "students" / "ada" / "code.py").read_text()


def versions(folder: Path) -> set[str]:
    """The code of all versions of Ada's."""
    return {file.read_text() for file in (folder / "class" / "students" / "ada" / "versions").glob("*/code.py")}


def asked_which(page: Visitor) -> None:
    """The page asks which code to go on with, as the server has told it."""
    page.page.wait_for_selector("#stale[open]")


def test_code_of_a_telephone_and_of_a_laptop_are_both_kept(
    visit: Callable[..., Visitor], site: str, tmp_path: Path
) -> None:
    telephone = visit(f"/#join={JOINING}", SIZES[1])
    telephone.expected = ("409", "ERR_FAILED")
    join(telephone, "Ada")
    link = telephone.page.input_value("#own-link").removeprefix(site)
    telephone.page.context.route("**/save", lambda route: route.abort())
    write(telephone, "# typed on the telephone")
    telephone.page.close()
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
    other = visit("/", context=first.page.context)
    other.expected = ("409",)
    other.wait("vrg.keeper")
    write(first, "# one")
    other.wait("vrg.editor.code === '# one'")
    other.page.evaluate("vrg.editor.insert('# two\\n')")
    first.wait("vrg.editor.code === '# two\\n# one'")
    # A tab that has slept through it asks.
    other.page.evaluate("vrg.keeper.base = 'older'; vrg.keeper.own.clear()")
    other.page.evaluate("vrg.editor.insert('# three\\n')")
    other.page.wait_for_selector("#stale[open]")
    assert newest(tmp_path) == "# two\n# one"
    other.page.click("#keep-there")
    other.wait("vrg.editor.code === '# two\\n# one' && !vrg.keeper.unsaved")
    assert any("# three" in text for text in versions(tmp_path))


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
    page.wait_text("#notice", "stores nothing")
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


@pytest.mark.parametrize("pause", [0.25, 1.5])
def test_a_slow_network_makes_no_conflict_of_a_page_with_itself(
    visit: Callable[..., Visitor], tmp_path: Path, pause: float
) -> None:
    page = visit(f"/#join={JOINING}")
    join(page, "Ada")

    def slow(route: Route) -> None:
        response = route.fetch()
        page.page.wait_for_timeout(1000.0 * pause)
        route.fulfill(response=response)

    page.page.route("**/save", slow)
    page.page.locator(".cm-content").click()
    for number in range(4):
        page.page.keyboard.type(f"# {number}\n", delay=30)
        page.page.wait_for_timeout(1100.0)
    page.page.keyboard.press("Control+Enter")
    page.wait("vrg.player.recording.version")
    page.wait("!vrg.keeper.unsaved")
    assert not page.page.is_visible("#stale")
    assert newest(tmp_path) == page.page.evaluate("vrg.editor.code")


def test_code_that_cannot_be_saved_shuts_nobody_out(visit: Callable[..., Visitor]) -> None:
    page = visit(f"/#join={JOINING}")
    page.expected = ("413",)
    join(page, "Ada")
    write(page, "# " + "x" * 100_001)
    page.wait_text("#saved", "more than 100000 letters")
    page.page.reload()
    page.page.wait_for_selector("#work:visible")
    page.wait("vrg.editor.code.includes('spede')")


def test_what_is_typed_while_the_link_changes_goes_on(visit: Callable[..., Visitor], site: str, tmp_path: Path) -> None:
    page, teacher = visit(f"/#join={JOINING}"), visit(f"/teacher.html#{TEACHER}")
    teacher.page.on("dialog", lambda dialog: dialog.accept())
    page.expected = ("401", "ERR_FAILED")
    join(page, "Ada")
    page.page.route("**/save", lambda route: route.abort())
    write(page, "# typed before")
    teacher.page.click("#students button")
    teacher.page.fill("#another-name", "Ada L.")
    teacher.page.keyboard.press("Enter")
    page.wait_text("#student", "Ada L.")
    assert page.page.evaluate("vrg.editor.code") == "# typed before"
    teacher.page.click("#students button")
    teacher.page.click("[data-act=revoke]")
    page.wait_text("#lost", "not known")
    link = teacher.page.input_value("#person-link").removeprefix(site)
    page.page.unroute("**/save")
    page.page.goto(site + link)
    page.wait("vrg.keeper && !vrg.keeper.unsaved")
    page.wait("vrg.editor.code === '# typed before'")
    assert newest(tmp_path) == "# typed before"
    page.page.click("#tabs [data-told=more]")
    page.page.click("#leave")
    page.page.wait_for_selector("#join:visible")
    kept = page.page.evaluate("JSON.stringify(Object.entries(localStorage))")
    assert link.removeprefix("/#") not in kept
