"""Trackers of VRPN 7 on loopback, as the server of a capture system has them: the public layout of its messages.

A client asks over UDP to be called back, and the server opens a TCP connection to it. Both send a cookie; then messages
follow, each after a header of six numbers. All numbers are big-endian, and messages are filled up to 8 bytes.

Layout: vrpn_Connection.C and vrpn_Tracker.C of VRPN.
"""

import contextlib
import socket
import struct
import threading
from collections.abc import Sequence
from typing import Final

COOKIE: Final = b"vrpn: ver. 07.35  0".ljust(24, b"\0")
SENDER, TYPE = -1, -2
"""The types of messages that tell the name of a sender, and of a type of messages."""
POSE: Final = 0
"""The type of messages with poses here."""


def message(kind: int, sender: int, data: bytes) -> bytes:
    filled = data + bytes(-len(data) % 8)
    return struct.pack(">6i", 24 + len(data), 0, 0, sender, kind, 0) + filled


def named(kind: int, number: int, name: str) -> bytes:
    text = name.encode() + b"\0"
    return message(kind, number, struct.pack(">I", len(text)) + text)


class Trackers:
    """Shows poses of some trackers when it is told to.

    Args:
        names: of the trackers.

    Attributes:
        port: of loopback, where it takes requests.
        connected: is set when a client can be shown something.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names
        self._requests = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._requests.bind(("127.0.0.1", 0))
        self._requests.settimeout(0.05)
        self.port = int(self._requests.getsockname()[1])
        self.connected, self._stop = threading.Event(), threading.Event()
        self._client: socket.socket | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def show(self, name: str, x: float) -> None:
        """Send a pose of a tracker that stands upright at (x, 0, 0.2), m."""
        assert self._client is not None
        data = struct.pack(">ii7d", 0, 0, x, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0)
        self._client.sendall(message(POSE, self._names.index(name), data))

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._requests.close()
        if self._client is not None:
            self._client.close()

    def _run(self) -> None:
        while not self._stop.is_set() and not self.connected.is_set():
            with contextlib.suppress(TimeoutError):
                asked, sender = self._requests.recvfrom(2048)
                self._call_back(sender[0], int(asked.rstrip(b"\0").split()[1]))

    def _call_back(self, host: str, port: int) -> None:
        client = socket.create_connection((host, port), 10.0)
        client.sendall(COOKIE)
        names = [named(SENDER, number, name) for number, name in enumerate(self._names)]
        client.sendall(b"".join([*names, named(TYPE, POSE, "vrpn_Tracker Pos_Quat")]))
        self._client = client
        self.connected.set()
