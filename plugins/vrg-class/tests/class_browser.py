"""A class with two short steps, and browsers that visit it."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from vrg.launch.endpoints import free_port
from vrg.testing.views.browser import Visitor
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

    def make(path: str, size: tuple[int, int] = SIZES[0], **how: Any) -> Visitor:
        visitors.append(Visitor(browser, site + path, size, **how))
        return visitors[-1]

    yield make
    for visitor in visitors:
        visitor.close()
    wrong = [error for visitor in visitors for error in visitor.errors]
    assert not wrong, wrong


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
