"""A recorded match as a page. Each browser asks for the instants that it shows, so that everybody goes to their own."""

import math
import zlib
from typing import Final

from aiohttp import web

from vrg.ui.timeline import Timeline
from vrg.ui.web.parts import call, encode, parts, welcome
from vrg.ui.web.site import Site

FASTEST: Final = 16.0
"""The most match seconds per real second that a page plays."""


class ReplaySite(Site):
    """Serves the page of a live match with another script, which shows a time bar, and what that asks for.

    Args:
        host: the address that is listened on. port: its port. timeline: of the match. match: its name.
    """

    def __init__(self, host: str, port: int, timeline: Timeline, match: str) -> None:
        super().__init__(host, port, "index.html", script="replay.js")
        self._timeline, self._match = timeline, match
        self._kept: dict[str, tuple[object, str]] = {}

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what pages ask for."""
        router.add_get("/match", self._about)
        router.add_get("/at", self._at)

    async def _about(self, request: web.Request) -> web.Response:
        """What a page needs once: the bounds of time, s, and the calls on it."""
        if (refused := self.turned_away(request)) is not None:
            return refused
        self.let_in(request, "")
        line = self._timeline
        marks = [{"time": mark.time, "text": mark.text, "number": mark.call.number} for mark in line.calls]
        return _json(encode(welcome(self._match) | {"begin": line.begin, "end": line.end, "marks": marks}))

    async def _at(self, request: web.Request) -> web.Response:
        """The parts of the scene at a match time `t`, s, but for those in `have`, by the marks of their texts."""
        if (refused := self.turned_away(request)) is not None:
            return refused
        self.let_in(request, "")
        try:
            time, rate = float(request.query["t"]), float(request.query.get("rate", "1"))
            if not (math.isfinite(time) and 0.0 <= rate <= FASTEST):
                raise ValueError
        except (KeyError, ValueError):
            words = f"expected a match time such as /at?t=83.2, and a rate up to {FASTEST:g}"
            return web.Response(status=400, text=words)
        scene = self._timeline.at(min(max(time, self._timeline.begin), self._timeline.end), rate)
        texts = parts(scene, self._kept)
        texts["calls"] = f'{{"t":"calls","calls":[{",".join(call(one, scene.game) for one in scene.calls)}]}}'
        marks = {name: f"{zlib.crc32(text.encode()):x}" for name, text in texts.items()}
        known = set(request.query.get("have", "").split(","))
        new = [text for name, text in texts.items() if marks[name] not in known]
        return _json(f"[{','.join([*new, encode({'t': 'have', 'marks': list(marks.values())})])}]")


def _json(text: str) -> web.Response:
    return web.Response(text=text, content_type="application/json")
