"""Passes what browsers ask of the page of the match on to its server, which only this computer reaches."""

import asyncio
from collections import Counter
from collections.abc import Callable
from typing import Any, Final

from aiohttp import ClientError, ClientSession, ClientTimeout, WSCloseCode, WSMsgType, web

from vrg.ui.web.admission import Admission
from vrg.ui.web.headers import PAGE_HEADERS
from vrg.ui.web.requests import REQUEST_LIMIT, Hello, read_request
from vrg_class.event.watching import LARGEST, LOOPBACK

VIEWERS: Final = 60
"""The viewers that watch a match through this; the page of a match has 64 places."""
_PATIENCE: Final = 8.0
"""The real time in s that either side has to answer, or to take what it is sent."""
_PING: Final = 10.0
"""The real time in s between two signs of life that are asked of a browser."""
FRAMED: Final = PAGE_HEADERS["Content-Security-Policy"].replace("frame-ancestors 'none'", "frame-ancestors 'self'")
"""The rules of a page that another page of the same address may show."""


class Proxy:
    """Passes requests of browsers on to the server of the page of the match. It is for the loop of the server."""

    def __init__(self, session: ClientSession) -> None:
        self._session = session
        self._viewers: dict[asyncio.BaseTransport, str] = {}

    def has_room(self, viewer: asyncio.BaseTransport, address: str) -> bool:
        """Take a viewer in, if there is room. One of an address with several makes room; else who was first stays."""
        if len(self._viewers) >= VIEWERS:
            crowd, count = Counter(self._viewers.values()).most_common(1)[0]
            if count == 1:
                return False
            oldest = next(other for other, its in self._viewers.items() if its == crowd)
            del self._viewers[oldest]
            if isinstance(oldest, asyncio.Transport):
                oldest.abort()
        self._viewers[viewer] = address
        return True

    async def file(self, page: Admission, path: str) -> web.Response | None:
        """A file of the page; None if it does not answer."""
        url = f"http://{LOOPBACK}:{page.port}/{path}"
        try:
            async with self._session.get(url, timeout=ClientTimeout(_PATIENCE), allow_redirects=False) as answer:
                body = await answer.read()
        except (ClientError, OSError, TimeoutError, ValueError):
            return None
        headers = {"Content-Type": answer.headers.get("Content-Type", "text/plain"), "Content-Security-Policy": FRAMED}
        return web.Response(body=body, status=answer.status, headers=headers)

    async def socket(
        self, page: Admission, request: web.Request, let_in: Callable[[web.Request], None]
    ) -> web.StreamResponse:
        """Let a browser talk to the page, until one of them ends it; `let_in` is called once it has said who it is."""
        browser = web.WebSocketResponse(heartbeat=_PING, max_msg_size=REQUEST_LIMIT, compress=False, timeout=1.0)
        transport, base = request.transport, f"http://{LOOPBACK}:{page.port}"
        try:
            await browser.prepare(request)
            hello = await browser.receive(_PATIENCE)
            if hello.type is not WSMsgType.TEXT or transport is None:
                return browser
            async with asyncio.timeout(_PATIENCE):
                match = await self._session.ws_connect(f"{base}/socket", origin=base, max_msg_size=LARGEST)
            async with match:
                let_in(request)
                # Officials and drivers have their own places.
                if not _is_known(page, hello.data) and not self.has_room(transport, request.remote or ""):
                    await browser.close(code=WSCloseCode.TRY_AGAIN_LATER)
                    return browser
                await match.send_str(hello.data)
                both = [asyncio.create_task(_pump(browser, match)), asyncio.create_task(_pump(match, browser))]
                try:
                    await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
                finally:
                    for task in both:
                        task.cancel()
                    await asyncio.gather(*both, return_exceptions=True)
            await browser.close(code=match.close_code or WSCloseCode.GOING_AWAY)
        except (ClientError, OSError, TimeoutError):
            await browser.close(code=WSCloseCode.TRY_AGAIN_LATER)  # one of them is gone
        finally:
            if transport is not None:
                self._viewers.pop(transport, None)
        return browser


def _is_known(page: Admission, hello: str) -> bool:
    """A browser offers a token of the page."""
    try:
        request = read_request(hello)
    except ValueError:
        return False
    return isinstance(request, Hello) and bool(request.token) and page.role_of(request.token) is not None


async def _pump(source: Any, target: Any) -> None:
    async for message in source:
        if message.type is WSMsgType.TEXT:
            async with asyncio.timeout(_PATIENCE):
                await target.send_str(message.data)
