"""The interface to a robot, the same for every backend (thesis 3.1.2 and Appendix B).

    features -> connect() -> arm() -> drive() / read() ... -> stop() -> disarm() -> close()

Connecting never energises a motor; arming is a step of its own.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from types import TracebackType
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from vrg.bus.codec import Received
from vrg.bus.messages import Laser, Pose
from vrg.hal.models import RobotModel
from vrg.hal.settings import BackendSettings

COMMAND_TIMEOUT = 0.2
"""s without a fresh drive command after which every backend stops the motors."""


@dataclass(frozen=True, slots=True)
class Wheels:
    """Wheel speeds, rad/s, positive = forward."""

    left: float
    right: float


@dataclass(frozen=True, slots=True)
class Scan:
    """One reading of a planar range finder.

    Args:
        stamp: match time of the scan, s. age: s since then.
        angles: shape (beams,), rad in the robot's frame.
        ranges: shape (beams,), m; `range_max` where a beam met nothing.
    """

    stamp: float
    age: float
    angles: npt.NDArray[np.float64]
    ranges: npt.NDArray[np.float32]
    range_max: float


@dataclass(frozen=True, slots=True)
class Readings:
    """What a robot's sensors say.

    Args:
        stamp: match time of the reading, s. age: s since then.
        ins: pose by the inertial navigation system, map frame.
        odometry: pose by wheel odometry since the start; drifts.
        v, w: body velocity by the wheels, m/s and rad/s.
        encoders: ticks, left and right.
        touch: each bumper, True = in contact.
        battery: charge left, 0 to 1.
        fault: what is wrong, in words.
        laser: None where the robot has none, or before the first scan.
        latched: the fault, or an emergency stop that was pressed at the robot itself, stays until a person clears it.
    """

    stamp: float
    age: float
    ins: Pose
    odometry: Pose
    v: float
    w: float
    encoders: tuple[int, int]
    touch: tuple[bool, ...]
    battery: float
    armed: bool
    estop: bool
    fault: str | None
    laser: Scan | None
    latched: bool = False


class Robot(ABC):
    """A robot with wheels on its left and right.

    Args:
        name: the robot's name in the match.
        model: its description; readable before connecting.

    Attributes:
        settings: checks the backend's own table in a match file; None where it has none.
    """

    settings: ClassVar[type[BackendSettings] | None] = None

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
            RobotError: not connected, or the emergency stop is engaged.
        """

    @abstractmethod
    def drive(self, left: float, right: float) -> Wheels:
        """Command wheel speeds, rad/s; hold for COMMAND_TIMEOUT at most.

        Returns:
            what was really sent, after the model's limits. Both sides are scaled alike, so that the curve stays.

        Raises:
            RobotError: not armed, or a speed that is not finite.
        """

    @abstractmethod
    def read(self) -> Readings:
        """The newest readings, with their age.

        Raises:
            StaleDataError: none has come yet.
        """

    @abstractmethod
    def stop(self) -> None:
        """Command zero speed; stays armed. Never raises for a robot that is connected."""

    @abstractmethod
    def disarm(self) -> None:
        """Stop, and let the motors accept no command until armed again. Idempotent."""

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


def limit_wheels(left: float, right: float, limit: float) -> Wheels:
    """Scale both wheel speeds alike so that neither exceeds `limit` (rad/s)."""
    fastest = max(abs(left), abs(right))
    if fastest <= limit:
        return Wheels(left, right)
    scale = limit / fastest
    return Wheels(left * scale, right * scale)


def scan_of(received: Received[Laser], now: float) -> Scan:
    """A scan that came over the bus, looked at at match time `now`.

    Its age is the distance of its stamp from now either way: one that is far ahead is of before the world was set back
    to a snapshot.
    """
    laser = received.body
    ranges = laser.ranges
    return Scan(
        stamp=received.stamp,
        age=abs(now - received.stamp),
        angles=laser.angle_min + laser.angle_step * np.arange(len(ranges), dtype=np.float64),
        ranges=ranges,
        range_max=laser.range_max,
    )
