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
from vrg.launch.fork_server import Child, ForkServer
from vrg_league.game_process import server_for
from vrg_mcp import work
from vrg_mcp.answers import as_table

LONGEST: Final = 50.0
"""The real time in s after which a call is ended; many clients wait 60 s for an answer."""
GRACE: Final = 6.0
"""The real time in s that it then has to tell how far it came."""
WAITING: Final = 4
"""The number of calls that run or wait; further ones are refused."""
_SIZE: Final = 4_000_000
"""The number of bytes of an answer."""


log = logging.getLogger(__name__)


class Jobs:
    """See the module. It is closed at the end.

    Args:
        longest: the real time that a call may take, s.
    """

    def __init__(self, longest: float = LONGEST) -> None:
        self._longest = longest
        self._server: ForkServer = server_for("sharks-and-minnows", "planar", work.__name__, "vrg.playing.deciding")
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
            raise ConfigError(f"one game is played at a time, and {WAITING - 1} calls wait: call again when they ended")
        self._asked += 1
        try:
            async with self._turn:
                found = await self._answer(json.dumps({"kind": kind, **arguments}).encode(), self._longest)
        finally:
            self._asked -= 1
        if "problem" in found:
            raise work.WorkError(str(found["problem"]))
        return found

    async def _answer(self, task: bytes, longest: float) -> dict[str, Any]:
        with tempfile.TemporaryFile() as output:
            with anyio.CancelScope(shield=True):
                child = await anyio.to_thread.run_sync(self._server.run, work.__name__, (), output)
            writer: asyncio.StreamWriter | None = None
            try:
                ours = socket.socket(fileno=child.detached())
                reader, writer = await asyncio.open_connection(sock=ours, limit=_SIZE)
                writer.write(task + b"\n")
                line = b""
                with anyio.move_on_after(longest) as patience:
                    line = await reader.readline()
                if patience.cancelled_caught:
                    child.send_signal(signal.SIGTERM)
                    with anyio.move_on_after(GRACE):
                        line = await reader.readline()
                if not line:
                    output.seek(0)
                    log.error("%s", output.read(20_000).decode("utf-8", "replace"))
                    why = (
                        f"took more than {longest:g} s" if patience.cancelled_caught else "has ended without an answer"
                    )
                    raise ConfigError(f"the process {why}: ask for less, such as fewer seconds or games")
                return as_table(json.loads(line))
            except OSError as error:
                output.seek(0)
                log.error("%s", output.read(20_000).decode("utf-8", "replace"))
                raise ConfigError(f"the process has ended without an answer: {error.strerror}") from None
            finally:
                if writer is not None:
                    writer.close()
                with anyio.CancelScope(shield=True):
                    await anyio.to_thread.run_sync(_end, child)


def _end(child: Child) -> None:
    with suppress(ProcessLookupError):
        child.kill()
        child.wait(2.0)
