"""The entrance of a router with seats: the public port, in front of several listeners of the router's own.

Each listener of zenoh's for TLS rests for 100 ms after a handshake that has failed, and lets none in meanwhile. So a
few hundred strangers would keep every newcomer out for half a minute, the emergency stop too. The entrance opens a
connection to the router only for a program that begins a handshake, to each listener in turn, so that a failed one
holds up only its own. It passes the bytes on as they are: seat and router encrypt and prove who they are, and it reads
nothing.
"""

import asyncio
import logging
import os
import random
import signal
import socket
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import cycle

from vrg.bus.configuration import BUFFER_SIZE
from vrg.hosts import host_of, port_of
from vrg.system import POSIX


class WaitingRoom:
    """Holds connections until they are admitted. It closes those that wait for too long, and some if too many wait.

    Args:
        limit: how many may wait. If more come, the oldest of the crowd that most of them are of is closed.
        patience: the real time in s that each may wait.
    """

    def __init__(self, limit: int, patience: float) -> None:
        self._limit, self._patience = limit, patience
        self._waiting: dict[asyncio.Transport, tuple[str, asyncio.TimerHandle]] = {}

    def come(self, transport: asyncio.Transport, crowd: str = "") -> None:
        """Let a connection wait, from now on. It is called on the loop of the connection.

        Args:
            crowd: what it has in common with others; its address if empty.
        """
        self.leave(transport)
        crowd = crowd or (transport.get_extra_info("peername") or ("",))[0]
        timer = asyncio.get_running_loop().call_later(self._patience, transport.abort)
        self._waiting[transport] = crowd, timer
        if len(self._waiting) > self._limit:
            crowd, _ = Counter(its for its, _ in self._waiting.values()).most_common(1)[0]
            oldest = next(other for other, (its, _) in self._waiting.items() if its == crowd)
            self.leave(oldest)
            oldest.abort()

    def leave(self, transport: asyncio.Transport) -> None:
        """Forget a connection that is admitted or closed. Idempotent."""
        if transport in self._waiting:
            _, timer = self._waiting.pop(transport)
            timer.cancel()


if POSIX:
    import resource

log = logging.getLogger(__name__)

DOORS = 256
"""The number of the router's listeners."""
HANDSHAKE_TIMEOUT = 5.0
"""The real time in s in which a handshake must succeed, and in which what is sent last must be taken."""
MAX_HANDSHAKES = 1000
"""The number of connections whose handshake may not have succeeded yet."""
MAX_CONNECTIONS = 2000
"""The number of connections of one address whose handshake has succeeded, so that one seat does not take all places."""
_BACKLOG = 4096
"""The number of connections that the system holds ready until they are taken."""
_TURNS = 3
"""The number of the router's answers in a handshake that has succeeded: a stranger gets a retry and a flight at
most."""
_HEADER = 5
"""The bytes before the first message of TLS: its kind (22), the version (3.x) and the length."""


def begins_handshake(data: bytes) -> bool | None:
    """True if some bytes begin with a ClientHello of TLS (RFC 8446, 4.1.2 and 5.1); None if more are needed."""
    if not b"\x16\x03".startswith(data[:2]) or data[5:6] not in (b"", b"\x01"):
        return False
    length = int.from_bytes(data[3:_HEADER], "big")
    if len(data) >= _HEADER and not 4 <= length <= 2**14:
        return False
    return True if len(data) >= _HEADER + max(4, length) else None


def doors() -> list[str]:
    """The endpoints of the router's listeners: free ports of this machine, which others cannot reach.

    Raises:
        OSError: there are none.
    """
    # At an address that is drawn at random no other program listens, or takes a port before the router does.
    random_host = f"127.{random.randrange(1, 255)}.{random.randrange(1, 255)}.{random.randrange(1, 255)}"
    host = random_host if sys.platform == "linux" else "127.0.0.1"
    with ExitStack() as stack:
        probes = [stack.enter_context(socket.create_server((host, 0))) for _ in range(DOORS)]
        return [f"tls/{host}:{probe.getsockname()[1]}" for probe in probes]


