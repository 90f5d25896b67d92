"""A process of a match that prints every call of the referee, and a check of `vrg doctor`."""

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.config.setup import MatchSetup
from vrg.kinds import Kind, Opening
from vrg.launch.context import Made, NodeContext
from vrg.plugins import Finding, Option
from vrg.seats.seat import SeatKind


class Crier(Node):
    """It hears the calls, and publishes nothing."""

    kind = "spectator"

    def __init__(self, name: str, mailbox: Mailbox, keys: Keys, cry: str) -> None:
        super().__init__(name, mailbox, 0.1)
        self._cry = cry
        self._calls = mailbox.subscribe(keys.referee_event)

    def tick(self, tick: Tick) -> None:
        """Print what was called since the last tick."""
        for call in self._calls.take():
            print(f"{self._cry}: {call.body.text}", flush=True)


def crier(on: NodeContext) -> Made:
    """The crier of a match."""
    return Made(Crier(on.named("crier"), Mailbox(), on.setup.keys, on.name))


def opening(setup: MatchSetup, typed: str | None, *, secured: bool) -> Opening:
    """Every call begins as it was typed, or with `hear ye`."""
    return Opening(typed or "hear ye", lambda endpoint: f"the calls of {setup.name}, by {endpoint}")


def check() -> Finding:
    """The crier is always well."""
    return Finding("crier", None, "its voice is clear")


KIND = Kind(
    name="crier",
    about="prints every call",
    seats=(SeatKind.OFFICIAL, SeatKind.WINDOW),
    node="toys.crier:crier",
    pulse="spectator",
    process="crier",
    shown="crier",
    opens="toys.crier:opening",
    option=Option("--cry", "Let a crier print every call."),
    views=True,
)
