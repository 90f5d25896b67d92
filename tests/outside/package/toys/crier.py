"""A process of a match that prints every call of the referee."""

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.kinds import Kind
from vrg.launch.context import Made, NodeContext
from vrg.seats.seat import SeatKind


class Crier(Node):
    """It hears the calls, and publishes nothing."""

    kind = "spectator"

    def __init__(self, name: str, mailbox: Mailbox, keys: Keys) -> None:
        super().__init__(name, mailbox, 0.1)
        self._calls = mailbox.subscribe(keys.referee_event)

    def tick(self, tick: Tick) -> None:
        """Print what was called since the last tick."""
        for call in self._calls.take():
            print(f"hear ye: {call.body.text}", flush=True)


def crier(on: NodeContext) -> Made:
    """The crier of a match."""
    return Made(Crier(on.named("crier"), Mailbox(), on.setup.keys))


KIND = Kind(
    name="crier",
    about="prints every call",
    seats=(SeatKind.OFFICIAL, SeatKind.WINDOW),
    node="toys.crier:crier",
    pulse="spectator",
)
