"""One way to send and receive between two processes for each system that `bus.py` compares."""

import os
import queue
import time
from abc import ABC, abstractmethod
from contextlib import ExitStack
from typing import Any, Final

import numpy as np
import zenoh

from vrg.bus.codec import Received, encode
from vrg.bus.configuration import client_settings
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Message, Report
from vrg.bus.process import AutoResetEvent
from vrg.bus.session import configuration, open_session
from vrg.bus.topics import Keys, Topic
from vrg.hal.sensors.laser import Laser

AIM = 1.15
"""Times bare zenoh on the same path."""
BURST = 64
PATIENCE = 10.0
"""s of real time to find the other side."""
LOST_AFTER = 1.0
"""s of real time after which a message is taken for lost."""
BEAT = 0.02
"""s of real time between a waiting child's looks at its orders."""
GAP = 0.002
"""s of real time between round trips of the idle kind."""
SMALL, LARGE = "64 B", "1 KB"
DDS_DOMAIN = 93
DDS_LOOPBACK = """<CycloneDDS><Domain Id="any">
<General><Interfaces><NetworkInterface name="lo"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""

_LASER: Final = Laser(
    angle_min=-1.5, angle_step=0.01, range_max=8.0, data=np.linspace(0.1, 8.0, 237, dtype="<f4").tobytes()
)
_REPORT: Final = Report(mode="Minnows/Cross-the-fie", armed=True)
BODIES: Final[dict[str, Message]] = {SMALL: _REPORT, LARGE: _LASER}
PAYLOADS: Final = {
    size: encode(Received("vrg/ping/robot/robot1/sensor/laser/front", 1.0, 1000, body, "player/robot1/3f60c1d2"))
    for size, body in BODIES.items()
}
"""What bare systems send: as many bytes as ours."""


class Link(ABC):
    """One end of a connection between two processes, `ping` and `pong`.

    Args:
        side: which end this is. address: where the other, or the router, is.
    """

    def __init__(self, side: str, address: str) -> None:
        self.side = side
        self.other = "pong" if side == "ping" else "ping"
        self.address = address

    @abstractmethod
    def open(self) -> None:
        """Connect and begin to listen."""

    @abstractmethod
    def find(self) -> None:
        """Wait until the other end listens, PATIENCE seconds at most."""

    @abstractmethod
    def send(self, size: str, key: int) -> None:
        """Send one message on a key of 0 to 2 * BURST - 1."""

    def send_burst(self, size: str, first: int) -> None:
        """Send BURST messages on keys that follow each other."""
        for key in range(first, first + BURST):
            self.send(size, key)

    @abstractmethod
    def receive(self, timeout: float) -> int:
        """Wait for arrivals; how many there were."""

    @abstractmethod
    def close(self) -> None:
        """Leave. Idempotent."""


class VrgLink(Link):
    """vrg.bus as a node uses it. Each side speaks in a match of its own name."""

    def open(self) -> None:
        """Connect and begin to listen."""
        self._arrived = AutoResetEvent()
        kind = type(self).__name__
        own, other = Keys(f"{kind}-{self.side}"), Keys(f"{kind}-{self.other}")
        self._mailbox = Mailbox()
        self._inlets: list[Inlet[Any]] = [
            self._mailbox.subscribe(other.sensor(Laser)),
            self._mailbox.subscribe(other.report()),
        ]
        names = [f"robot{i}" for i in range(2 * BURST)]
        self._topics: dict[str, list[Topic[Any]]] = {
            SMALL: [own.report(name) for name in names],
            LARGE: [own.sensor(Laser, name, "front") for name in names],
        }
        self._stack = ExitStack()
        self._session = self._stack.enter_context(open_session(self.address, patience=PATIENCE))
        self._session.attach(self._mailbox, self._wake)

    def find(self) -> None:
        """Wait until the other end listens, PATIENCE seconds at most."""
        for topics in self._topics.values():
            if not self._session.wait_for_listener(topics[0].key, topics[0].qos, PATIENCE):
                raise TimeoutError(f"vrg.bus: nobody listens to {topics[0].key}")

    def send(self, size: str, key: int) -> None:
        """Send one message."""
        self._mailbox.publish(self._topics[size][key], BODIES[size])
        self._session.send(self._mailbox.collect())

    def send_burst(self, size: str, first: int) -> None:
        """Send BURST messages as a node does that publishes them in one tick."""
        body = BODIES[size]
        for topic in self._topics[size][first : first + BURST]:
            self._mailbox.publish(topic, body)
        self._session.send(self._mailbox.collect())

    def receive(self, timeout: float) -> int:
        """Wait for arrivals; how many there were."""
        self._arrived.wait(timeout)
        self._session.receive()
        self._mailbox.handover(1.0)
        return sum(len(inlet.take()) for inlet in self._inlets)

    def close(self) -> None:
        """Leave. Idempotent."""
        self._stack.close()

    def _wake(self, _inlet: Inlet[Message]) -> None:
        self._arrived.set()


class ZenohLink(Link):
    """Bare zenoh-python."""

    def open(self) -> None:
        """Connect and begin to listen."""
        self._queue: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._session = zenoh.open(configuration(client_settings(self.address)))
        self._subscriber = self._session.declare_subscriber(f"{type(self).__name__}/{self.other}/*/*", self._enqueue)
        self._publishers = {
            size: [
                self._session.declare_publisher(
                    f"{type(self).__name__}/{self.side}/robot{i}/{number}",
                    congestion_control=zenoh.CongestionControl.DROP,
                )
                for i in range(2 * BURST)
            ]
            for number, size in enumerate(PAYLOADS)
        }

    def find(self) -> None:
        """Wait until the other end listens, PATIENCE seconds at most."""
        deadline = time.monotonic() + PATIENCE
        # The stub says bool, the library returns a MatchingStatus.
        while not getattr(self._publishers[LARGE][0].matching_status, "matching", False):
            if time.monotonic() > deadline:
                raise TimeoutError("zenoh: nobody listens")
            time.sleep(0.01)

    def send(self, size: str, key: int) -> None:
        """Send one message."""
        self._publishers[size][key].put(PAYLOADS[size])

    def receive(self, timeout: float) -> int:
        """Wait for arrivals; how many there were."""
        try:
            self._queue.get(timeout=timeout)
        except queue.Empty:
            return 0
        found = 1
        while not self._queue.empty():
            self._queue.get_nowait()
            found += 1
        return found

    def close(self) -> None:
        """Leave. Idempotent."""
        if not self._session.is_closed():
            self._subscriber.undeclare()  # type: ignore[no-untyped-call]
            self._session.close()  # type: ignore[no-untyped-call]

    def _enqueue(self, sample: zenoh.Sample) -> None:
        self._queue.put(sample.payload.to_bytes())


class ZmqLink(Link):
    """pyzmq, a PAIR over tcp."""

    def open(self) -> None:
        """Connect and begin to listen."""
        import zmq  # noqa: PLC0415 - not everybody has it

        self._context = zmq.Context()
        self._again = zmq.Again
        self._socket = self._context.socket(zmq.PAIR)
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.setsockopt(zmq.SNDTIMEO, 5000)
        endpoint = f"tcp://{self.address}"
        if self.side == "ping":
            self._socket.bind(endpoint)
        else:
            self._socket.connect(endpoint)
        self._timeout = -1

    def find(self) -> None:
        """A PAIR keeps what is sent until the other end is there."""

    def send(self, size: str, key: int) -> None:
        """Send one message; there are no keys."""
        self._socket.send(PAYLOADS[size])

    def receive(self, timeout: float) -> int:
        """Wait for arrivals; how many there were."""
        wanted = int(timeout * 1000)
        if wanted != self._timeout:
            self._timeout = self._socket.rcvtimeo = wanted
        try:
            self._socket.recv()
        except self._again:
            return 0
        return 1

    def close(self) -> None:
        """Leave. Idempotent."""
        self._socket.close()
        self._context.term()


class DdsLink(Link):
    """cyclonedds-python, reliable, everything kept."""

    def open(self) -> None:
        """Connect and begin to listen."""
        os.environ["CYCLONEDDS_URI"] = DDS_LOOPBACK
        from cyclonedds import core, domain, pub, qos, sub, topic, util  # noqa: PLC0415 - not everybody has it
        from dds_types import Blob  # noqa: PLC0415

        policies = qos.Qos(qos.Policy.Reliability.Reliable(util.duration(seconds=5)), qos.Policy.History.KeepAll)
        self._participant = domain.DomainParticipant(DDS_DOMAIN)
        outward = topic.Topic(self._participant, f"from_{self.side}", Blob, qos=policies)
        inward = topic.Topic(self._participant, f"from_{self.other}", Blob, qos=policies)
        self._writer = pub.DataWriter(self._participant, outward, qos=policies)
        self._reader = sub.DataReader(self._participant, inward, qos=policies)
        state = core.SampleState.Any | core.ViewState.Any | core.InstanceState.Any
        self._condition = core.ReadCondition(self._reader, state)
        self._waitset = core.WaitSet(self._participant)
        self._waitset.attach(self._condition)
        self._duration = util.duration
        self._blobs = {size: Blob(data=list(payload)) for size, payload in PAYLOADS.items()}

    def find(self) -> None:
        """Wait until the other end listens, PATIENCE seconds at most."""
        deadline = time.monotonic() + PATIENCE
        while not (self._writer.get_matched_subscriptions() and self._reader.get_matched_publications()):
            if time.monotonic() > deadline:
                raise TimeoutError("cyclonedds: nobody listens")
            time.sleep(0.01)

    def send(self, size: str, key: int) -> None:
        """Send one message; there are no keys."""
        self._writer.write(self._blobs[size])

    def receive(self, timeout: float) -> int:
        """Wait for arrivals; how many there were."""
        if not self._waitset.wait(self._duration(milliseconds=int(timeout * 1000))):
            return 0
        return len(self._reader.take(N=2 * BURST))

    def close(self) -> None:
        """Leave. Idempotent."""
        for entity in ("_waitset", "_condition", "_reader", "_writer", "_participant"):
            if hasattr(self, entity):
                delattr(self, entity)


KINDS: Final[dict[str, type[Link]]] = {"vrg.bus": VrgLink, "zenoh": ZenohLink, "pyzmq": ZmqLink, "cyclonedds": DdsLink}
