"""The contract of everything that runs: the executor calls the node, the node never calls the executor."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from vrg.bus.mailbox import Mailbox

TIME_TOLERANCE = 1e-6
"""s; match times closer than this are the same instant."""

CLOCK_SKEW = 0.2
"""s of match time by which a stamp of another node may be ahead."""


@dataclass(frozen=True, slots=True)
class Tick:
    """One call of a node.

    Args:
        time: match time, s.
        live: False when the world's clock has stopped: `time` is then the last that was heard, the tick comes by
            real time, and a node may only stop things and tell of it.
    """

    time: float
    live: bool = True


class Node(ABC):
    """A referee, a player, the world, a window, the recorder.

    A node declares its subscriptions in its constructor, on the mailbox it is given, and opens nothing there: that is
    for `start`. It never blocks, sleeps, reads a
    clock or touches the network; what it does is a function of its ticks and its messages alone.

    Args:
        name: unique among the nodes of its kind in a match.
        mailbox: the node's own.
        period: s of match time between ticks.
    """

    kind: ClassVar[str]

    def __init__(self, name: str, mailbox: Mailbox, period: float) -> None:
        self.name = name
        self.mailbox = mailbox
        self.period = period

    def start(self) -> None:  # noqa: B027 - most nodes need nothing but their mailbox
        """Open what the node needs. Called once before the first tick, when the node is known to be the only one."""

    @abstractmethod
    def tick(self, tick: Tick) -> None:
        """Read the inlets, decide, publish."""

    def stop(self) -> None:  # noqa: B027 - a node without a robot has nothing to stop
        """Called once, when the node will not be ticked again: leave every robot stopped.

        What it publishes is still sent.
        """


def due_index(time: float, period: float) -> int:
    """How many periods have begun by `time`: a node is due when this has risen since its last tick.

    A function of time alone, so that every executor ticks a node at the same instants.
    """
    return int((time + TIME_TOLERANCE) / period)


def is_fresh(stamp: float, now: float, limit: float) -> bool:
    """Whether what was stamped is at most `limit` seconds of match time old.

    Two nodes' clocks differ by a tick; a stamp further ahead is of before the world stepped back to a snapshot.
    """
    return -CLOCK_SKEW <= now - stamp <= limit
