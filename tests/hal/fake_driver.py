"""A driver that remembers what it was told, for tests of what is above it."""

from vrg.bus.messages import SensorMessage
from vrg.errors import RobotError, StaleDataError
from vrg.hal.driver import Driver
from vrg.hal.models import robot_model
from vrg.hal.readings import Readings
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.types import STILL, Pose, Twist

MODEL = robot_model("P2AT")
POSE = Pose(1.0, 2.0, 0.0)


class FakeDriver(Driver):
    """Says of itself what the test has set."""

    physical = False

    def __init__(self, name: str = "a") -> None:
        super().__init__(name, MODEL)
        self.armed = False
        self.told: list[str] = []
        self.stamp = 0.0
        self.age = 0.0
        self.fault: str | None = None
        self.latched = False
        self.blind = False
        self.samples: list[Sample[SensorMessage]] = [
            Sample(0.0, 0.0, Ins(pose=POSE)),
            Sample(0.0, 0.0, Odometry(pose=POSE, twist=STILL)),
        ]

    def connect(self) -> None:
        self.told.append("connect")

    def arm(self) -> None:
        self.told.append("arm")
        self.armed = True

    def drive(self, twist: Twist) -> None:
        if not self.armed:
            raise RobotError("not armed")
        self.told.append(f"drive {twist.v:.2f} {twist.w:.2f}")

    def read(self) -> Readings:
        if self.blind:
            raise StaleDataError("no reading has arrived yet", self.name)
        return Readings(self.stamp, self.age, self.armed, False, self.fault, self.latched, list(self.samples))

    def stop(self) -> None:
        self.told.append("stop")

    def disarm(self) -> None:
        self.armed = False
        self.told.append("disarm")

    def emergency_stop(self) -> None:
        self.armed = False
        self.told.append("emergency stop")

    def release(self) -> None:
        self.told.append("release")

    def recover(self) -> None:
        self.told.append("recover")

    def close(self) -> None:
        self.disarm()
        self.told.append("close")


class PhysicalFake(FakeDriver):
    """Drives a physical robot that measures its way by odometry, and has no laser."""

    physical = True
    measures = frozenset({"odometry"})

    def __init__(self, name: str = "a") -> None:
        super().__init__(name)
        self.samples = [Sample(0.0, 0.0, Odometry(pose=Pose(0.0, 0.0, 0.0), twist=STILL))]

    def at(self, pose: Pose, stamp: float, age: float = 0.0, twist: Twist = STILL) -> None:
        """Its odometry says so."""
        self.samples = [Sample(stamp, age, Odometry(pose=pose, twist=twist))]
