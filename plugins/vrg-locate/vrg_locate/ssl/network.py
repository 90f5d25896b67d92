"""Receives packets, on multicast addresses as a rule. A thread receives: what waits in a socket is old."""

import ipaddress
import socket
import struct
import time
from collections.abc import Callable
from typing import Final, NamedTuple

from vrg.errors import LaunchError
from vrg_locate.stream import LiveStream

MAX_PACKET_SIZE: Final = 65_535
"""The number of bytes of the longest packet of UDP."""
SILENCE: Final = 3.0
"""The time in s without a packet after which that is told."""
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


class PacketStream(LiveStream[Packet]):
    """The packets that are sent to an address.

    Args:
        address, port: where they are sent, such as `224.5.23.2` and 10006; an address of this machine works, too.
        interface: the address of the network interface of this machine; empty for the one that it chooses.
        monotonic: the clock by which arrivals are stamped, s.
    """

    def __init__(
        self, address: str, port: int, interface: str = "", monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__("packets", SILENCE, _QUEUE_LENGTH, monotonic)
        self._at, self._interface = (address, port), interface
        self._socket: socket.socket | None = None

    def start(self) -> None:
        """Begin to receive.

        Raises:
            LaunchError: the address cannot be opened.
        """
        address, port = self._at
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            # Other programs on this machine receive the same packets.
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            opened.bind(self._at)
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
        self._socket = opened
        super().start()

    def close(self) -> None:
        """Receive no more. Idempotent."""
        super().close()
        if self._socket is not None:
            self._socket.close()

    def listen(self) -> str:
        """Receive packets until the network is down."""
        assert self._socket is not None
        while not self.ending.is_set():
            try:
                data, (host, port) = self._socket.recvfrom(MAX_PACKET_SIZE)
            except TimeoutError:
                continue
            except OSError as error:
                return "{}:{}: {}".format(*self._at, error.strerror)
            self.put(Packet(self._monotonic(), f"{host}:{port}", data))
        return ""

    def silent(self, silence: float) -> str:
        """That no packet comes."""
        where = "{}:{}".format(*self._at)
        advice = "does vision run, and is `interface` of its network?"
        return f"nothing was received at {where} for {silence:.0f} s: {advice}"
