"""A page that listens: what the server sends it waits until it takes it, in batches."""

import asyncio
import contextlib
from collections import deque
from typing import Final

from aiohttp import WSCloseCode, web

HELLO: Final = 10.0
"""The real time in s in which a page must send its token, and take a batch."""
_BATCH: Final = 0.05
"""The real time in s for which messages to a page are gathered."""
_MOST: Final = 50_000
"""The number of messages that wait for a page: more than a try has."""
_GOODBYE: Final = 1.0
"""The real time in s that a page may take to say that it has heard of the end."""
_BATCH_SIZE: Final = 500
"""The number of messages that go to a page in one of the network's."""


class Page:
    """A page that listens; what it is sent waits here until it takes it.

    Args:
        socket: of the page. transport: of its connection; None if it has gone.
    """

    def __init__(self, socket: web.WebSocketResponse, transport: asyncio.BaseTransport | None) -> None:
        self._socket, self._transport = socket, transport
        self._waiting: deque[str] = deque()
        self._news = asyncio.Event()
        self._leaving: asyncio.Task[None] | None = None

    def send(self, text: str) -> None:
        """Send a message, a text of JSON. A page that takes none of very many is left."""
        if len(self._waiting) < _MOST:
            self._waiting.append(text)
            self._news.set()
        elif self._leaving is None:
            self.leave(WSCloseCode.TRY_AGAIN_LATER)

    def leave(self, code: int) -> None:
        """End the connection, with a code that tells the page why. It waits for nothing."""
        self._waiting.clear()
        self._leaving = asyncio.get_running_loop().create_task(self._leave(code))

    async def _leave(self, code: int) -> None:
        with contextlib.suppress(TimeoutError, ConnectionError, RuntimeError):
            await asyncio.wait_for(self._socket.close(code=code), _GOODBYE)
        if isinstance(self._transport, asyncio.Transport):
            self._transport.abort()

    async def serve(self) -> None:
        """Send what waits, in batches, until the page is gone or takes nothing any more."""
        with contextlib.suppress(TimeoutError, ConnectionError):
            while not self._socket.closed:
                await self._news.wait()
                self._news.clear()
                while self._waiting:
                    batch = [self._waiting.popleft() for _ in range(min(len(self._waiting), _BATCH_SIZE))]
                    await asyncio.wait_for(self._socket.send_str(f"[{','.join(batch)}]"), HELLO)
                await asyncio.sleep(_BATCH)
        self.leave(WSCloseCode.TRY_AGAIN_LATER)
