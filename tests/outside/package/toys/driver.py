"""A robot that glides exactly as it is told: a driver that knows no bus and no match."""

import math
from typing import ClassVar

from vrg.errors import RobotError, StaleDataError
from vrg.geometry import along_arc, wrap
from vrg.hal.driver import COMMAND_TIMEOUT, Driver, DriverContext
from vrg.hal.readings import Readings
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.hal.settings import BackendSettings
from vrg.types import STILL, Pose, Twist

STEP = 0.01


class HoverSettings(BackendSettings):
    """`[backends.hover]`: a file whose existence is a fault of the robot that latches."""

    fault_file: str = ""


class HoverDriver(Driver):
    settings = HoverSettings
    measures: ClassVar[frozenset[str]] = frozenset({"odometry"})

    def __init__(self, context: DriverContext) -> None:
        super().__init__(context.name, context.model)
        self._now = context.now
        own = HoverSettings.model_validate(context.options)
        self._fault_file = context.base / own.fault_file if own.fault_file else None
        self._connected = self._armed = self._fault = self.cut = False
        self._pose, self._twist, self._at, self._until, self._heard = Pose(0, 0, 0), STILL, 0.0, 0.0, -math.inf

    def connect(self) -> None:
        if not self._connected:
            self._connected, self._at = True, self._now()

    def arm(self) -> None:
        if not self._connected:
            raise RobotError("connect it first", self.name)
        self._glide()
        if self._fault:
            raise RobotError("it has a fault", self.name)
        self._armed = True

    def drive(self, twist: Twist) -> None:
        self._glide()
        if not self._armed:
            raise RobotError("arm it first", self.name)
        self._twist = twist
        self._until = self._now() + COMMAND_TIMEOUT

    def read(self) -> Readings:
        self._glide()
        if not math.isfinite(self._heard):
            raise StaleDataError("it has said nothing yet", self.name)
        age = self._now() - self._heard
        odometry = Sample(self._heard, age, Odometry(pose=self._pose, twist=self._twist))
        fault = "the fault file is there" if self._fault else None
        return Readings(
            self._heard, age, self._armed, estop=False, fault=fault, latched=self._fault, samples=[odometry]
        )

    def stop(self) -> None:
        self._glide()
        self._twist = STILL

    def disarm(self) -> None:
        self.stop()
        self._armed = False

    def recover(self) -> None:
        self._fault = False

    def close(self) -> None:
        self.disarm()
        self._connected = False

    def _glide(self) -> None:
        now = self._now()
        if self._fault_file is not None and self._fault_file.exists():
            self._fault, self._armed, self._twist = True, False, STILL
        while self._connected and self._at + STEP <= now:
            self._at += STEP
            if self._at > self._until:
                self._twist = STILL
            pose = along_arc(self._pose, self._twist, STEP)
            self._pose = Pose(pose.x, pose.y, wrap(pose.theta))
        if self._connected and not self.cut:
            self._heard = now
