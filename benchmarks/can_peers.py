"""Processes of the CAN benchmark that know nothing of VRG, and their ends in it.

Run as a script it is one of them: `can_peers.py answer` sends each frame of REQUESTS back with its identifier plus
ANSWER; `can_peers.py listen ID:MASK...` notes all frames that match, with the kernel's time of their arrival;
`can_peers.py idle SECONDS` counts, whenever it is asked, what processor time nobody else wants for so long.
"""

import os
import select
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

CHANNEL = "vcan0"
REQUESTS = (0x100, 0x7F0)
"""Identifier and mask that the answering process hears."""
ANSWER = 0x100
"""What it adds to the identifier."""
FRAME = struct.Struct("=IB3x8s")
"""struct can_frame of linux/can.h."""
REMOTE = 0x40000000
EXTENDED = 0x80000000
RECEIVE_BUFFER = 8 << 20
"""bytes; some 30 000 frames."""
PATIENCE = 30.0
"""s for another process to answer."""

_STAMPED = 35
"""SO_TIMESTAMPNS and SCM_TIMESTAMPNS."""
_OVERFLOWN = 40
"""SO_RXQ_OVFL."""
_NOTE = struct.Struct("<qIB3x8s")
_LOOK = 0.05
"""s between the listener's looks: the kernel stamps, so it need not wake for each frame."""


def raw_socket(*filters: tuple[int, int], receive_buffer: int = 0) -> socket.socket:
    """A raw CAN socket that hears what matches (identifier, mask); everything if none is given."""
    bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    if filters:
        packed = b"".join(struct.pack("=II", *one) for one in filters)
        bus.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, packed)
    if receive_buffer:
        try:
            bus.setsockopt(socket.SOL_SOCKET, 33, receive_buffer)  # SO_RCVBUFFORCE
        except OSError:
            bus.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    bus.bind((CHANNEL,))
    return bus


