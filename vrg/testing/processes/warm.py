"""Fork servers that the tests of a process share.

To start one takes about a second, as it loads VRG, and what it forks is as fresh as what a new one forks.
"""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence

from vrg.launch import forking
from vrg.launch.fork_server import ForkServer


class Warm(ForkServer):
    """A server that stays when somebody has done with it."""

    def close(self, patience: float = 1.0) -> None:
        """Close it only if it has died or is frozen: it then closes itself, with no patience."""
        if patience == 0.0:
            super().close(0.0)

    def end(self) -> None:
        """Close it for good."""
        super().close()


class WarmServers:
    """The servers, by what they have loaded. Each is started when it is first wanted, and again if it has died."""

    def __init__(self) -> None:
        self._servers: dict[tuple[str, ...], Warm] = {}

    @contextlib.contextmanager
    def fork_server(self, *, wanted: bool = True, preload: Sequence[str] = forking.PRELOADED) -> Iterator[ForkServer]:
        """As `vrg.launch.fork_server.fork_server`."""

        def started() -> Warm:
            server = Warm()
            server.start(preload)
            return server

        yield self.kept(started, *preload) if wanted else ForkServer()

    def kept(self, start: Callable[[], Warm], *words: str) -> Warm:
        """The server for these words, which is started if none is there that works."""
        key = (*words, os.environ.get("PYTHONPATH", ""))
        server = self._servers.get(key)
        if server is None or not server.alive or server.frozen():
            # The folder where a test is now may be gone when the next one runs.
            with contextlib.chdir("/"):
                server = self._servers[key] = start()
        return server

    def end(self) -> None:
        """End all."""
        for server in self._servers.values():
            server.end()
