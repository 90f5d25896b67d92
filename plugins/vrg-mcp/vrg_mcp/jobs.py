"""Games and pictures are made in processes of their own, one at a time, and ended when they take too long."""

import asyncio
import json
import logging
import signal
import socket
import tempfile
from contextlib import suppress
from typing import Any, Final

import anyio
import anyio.to_thread

from vrg.errors import ConfigError
from vrg_league.game_process import server_for
from vrg_mcp import work

LONGEST: Final = 50.0
"""The real time in s after which a call is ended; many clients wait 60 s for an answer."""
GRACE: Final = 6.0
"""The real time in s that it then has to tell how far it came."""
WAITING: Final = 4
"""The number of calls that run or wait; further ones are refused."""
_SIZE: Final = 4_000_000
"""The number of bytes of an answer."""
_LOG: Final = 20_000
"""The bytes of what a process has printed that are logged if it does not answer."""


log = logging.getLogger(__name__)


class Jobs:
    """Makes games and pictures in processes of their own, one at a time. It is closed at the end.

    Args:
        longest: the real time that a call may take, s.
    """

    def __init__(self, longest: float = LONGEST) -> None:
        self._longest = longest
        self._server = server_for("sharks-and-minnows", "planar", work.__name__, "vrg.playing.strategy_process")
        self._turn = anyio.Lock()
        self._asked = 0

    def close(self) -> None:
        """End the server of the processes, and with it all of them. Idempotent."""
        self._server.close()

    async def run(self, kind: str, **arguments: object) -> dict[str, Any]:
        """Let a process do something, and return its answer; see `vrg_mcp.work`.

        Args:
            kind: of the work.

        Raises:
            ConfigError: too many calls wait, or it took too long. VrgError: it could not be done.
        """
        if self._asked >= WAITING:
            raise ConfigError(f"one game is played at a time, and {WAITING - 1} calls wait: call again when they end")
        self._asked += 1
        try:
            async with self._turn:
                found = await self._answer(json.dumps({"kind": kind, **arguments}).encode())
        finally:
            self._asked -= 1
        if "problem" in found:
            raise work.WorkError(str(found["problem"]))
        return found

    async def _answer(self, task: bytes) -> dict[str, Any]:
        with tempfile.TemporaryFile() as output:
            with anyio.CancelScope(shield=True):
                child = await anyio.to_thread.run_sync(self._server.run, work.__name__, (), output)
            try:
                reader, writer = await asyncio.open_connection(sock=socket.socket(fileno=child.detached()), limit=_SIZE)
                writer.write(task + b"\n")
                line, late = b"", False
                with suppress(OSError, ValueError):  # it has ended
                    for patience in (self._longest, GRACE):
                        with anyio.move_on_after(patience):
                            line = await reader.readline()
                            break
                        late = True
                        child.send_signal(signal.SIGTERM)
                writer.close()
            finally:
                child.kill()
                with anyio.CancelScope(shield=True):
                    await anyio.to_thread.run_sync(child.wait, 2.0)
            if not line:
                output.seek(0)
                log.error("%s", output.read(_LOG).decode("utf-8", "replace"))
                why = f"took more than {self._longest:g} s" if late else "has ended without an answer"
                raise ConfigError(f"the process {why}: ask for less, such as fewer seconds or games")
            return json.loads(line)  # type: ignore[no-any-return]
