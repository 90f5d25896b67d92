"""An event whose matches are not played, but shown by a page of their own, until a test ends them."""

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from aiohttp import ClientSession

from vrg.bus.messages import Call, Stage
from vrg.commands.page import encrypted
from vrg.launch.endpoints import free_port
from vrg.ui.scene import Scene
from vrg.ui.web.admission import Admission
from vrg.ui.web.parts import call, parts
from vrg.ui.web.server import WebServer
from vrg_class.event.course import Event, Live, Report
from vrg_class.event.field import Field
from vrg_class.event.outcomes import Kept, Match
from vrg_class.event.plan import Game
from vrg_class.event.running import EventClock, Running
from vrg_class.event.site import EventSite
from vrg_class.event.timetable import Timetable
from vrg_class.event.watching import LOOPBACK, watch
from vrg_class.links import Served

TOKEN, SEAT = "officials-token", "seat-token-of-ann"
SIDES = ("sharks", "minnows")
SCENE = Scene(
    live=True, game="sharks-and-minnows", stage=Stage.PLAY_ROUND, clock=12.3, round=1, rounds=3,
    score=(("sharks", 2), ("minnows", 1)),
)  # fmt: skip
LINING_UP = replace(SCENE, stage=Stage.INITIALIZE, waiting=("ann is not at its mark",), clock=0.0)


class ShownMatch(Field):
    """Plays matches that last until `report` is there; `shown` serves the page of each."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, folder, TOKEN, [], paged=True)
        self.report: Report | None = None
        self.shown: WebServer | None = None
        self.played: list[Match] = []

    async def play(
        self, match: Match, session: ClientSession, hear: Callable[[Live | None], None], stopping: Callable[[], bool]
    ) -> Report:
        self.played.append(match)
        self.page = Admission(LOOPBACK, free_port(LOOPBACK, 18471, tries=300), TOKEN, {"ann": SEAT})
        watching = asyncio.create_task(watch(session, self.page, hear))
        try:
            while self.report is None and not stopping():
                await asyncio.sleep(0.02)
        finally:
            watching.cancel()
            self.page = None
        report, self.report = self.report or Report(why="not_begun"), None
        return report

    def show(self, scene: Scene = SCENE) -> None:
        """Show the match on a page, from now on."""
        if self.shown is None:
            assert self.page is not None
            self.shown = WebServer(self.page, "tiny")
            self.shown.start()
        told = [call(one, scene.game) for one in (Call(number=1, rule="round", text="pass 1 of 3 begins"),)]
        self.shown.show(parts(scene), told)

    def hide(self) -> None:
        """Let the page of the match die."""
        if self.shown is not None:
            self.shown.stop()
            self.shown = None


class Day:
    """An event that runs, and its pages.

    Attributes:
        base: the address of the spectators' page.
    """

    def __init__(self, folder: Path, table: Timetable, game: Game, *, tls: bool = False) -> None:
        page = Admission(LOOPBACK, free_port(LOOPBACK, 18271, tries=200), TOKEN)
        page = encrypted(page) if tls else page
        self.field, clock = ShownMatch(folder), EventClock()
        self.event = Event(table, [game] * len(table.matches), Kept(), clock.now())
        self.running = Running(self.event, self.field, clock, folder)
        self.site = EventSite(Served(page, "robots.example", page.port), self.running)
        self.base = f"{'https' if tls else 'http'}://{LOOPBACK}:{page.port}/"


@contextmanager
def day(
    folder: Path, titles: Sequence[str] = ("Ann against Bob", "Cid against Dee"), *, tls: bool = False, **more: Any
) -> Iterator[Day]:
    """An event of single matches that begin when an official wants them to."""
    matches = [{"match": "x", "title": title} for title in titles]
    table = Timetable.model_validate({"title": "Open day", "pause": 300.0, "matches": matches} | more)
    made = Day(folder, table, Game(SIDES, 2), tls=tls)
    made.event.hold(0.0, "official")
    made.site.start()
    try:
        yield made
    finally:
        made.field.hide()
        made.running.close()
        made.site.stop()