@contextmanager
def entrance(endpoint: str, behind: list[str]) -> Iterator[Callable[[], None]]:
    """Let programs that begin a handshake at `endpoint` pass to the listeners behind it, until the context ends.

    Returns:
        a function that opens the entrance, to be called when the listeners are there. Earlier ones wait.

    Raises:
        OSError: the endpoint is taken or cannot be listened on.
    """
    if POSIX:
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, 2**16)), hard))  # two files for each connection
    family, _, _, _, address = socket.getaddrinfo(host_of(endpoint), int(port_of(endpoint)), type=socket.SOCK_STREAM)[0]
    both = family is socket.AF_INET6 and address[0] == "::"
    with socket.create_server(address, family=family, backlog=_BACKLOG, dualstack_ipv6=both) as listening:
        # The connections inherit it. Messages for a slow one must wait in the router, which drops old ones.
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_SIZE)
        loop = asyncio.new_event_loop()
        hall = _Hall(loop, [(host_of(door), int(port_of(door))) for door in behind])
        thread = threading.Thread(target=hall.serve, args=(listening,), name="entrance", daemon=True)
        try:
            yield thread.start
        finally:
            hall.ending = True
            loop.call_soon_threadsafe(loop.stop)
            if thread.is_alive():
                thread.join()
            loop.close()


class _Hall:
    """The connections between the public port and the router's listeners.

    Args:
        loop: runs all connections. doors: the addresses of the router's listeners.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, doors: list[tuple[str, int]]) -> None:
        self.loop = loop
        self.ending = False
        self.room = WaitingRoom(MAX_HANDSHAKES, HANDSHAKE_TIMEOUT)
        self.held: Counter[str] = Counter()
        self._doors = cycle(doors)

    def serve(self, listening: socket.socket) -> None:
        """Run until the loop is stopped. Without it no client reaches the router, so the process then ends, too."""
        try:
            server = self.loop.run_until_complete(
                self.loop.create_server(lambda: _Outside(self), sock=listening, backlog=_BACKLOG)
            )
            self.loop.run_forever()
            server.close()
            for task in asyncio.all_tasks(self.loop):
                task.cancel()
            self.loop.run_until_complete(asyncio.sleep(0))
        finally:
            if not self.ending:
                log.critical("the router's entrance has failed, so the router stops")
                os.kill(os.getpid(), signal.SIGTERM)

    async def open_door(self, guest: "_Outside") -> None:
        """Connect a client to the next listener."""
        try:
            await self.loop.create_connection(lambda: _Inside(guest), *next(self._doors))
        except OSError as error:
            log.warning("the router refuses a connection: %s", error)
            guest.transport.abort()


class _Side(asyncio.Protocol):
    """One end of a passage: passes on what it reads to the other end."""

    transport: asyncio.Transport
    other: "_Side | None" = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        if self.other is not None:
            self.other.transport.write(data)

    def pause_writing(self) -> None:
        if self.other is not None:
            self.other.transport.pause_reading()

    def resume_writing(self) -> None:
        if self.other is not None:
            self.other.transport.resume_reading()

    def connection_lost(self, error: Exception | None) -> None:
        if self.other is not None:
            self.other.transport.close()
            # A program that does not read the last bytes would keep the connection for ever.
            asyncio.get_running_loop().call_later(HANDSHAKE_TIMEOUT, self.other.transport.abort)


class _Outside(_Side):
    """The end of the program that has connected."""

    def __init__(self, hall: _Hall) -> None:
        self._hall = hall
        self._hello = b""
        self._turns, self._asked = 0, True

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._hall.room.come(self.transport)

    def data_received(self, data: bytes) -> None:
        self._asked = True
        if self.other is not None:
            self.other.transport.write(data)
            return
        self._hello += data
        begins = begins_handshake(self._hello)
        if begins:
            self.transport.pause_reading()
            self._opening = self._hall.loop.create_task(self._hall.open_door(self))
        elif begins is False:
            self.transport.abort()

    def enter(self, door: "_Inside") -> None:
        """Go on at a listener of the router's."""
        if self.transport.is_closing():
            door.transport.abort()
            return
        self.other = door
        door.transport.write(self._hello)
        self._hello = b""
        self.transport.resume_reading()

    def answered(self) -> None:
        """Count the router's answers; after some the handshake has succeeded."""
        if self._asked:
            self._asked, self._turns = False, self._turns + 1
            if self._turns == _TURNS:
                self._hall.room.leave(self.transport)
                self._address = (self.transport.get_extra_info("peername") or ("",))[0]
                self._hall.held[self._address] += 1
                if self._hall.held[self._address] > MAX_CONNECTIONS:
                    self.transport.abort()

    def connection_lost(self, error: Exception | None) -> None:
        super().connection_lost(error)
        self._hall.room.leave(self.transport)
        if self._turns >= _TURNS:
            self._hall.held -= Counter({self._address: 1})  # an address that has none left is forgotten


class _Inside(_Side):
    """The end at one of the router's listeners."""

    other: _Outside

    def __init__(self, guest: _Outside) -> None:
        self.other = guest

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_SIZE)
        self.other.enter(self)

    def data_received(self, data: bytes) -> None:
        self.other.answered()
        self.other.transport.write(data)
