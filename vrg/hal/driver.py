"""The interface to a robot's motors and sensors, which the author of a backend implements (thesis 3.1.2, Appendix B).

    features -> connect() -> arm() -> drive() / read() ... -> stop() -> disarm() -> close()

A driver knows no bus, no keys and no match. The device (vrg.hal.device), which is written once for all drivers,
enforces what the match demands of a robot. Commands come one at a time; `emergency_stop` may come from
another thread than the others, and also while the driver reads. `recover` may take long, and has a thread of its own.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, ClassVar, Self

from vrg.errors import RobotError
from vrg.hal.models import RobotModel
from vrg.hal.readings import Readings
from vrg.types import Twist

if TYPE_CHECKING:
    from vrg.hal.settings import BackendSettings

COMMAND_TIMEOUT = 0.2
"""The time in s without a fresh drive command after which every driver stops the motors."""


@dataclass(frozen=True, kw_only=True)
class DriverContext:
    """The context from which a driver is constructed.

    Args:
        name: the robot's name in the match. model: its description.
        options: the backend's own table in the match file. base: the folder that relative paths in it start from.
        now: returns the time that stamps are given in, s; it is the match time in a match.
    """

    name: str
    model: RobotModel
    options: Mapping[str, Any] = field(default_factory=dict)
    base: Path = Path()
    now: Callable[[], float] = time.monotonic


class Driver(ABC):
    """The base class of all drivers. Connecting never energises a motor; arming is a step of its own.

    Args:
        name: the robot's name, for messages.
        model: the robot's description, which can be read before connecting.

    Attributes:
        physical: True if the robot is a physical one, which a person must carry to its place.
        settings: the class that checks the backend's own table in a match file; None where the backend has no table.
        uses: the names of the actuators that the driver drives. The others of the model do nothing.
        measures: the kinds of sensors that the driver reads itself. The world simulates those other sensors of the
            model that it can simulate from the robot's pose.
    """

    physical: ClassVar[bool] = True
    settings: "ClassVar[type[BackendSettings] | None]" = None
    uses: frozenset[str] = frozenset()
    measures: frozenset[str] = frozenset()

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
        """Let the motors accept commands. It is called again until `read().armed` is True.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """

    @abstractmethod
    def drive(self, twist: Twist) -> None:
        """Command a motion of the body; it holds for COMMAND_TIMEOUT at most.

        Args:
            twist: finite, and within the limits of the model: the device sees to both, and to the referee's limits.

        Raises:
            RobotError: not armed, a fault, or the emergency stop.
        """

    def use(self, name: str, value: float) -> None:
        """Use an actuator of the robot, such as a kicker. The next motion is commanded just after it.

        A kicker kicks once, a gripper stays as it is, and a dribbler turns for COMMAND_TIMEOUT at most.

        Args:
            name: one of `uses`. value: within what that can do; see `vrg.hal.actuators`.

        Raises:
            RobotError: this driver has none of that name, or, as for `drive`, it cannot be commanded now.
        """
        raise RobotError(f"expected an actuator that its backend drives, got {name!r}", self.name)

    @abstractmethod
    def read(self) -> Readings:
        """Return the newest readings, each with its stamp and its age.

        Raises:
            StaleDataError: the robot has not reported yet.
        """

    @abstractmethod
    def stop(self) -> None:
        """Command zero speed; the robot stays armed. Never raises for a robot that is connected."""

    @abstractmethod
    def disarm(self) -> None:
        """Stop, and let the motors accept no command until the robot is armed again. Idempotent."""

    def emergency_stop(self) -> None:
        """Disarm in the fastest way possible. Called as soon as the order to stop arrives, on its own thread."""
        self.disarm()

    def release(self) -> None:  # noqa: B027 - not every robot latches its emergency stop
        """Unlatch the emergency stop, which a person has released. The motors stay off until armed again."""

    def recover(self) -> None:  # noqa: B027 - where faults do not latch there is nothing to do
        """Clear a latched fault, because a person asks for it. The robot stays disarmed.

        A fault whose cause is still there latches again.
        """

    @abstractmethod
    def close(self) -> None:
        """Disarm and release the connection to the robot. Idempotent."""

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
