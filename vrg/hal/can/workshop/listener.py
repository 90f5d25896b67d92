"""The contract by which one protocol recognises the frames and nodes on a bus, for people who want to see them."""

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, Generic, TypeVar

from vrg.errors import RobotError
from vrg.hal.can.axis import AxisReport, Send
from vrg.hal.can.frame import Frame
from vrg.hal.clock import MonotonicClock


class Claim(enum.IntEnum):
    """The certainty of a protocol that a frame is one of its own."""

    NONE = 0
    LIKELY = 1
    """It looks like one, but frames of other protocols may look the same: the node is recognised once it has been heard
    REPEATS times in a row."""
    FITTING = 2
    """It is of a node that was recognised by frames which look like it, or an answer to what was asked."""
    CERTAIN = 3
    """Hardly any other protocol has such a frame, or its identifier belongs to a node that was recognised by one."""


REPEATS = 3
"""Frames of one identifier in a row that must look like those of a protocol before there is a node."""

NodeT = TypeVar("NodeT", bound=AxisReport)
"""What listens to one node: the axis of the protocol, or another report."""


class Listener(ABC, Generic[NodeT]):
    """The nodes of one protocol on a bus, each as its axis hears it. A subclass recognises frames, and assigns them.

    What an axis hears must not let it send: who only listens to a bus disturbs nobody.

    `claim` and `hear` are called by the bus' receive thread, or under the listener's lock. `greet` and `ask`
    are called by another thread, without that lock, so that they may wait for answers.

    Args:
        send: sends a frame.
        clock: the time by which answers are waited for.

    Attributes:
        word: the protocol's word in tables. title: its name in sentences.
        node_type: makes what listens to one node, by its id: an axis that is never started.
        found: the nodes by id. known_by: the frames by which they were recognised.
    """

    word: ClassVar[str]
    title: ClassVar[str]
    node_type: Callable[[int, Send, MonotonicClock], NodeT]

    def __init__(self, send: Send, clock: MonotonicClock) -> None:
        self._send = send
        self._clock = clock
        self.found: dict[int, NodeT] = {}
        self.known_by: dict[int, Frame] = {}

    @abstractmethod
    def claim(self, frame: Frame) -> Claim:
        """The certainty of this protocol that a frame is its own, by all frames before."""

    @abstractmethod
    def hear(self, frame: Frame) -> None:
        """Take in a frame that no other protocol claims more firmly."""

    def greet(self) -> None:
        """Ask everybody on the bus who they are."""

    def owns(self, frame: Frame) -> bool:
        """True if a frame has an identifier of a node that was recognised: no other protocol may send it.

        The node, or who drives it, would take it for one of their own.
        """
        return False

    @abstractmethod
    def ask(self, node: NodeT) -> None:
        """Ask a node of this protocol for all that it does not send by itself.

        It may wait for answers, but for one that does not come only ANSWER_TIMEOUT s in all.

        Raises:
            RobotError: a question could not be sent.
        """

    @abstractmethod
    def stop(self) -> None:
        """Switch every motor on the bus off, whichever process switched it on, also of drives that have not been heard.

        Those that are known are ordered first. Whether they are off is what they report afterwards.

        Raises:
            RobotError: it could not be sent.
        """

    @abstractmethod
    def clear(self, node: NodeT) -> None:
        """Let a node forget its latched errors; its motor stays off.

        Raises:
            RobotError: it could not be sent.
        """

    def rename(self, node: NodeT, serial: str, to: int) -> None:
        """Give the drive of this id and serial number another id.

        Raises:
            RobotError: it could not be sent, or this protocol cannot do it.
        """
        raise RobotError(f"{self.title} drives get their id from their maker's own tool, not over the bus")

    def read(self, node: NodeT, setting: str) -> str:
        """Return the value of one of a node's settings, in words. It may wait ANSWER_TIMEOUT s.

        Args:
            setting: as people write it; see the protocol's own listener.

        Raises:
            RobotError: there is no answer, or this protocol cannot do it. ValueError: there is no such setting.
        """
        raise RobotError(f"{self.title} drives are configured with their maker's own tool, not over the bus")

    def write(self, node: NodeT, setting: str, value: str) -> None:
        """Change one of a node's settings, until it is switched off.

        Raises:
            RobotError, ValueError: as for `read`, or the value is none that it can have.
        """
        raise RobotError(f"{self.title} drives are configured with their maker's own tool, not over the bus")

    def save(self, node: NodeT) -> None:
        """Let a node keep all its settings for good.

        Raises:
            RobotError: it could not be sent, or this protocol cannot do it.
        """
        raise RobotError(f"{self.title} drives save their settings with their maker's own tool, not over the bus")

    def forget(self, node: int) -> None:
        """This node was none: its frames turned out to belong to another protocol."""
        del self.found[node], self.known_by[node]

    def _recognise(self, number: int, frame: Frame) -> NodeT:
        """The node of this id, which is new where it has not been recognised before."""
        if number not in self.found:
            self.found[number] = node = self.node_type(number, self._send, self._clock)
            self.known_by[number], node.protocol = frame, self.word
        return self.found[number]


ANSWER_TIMEOUT = 0.1
"""s that `Listener.ask` may wait for a node that does not answer."""
