"""The interface to a robot's motors and sensors, which the author of a backend implements (thesis 3.1.2, Appendix B).

    features -> connect() -> arm() -> drive() / read() ... -> stop() -> disarm() -> close()

A driver knows no bus, no keys and no match: what the match has to say to a robot is the device's business
(vrg.hal.device), which is written once for all drivers. A driver is called by one thread, but for `recover`, which may
take long and has a thread of its own, and for `emergency_stop`, which may come at any time.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, ClassVar, Self

from vrg.hal.models import RobotModel
from vrg.hal.readings import Readings
from vrg.types import Twist

if TYPE_CHECKING:
    from vrg.hal.settings import BackendSettings

COMMAND_TIMEOUT = 0.2
"""s without a fresh drive command after which every driver stops the motors."""


@dataclass(frozen=True, kw_only=True)
class DriverContext:
    """What a driver is constructed from.

    Args:
        name: the robot's in the match. model: its description.
        options: the backend's own table in the match file. base: folder that relative paths in it start from.
        now: the time that stamps are told in, s: match time in a match.
    """

    name: str
    model: RobotModel
    options: Mapping[str, Any] = field(default_factory=dict)
    base: Path = Path()
    now: Callable[[], float] = time.monotonic


class Driver(ABC):
    """See the module. Connecting never energises a motor; arming is a step of its own.

    Args:
        name: the robot's name, for messages.
        model: its description; readable before connecting.

    Attributes:
        physical: it drives a physical robot, which a person must carry to its place.
        settings: checks the backend's own table in a match file; None where it has none.
        measures: the kinds of sensors that it reads itself. Of those that the model has besides, the world simulates
            what it can from the robot's place.
    """

    physical: ClassVar[bool] = True
    settings: "ClassVar[type[BackendSettings] | None]" = None
    measures: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, name: str, model: RobotModel) -> None:
        self.name = name
        self.features = model

    @abstractmethod
    def connect(self) -> None:
        """Open the way to the robot. Idempotent; energises nothing.

        Raises:
            RobotError: it cannot be reached.
        """

    @abstractmethod
    def arm(self) -> None:
        """Let the motors accept commands.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """

    @abstractmethod
    def drive(self, twist: Twist) -> Twist:
        """Command a motion of the body; it holds for COMMAND_TIMEOUT at most.

        Returns:
            what was really sent, after the limits of the robot. The curve stays: v and w are scaled alike.

        Raises:
            RobotError: not armed, a fault, the emergency stop, or a number that is not finite.
        """

    @abstractmethod
    def read(self) -> Readings:
        """The newest readings, each with its stamp and its age.

        Raises:
            StaleDataError: the robot has said nothing yet.
        """

    @abstractmethod
    def stop(self) -> None:
        """Command zero speed; stays armed. Never raises for a robot that is connected."""

    @abstractmethod
    def disarm(self) -> None:
        """Stop, and let the motors accept no command until armed again. Idempotent."""

    def emergency_stop(self) -> None:
        """Disarm by the shortest way there is. Called the moment that the stop arrives, also between two ticks."""
        self.disarm()

    def release(self) -> None:  # noqa: B027 - where the emergency stop is not latched in the robot nothing is to be done
        """A person has released the emergency stop. The motors stay off until armed again."""

    def recover(self) -> None:  # noqa: B027 - where faults do not latch there is nothing to do
        """Forget a fault that has latched, as a person has decided; stays disarmed. What is still wrong comes back."""

    @abstractmethod
    def close(self) -> None:
        """Disarm and let go. Idempotent."""

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
