"""The way to emulated Crazyflies within cflib: links whose addresses begin with `vrg://`.

An unmodified program of cflib can open them after `register()`.
"""

import math
import random
import re
import threading
from collections import deque
from collections.abc import Callable
from typing import Any, Final

import cflib.crtp
from cflib.crtp.crtpdriver import CRTPDriver
from cflib.crtp.crtpstack import CRTPPacket
from cflib.crtp.exceptions import WrongUriType

from vrg.hal.clock import REAL_CLOCK, MonotonicClock
from vrg_crazyflie.emulated.firmware import Firmware
from vrg_crazyflie.emulated.supervisor import State
from vrg_crazyflie.emulated.vehicle import STEP, Vehicle
from vrg_crazyflie.emulated.wire import COMMANDER, GENERIC, Packet

SCHEME: Final = "vrg://"
"""What the addresses of emulated Crazyflies begin with."""
LINK_TIMEOUT: Final = 1.0
"""The time in s without an answer after which a link is lost; that of a Crazyradio gives up after about as long."""
BOOT_TIME: Final = 1.0
"""The time in s from switching it on until it answers: an estimate."""
SETTLING: Final = 60.0
"""The real time in s that simulated time waits for cflib to take in what was sent: a test fails after it."""
_POWER = (0xF, 3)
"""The port and the channel of packets to the radio's own processor, which switches the other one off and on."""


class Emulated:
    """A Crazyflie in the air, and its radio.

    Args:
        name: what follows SCHEME in its address. clock: the time by which it lives. vehicle: its body.

    Attributes:
        reachable: False while no packet comes through. silent: True while it hears, but is not heard.
        loss: the share of set-points and of log values that are lost, 0 to 1; cflib has all others repeated.
    """

    def __init__(self, name: str, *, clock: MonotonicClock = REAL_CLOCK, vehicle: Vehicle | None = None) -> None:
        self.name, self.clock = name, clock
        self.vehicle = vehicle or Vehicle()
        self.firmware = Firmware(self.vehicle)
        self.reachable, self.silent, self.loss = True, False, 0.0
        self.link: EmulatedLink | None = None
        self._random = random.Random(0)
        self._lock = threading.Lock()
        self._boots: float | None = None
        """The time at which it answers again, s; infinity while it is off, None while it is on."""
        self._lived = self._unheard = clock.now()
        self._closed = False
        clock.spawn(self._run, f"emulated {name}")

    @property
    def hears(self) -> bool:
        """True if it is on, and packets come through."""
        return self.reachable and self._boots is None and self.vehicle.powered

    def receive(self, packet: Packet) -> list[Packet]:
        """The answers to a packet of a client, which may come on any thread."""
        with self._lock:
            if packet[:2] == _POWER and packet[2][:1] == b"\xfe":
                return self._switch(packet[2][1]) if self.reachable else []
            lossy = packet[0] in (GENERIC, COMMANDER) and self._random.random() < self.loss
            answers = self.firmware.receive(packet) if self.hears and not lossy else []
            return [] if self.silent else answers

    def close(self) -> None:
        """End it; its address can be used again."""
        self._closed = True
        CRAZYFLIES.pop(self.name, None)

    def _switch(self, command: int) -> list[Packet]:
        """Switch off what flies, or on again."""
        if command == 2:
            self._boots = math.inf
            self.vehicle.supervisor.state = State.LOCKED
        elif command == 3:
            self._boots = self.clock.now() + BOOT_TIME
        return [(*_POWER, b"\xfe")]

    def _run(self) -> None:
        while not self._closed:
            self._settle()  # what was sent meanwhile comes before the next step
            self._step()
            self._settle()
            self.clock.sleep(STEP)

    def _settle(self) -> None:
        link = self.link
        if link is not None and self.clock is not REAL_CLOCK:
            link.settle()

    def _step(self) -> None:
        with self._lock:
            now = self.clock.now()
            if self._boots is not None and now >= self._boots:
                self._boots = None
                self.vehicle.boot()
                self.firmware = Firmware(self.vehicle)
            while self._lived < now - 1e-9:
                self.vehicle.step()
                self._lived += STEP
            is_heard = self.hears and not self.silent
            sent = [one for one in self.firmware.due() if is_heard and self._random.random() >= self.loss]
            link = self.link
        if link is None or is_heard:
            self._unheard = now
        elif now - self._unheard > LINK_TIMEOUT:
            self.link = None
            link.failed("Too many packets lost")
        if link is not None:
            for packet in sent:
                link.hear(packet)


