"""Three ways onto a CAN bus for the benchmark, and what codecs cost."""

import socket
import struct
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable

import can
from can_peers import ANSWER, CHANNEL, FRAME, answering, raw_socket, sent_packets
from common import median, quantile

from vrg.hal.can.bus import CanBus, can_message, frame_of
from vrg.hal.can.frame import STANDARD_MASK, Filter, Frame
from vrg.hal.can.link import Link
from vrg.hal.can.odrive import codec, messages

AIM = 1.3
"""The driver's round trip over that of bare python-can, p50."""
POLL = 0.05
"""s that a receive thread waits at most, as in the driver."""
MUTE = 0x300
"""Nobody hears it."""
PAYLOAD = struct.pack("<ff", 12.5, 0.0)
_DBC = """
BO_ 13 Set_Input_Vel: 8 Vector__XXX
 SG_ Input_Vel : 0|32@1- (1,0) [0|0] "rev/s" Vector__XXX
 SG_ Input_Torque_FF : 32|32@1- (1,0) [0|0] "Nm" Vector__XXX
BO_ 9 Get_Encoder_Estimates: 8 Vector__XXX
 SG_ Pos_Estimate : 0|32@1- (1,0) [0|0] "rev" Vector__XXX
 SG_ Vel_Estimate : 32|32@1- (1,0) [0|0] "rev/s" Vector__XXX
SIG_VALTYPE_ 13 Input_Vel : 1;
SIG_VALTYPE_ 13 Input_Torque_FF : 1;
SIG_VALTYPE_ 9 Pos_Estimate : 1;
SIG_VALTYPE_ 9 Vel_Estimate : 1;
"""


class Way(ABC):
    """A way onto the bus, with a receive thread. The answer counts as received when that thread holds it.

    Args:
        ask: identifier of its requests, its own; it hears nothing but the answers to them.
    """

    name: str

    def __init__(self, ask: int) -> None:
        self.ask = ask
        self.answer = ask + ANSWER
        self.trips: list[list[float]] = []
        self.rates: list[float] = []
        self.lost = 0
        self._arrived = threading.Lock()
        self._arrived.acquire()
        self._at = 0.0
        self._stopping = False

    @abstractmethod
    def start(self) -> None:
        """Open, and begin to listen."""

    @abstractmethod
    def send(self, id_: int) -> None:
        """Send PAYLOAD."""

    @abstractmethod
    def stop(self) -> None:
        """Close."""

    def note(self) -> None:
        """The answer is here."""
        self._at = time.perf_counter()
        self._arrived.release()

    def round_trips(self, count: int) -> list[float]:
        """us each."""
        times = []
        for _ in range(count):
            began = time.perf_counter()
            self.send(self.ask)
            if self._arrived.acquire(timeout=1.0):
                times.append((self._at - began) * 1e6)
            else:
                self.lost += 1
        return times

    def rate(self, count: int) -> float:
        """Frames/s that one thread sends; the kernel's count tells whether they went out."""
        before, began = sent_packets(), time.perf_counter()
        for _ in range(count):
            self.send(MUTE)
        took = time.perf_counter() - began
        self.lost += count - (sent_packets() - before)
        return count / took


class Raw(Way):
    """A socket and struct."""

    name = "raw socket"

    def start(self) -> None:
        """Open, and begin to listen."""
        self._bus = raw_socket((self.answer, STANDARD_MASK))
        self._bus.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("@ll", 0, int(POLL * 1e6)))
        self._thread = threading.Thread(target=self._receive)
        self._thread.start()

    def send(self, id_: int) -> None:
        """Send PAYLOAD."""
        self._bus.send(FRAME.pack(id_, len(PAYLOAD), PAYLOAD))

    def stop(self) -> None:
        """Close."""
        self._stopping = True
        self._thread.join()
        self._bus.close()

    def _receive(self) -> None:
        while not self._stopping:
            try:
                FRAME.unpack(self._bus.recv(FRAME.size))
            except BlockingIOError:
                continue
            self.note()


