"""Receives and sends packets, on multicast addresses as a rule. A thread receives: what waits in a socket is old."""

import contextlib
import ipaddress
import logging
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from vrg.errors import LaunchError

log = logging.getLogger(__name__)

MAX_PACKET_SIZE: Final = 65_535
"""The number of bytes of the longest packet of UDP."""
_QUEUE_LENGTH: Final = 512
"""The number of packets that wait for a node that does not tick."""
_LOOK: Final = 0.2
"""The time in s between two looks at whether the thread is to end."""


class Packet(NamedTuple):
    """A packet.

    Args:
        arrived: when, monotonic, s. sender: the address and the port that it came from. data: what is in it.
    """

    arrived: float
    sender: str
    data: bytes


class Receiver:
    """Receives packets.

    Args:
        address, port: where they are sent, such as `224.5.23.2` and 10006; an address of this machine works, too.
        interface: the address of the network interface of this machine; empty for the one that it chooses.
        monotonic: the clock by which arrivals are stamped, s.
    """

    def __init__(
        self, address: str, port: int, interface: str = "", monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        self._at = (address, port)
        self._interface = interface
        self._monotonic = monotonic
        self._packets: deque[Packet] = deque(maxlen=_QUEUE_LENGTH)
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Open the socket, and begin to receive.

        Raises:
            LaunchError: it cannot be opened.
        """
        address, port = self._at
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            # Other programs on this machine receive the same packets.
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            opened.bind((address, port))
            if ipaddress.ip_address(address).is_multicast:
                own = socket.inet_aton(self._interface or "0.0.0.0")
                joined = struct.pack("4s4s", socket.inet_aton(address), own)
                opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
            opened.settimeout(_LOOK)
        except OSError as error:
            opened.close()
            raise LaunchError(
                f"{address}:{port}: expected to receive packets there: {error.strerror}: is the address right, and the "
                "network up?"
            ) from error
        self._thread = threading.Thread(target=self._receive, args=(opened,), name="packets", daemon=True)
        self._thread.start()

    def take(self) -> list[Packet]:
        """The packets since the last call, oldest first."""
        found = []
        with contextlib.suppress(IndexError):
            while True:
                found.append(self._packets.popleft())
        return found

    def close(self) -> None:
        """Receive no more. Idempotent."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()

    def _receive(self, opened: socket.socket) -> None:
        with opened:
            while not self._ending.is_set():
                try:
                    data, (host, port) = opened.recvfrom(MAX_PACKET_SIZE)
                except TimeoutError:
                    continue
                except OSError as error:  # the network is down for a while
                    log.warning("%s:%d: %s", *self._at, error.strerror)
                    self._ending.wait(1.0)
                    continue
                self._packets.append(Packet(self._monotonic(), f"{host}:{port}", data))


class Sender:
    """Sends packets of several kinds, each to an address of its own. What cannot be sent now is lost.

    Args:
        addresses: the address and the port of each kind of packet.
        interface: the address of the network interface of this machine; empty for the one that it chooses.
        hops: how many networks packets to a multicast address may come into, the first included, 1 to 255.

    Raises:
        LaunchError: there is no such interface.
    """

    def __init__(self, addresses: Mapping[str, tuple[str, int]], interface: str = "", hops: int = 1) -> None:
        self._addresses = addresses
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, hops)
            if interface:
                own = socket.inet_aton(interface)
                self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, own)
        except OSError as error:
            self._socket.close()
            raise LaunchError(f"{interface}: expected a network interface of this machine: {error.strerror}") from error
        self._failed = False

    def send(self, kind: str, data: bytes) -> None:
        """Send a packet; that it cannot be sent is logged once."""
        try:
            self._socket.sendto(data, self._addresses[kind])
            self._failed = False
        except OSError as error:
            if not self._failed:
                log.warning("%s:%d: packets cannot be sent: %s", *self._addresses[kind], error.strerror)
            self._failed = True

    def close(self) -> None:
        """Send no more."""
        self._socket.close()
