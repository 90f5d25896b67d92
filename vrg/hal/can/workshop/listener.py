"""The contract by which one protocol recognises the frames and nodes on a bus, for people who want to see them."""

import enum
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from vrg.errors import RobotError
from vrg.hal.can.axis import NEVER, Axis, Send
from vrg.hal.can.frame import Frame
from vrg.hal.clock import Clock


class Claim(enum.IntEnum):
    """The certainty of a protocol that a frame is one of its own."""

    NONE = 0
    LIKELY = 1
    """It looks like one, but frames of other protocols may look the same."""
    CERTAIN = 2
    """Hardly any other protocol has such a frame, or its identifier belongs to a node that was recognised by one."""


@dataclass
class Found:
    """One node on a bus.

    Args:
        protocol: the protocol's word in tables, for example `odrive`.
        node: the id of the node.
        known_by: the frame by which it was recognised.
        state: the node's state in words. errors: its errors in words; empty where there is none.
        firmware: the version in words; empty before it is known.
        heard: monotonic time of its newest heartbeat, s.
        serials: the serial numbers that answered for this node, in words: two drives may share an id by mistake.
        on: its motor is switched on; None before that is known.
        position: turns of the shaft. velocity: turn/s. voltage: of its supply, V. Each is None before it is known.
    """

    protocol: str
    node: int
    known_by: Frame
    state: str = ""
    errors: str = ""
    firmware: str = ""
    heard: float = 0.0
    serials: tuple[str, ...] = ()
    on: bool | None = None
    position: float | None = None
    velocity: float | None = None
    voltage: float | None = None


class Listener(ABC):
    """The nodes of one protocol on a bus. A subclass recognises and decodes its frames.

    `claim` and `hear` are called by the bus' receive thread, or under the listener's lock. `greet` and `ask`
    are called by another thread, without that lock, so that they may wait for answers.

    Args:
        send: sends a frame.
        clock: the time by which answers are waited for.

    Attributes:
        word: the protocol's word in tables. title: its name in sentences.
        found: the nodes by id.
    """

    word: ClassVar[str]
    title: ClassVar[str]

    def __init__(self, send: Send, clock: Clock) -> None:
        self._send = send
        self._clock = clock
        self.found: dict[int, Found] = {}

    @abstractmethod
    def claim(self, frame: Frame) -> Claim:
        """The certainty of this protocol that a frame is its own, by all frames before."""

    @abstractmethod
    def hear(self, frame: Frame) -> None:
        """Take in a frame that no other protocol claims more firmly."""

    def greet(self) -> None:  # noqa: B027 - not every protocol has a question to everybody
        """Ask everybody on the bus who they are."""

    @abstractmethod
    def ask(self, node: Found) -> None:
        """Ask a node of this protocol for all fields of `Found`.

        It may wait for answers, but for one that does not come only ANSWER_TIMEOUT s in all.

        Raises:
            RobotError: a question could not be sent.
        """

    @abstractmethod
    def stop(self) -> None:
        """Switch every motor on the bus off, whichever process switched it on, also of drives that have not been heard.

        Raises:
            RobotError: it could not be sent.
        """

    @abstractmethod
    def clear(self, node: Found) -> None:
        """Let a node forget its latched errors; its motor stays off.

        Raises:
            RobotError: it could not be sent.
        """

    def rename(self, node: Found, serial: str, to: int) -> None:
        """Give the drive of this id and serial number another id.

        Raises:
            RobotError: it could not be sent, or this protocol cannot do it.
        """
        raise RobotError(f"{self.title} drives get their id by their maker's own tool, not over the bus")

    def read(self, node: Found, setting: str) -> str:
        """Return the value of one of a node's settings, in words. It may wait ANSWER_TIMEOUT s.

        Args:
            setting: as people write it; see the protocol's own listener.

        Raises:
            RobotError: there is no answer, or this protocol cannot do it. ValueError: there is no such setting.
        """
        raise RobotError(f"{self.title} drives are configured by their maker's own tool, not over the bus")

    def write(self, node: Found, setting: str, value: str) -> None:
        """Change one of a node's settings, until it is switched off.

        Raises:
            RobotError, ValueError: as for `read`, or the value is none that it can have.
        """
        raise RobotError(f"{self.title} drives are configured by their maker's own tool, not over the bus")

    def save(self, node: Found) -> None:
        """Let a node keep all its settings for good.

        Raises:
            RobotError: it could not be sent, or this protocol cannot do it.
        """
        raise RobotError(f"{self.title} drives save their settings by their maker's own tool, not over the bus")

    def forget(self, node: int) -> None:
        """This node was none: its frames turned out to belong to another protocol."""
        del self.found[node]

    def _recognise(self, node: int, frame: Frame) -> Found:
        """The node of this id, which is new where it has not been recognised before."""
        return self.found.setdefault(node, Found(self.word, node, frame))


class AxisListener(Listener):
    """A listener whose nodes are heard by the axes that drive them. A subclass assigns frames to nodes.

    Attributes:
        axis_type: the protocol's axis. axes: those of the nodes by id.
    """

    axis_type: ClassVar[type[Axis]]

    def __init__(self, send: Send, clock: Clock) -> None:
        super().__init__(send, clock)
        self.axes: dict[int, Any] = {}

    def clear(self, node: Found) -> None:
        """Let a node forget its errors."""
        self.axes[node.node].clear()

    def forget(self, node: int) -> None:
        """This node was none."""
        super().forget(node)
        del self.axes[node]

    def _tell(self, number: int, frame: Frame) -> Found:
        """Let the axis of a node hear a frame; what it then reports."""
        if number not in self.axes:
            self.axes[number] = self.axis_type(number, self._send, self._clock)
        axis = self.axes[number]
        axis.receive(frame)
        node = self._recognise(number, frame)
        if axis.heard != NEVER:
            node.heard = axis.heard
        node.state, node.errors, node.on = axis.words, axis.fault or "", axis.on
        node.firmware, node.serials, node.voltage = axis.firmware, tuple(sorted(axis.serials)), axis.voltage
        return node


ANSWER_TIMEOUT = 0.1
"""s that `Listener.ask` may wait for a node that does not answer."""
