"""The pages of an event: the stage, spectators, officials, and the match on the field, all at one address."""

import asyncio
import html
from collections.abc import Callable
from importlib.resources import files
from typing import Any, Final
from urllib.parse import urlsplit

import msgspec
from aiohttp import ClientSession, TCPConnector, web
from msgspec import Struct

from vrg.seats.folder import LOCAL_HOSTS
from vrg.ui.web.admission import is_token
from vrg.ui.web.headers import PAGE_HEADERS
from vrg.ui.web.parts import encode
from vrg_class.event.proxy import FRAMED, Proxy
from vrg_class.event.running import Running
from vrg_class.languages import words
from vrg_class.links import Served
from vrg_class.site import DaySite, RefusalError, language_of, read

FRAMING: Final = PAGE_HEADERS["Content-Security-Policy"] + "; frame-src 'self'; child-src 'self'"
"""The rules of a page that shows the match in a frame."""
_NOBODY: Final = """<!DOCTYPE html><html lang="{tag}"><meta charset="utf-8"><meta http-equiv="refresh" content="5">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>VRG</title>
<link rel="stylesheet" href="/event.css"><body class="nobody"><p>{nobody}</p><a href="/">{back}</a></body></html>"""
"""The page in place of that of a match that is not there. It tries again by itself."""


class Act(Struct, frozen=True, forbid_unknown_fields=True):
    """What an official wants.

    Args:
        act: one of `begin`, `hold`, `go on`, `confirm`, `stop`, `again`, `correct` and `title`. n: the number of the
            match that it is about. score, winner, reason: of a correction. title: the new one.
    """

    act: str
    n: int = 0
    score: dict[str, int] = {}
    winner: str = ""
    reason: str = ""
    title: str = ""


class EventSite(DaySite):
    """Serves the pages of an event, and runs it while it does.

    Args:
        at: where. running: the event.
    """

    def __init__(self, at: Served, running: Running) -> None:
        super().__init__(at, "event.html")
        self._official, self._running, self._event = at.page.official, running, running.event
        self._listed: tuple[int, dict[str, msgspec.Raw]] = (-1, {})
        base = at.bases()[0][0]
        self._link = "" if urlsplit(base).hostname in LOCAL_HOSTS else base

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what pages ask for, and begin to run the event."""
        super().add_routes(router)
        router.add_get("/state", self.told(self._state))
        router.add_post("/act", self.told(self._act))
        router.add_get("/stage.html", self._stage)
        for name in ("csv", "json"):
            router.add_get(f"/results.{name}", self._results)
        router.add_get("/match/{path:[A-Za-z0-9_./-]*}", self._match)
        self._going = asyncio.get_running_loop().create_task(self._go())

    async def _go(self) -> None:
        async with ClientSession(connector=TCPConnector(limit=0)) as session:  # the rooms of the server bound them
            self._proxy = Proxy(session)
            await self._running.go(session)

    async def dismiss(self) -> None:
        """End what runs in the loop."""
        self._going.cancel()
        await asyncio.gather(self._going, return_exceptions=True)

    def _is_official(self, request: web.Request) -> bool:
        """An official asks.

        Raises:
            RefusalError: a token is offered, and is another one.
        """
        token = self.token_of(request)
        if token and not is_token(token, self._official):
            raise RefusalError("officials", 401)
        self.let_in(request, None if token else "")
        return bool(token)

    async def _state(self, request: web.Request) -> Any:
        official, page = self._is_official(request), self._running.field.page
        found = self._event.state(self._running.now()) | {"link": self._link}
        if request.query.get("since", "") != str(found["version"]):
            found |= self._listing(found["version"])
        if official and page is not None:
            found["seats"] = page.seats
        if not official and found["held"] is not None:
            found["held"] = {"why": found["held"]["why"]}  # the words may have paths of this computer
        return found

    def _listing(self, version: int) -> dict[str, msgspec.Raw]:
        """What changes with the version alone, as bytes: a crowd asks for it, and it is made once."""
        if self._listed[0] != version:
            raw = {key: msgspec.Raw(encode(part).encode()) for key, part in self._event.listing().items()}
            self._listed = version, raw
        return self._listed[1]

    async def _act(self, request: web.Request) -> Any:
        if not self._is_official(request):
            raise RefusalError("officials", 401)
        wanted, event, now = await read(request, Act), self._event, self._running.now()
        acts: dict[str, Callable[[], None]] = {
            "begin": lambda: event.begin(now), "hold": lambda: event.hold(now, "official"),
            "go on": lambda: event.go_on(now), "confirm": lambda: event.confirm(now), "stop": event.stop,
            "again": lambda: event.again(wanted.n, now), "title": lambda: event.rename(wanted.n, wanted.title),
            "correct": lambda: event.correct(wanted.n, wanted.score, wanted.winner, wanted.reason),
        }  # fmt: skip
        if wanted.act not in acts:
            raise RefusalError("request", words=repr(wanted.act[:20]))
        acts[wanted.act]()
        if not await self._running.keep():  # what an official has decided is written before it is answered
            raise RefusalError("disk", 507, words=(event.held or {}).get("words", ""))
        return {}

    async def _stage(self, request: web.Request) -> web.StreamResponse:
        body = (files("vrg_class") / "static" / "event_stage.html").read_bytes()
        headers = {"Content-Security-Policy": FRAMING}
        return web.Response(body=body, content_type="text/html", charset="utf-8", headers=headers)

    async def _results(self, request: web.Request) -> web.StreamResponse:
        """A file of results, as it was written last: a crowd may ask for it."""
        if (refused := self.turned_away(request)) is not None:
            return refused
        name = request.path.removeprefix("/")
        kind = "text/csv" if name.endswith(".csv") else "application/json"
        headers = {"Content-Disposition": f'attachment; filename="{name}"'}
        body = self._running.files.get(name, b"")
        return web.Response(body=body, content_type=kind, charset="utf-8", headers=headers)

    async def _match(self, request: web.Request) -> web.StreamResponse:
        """What belongs to the page of the match on the field."""
        if (refused := self.turned_away(request)) is not None:
            return refused
        page, path = self._running.field.page, request.match_info["path"]
        if page is not None and path == "socket":
            return await self._proxy.socket(page, request, self.let_in)
        if page is not None and (found := await self._proxy.file(page, path)) is not None:
            return found
        tag = language_of(request, words())
        told = {name: html.escape(str(words()[tag]["event"][name])) for name in ("nobody", "back")}
        text, headers = _NOBODY.format(tag=tag, **told), {"Content-Security-Policy": FRAMED}
        return web.Response(status=404 if path else 200, text=text, content_type="text/html", headers=headers)
