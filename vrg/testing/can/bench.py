"""A CAN robot with emulated drives, on a simulated bus, for tests."""

import random
from collections.abc import Sequence
from typing import Any, Self

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease, Message, Recover
from vrg.bus.topics import Keys, Topic
from vrg.hal.can.driver import CanDriver
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.workshop.emulated import DriveOptions, EmulatedDrive
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.workshop.simulation import Port, Simulation
from vrg.hal.device import Device
from vrg.hal.driver import DriverContext
from vrg.hal.models import RobotModel, robot_model
from vrg.testing.can.vcan import INTERFACE
from vrg.testing.can_robot import RATIO, adapter_of, deliver
from vrg.testing.driver import DriverBench
from vrg.types import Pose

KEYS = Keys("test")
LINK = Link(channel=INTERFACE)
HERE = Link(interface="virtual", channel="here")
"""A bus within this process."""
START = Pose(1.0, 2.0, 0.5)
NODES = {name: ([0], [1]) if name == "odrive" else ([1], [2]) for name in PROTOCOLS.names()}
"""The ids of a robot's drives, left and right, by each protocol that is installed."""
PATIENCE = 20.0
"""s of simulated time for a condition that a test waits for."""
STEP = 0.02


def settings(
    protocol: str, left: Sequence[int], right: Sequence[int], link: Link = LINK, **wiring: object
) -> dict[str, Any]:
    """The table [backends.can] of one robot, `r`."""
    robot = {
        "left": list(left),
        "right": list(right),
        "ratio": RATIO,
        "options": PROTOCOLS.get(protocol).drive_type.wiring,
        **wiring,
    }
    return {"interface": link.interface, "channel": link.channel, "protocol": protocol, "robots": {"r": robot}}


class Lab:
    """The simulation of the test that runs: every test begins with a new one."""

    simulation = Simulation()


class Drives:
    """Emulated drives on a simulated bus, by default those that NODES has; a context manager."""

    def __init__(
        self,
        protocol: str,
        nodes: Sequence[int] | None = None,
        *,
        watchdog: float = 0.25,
        serial: int = 0x1000,
        link: Link = LINK,
    ) -> None:
        nodes = [node for side in NODES[protocol] for node in side] if nodes is None else nodes
        kind = PROTOCOLS.get(protocol).drive_type
        now = Lab.simulation.clock.now()
        self.drives: list[EmulatedDrive] = [
            kind(node, DriveOptions(serial=serial + i, watchdog=watchdog), now, random.Random(serial + i))
            for i, node in enumerate(nodes)
        ]
        self._wire = Lab.simulation.wire(link)

    def __enter__(self) -> "Drives":
        self._wire.attach(self.drives)
        return self

    def __exit__(self, *_: object) -> None:
        self._wire.detach(self.drives)


class CanBench(DriverBench):
    """The driver of one robot, by default with the drives that NODES has. Time is the simulation's."""

    driver: CanDriver

    def __init__(
        self,
        protocol: str,
        left: Sequence[int] | None = None,
        right: Sequence[int] | None = None,
        *,
        link: Link = LINK,
        model: RobotModel | None = None,
        **wiring: object,
    ) -> None:
        if left is None or right is None:
            left, right = NODES[protocol]
        self.nodes = [*left, *right]
        self.clock = Lab.simulation.clock
        self.wire = Lab.simulation.wire(link)
        options = settings(protocol, left, right, link, **wiring)
        model = model or robot_model("P2AT")
        context = DriverContext(name="r", model=model, options=options, now=self.clock.now)
        self.driver = CanDriver(context, Lab.simulation)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def port(self) -> Port:
        """The driver's adapter."""
        return adapter_of(self.driver)

    @property
    def now(self) -> float:
        """Simulated time, s."""
        return self.clock.now()

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        self.clock.sleep(seconds)

    def cut(self) -> None:
        """The drives fall silent."""
        for node in self.nodes:
            self.fault(node, FaultKind.SILENCE)

    def fault(self, node: int, kind: FaultKind, duration: float = 0.0, value: int = 0) -> None:
        """Let something go wrong in a drive."""
        self.inject(encode_fault(node, FaultRequest(kind, duration, value)))

    def inject(self, frame: Frame) -> None:
        """Put a frame on the bus."""
        assert self.wire.put(frame), "the bus is full"

    def close(self) -> None:
        """Let go of the bus."""
        self.driver.close()


class DeviceBench(CanBench):
    """The same robot in a match: a device around its driver, and a mailbox on which the match is heard."""

    def __init__(self, protocol: str, *sides: Sequence[int], link: Link = LINK, **wiring: Any) -> None:
        super().__init__(protocol, *sides, link=link, **wiring)
        self.mailbox = Mailbox()
        self.said: list[tuple[str, Message]] = []
        self.device = Device(self.driver, KEYS, self.mailbox, start=START, clock=self.clock)
        self._sequence = 0

    @property
    def trouble(self) -> str:
        """The fault that the robot tells of; empty where there is none."""
        return self.device.read().fault or ""

    def advance(self, seconds: float) -> None:
        """Let time pass; each tick begins as an executor and a player begin it."""
        until = self.now + seconds
        while True:
            self.mailbox.handover(self.now)
            self.device.hear()
            self.said += [(out.message.key, out.message.body) for out in self.mailbox.collect()]
            left = until - self.now
            if left <= 1e-9:
                return
            self.clock.sleep(min(STEP, left))

    def hear(self, topic: Topic[Any], body: Message) -> None:
        """Somebody on the match's bus says something; an alarm is raised at once."""
        self._sequence += 1
        deliver(self.mailbox, Received(topic.key, self.mailbox.now, self._sequence, body))

    def estop(self, engaged: bool) -> None:
        """Somebody engages or releases the emergency stop on the match's bus."""
        if engaged:
            self.hear(KEYS.estop, Estop(by="test"))
        else:
            self.hear(KEYS.estop_release, EstopRelease(by="test"))

    def recover(self) -> None:
        """An official asks for it."""
        self.hear(KEYS.recover("r"), Recover(by="test"))

    def close(self) -> None:
        """Let go of the bus."""
        self.device.close()
        super().close()