class Bare(Way):
    """python-can's Bus.send, and Bus.recv in a thread."""

    name = "python-can"

    def start(self) -> None:
        """Open, and begin to listen."""
        only: list[can.typechecking.CanFilter] = [{"can_id": self.answer, "can_mask": STANDARD_MASK, "extended": False}]
        self._bus = can.Bus(interface="socketcan", channel=CHANNEL, ignore_config=True, can_filters=only)
        self._thread = threading.Thread(target=self._receive)
        self._thread.start()

    def send(self, id_: int) -> None:
        """Send PAYLOAD."""
        self._bus.send(can.Message(arbitration_id=id_, data=PAYLOAD, is_extended_id=False))

    def stop(self) -> None:
        """Close."""
        self._stopping = True
        self._thread.join()
        self._bus.shutdown()

    def _receive(self) -> None:
        while not self._stopping:
            if self._bus.recv(POLL) is not None:
                self.note()


class Ours(Way):
    """The driver's CanBus."""

    name = "vrg CanBus"

    def start(self) -> None:
        """Open, and begin to listen."""
        self._bus = CanBus(Link(channel=CHANNEL), lambda _frame: self.note())
        self._bus.listen_to([Filter(self.answer, STANDARD_MASK)])
        self._bus.start()

    def send(self, id_: int) -> None:
        """Send PAYLOAD."""
        self._bus.send(Frame(id_, PAYLOAD))

    def stop(self) -> None:
        """Close."""
        self._bus.stop()


def measure(rounds: int, trips: int, burst: int, tell: Callable[[str], None]) -> list[Way]:
    """Every way in turn, each round beginning with another one."""
    ways: list[Way] = [Raw(0x101), Bare(0x102), Ours(0x103)]
    started: list[Way] = []
    with answering():
        try:
            for way in ways:
                way.start()
                started.append(way)
                way.round_trips(50)
            for number in range(rounds):
                tell(f"round trips and sending, round {number + 1} of {rounds}")
                for offset in range(len(ways)):
                    way = ways[(number + offset) % len(ways)]
                    way.trips.append(way.round_trips(trips))
                    way.rates.append(way.rate(burst))
        finally:
            for way in started:
                way.stop()
    return ways


def codec_costs(rounds: int, count: int) -> dict[str, float]:
    """us each by what is done, the median of rounds in which all take turns."""
    setpoint = codec.encode(3, messages.SetInputVel(12.5))
    estimate = codec.encode(3, messages.EncoderEstimates(7.25, 12.5))
    message = can_message(estimate)
    message.timestamp = time.time()
    packing = struct.Struct("<ff")
    tasks: dict[str, Callable[[], object]] = {
        "encode SetInputVel": lambda: codec.encode(3, messages.SetInputVel(12.5)),
        "decode EncoderEstimates": lambda: codec.decode(estimate),
        "Frame to can.Message": lambda: can_message(setpoint),
        "can.Message to Frame": lambda: frame_of(message),
        "struct alone: pack": lambda: packing.pack(12.5, 0.0),
        "struct alone: unpack": lambda: packing.unpack(estimate.data),
    }
    try:
        import cantools  # noqa: PLC0415 - goes on without it
    except ImportError:
        pass
    else:
        table = cantools.database.load_string(_DBC, "dbc")
        tasks["cantools: encode SetInputVel"] = lambda: table.encode_message(
            13, {"Input_Vel": 12.5, "Input_Torque_FF": 0.0}
        )
        tasks["cantools: decode EncoderEstimates"] = lambda: table.decode_message(9, estimate.data)
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            began = time.perf_counter()
            for _ in range(count):
                task()
            times[name].append((time.perf_counter() - began) / count * 1e6)
    return {name: median(values) for name, values in times.items()}


def rows(ways: list[Way]) -> list[dict[str, object]]:
    """The table of `measure`."""
    bare = next(way for way in ways if isinstance(way, Bare))
    table: list[dict[str, object]] = []
    for way in ways:
        every = [one for trips in way.trips for one in trips]
        ratio = median([median(a) / median(b) for a, b in zip(way.trips, bare.trips, strict=True)])
        tail = median([quantile(a, 0.99) / quantile(b, 0.99) for a, b in zip(way.trips, bare.trips, strict=True)])
        table.append(
            {
                "way": way.name,
                "round trip p50, us": median(every),
                "p99, us": quantile(every, 0.99),
                "p50 x python-can": ratio,
                "p99 x python-can": tail,
                "sent, frames/s": median(way.rates),
                "sent x python-can": median([a / b for a, b in zip(way.rates, bare.rates, strict=True)]),
                "lost": way.lost,
                f"aim p50 <= {AIM:g} x": ("met" if ratio <= AIM else "missed") if isinstance(way, Ours) else None,
            }
        )
    return table