class Peer:
    """A process of this file's or another's that says a line when it is ready; a context manager that ends it."""

    def __init__(self, command: Sequence[str]) -> None:
        self._command = [sys.executable, *command]

    def __enter__(self) -> "Peer":
        self.process = subprocess.Popen(self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.pid = self.process.pid
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self._in, self._out = self.process.stdin.fileno(), self.process.stdout.fileno()
        try:
            self.line()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, _: object, __: TracebackType | None) -> None:
        self.process.terminate()
        try:
            self.process.wait(5.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def line(self, patience: float = PATIENCE) -> str:
        """The next line that it says."""
        said = b""
        while not said.endswith(b"\n"):
            said += self.read(1, patience)
        return said.decode().strip()

    def ask(self) -> None:
        """Order the answer for which `read` waits."""
        os.write(self._in, b"t")

    def read(self, size: int, patience: float = PATIENCE) -> bytes:
        """So many bytes of what it says."""
        said = b""
        while len(said) < size:
            if not select.select([self._out], [], [], patience)[0]:
                raise TimeoutError(f"{self._command[1:]} does not answer")
            part = os.read(self._out, size - len(said))
            if not part:
                raise RuntimeError(f"{self._command[1:]} has ended")
            said += part
        return said


def answering() -> Peer:
    """Who answers."""
    return Peer([__file__, "answer"])


@dataclass(frozen=True, slots=True)
class Heard:
    """A frame on the bus: kernel time of its arrival, s of time.time(); identifier with flags; data."""

    at: float
    id: int
    data: bytes


class Listener(Peer):
    """Hears what matches (identifier, mask); see `Peer`.

    Attributes:
        lost: frames that the kernel has dropped because its queue was full.
    """

    def __init__(self, *filters: tuple[int, int]) -> None:
        super().__init__([__file__, "listen", *(f"{id_}:{mask}" for id_, mask in filters)])
        self.lost = 0

    def __enter__(self) -> "Listener":
        super().__enter__()
        return self

    def take(self) -> list[Heard]:
        """What has come since the last call, up to now."""
        self.ask()
        count, self.lost = struct.unpack("<II", self.read(8))
        notes = self.read(count * _NOTE.size) if count else b""
        return [Heard(at * 1e-9, id_, data[:size]) for at, id_, size, data in _NOTE.iter_unpack(notes)]


class Idler(Peer):
    """Tells how much of one processor nobody wants; see `Peer`. Begins with a machine that does nothing else.

    A kernel that counts processor time in ticks of 10 ms, as a user-mode one does, does not see a process that works
    for a moment every 10 ms: its sleep always ends just after the tick.
    """

    def __init__(self, seconds: float) -> None:
        super().__init__([__file__, "idle", str(seconds)])

    def __enter__(self) -> "Idler":
        super().__enter__()
        self._all = self._count()
        return self

    def used(self) -> float:
        """Share of the processor that others use in the next `seconds`."""
        return max(0.0, 1.0 - self._count() / self._all)

    def _count(self) -> int:
        self.ask()
        (count,) = struct.unpack("<Q", self.read(8))
        return int(count)


def counts_ticks() -> bool:
    """Whether this kernel counts processor time in ticks."""
    began, until = time.process_time(), time.perf_counter() + 2e-3
    while time.perf_counter() < until:
        pass
    return not 1e-3 < time.process_time() - began < 4e-3


def of_command(command: int) -> tuple[int, int]:
    """The filter for one CANSimple command of every node."""
    return command, 0x1F | EXTENDED


def _answer() -> None:
    bus = raw_socket(REQUESTS)
    print("ready", flush=True)
    while True:
        id_, size, data = FRAME.unpack(bus.recv(FRAME.size))
        bus.send(FRAME.pack(id_ + ANSWER, size, data))


def _listen(filters: Iterable[tuple[int, int]]) -> None:
    # It takes processor time from nobody.
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    bus = raw_socket(*filters, receive_buffer=RECEIVE_BUFFER)
    bus.setsockopt(socket.SOL_SOCKET, _STAMPED, 1)
    bus.setsockopt(socket.SOL_SOCKET, _OVERFLOWN, 1)
    bus.setblocking(False)
    notes, lost = bytearray(), 0
    print("ready", flush=True)
    while True:
        asked = bool(select.select([0], [], [], _LOOK)[0])
        if asked and not os.read(0, 1):
            return
        while True:
            try:
                frame, extras, _, _ = bus.recvmsg(FRAME.size, 128)
            except BlockingIOError:
                break
            at = 0
            for _, kind, value in extras:
                if kind == _STAMPED:
                    seconds, nanoseconds = struct.unpack("@ll", value[:16])
                    at = seconds * 1_000_000_000 + nanoseconds
                elif kind == _OVERFLOWN:
                    (lost,) = struct.unpack("=I", value[:4])
            notes += _NOTE.pack(at or time.time_ns(), *FRAME.unpack(frame))
        if asked:
            sys.stdout.buffer.write(struct.pack("<II", len(notes) // _NOTE.size, lost) + notes)
            sys.stdout.buffer.flush()
            notes = bytearray()


def _idle(seconds: float) -> None:
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    print("ready", flush=True)
    while os.read(0, 1):
        count, until = 0, time.perf_counter() + seconds
        while time.perf_counter() < until:
            for _ in range(2000):
                count += 1
        sys.stdout.buffer.write(struct.pack("<Q", count))
        sys.stdout.buffer.flush()


def sent_packets() -> int:
    """Frames that have gone out on CHANNEL, by the kernel's count."""
    for row in Path("/proc/net/dev").read_text().splitlines():
        name, _, numbers = row.partition(":")
        if name.strip() == CHANNEL:
            return int(numbers.split()[9])
    raise RuntimeError(f"{CHANNEL} is not there")


if __name__ == "__main__":
    if sys.argv[1] == "answer":
        _answer()
    elif sys.argv[1] == "idle":
        _idle(float(sys.argv[2]))
    else:
        _listen([(int(one), int(mask)) for one, _, mask in (text.partition(":") for text in sys.argv[2:])])
