"""An emulated server of NatNet 3.0, as OptiTrack's Motive is one: packets of the public layout, over UDP on loopback.

Layout: OptiTrack's NatNet SDK, sample PacketClient. All numbers are little-endian; texts end with a zero byte.
"""

import contextlib
import socket
import struct
import threading
from collections.abc import Mapping, Sequence

from msgspec import Struct

CONNECT, SERVER_INFO, REQUEST_DESCRIPTIONS, DESCRIPTIONS, FRAME = 0, 1, 4, 5, 7
VERSION = (3, 0, 0, 0)
TICKS = 1_000_000
"""Those of the server's clock in a second."""
GROUP = "239.255.42.99"


class Shown(Struct, frozen=True):
    """A rigid body in a frame: position, m; quaternion x, y, z, w; and whether it is tracked."""

    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    tracked: bool = True


def packet(message: int, data: bytes) -> bytes:
    return struct.pack("<HH", message, len(data)) + data


def server_info(port: int, multicast: bool) -> bytes:
    name = b"emulated".ljust(256, b"\0")
    versions = bytes((3, 0, 0, 0)) + bytes(VERSION)
    connection = struct.pack("<QH?4s", TICKS, port, multicast, socket.inet_aton(GROUP))
    # The compilers of both sides end it at a multiple of the alignment of its numbers.
    return packet(SERVER_INFO, name + versions + connection + b"\0")


def descriptions(names: Sequence[str]) -> bytes:
    """The names of the rigid bodies, which have the numbers from 1 on; each has no parent, offset or marker."""
    data = struct.pack("<i", len(names))
    for number, name in enumerate(names, 1):
        data += struct.pack("<i", 1) + name.encode() + b"\0"
        data += struct.pack("<ii3fi", number, -1, 0.0, 0.0, 0.0, 0)
    return packet(DESCRIPTIONS, data)


def frame(number: int, bodies: Mapping[int, Shown]) -> bytes:
    """A frame with rigid bodies by their numbers, taken 5 ms before it was sent."""
    data = struct.pack("<iiii", number, 0, 0, len(bodies))
    for identity, body in bodies.items():
        data += struct.pack("<i3f4ffh", identity, *body.position, *body.rotation, 0.0002, int(body.tracked))
    # No skeletons, labelled markers, force plates or devices; no time code; then the times.
    data += struct.pack("<iiii", 0, 0, 0, 0)
    exposed = number * TICKS // 100
    data += struct.pack("<IIdQQQ", 0, 0, number / 100, exposed, exposed + 2000, exposed + 5000)
    return packet(FRAME, data + struct.pack("<hi", 0, 0))


class Server:
    """Answers requests on a port of loopback, and sends 100 frames a second to a multicast group there.

    Args:
        names: of the rigid bodies.

    Attributes:
        port: where it takes requests. shown: the bodies in the next frames, by their names.
        noise: m; about what the newest frame differs by from the one before, as real ones do.
        silent: True to send nothing and answer nothing. connections: the number of requests to connect.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self.names, self.shown, self.noise, self.silent = names, dict[str, Shown](), 1e-5, False
        self.connections = 0
        self._requests = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._requests.bind(("127.0.0.1", 0))
        self._requests.settimeout(0.01)
        self.port = int(self._requests.getsockname()[1])
        self._frames = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._frames.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("", 0))
            self._data_port = int(free.getsockname()[1])
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._requests.close()
        self._frames.close()

    def _run(self) -> None:
        number = 0
        while not self._stop.is_set():
            with contextlib.suppress(TimeoutError):
                asked, sender = self._requests.recvfrom(2048)
                if not self.silent:
                    self._answer(struct.unpack_from("<H", asked)[0], sender)
            if not self.silent:
                number += 1
                self._frames.sendto(frame(number, self._bodies(number)), (GROUP, self._data_port))

    def _answer(self, message: int, sender: tuple[str, int]) -> None:
        if message == CONNECT:
            self.connections += 1
            self._requests.sendto(server_info(self._data_port, True), sender)
        elif message == REQUEST_DESCRIPTIONS:
            self._requests.sendto(descriptions(self.names), sender)

    def _bodies(self, number: int) -> dict[int, Shown]:
        away, bodies = self.noise * (number % 97), {}
        for name, body in dict(self.shown).items():
            x, y, z = body.position
            bodies[self.names.index(name) + 1] = Shown((x + away, y, z), body.rotation, body.tracked)
        return bodies
