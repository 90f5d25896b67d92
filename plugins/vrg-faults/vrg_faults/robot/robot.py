"""The robot that things happen to: the driver and the device of real ones, two emulated drives, a simulated bus."""

from contextlib import suppress
from dataclasses import dataclass, field

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Message
from vrg.bus.topics import Keys, Topic
from vrg.errors import RobotError, StaleDataError
from vrg.hal.can.driver import CanDriver
from vrg.hal.can.link import Link
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.workshop.simulation import Port, Simulation
from vrg.hal.device import Device
from vrg.hal.driver import DriverContext
from vrg.hal.models import robot_model
from vrg.hal.readings import Readings
from vrg.testing.can_robot import RATIO, adapter_of, deliver
from vrg.types import STILL, Pose, Twist

NODE_IDS = (1, 2)
"""The ids of its left and its right drive."""
OTHER = 3
"""The id of a drive of another robot on the same bus."""
LINK = Link(interface="virtual", channel="faults")
KEYS = Keys("faults")


@dataclass
class Robot:
    """The process of a player: what it has on the match's bus, and on the CAN bus."""

    simulation: Simulation
    protocol: str
    mailbox: Mailbox = field(default_factory=Mailbox)
    connected: bool = False
    sequence: int = 0

    def __post_init__(self) -> None:
        left, right = NODE_IDS
        wiring = {
            "left": [left],
            "right": [right],
            "ratio": RATIO,
            "options": PROTOCOLS.get(self.protocol).drive_type.wiring,
        }
        table = {"interface": "virtual", "channel": LINK.channel, "protocol": self.protocol, "robots": {"r": wiring}}
        clock = self.simulation.clock
        context = DriverContext(name="r", model=robot_model("P2AT"), options=table, now=clock.now)
        self.driver = CanDriver(context, self.simulation)
        self.device = Device(self.driver, KEYS, self.mailbox, start=Pose(0.0, 0.0, 0.0), clock=clock)

    @property
    def port(self) -> Port:
        """Its adapter."""
        return adapter_of(self.driver)

    def hear(self, topic: Topic[Message], body: Message) -> None:
        """A message is published on the match's bus."""
        self.sequence += 1
        deliver(self.mailbox, Received(topic.key, self.simulation.clock.now(), self.sequence, body))

    def tick(self, twist: Twist) -> tuple[Readings | None, Twist]:
        """Do what a player does in a tick; return what it has read, and the twist that was sent."""
        self.mailbox.handover(self.simulation.clock.now())
        self.device.hear()
        self.mailbox.collect()
        try:
            readings = self.device.read()
        except StaleDataError:
            self.device.stop()
            return None, STILL
        self.mailbox.collect()
        sent = STILL
        if readings.fault or readings.estop or readings.age > 0.3:
            self.device.stop()
        else:
            with suppress(RobotError):
                if readings.armed:
                    sent = self.device.drive(twist)
                else:
                    self.device.arm()
        return readings, sent