CRAZYFLIES: Final[dict[str, Emulated]] = {}
"""The emulated Crazyflies of this process, by name."""


class EmulatedLink(CRTPDriver):  # type: ignore[misc]
    """One end of a link: what cflib sends and receives by; see `cflib.crtp.crtpdriver.CRTPDriver`."""

    def __init__(self) -> None:
        super().__init__()
        self.needs_resending = False  # as a radio link does not, which repeats each packet until it is acknowledged
        self._craft: Emulated | None = None
        self.failed: Callable[[str], None] = lambda _: None
        """Tells cflib that the link is lost, and why."""
        self._queue: deque[Packet] = deque()
        self._changed = threading.Condition()
        self._idle = self._closed = False
        self._reads = True

    def connect(self, uri: str, _statistics: object, failed: Callable[[str], None] | None) -> None:
        """Open a link to the emulated Crazyflie of this address; one that does not exist begins to.

        Raises:
            WrongUriType: it is an address of another kind. ConnectionError: it does not answer.
        """
        found = re.fullmatch(rf"{SCHEME}([\w.-]+)(\?.*)?", uri)
        if found is None:
            raise WrongUriType(f"expected an address such as {SCHEME}ann, got {uri!r}")
        name, self.failed = found[1], failed or self.failed
        craft = CRAZYFLIES.get(name) or CRAZYFLIES.setdefault(name, Emulated(name))
        # With options, the processor of the radio is meant; whoever speaks to that reads one answer and no more.
        self._reads = found[2] is None
        if self._reads and (craft.silent or not craft.hears):
            raise ConnectionError(f"{uri} does not answer")
        self._craft, craft.link = craft, self

    def send_packet(self, packet: Any) -> None:
        """Send a packet of cflib's."""
        if self._craft is not None:
            for answer in self._craft.receive((packet.port, packet.channel, bytes(packet.data))):
                self.hear(answer)

    def receive_packet(self, wait: float = 0) -> Any:
        """The next packet; None if there is none within `wait` seconds of real time. Below 0 it waits for ever."""
        with self._changed:
            self._idle = True
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._queue or self._closed, None if wait < 0 else wait)
            if not self._queue:
                return None
            self._idle = False
            port, channel, data = self._queue.popleft()
            return CRTPPacket(port << 4 | channel, data)

    def hear(self, packet: Packet) -> None:
        """A packet has come from the Crazyflie."""
        with self._changed:
            self._queue.append(packet)
            self._changed.notify_all()

    def settle(self) -> None:
        """Wait until cflib has taken in all packets, so that simulated time is not ahead of it.

        Raises:
            TimeoutError: it does not within SETTLING.
        """
        with self._changed:
            if self._reads and not self._changed.wait_for(
                lambda: self._closed or (self._idle and not self._queue), SETTLING
            ):
                raise TimeoutError(f"expected cflib to take in {len(self._queue)} packets: does its thread run?")

    def close(self) -> None:
        """Close the link."""
        if self._craft is not None and self._craft.link is self:
            self._craft.link = None
        self._craft = None
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def scan_interface(self, address: int | None = None) -> list[list[str]]:
        """The addresses of the emulated Crazyflies that there are, each with an empty remark."""
        return [[f"{SCHEME}{name}", ""] for name in sorted(CRAZYFLIES)]

    def get_name(self) -> str:
        """The name of this kind of link."""
        return "vrg"


def register() -> None:
    """Let cflib know links to emulated Crazyflies, and initialise its own kinds of links, unless that is done."""
    if not cflib.crtp.CLASSES:
        cflib.crtp.init_drivers()
    if EmulatedLink not in cflib.crtp.CLASSES:
        cflib.crtp.CLASSES.insert(0, EmulatedLink)
