"""One motor axis as the layers above see it, whatever protocol its drive speaks.

    SILENT -> IDLE -> STARTING -> CLOSED_LOOP
                ^________|____________|          idle(), or the drive's own watchdog
                FAULT, ESTOP                      latched in the drive until clear()

Angles are turns of the motor's shaft, before any gear. An axis neither waits nor reads a clock: it hears frames, and
sends them through the function that it was given.
"""

import enum
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

from vrg.hal.can.frame import Frame

NEVER = -math.inf
"""Stamp of what has not been heard yet, s."""


class State(enum.Enum):
    """What a drive says of its axis, and what it was asked for."""

    SILENT = "silent"
    IDLE = "idle"
    STARTING = "starting"
    CLOSED_LOOP = "closed loop"
    FAULT = "fault"
    ESTOP = "emergency stop"


class Axis(ABC):
    """One axis.

    Args:
        node: the drive's id on the bus.
        send: sends a frame.

    Attributes:
        heard: monotonic s of the newest heartbeat. state: by it.
        fault: errors that the drive has latched, in words; None while it has none.
        starved: the drive has stopped the motor because no setpoint came: its watchdog.
        position, velocity: turn and turn/s of the shaft. measured: monotonic s of both.
        wrap: turns after which `position` begins anew, 0 = never.
        voltage: of its supply, V; None before it was told.
        odd: what makes no sense in what was heard, in words: rubbish, a number that is none, another master.
        serial, firmware: in words, empty before they are known.
    """

    protocol: ClassVar[str]

    def __init__(self, node: int, send: Callable[[Frame], None]) -> None:
        self.node = node
        self._send = send
        self.heard = NEVER
        self.state = State.SILENT
        self.fault: str | None = None
        self.starved = False
        self.position = 0.0
        self.velocity = 0.0
        self.measured = NEVER
        self.wrap = 0.0
        self.voltage: float | None = None
        self.odd: str | None = None
        self.serial = ""
        self.firmware = ""

    @classmethod
    @abstractmethod
    def check_node(cls, node: int) -> str | None:
        """Why a drive cannot have this id, or None."""

    @property
    @abstractmethod
    def filters(self) -> list[tuple[int, int]]:
        """The identifiers (wanted, mask) that this axis must hear."""

    @property
    @abstractmethod
    def identified(self) -> bool:
        """Whether all is known that `problem` needs."""

    @property
    @abstractmethod
    def problem(self) -> str | None:
        """Why this drive cannot be used as it is: a version, a second one of the same id; None if nothing is known."""

    @abstractmethod
    def receive(self, frame: Frame) -> None:
        """Hear a frame, of whatever node."""

    @abstractmethod
    def identify(self) -> None:
        """Ask the drive who it is; the answers come to `receive`."""

    @abstractmethod
    def prepare(self) -> None:
        """Set up what the protocol needs before a start, without energising; may wait for the drive's answers.

        Raises:
            RobotError: the drive refuses, or does not answer.
        """

    @abstractmethod
    def start(self) -> None:
        """Ask for closed-loop velocity control, with a setpoint of zero."""

    @abstractmethod
    def command(self, velocity: float) -> None:
        """Send a setpoint, turn/s; it also goes on with a start that takes several steps."""

    @abstractmethod
    def idle(self) -> None:
        """Switch the motor off."""

    @abstractmethod
    def stop_now(self) -> None:
        """The emergency stop: switch the motor off, by the shortest way that the protocol has."""

    @abstractmethod
    def clear(self) -> None:
        """Forget latched errors; the motor stays off. Only ever by an explicit act of a person, or after `starved`."""

    def forget_oddities(self) -> None:
        """Judge anew what is heard from now on."""
        self.odd = None

    def _estimate(self, position: float, velocity: float, at: float) -> None:
        """Take in an encoder's estimate, unless it is no number."""
        if math.isfinite(position) and math.isfinite(velocity):
            self.position, self.velocity, self.measured = position, velocity, at
        else:
            self._complain(f"its encoder says {position} turn, {velocity} turn/s")

    def _complain(self, words: str) -> None:
        """Remember the first oddity."""
        self.odd = self.odd or words
