"""The page of an event: the timetable, a countdown, and the officials' buttons."""

import time
from importlib.resources import files
from typing import Any, Final

import msgspec
from aiohttp import web
from msgspec import Struct

from vrg.ui.web.admission import is_token
from vrg.ui.web.parts import encode
from vrg.ui.web.site import Site
from vrg_class.event.timetable import Event

ACTS: Final = ("begin", "hold", "go on", "again")


class Act(Struct, frozen=True, forbid_unknown_fields=True):
    """What an official wants: the next match now, none until `go on`, or the last one once more."""

    act: str


class EventSite(Site):
    """Serves the page of an event.

    Args:
        host, port: as for `Site`. event: what it shows. page: the port of the page of a match. token: of the officials.
    """

    def __init__(self, host: str, port: int, event: Event, page: int, token: str) -> None:
        super().__init__(host, port, "event.html", own=files("vrg_class") / "static")
        self._event, self._match_page, self._token = event, page, token

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what pages ask for."""
        router.add_get("/state", self._state)
        router.add_post("/act", self._act)

    async def _state(self, request: web.Request) -> web.Response:
        if (refused := self.turned_away(request)) is not None:
            return refused
        self.let_in(request, "")
        found: dict[str, Any] = self._event.state() | {"now": time.time(), "page": self._match_page}
        return web.Response(text=encode(found), content_type="application/json")

    async def _act(self, request: web.Request) -> web.Response:
        if (refused := self.turned_away(request)) is not None:
            return refused
        if not is_token(self.token_of(request), self._token):
            return web.Response(status=401, text="this needs the officials' link")
        self.let_in(request)
        try:
            act = msgspec.json.decode(await request.read(), type=Act).act
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            return web.Response(status=400, text=f"expected an act: {error}")
        if act not in ACTS:
            return web.Response(status=400, text=f"expected one of {', '.join(ACTS)}, got {act!r}")
        event = self._event
        if act in ("hold", "go on"):
            event.held = act == "hold"
        elif act == "begin" and event.playing is None:
            event.begun, event.held = True, False
        elif act == "again" and event.playing is None and event.outcomes:
            event.again = True
        return web.Response(text="{}", content_type="application/json")
