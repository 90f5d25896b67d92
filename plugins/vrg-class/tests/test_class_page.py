"""The pages of a class in Chromium: a student joins, tries, mends an error, reaches the goal and hands in."""

from collections.abc import Callable
from pathlib import Path

import pytest
from class_browser import CODE, JOINING, SIZES, TEACHER, join, write

from vrg.testing.views.browser import Visitor

pytest_plugins = ["class_browser"]
CUT = """() => {
    const cut = [...document.querySelectorAll("button, h1, h2, label, #result-words")]
        .filter((e) => e.getClientRects().length && getComputedStyle(e).display !== "inline")
        .filter((e) => e.scrollWidth > e.clientWidth + 1 || e.getBoundingClientRect().right > innerWidth + 1)
        .map((e) => e.textContent);
    const root = document.documentElement, act = document.querySelector("#try").getBoundingClientRect();
    return { cut, wide: root.scrollWidth > innerWidth, reached: act.width > 0 && act.bottom <= innerHeight };
}"""
"""What is cut off, whether the page is wider than the window, and whether Try can be pressed."""


def test_a_student_mends_an_error_reaches_the_goal_and_hands_in(visit: Callable[..., Visitor], tmp_path: Path) -> None:
    page = visit(f"/#join={JOINING}")
    join(page, "Ada")
    page.wait_text("#text strong", "safe")
    page.page.locator(".cm-content").click()
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
    # After a try the field is there as well.
    write(page, CODE.format("0.7"))
    page.page.click("#try")
    page.wait("vrg.player.recording.end")
    page.page.reload()
    page.wait("vrg.player.recording.end && vrg.match.ground?.figures.length > 3")


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
    student.expected = ("401",)
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
    assert table[0] == '"Name","Drive","Print","Tries","Handed in","Last error"'
    assert table[1] == '"Ada L.","1","0","1","0",""'
    teacher.page.click("#done button")
    teacher.page.click("[data-act=reset]")
    student.wait("vrg.editor.code.includes('spede')")
    teacher.page.click("#done button")
    teacher.page.click("[data-act=revoke]")
    student.wait_text("#join-problem, #lost", "link is not known")
    teacher.page.click("[data-act=remove]")
    teacher.wait_text("#summary", "Nobody has joined yet")
