"""A CAN robot with emulated drives, on vcan0 or in this process, for tests: real time, real frames."""

import random
import threading
import time
from collections.abc import Sequence
from typing import Any

from tests.vcan import INTERFACE
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease, Message, Recover
from vrg.bus.topics import Keys, Topic
from vrg.errors import RobotError
from vrg.hal.can.bus import message_of
from vrg.hal.can.driver import CanDriver
from vrg.hal.can.emulator.drive import DriveOptions, EmulatedDrive
from vrg.hal.can.emulator.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.emulator.run import run_drives
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.opening import open_bus
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.device import Device
from vrg.hal.driver import DriverContext
from vrg.hal.models import robot_model
from vrg.testing.driver import DriverBench, arm
from vrg.types import Pose, Twist

KEYS = Keys("test")
LINK = Link(channel=INTERFACE)
HERE = Link(interface="virtual", channel="here")
"""A bus within this process."""
START = Pose(1.0, 2.0, 0.5)
NODES = {"odrive": ([0], [1]), "cia402": ([1], [2]), "moteus": ([1], [2]), "vesc": ([1], [2])}
OPTIONS = {"vesc": {"pole_pairs": 7}}
"""What the wiring must say of drives of a protocol."""
RATIO = 50.0
PATIENCE = 20.0
"""s of real time for a condition that a test waits for."""
STEP = 0.02


def settings(
    protocol: str, left: Sequence[int], right: Sequence[int], link: Link = LINK, **wiring: object
) -> dict[str, Any]:
    """The table [backends.can] of one robot, `r`."""
    robot = {"left": list(left), "right": list(right), "ratio": RATIO, "options": OPTIONS.get(protocol, {}), **wiring}
    return {"interface": link.interface, "channel": link.channel, "protocol": protocol, "robots": {"r": robot}}


class Drives:
    """Emulated drives in a thread of their own, with their own socket on the bus; a context manager."""

    def __init__(
        self, protocol: str, nodes: Sequence[int], *, watchdog: float = 0.25, serial: int = 0x1000, link: Link = LINK
    ) -> None:
        now = time.monotonic()
        kind = PROTOCOLS.get(protocol).drive_type
        self.drives: list[EmulatedDrive] = [
            kind(node, DriveOptions(serial=serial + i, watchdog=watchdog), now, random.Random(serial + i))
            for i, node in enumerate(nodes)
        ]
        self._stop = threading.Event()
        self._ready = threading.Event()
        self._thread = threading.Thread(
            target=run_drives, args=(link, self.drives, self._stop), kwargs={"ready": self._ready.set}
        )

    def __enter__(self) -> "Drives":
        self._thread.start()
        assert self._ready.wait(PATIENCE)
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()


class CanBench(DriverBench):
    """The driver of one robot. Time is real time since the bench was made."""

    driver: CanDriver

    def __init__(
        self, protocol: str, left: Sequence[int], right: Sequence[int], *, link: Link = LINK, **wiring: object
    ) -> None:
        self.nodes = [*left, *right]
        self._began = time.monotonic()
        options = settings(protocol, left, right, link, **wiring)
        self.driver = CanDriver(
            DriverContext(name="r", model=robot_model("P2AT"), options=options, now=lambda: self.now)
        )
        self._injector = open_bus(link)

    @property
    def now(self) -> float:
        """s since the bench was made."""
        return time.monotonic() - self._began

    def advance(self, seconds: float) -> None:
        """Let real time pass."""
        time.sleep(seconds)

    def run(self, twist: Twist, seconds: float) -> None:
        """Drive for a while, with a fresh command every 0.05 s.

        A machine that is busy makes some of them late. Where the drives' watchdogs have met that, it arms again, as a
        player does, and goes on for as long again.
        """
        left = round(seconds / 0.05)
        while left:
            try:
                self.driver.drive(twist)
            except RobotError:
                if self.driver.read().latched or self.driver.read().estop:
                    raise
                arm(self)
                left = round(seconds / 0.05)
                continue
            self.advance(0.05)
            left -= 1
            if not left and not self.driver.read().armed:
                left = 1  # even the last one was late

    def revive(self) -> bool:
        """Recover if the drives, which have no processor of their own, were heard too late."""
        late = "no heartbeat" in (self.driver.read().fault or "")
        if late:
            self.driver.recover()
        return late

    def cut(self) -> None:
        """The drives fall silent."""
        for node in self.nodes:
            self.fault(node, FaultKind.SILENCE)

    def fault(self, node: int, kind: FaultKind, duration: float = 0.0, value: int = 0) -> None:
        """Let something go wrong in a drive."""
        self.inject(encode_fault(node, FaultRequest(kind, duration, value)))

    def inject(self, frame: Frame) -> None:
        """Put a frame on the bus."""
        self._injector.send(message_of(frame))

    def close(self) -> None:
        """Let go of the bus."""
        self.driver.close()
        self._injector.shutdown()


class DeviceBench(CanBench):
    """The same robot in a match: a device around its driver, and a mailbox on which the match is heard."""

    def __init__(
        self, protocol: str, left: Sequence[int], right: Sequence[int], *, link: Link = LINK, **wiring: object
    ) -> None:
        super().__init__(protocol, left, right, link=link, **wiring)
        self.mailbox = Mailbox()
        self.said: list[tuple[str, Message]] = []
        self.device = Device(self.driver, KEYS, self.mailbox, start=START)
        self._sequence = 0

    def advance(self, seconds: float) -> None:
        """Let real time pass; each tick begins as an executor and a player begin it."""
        until = time.monotonic() + seconds
        while True:
            self.mailbox.sound()
            self.mailbox.handover(self.now)
            self.device.hear()
            self.said += [(out.message.key, out.message.body) for out in self.mailbox.collect()]
            left = until - time.monotonic()
            if left <= 0:
                return
            time.sleep(min(STEP, left))

    def hear(self, topic: Topic[Any], body: Message) -> None:
        """Somebody on the match's bus says something; an alarm is raised at once."""
        self._sequence += 1
        message = Received(topic.key, self.mailbox.now, self._sequence, body)
        for inlet in self.mailbox.inlets:
            if inlet.topic.key == topic.key:
                inlet.offer(message)
        self.mailbox.sound()

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
