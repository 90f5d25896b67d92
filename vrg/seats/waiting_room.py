"""A bound on connections whose other ends have not proved yet who they are."""

import asyncio
from collections import Counter


class WaitingRoom:
    """Holds connections until they are let in. It closes those that wait for too long, and some if too many wait.

    Args:
        limit: how many may wait. If more come, the oldest of the address that most of them come from is closed.
        patience: the real time in s that each may wait.
    """

    def __init__(self, limit: int, patience: float) -> None:
        self._limit, self._patience = limit, patience
        self._waiting: dict[asyncio.Transport, tuple[str, asyncio.TimerHandle]] = {}

    def come(self, transport: asyncio.Transport) -> None:
        """Let a connection wait. It is called on the loop of the connection."""
        address = (transport.get_extra_info("peername") or ("",))[0]
        timer = asyncio.get_running_loop().call_later(self._patience, transport.abort)
        self._waiting[transport] = address, timer
        if len(self._waiting) > self._limit:
            crowd, _ = Counter(its for its, _ in self._waiting.values()).most_common(1)[0]
            oldest = next(other for other, (its, _) in self._waiting.items() if its == crowd)
            self.leave(oldest)
            oldest.abort()

    def leave(self, transport: asyncio.Transport) -> None:
        """Forget a connection that is let in or closed. Idempotent."""
        if transport in self._waiting:
            _, timer = self._waiting.pop(transport)
            timer.cancel()
