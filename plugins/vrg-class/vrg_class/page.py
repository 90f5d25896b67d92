"""A page that listens: what the server sends it waits until it takes it, in batches."""

import asyncio
import contextlib
from collections import deque
from typing import Final

from aiohttp import web

HELLO: Final = 10.0
"""The real time in s in which a page must send its token, and take a batch."""
_BATCH: Final = 0.05
"""The real time in s for which messages to a page are gathered."""
_BATCH_SIZE: Final = 500
"""The number of messages that go to a page in one of the network's."""


class Page:
    """A page that listens; what it is sent waits here until it takes it."""

    def __init__(self, socket: web.WebSocketResponse) -> None:
        self.socket = socket
        self.waiting: deque[str] = deque()
        self.news = asyncio.Event()

    def send(self, text: str) -> None:
        """Send a message, a text of JSON."""
        self.waiting.append(text)
        self.news.set()

    async def serve(self) -> None:
        """Send what waits, in batches, until the page is gone or takes nothing any more."""
        with contextlib.suppress(TimeoutError, ConnectionError):
            while not self.socket.closed:
                await self.news.wait()
                self.news.clear()
                while self.waiting:
                    batch = [self.waiting.popleft() for _ in range(min(len(self.waiting), _BATCH_SIZE))]
                    await asyncio.wait_for(self.socket.send_str(f"[{','.join(batch)}]"), HELLO)
                await asyncio.sleep(_BATCH)
        await self.socket.close()
