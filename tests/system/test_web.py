"""A match in browsers: who has no link may only watch, whoever drives does it under a lease, and play goes on."""

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from vrg.testing.processes.arena import Arena
from vrg.testing.processes.match import MINNOWS, LiveMatch, long_match
from vrg.testing.views.browser import Visitor, chromium
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

SIZE = (800, 500)
"""Pixels: Chromium draws without a graphics card, beside a match."""


@pytest.fixture(scope="module")
def match(arena: Arena) -> Iterator[LiveMatch]:
    running = arena.start(long_match("web"), options=["--web"], seats=True)
    yield running
    running.close()


@pytest.fixture(scope="module")
def links(match: LiveMatch) -> dict[str, str]:
    """What the launcher prints, by who it is for: all may watch, one link is for officials, and one for each player."""
    found: dict[str, str] = {}

    def look() -> bool:
        found.update(re.findall(r"(watch|official|drive \w+) +(http://\S+)", match.output.read_text()))
        return len(found) == 6

    wait_until(look, "the launcher to print the links")
    return found


@pytest.fixture(scope="module")
def visit(links: dict[str, str]) -> Iterator[Callable[[str], Visitor]]:
    with chromium() as browser:
        yield lambda who: Visitor(browser, links[who], SIZE)


def test_viewers_watch_drivers_drive_and_officials_decide(
    match: LiveMatch, visit: Callable[[str], Visitor], links: dict[str, str]
) -> None:
    viewer = visit("watch")
    _watch(match, viewer)
    _drive(match, visit)
    _decide(match, viewer, visit)
    _restart(match, viewer)
    tokens = [link.partition("#")[2] for link in links.values() if "#" in link]
    assert len(tokens) == 5
    _assert_nowhere(tokens, match.run.path, match.launcher.pid)
    match.launcher.send_signal(signal.SIGINT)
    viewer.wait_text("#link-words", "The match has ended")
    assert match.wait_ended() == 130


def _watch(match: LiveMatch, viewer: Visitor) -> None:
    """A viewer sees robots move, and is refused when it sends what the buttons of others would."""
    observer = match.observer
    viewer.wait_text("#title", "Sharks and Minnows")
    viewer.wait("vrg.match.motion.trails.some((trail) => trail.points.length > 3)")
    shown = viewer.page.locator("#field").screenshot()
    observer.wait_until(lambda: viewer.page.locator("#field").screenshot() != shown, "robots to be drawn elsewhere")
    viewer.page.evaluate("vrg.link.send({ t: 'act', what: 'halt' })")
    viewer.wait_text("#notice", "Refused: deciding")
    viewer.page.evaluate("vrg.link.send({ t: 'drive', forward: -1, turn: 0 })")
    viewer.wait_text("#notice", "Refused: driving")
    observer.time_passes(0.5, "what must not follow")
    assert observer.playing or observer.stalled
    assert not any(reports[-1].body.manual for reports in observer.heard.reports.values())
    assert re.search(r"viewer \(web\), connection \d+, wanted to halt: refused", match.log("web"))


def _drive(match: LiveMatch, visit: Callable[[str], Visitor]) -> None:
    """A seat drives its robot; a second tab is refused; closing the page gives the robot back."""
    observer = match.observer
    driver = visit("drive ann")
    driver.wait("vrg.match.role === 'seat'")
    driver.page.keyboard.down("ArrowDown")
    pressed = time.monotonic()

    def backwards() -> bool:
        nonlocal pressed
        if observer.stalled:  # the machine stood still, which halts play
            observer.resume()
        manual = observer.heard.reports["ann"][-1].body.manual
        if not manual and time.monotonic() - pressed > 2.0:
            # A page that was silent for a moment, as the machine was busy, has lost its lease and must let go once.
            driver.page.keyboard.up("ArrowDown")
            driver.page.keyboard.down("ArrowDown")
            pressed = time.monotonic()
        return manual and observer.body("ann").twist.v < -0.1

    observer.wait_until(backwards, "ann to drive backwards, and its player to report that a person drives it")
    second = visit("drive ann")
    second.wait_text("#door", "Another page drives ann already")
    second.close()
    assert observer.playing or observer.stalled
    driver.close()
    observer.wait_until(lambda: not observer.heard.reports["ann"][-1].body.manual, "ann to be given back")
    observer.wait_moving(*MINNOWS)


def _decide(match: LiveMatch, viewer: Visitor, visit: Callable[[str], Visitor]) -> None:
    """An official halts play and continues it."""
    official = visit("official")
    official.wait("vrg.match.role === 'official'")
    official.page.click("#halt")
    match.observer.wait_until(lambda: match.observer.state.halted, "the halt")
    viewer.wait_text("#banners", "HALT")
    asked = -1.0

    def goes_on() -> bool:
        nonlocal asked
        # A player that is late hinders it, so an official asks again.
        state, now = match.observer.state, time.monotonic()
        if state.halted and not state.waiting and now - asked > 1.0:
            asked = now
            official.page.evaluate("document.querySelector('#resume').click()")
        return match.observer.playing

    match.observer.wait_until(goes_on, "play to go on")
    official.close()


def _restart(match: LiveMatch, viewer: Visitor) -> None:
    """The process that serves the page dies and comes back, and the page with it; play goes on."""
    assert viewer.errors == []
    old = match.child("web")
    old.kill()
    viewer.wait_text("#link-words", "connection is lost")
    match.wait_replaced("web", old)
    viewer.wait("vrg.link.open")
    match.observer.look()
    assert match.observer.playing or match.observer.stalled


def _assert_nowhere(tokens: list[str], run: Path, launcher: int) -> None:
    """No token is in a file of the run, nor in the arguments or the environment of a process."""
    places = [path.read_bytes() for path in run.rglob("*") if path.is_file()]
    for process in [psutil.Process(launcher), *psutil.Process(launcher).children(recursive=True)]:
        places += [Path(f"/proc/{process.pid}/{file}").read_bytes() for file in ("cmdline", "environ")]
    assert len(places) > 20
    assert not [token for token in tokens if any(os.fsencode(token) in place for place in places)]
