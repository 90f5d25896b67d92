"""Serves pages by aiohttp, in its own thread: static files, and what a kind of page adds to them."""

import asyncio
import contextlib
import logging
import socket
import ssl
import threading
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any, Final

from aiohttp import web
from aiohttp.http import HttpProcessingError
from aiohttp.web import RequestPayloadError

from vrg.bus.entrance import WaitingRoom
from vrg.bus.mailbox import is_power_of_ten
from vrg.errors import LaunchError
from vrg.ui.web.admission import tls_context
from vrg.ui.web.headers import PAGE_HEADERS, foreign

log = logging.getLogger(__name__)
_http_log = log.getChild("http")
"""The log of aiohttp: a client that sends no valid request gets an answer, and cannot fill the log."""
_http_log.setLevel(logging.WARNING)
_http_log.addFilter(
    lambda record: not (record.exc_info and isinstance(record.exc_info[1], (HttpProcessingError, RequestPayloadError)))
)

PAGE_TIMEOUT: Final = 10.0
"""The real time in s that a browser has to say who it is, or to take what it is sent."""
HANDSHAKE: Final = 3.0
"""The real time in s that a browser has to agree on how a connection is encrypted."""
_TYPES: Final = {"html": "text/html", "css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}
WAITING: Final = 256
"""The limit of connections that have not introduced themselves. A browser opens some for the page itself."""
VISIT: Final = 30.0
"""The real time in s that such a connection stays."""
VISITORS: Final = 384
"""The limit of connections of those who have, but for officials and for what is bounded in another way.

With those that wait they leave some of the 1,024 files that a process may commonly have open."""
KEEP_ALIVE: Final = 15.0
"""The real time in s that a connection stays between two requests."""
_ALWAYS: Final = 86_400.0
"""The real time in s that a visitor may take: only a crowd of others, or the end of its keep-alive, makes it leave."""
_AT_ONCE: Final = 64
"""The number of connections that are taken before any of them is looked at."""


class Site:
    """Serves the files of a page from `start` to `stop`. All methods are for another thread, and none of them waits.

    Args:
        host: the address that is listened on. port: its port. page: the file that is served at the top.
        script: the file of its program, where another one takes the place of `main.js`.
        certificate, private_key: of the page, in PEM; empty serves it without encryption.
        own: a folder with further files, which a page of another package has; None for none.
        named: a further name by which browsers reach this machine; empty for none.
    """

    def __init__(
        self,
        host: str,
        port: int,
        page: str,
        certificate: str = "",
        private_key: str = "",
        *,
        script: str = "main.js",
        own: Traversable | None = None,
        named: str = "",
    ) -> None:
        self._named = named
        self._host, self._port, self._page, self._script = host, port, page, script
        self._folders = [files("vrg.ui.web") / "static", *([] if own is None else [own])]
        self._certificate, self._private_key = certificate, private_key
        self._waiting, self._visitors = WaitingRoom(WAITING, VISIT), WaitingRoom(VISITORS, _ALWAYS)
        self._troubles = Counter[str]()
        self._foreign = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stopping = asyncio.Event()
        self._ready = threading.Event()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="web server", daemon=True)

    def start(self) -> None:
        """Open the port.

        Raises:
            LaunchError: it cannot be opened.
        """
        self._thread.start()
        self._ready.wait(PAGE_TIMEOUT)
        self.check()

    def check(self) -> None:
        """Make sure that the page is served.

        Raises:
            LaunchError: it is not.
        """
        if self._failure is not None:
            where = f"{self._host}, port {self._port}"
            raise LaunchError(f"the page cannot be served at {where}: {self._failure}") from self._failure

    def stop(self) -> None:
        """Tell all pages that this is the end, and close the port. Idempotent."""
        if self._loop is not None and self._thread.is_alive():
            with contextlib.suppress(RuntimeError):  # it has just closed its loop, as where the port is taken
                self._loop.call_soon_threadsafe(self._stopping.set)
            self._thread.join(PAGE_TIMEOUT / 4)

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what there is besides files."""

    def add_files(self, router: web.UrlDispatcher, folder: Traversable, below: str = "/") -> None:
        """Add the files of a folder, by addresses that begin with `below`."""
        for file in folder.iterdir():
            kind = _TYPES.get(file.name.rpartition(".")[2])
            if kind is not None:
                path, body = f"{below}{file.name}", file.read_bytes()
                if path == f"/{self._page}":
                    path, body = "/", body.replace(b'src="main.js"', f'src="{self._script}"'.encode())
                router.add_get(path, _file(body, kind))

    async def dismiss(self) -> None:
        """Tell the pages that this is the end."""

    def turned_away(self, request: web.Request) -> web.Response | None:
        """The answer to a request that may be another site's doing; None to one of the page."""
        try:
            origin, machine = request.headers.get("Origin"), socket.gethostname()
            why, status = foreign(origin, request.host, self._host, machine, self._named), 403
        except ValueError as error:
            why, status = f"expected an address in Host and Origin: {error}", 400
        if not why:
            return None
        self._foreign += 1
        if is_power_of_ten(self._foreign):
            log.warning("refused a connection (number %d): %s", self._foreign, why)
        return web.Response(status=status, text=why)

    @staticmethod
    def token_of(request: web.Request) -> str:
        """The token that a request offers; empty for none."""
        return request.headers.get("Authorization", "").removeprefix("Bearer ")

    def let_in(self, request: web.Request, who: str | None = None) -> None:
        """Take in that it is known who is there: the connection may stay.

        Args:
            who: asks, such as a token; empty for the address. If there are too many connections, those of whom most are
                go first. None for officials, and where others bound the number.
        """
        if request.transport is not None:
            self._waiting.leave(request.transport)
            self._visitors.leave(request.transport)
            if who is not None:
                self._visitors.come(request.transport, who)

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except BaseException as error:  # whatever it is, the owner must learn that no page is served any more
            log.exception("the page's server has failed")
            self._failure = error
        finally:
            self._ready.set()

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._loop.set_exception_handler(self._log_trouble)
        app = web.Application()
        app.on_response_prepare.append(_add_headers)
        self.add_routes(app.router)
        for folder in self._folders:
            self.add_files(app.router, folder)
        runner = web.AppRunner(app, handle_signals=False, shutdown_timeout=1.0)
        await runner.setup()
        try:
            handlers, rooms = runner.server, (self._waiting, self._visitors)
            assert handlers is not None
            try:
                tls = tls_context(self._certificate, self._private_key) if self._certificate else None
                site = await self._loop.create_server(
                    lambda: _Greeting(rooms, handlers, tls) if tls else _Connection(rooms, handlers),
                    self._host,
                    self._port,
                    backlog=_AT_ONCE,
                )
            except OSError as error:
                self._failure = error
                return
            log.info("serving the page at %s, port %d", self._host, self._port)
            self._ready.set()
            await self._stopping.wait()
            site.close()
            await self.dismiss()
        finally:
            await runner.cleanup()

    def _log_trouble(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Log what the loop could not do, the same thing ever more rarely."""
        what = context.get("message", "")
        self._troubles[what] += 1
        if is_power_of_ten(self._troubles[what]):
            loop.default_exception_handler(context)


class _Greeting(asyncio.Protocol):
    """A connection whose encryption is being agreed on. It waits in a room, too, unlike that of a server with `ssl`."""

    def __init__(self, rooms: Sequence[WaitingRoom], server: web.Server, tls: ssl.SSLContext) -> None:
        self._rooms, self._server, self._tls = rooms, server, tls
        self._early = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        transport.pause_reading()
        self._rooms[0].come(transport)
        self._agreeing = asyncio.get_running_loop().create_task(self._agree(transport))

    def data_received(self, data: bytes) -> None:
        self._early += data  # it came with the end of the handshake

    async def _agree(self, transport: asyncio.Transport) -> None:
        start = asyncio.get_running_loop().start_tls
        try:
            secured = await start(transport, self, self._tls, server_side=True, ssl_handshake_timeout=HANDSHAKE)
        except OSError as error:
            log.debug("a connection was not encrypted: %s", error)
            return
        finally:
            self._rooms[0].leave(transport)
        if secured is None or secured.is_closing():
            return
        connection = _Connection(self._rooms, self._server)
        secured.set_protocol(connection)
        connection.connection_made(secured)
        if self._early:
            connection.data_received(self._early)


class _Connection(web.RequestHandler):
    """A connection of aiohttp's that waits in the first of some rooms until it is known who is there."""

    __slots__ = ("_rooms",)

    def __init__(self, rooms: Sequence[WaitingRoom], server: web.Server) -> None:
        loop = asyncio.get_running_loop()
        super().__init__(
            server, loop=loop, logger=_http_log, access_log=_http_log, auto_decompress=False,
            keepalive_timeout=KEEP_ALIVE,
        )  # fmt: skip
        self._rooms = rooms

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if isinstance(transport, asyncio.Transport):
            self._rooms[0].come(transport)

    def connection_lost(self, exc: BaseException | None) -> None:
        if self.transport is not None:
            for room in self._rooms:
                room.leave(self.transport)
        super().connection_lost(exc)


def _file(body: bytes, kind: str) -> Callable[[web.Request], Awaitable[web.Response]]:
    async def handler(_request: web.Request) -> web.Response:
        return web.Response(body=body, content_type=kind, charset="utf-8")

    return handler


async def _add_headers(_request: web.Request, response: web.StreamResponse) -> None:
    for name, value in PAGE_HEADERS.items():
        response.headers.setdefault(name, value)
