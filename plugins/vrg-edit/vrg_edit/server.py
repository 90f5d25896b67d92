"""The server of the configurator's page: one that holds its token asks, and an editor answers."""

import asyncio
import secrets
import threading
from importlib.resources import files
from typing import Any, Final

from aiohttp import web

from vrg.ui.web.admission import TOKEN_BYTES, is_token
from vrg.ui.web.parts import encode
from vrg.ui.web.site import Site
from vrg_edit.editor import Editor, NextStep
from vrg_edit.requests import Check, read_request

HOST: Final = "127.0.0.1"
"""The page writes files and plays matches as the user who has begun it, so only this machine is served."""


class EditServer(Site):
    """Serves the page from `start` to `stop`.

    A request needs a token. `link` carries one for as long as the page is served. `ticket` carries one that the
    first page uses up, because everybody on this machine can read the command that opens a browser.

    Args:
        editor: answers. port: of the page.
    """

    def __init__(self, editor: Editor, port: int) -> None:
        super().__init__(HOST, port, "edit.html", own=files("vrg_edit") / "static")
        self._editor = editor
        self._token, self._ticket = secrets.token_urlsafe(TOKEN_BYTES), secrets.token_urlsafe(TOKEN_BYTES)
        self._turn, self._checking = threading.Lock(), threading.Lock()
        self._over = threading.Event()
        self.link, self.ticket = (f"http://{HOST}:{port}/#{token}" for token in (self._token, self._ticket))

    def wait(self, patience: float) -> NextStep | None:
        """Return the request of the person, once it is answered; None if nothing has arrived within `patience`, s.

        Raises:
            LaunchError: the page is not served any more.
        """
        self.check()
        return self._editor.outcome if self._over.wait(patience) else None

    def rescue(self) -> str:
        """Keep what is not saved; return a sentence about it, which is empty if all is saved."""
        with self._turn:
            return self._editor.rescue()

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what answers, and what gives the lasting token for a ticket."""
        router.add_post("/edit", self._answer)
        router.add_post("/ticket", self._exchange)

    def _refused(self, request: web.Request, own: str) -> web.Response | None:
        refused = self.turned_away(request)
        if refused is None and not is_token(self.token_of(request), own):
            refused = web.Response(status=401, text="expected the token of the link that the terminal shows")
        return refused

    async def _exchange(self, request: web.Request) -> web.Response:
        if self._refused(request, self._token) is not None:
            if (refused := self._refused(request, self._ticket)) is not None:
                return refused
            self._ticket = ""
        return web.Response(text=self._token)

    async def _answer(self, request: web.Request) -> web.StreamResponse:
        if (refused := self._refused(request, self._token)) is not None:
            return refused
        self.let_in(request)
        try:
            answer = await asyncio.to_thread(self._work, await request.read())
        except ValueError as error:
            return web.Response(status=400, text=str(error))
        response = web.Response(text=encode(answer), content_type="application/json")
        try:
            await response.prepare(request)
            await response.write_eof()
        finally:  # also where the browser has gone meanwhile
            if self._editor.outcome is not None:
                self._over.set()
        return response

    def _work(self, text: bytes) -> dict[str, Any]:
        wanted = read_request(text)
        if isinstance(wanted, Check):
            # A check imports strategies, which may take long; nothing waits for it to go on.
            with self._checking:
                self._editor.check()
        with self._turn:
            return self._editor.answer(wanted)
