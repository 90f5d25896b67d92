"""The contract of everything that runs: the executor calls the node, and the node never calls the executor."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from vrg.bus.mailbox import Mailbox
from vrg.names import chunk_of

TIME_TOLERANCE = 1e-6
"""The time in s below which two match times count as the same instant."""

CLOCK_SKEW = 0.2
"""The match time in s by which a stamp of another node may be ahead."""


@dataclass(frozen=True, slots=True)
class Tick:
    """One call of a node.

    Args:
        time: the match time, s.
        live: False if the world's clock has stopped. `time` is then the last match time that was heard, the ticks come
            in real time, and a node may only stop things and report it.
        frozen: the real time in s for which the node's own process did not run, if that is why it is not live; else 0.
            It lasts until the clock is heard again, or could have been.
    """

    time: float
    live: bool = True
    frozen: float = 0.0


class Node(ABC):
    """The base class of the referee, the players, the world, the windows and the recorder.

    A node subscribes in its constructor, on the mailbox that it is given, but opens nothing there: that is for `start`.
    It never blocks, sleeps, reads a clock or touches the network. What it does depends on its ticks and messages alone.

    Args:
        name: the node's name, unique among the nodes of its kind in a match.
        mailbox: the node's own mailbox.
        period: the match time between ticks, s.

    Attributes:
        kind: the word that stands for this kind of node in keys, such as `player`.
    """

    kind: ClassVar[str]

    def __init__(self, name: str, mailbox: Mailbox, period: float) -> None:
        self.name = name
        self.mailbox = mailbox
        self.period = period
        mailbox.sender = sender_of(self.kind, name)

    def start(self) -> None:  # noqa: B027 - most nodes need nothing but their mailbox
        """Open what the node needs. Called once before the first tick, when the node is known to be the only one."""

    def begin(self, tick: Tick) -> None:  # noqa: B027 - most nodes wait for nothing
        """Begin what takes long elsewhere, so that several nodes wait for it at the same time. It publishes nothing.

        It is called before the tick, and where nodes share a process before the tick of the first of them.
        """

    @abstractmethod
    def tick(self, tick: Tick) -> None:
        """Read the inlets, decide, publish."""

    def counted(self) -> dict[str, Any]:
        """The counts of the node, as plain data for the result of the match; empty if it counts nothing."""
        return {}

    def stop(self) -> None:  # noqa: B027 - a node without a robot has nothing to stop
        """Leave every robot stopped. Called once, when the node will not be ticked again.

        What the node publishes here is still sent.
        """


def sender_of(kind: str, name: str) -> str:
    """The sender in the messages of a node, as in the key of its liveliness token: `player/ann`."""
    return f"{kind}/{chunk_of(name)}"


def due_index(time: float, period: float) -> int:
    """The number of periods that are complete at `time`. A node is due if it has risen since the node's last tick.

    It depends on time alone, so that every executor ticks a node at the same instants.
    """
    return int((time + TIME_TOLERANCE) / period)


def is_fresh(stamp: float, now: float, limit: float) -> bool:
    """True if a message with this stamp is at most `limit` seconds of match time old.

    The clocks of two nodes may differ by CLOCK_SKEW. A stamp further in the future is from before the world stepped
    back to a snapshot, so it does not count as fresh.
    """
    return -CLOCK_SKEW <= now - stamp <= limit
