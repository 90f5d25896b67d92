"""What tests of the bus share: endpoints, patience, and one who publishes to one who hears."""

import socket
import time
from collections.abc import Callable

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.session import Session
from vrg.bus.topics import Keys, Topic
from vrg.bus.transport import OnArrival, Transport
from vrg.types import Pose

KEYS = Keys("m")
PATIENCE = 60.0


def free(scheme: str = "tcp") -> str:
    """An endpoint that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"{scheme}/127.0.0.1:{probe.getsockname()[1]}"


def wait(condition: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"waited {PATIENCE} s in vain for {what}"
        time.sleep(0.005)


def call(number: int) -> m.Call:
    return m.Call(number=number, rule="r", text="", players=("a",), poses=(Pose(1.0, 2.0, 0.5),), clock=0.5)


class Pair:
    """One who publishes by a transport, and one who hears topics by another."""

    def __init__(
        self, one: Transport, other: Transport, *topics: Topic[m.Message], name: str = "coordinator/referee"
    ) -> None:
        self.one, self.other = one, other
        self.sender, self.receiver = Mailbox(name), Mailbox()
        self.inlets = [self.receiver.subscribe(topic) for topic in topics]
        self.numbers: list[int] = []

    def ready(self, *topics: Topic[m.Message], on_arrival: OnArrival | None = None) -> None:
        """Attach the receiver, and wait until the sender's transport knows that somebody listens."""
        self.other.attach(self.receiver, on_arrival)
        for topic in topics or [inlet.topic for inlet in self.inlets]:
            if isinstance(self.one, Session):
                assert self.one.wait_for_listener(topic.key, topic.qos, PATIENCE)

    def send(self, *messages: tuple[Topic[m.Message], m.Message]) -> None:
        for topic, body in messages:
            self.sender.publish(topic, body)
        self.one.send(self.sender.collect())

    def call(self, *numbers: int) -> None:
        self.send(*((KEYS.referee_event, call(number)) for number in numbers))

    def until(self, condition: Callable[[], object], what: str) -> None:
        """Receive until something is so."""

        def received() -> object:
            self.other.receive()
            self.receiver.handover(0.0)
            return condition()

        wait(received, what)

    def called(self, number: int) -> bool:
        """Whether this call has come; the first inlet is that of calls."""
        self.numbers.extend(message.body.number for message in self.inlets[0].take())
        return number in self.numbers

    def until_called(self, number: int) -> None:
        self.until(lambda: self.called(number), f"call {number}")
