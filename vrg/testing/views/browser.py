"""Debian's Chromium without a screen, for tests of the page."""

import asyncio
import atexit
import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Playwright, sync_playwright

from vrg.testing.requirements import missing

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
PATIENCE = 120_000.0
"""ms of real time for anything to happen on a page."""
SIZES = ((1280, 720), (1920, 1080), (390, 844))
"""The pixels of a small and of a large projector, and of a telephone."""
LAYOUT = """async () => {
    const overlap = (a, b) => Math.min(a.left + a.width, b.left + b.width) > Math.max(a.left, b.left) &&
        Math.min(a.top + a.height, b.top + b.height) > Math.max(a.top, b.top);
    const plates = vrg.field.plates, cut = [], root = document.documentElement;
    const told = "h1, .team, .chip, button, #link-words, .round, .name, .deed, .points, .estop";
    for (const element of document.querySelectorAll(told)) {
        const hidden = !element.getClientRects().length, box = element.getBoundingClientRect();
        const wide = element.scrollWidth > element.clientWidth + 1 || box.right > innerWidth;
        if (!hidden && wide) cut.push(element.textContent);
    }
    const act = document.querySelector(".act:not([hidden])")?.getBoundingClientRect();
    return {
        cut,
        covered: plates.some((a, i) => plates.slice(i + 1).some((b) => overlap(a, b))),
        scrolls: root.scrollWidth > innerWidth || root.scrollHeight > innerHeight,
        reachable: !act || act.bottom <= innerHeight,
        field: vrg.field.canvas.clientHeight * vrg.field.canvas.clientWidth / innerWidth / innerHeight > 0.2,
    };
}"""
"""What is cut off, covers something, or takes too much room on a page."""


class _Browsers:
    """The browsers of this process, by their further flags, and Playwright, which takes longer to start than they do.

    Playwright's event loop counts as the running one of this thread, also between its calls, and another one cannot run
    beside it. So it counts only while somebody has a browser.
    """

    def __init__(self) -> None:
        self._started: tuple[Playwright, asyncio.AbstractEventLoop] | None = None
        self._browsers: dict[tuple[str, ...], Browser] = {}
        self._wanted = 0

    @contextmanager
    def browser(self, path: str, flags: tuple[str, ...]) -> Iterator[Browser]:
        """The one with these flags, which is started if there is none."""
        playwright = self._running()
        self._wanted += 1
        try:
            browser = self._browsers.get(flags)
            if browser is None or not browser.is_connected():
                browser = playwright.chromium.launch(executable_path=path, args=[*FLAGS, *flags])
                self._browsers[flags] = browser
            before = browser.contexts
            yield browser
            for context in browser.contexts:
                if context not in before:
                    context.close()
        finally:
            self._wanted -= 1
            if not self._wanted:
                asyncio._set_running_loop(None)

    def _running(self) -> Playwright:
        if self._started is None:
            playwright = sync_playwright().start()
            self._started = playwright, asyncio.get_running_loop()
            atexit.register(self._end)
        playwright, loop = self._started
        asyncio._set_running_loop(loop)
        return playwright

    def _end(self) -> None:
        playwright = self._running()
        for browser in self._browsers.values():
            browser.close()
        playwright.stop()
        asyncio._set_running_loop(None)


_BROWSERS = _Browsers()


@contextmanager
def chromium(*flags: str) -> Iterator[Browser]:
    """A browser that all tests of this process share, without a page; `flags` are further ones.

    What a test opens has a context of its own, which is closed with the block at the latest.
    """
    # Without a window of its own it takes half the time.
    path = shutil.which("chromium-headless-shell") or shutil.which("chromium")
    if path is None:
        missing("neither chromium-headless-shell nor chromium is installed: no browser for the page")
    with _BROWSERS.browser(path, flags) as browser:
        yield browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """The browser, for a `conftest.py` to import; between modules of tests another event loop may run."""
    with chromium() as found:
        yield found


class Visitor:
    """A page in a context of its own, as another person's browser is.

    Args:
        locale: the language of the browser. script: JavaScript that runs before that of each page.
        context: of another page, of which this one is a further tab; None makes one.

    Attributes:
        page: Playwright's. errors: of the page, and of what it has loaded.
        expected: words of those that belong to the test, such as the status of an answer.
    """

    def __init__(
        self,
        browser: Browser,
        link: str,
        size: tuple[int, int] = SIZES[0],
        *,
        locale: str = "en",
        script: str = "",
        context: BrowserContext | None = None,
    ) -> None:
        context = context or browser.new_context(
            viewport={"width": size[0], "height": size[1]}, locale=locale, ignore_https_errors=True
        )
        if script:
            context.add_init_script(script)
        self.page: Page = context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.errors: list[str] = []
        self.expected: tuple[str, ...] = ()
        self.page.on("pageerror", lambda error: self._note(str(error)))
        self.page.on("console", lambda said: self._note(said.text) if said.type == "error" else None)
        self.page.goto(link)

    def _note(self, error: str) -> None:
        if not any(words in error for words in self.expected):
            self.errors.append(error)

    def wait(self, expression: str) -> None:
        """Wait until an expression of JavaScript holds; `vrg` is what the page knows."""
        self.page.wait_for_function(f"() => {{ const vrg = window.vrg; return vrg && ({expression}); }}")

    def text(self, what: str) -> str:
        """What is written in an element."""
        return self.page.inner_text(what)

    def wait_text(self, what: str, words: str) -> None:
        """Wait until an element is seen that has these words in it."""
        self.page.locator(what, has_text=words).first.wait_for()

    def colour_at(self, x: float, y: float) -> str:
        """The colour of the field at a point of it, m, such as `#56b4e9`."""
        found: str = self.page.evaluate(
            """async ([x, y]) => {
                const { point } = await import(`${location.origin}/view.js`);
                const [px, py] = point(vrg.field.view, x, y).map((at) => Math.round(at * devicePixelRatio));
                const data = vrg.field.canvas.getContext("2d").getImageData(px, py, 1, 1).data;
                return "#" + [...data].slice(0, 3).map((part) => part.toString(16).padStart(2, "0")).join("");
            }""",
            [x, y],
        )
        return found

    def close(self) -> None:
        """Close the browser's window, as a person does."""
        self.page.context.close()
