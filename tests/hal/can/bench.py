"""A CAN robot on vcan0 with emulated drives, for tests: real time, real frames."""

import random
import threading
import time
from collections.abc import Sequence
from typing import Any

from tests.hal.contract import Bench
from tests.vcan import INTERFACE
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, Message, Pose, Recover
from vrg.bus.topics import Keys, Topic
from vrg.hal.backends import RobotContext, open_robot
from vrg.hal.can.bus import message_of, open_bus
from vrg.hal.can.emulator.drive import DriveOptions, EmulatedDrive
from vrg.hal.can.emulator.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.emulator.run import run_drives
from vrg.hal.can.emulator.table import emulated_drive
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.models import robot_model

KEYS = Keys("test")
LINK = Link(channel=INTERFACE)
NODES = {"odrive": ([0], [1]), "cia402": ([1], [2])}
RATIO = 50.0
PATIENCE = 20.0
"""s of real time for a condition that a test waits for."""
STEP = 0.02


def settings(protocol: str, left: Sequence[int], right: Sequence[int], **wiring: object) -> dict[str, Any]:
    """The table [backends.can] of one robot, `r`."""
    robot = {"left": list(left), "right": list(right), "ratio": RATIO, **wiring}
    return {"channel": INTERFACE, "protocol": protocol, "robots": {"r": robot}}


class Drives:
    """Emulated drives in a thread of their own, with their own socket on the bus; a context manager."""

    def __init__(self, protocol: str, nodes: Sequence[int], *, watchdog: float = 0.25, serial: int = 0x1000) -> None:
        now = time.monotonic()
        self.drives: list[EmulatedDrive] = [
            emulated_drive(
                protocol, node, DriveOptions(serial=serial + i, watchdog=watchdog), now, random.Random(serial + i)
            )
            for i, node in enumerate(nodes)
        ]
        self._stop = threading.Event()
        self._ready = threading.Event()
        self._thread = threading.Thread(
            target=run_drives, args=(LINK, self.drives, self._stop), kwargs={"ready": self._ready.set}
        )

    def __enter__(self) -> "Drives":
        self._thread.start()
        assert self._ready.wait(PATIENCE)
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()


class CanBench(Bench):
    """One robot of the can backend. Match time is real time since the bench was made."""

    def __init__(self, protocol: str, left: Sequence[int], right: Sequence[int], **wiring: object) -> None:
        self.nodes = [*left, *right]
        self.mailbox = Mailbox()
        self.said: list[tuple[str, Message]] = []
        self._began = time.monotonic()
        self._sequence = 0
        context = RobotContext(
            name="r",
            model=robot_model("P2AT"),
            keys=KEYS,
            mailbox=self.mailbox,
            start=Pose(1.0, 2.0, 0.5),
            options=settings(protocol, left, right, **wiring),
        )
        self.robot = open_robot("can", context)
        self._injector = open_bus(LINK)

    def advance(self, seconds: float) -> None:
        """Let real time pass, ticking the mailbox as an executor does."""
        until = time.monotonic() + seconds
        while True:
            self.mailbox.sound()
            self.mailbox.handover(time.monotonic() - self._began)
            self.said += [(out.message.key, out.message.body) for out in self.mailbox.collect()]
            left = until - time.monotonic()
            if left <= 0:
                return
            time.sleep(min(STEP, left))

    def run(self, left: float, right: float, seconds: float) -> None:
        """Drive for a while, with a fresh command every 0.05 s: a machine that is busy makes some of them late."""
        for _ in range(round(seconds / 0.05)):
            self.robot.drive(left, right)
            self.advance(0.05)

    def hear(self, topic: Topic[Any], body: Message) -> None:
        """Somebody on the match's bus says something; an alarm is raised at once."""
        self._sequence += 1
        message = Received(topic.key, self.mailbox.now, self._sequence, body)
        for inlet in self.mailbox.inlets:
            if inlet.topic.key == topic.key:
                inlet.offer(message)
        self.mailbox.sound()

    def estop(self, engaged: bool) -> None:
        """On the match's bus."""
        self.hear(KEYS.estop, Estop(engaged=engaged, by="test"))

    def recover(self) -> None:
        """An official asks for it."""
        self.hear(KEYS.recover("r"), Recover(by="test"))

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
        self.robot.close()
        self._injector.shutdown()
