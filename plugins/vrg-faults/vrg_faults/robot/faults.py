"""Faults of drives and of a bus."""

import random
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial

from msgspec.structs import replace

from vrg.hal.can.frame import EXTENDED_MASK, STANDARD_MASK, Frame, fd_size
from vrg.hal.can.workshop.emulated import EmulatedDrive
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest
from vrg.hal.can.workshop.simulation import Simulation, Tamper
from vrg_faults.robot.judge import STOP_TIMEOUT
from vrg_faults.robot.robot import LINK


class Faults:
    """Lets drives and a bus fail. Each method lets one thing go wrong from now on, for a while.

    Args:
        simulation: has the bus. drives: those on it. rng: decides what exactly, and for how long.
        note: called with what goes wrong, in words.

    Attributes:
        strangers: how many others speak on the bus, or may have spoken so recently that a motor follows them.
        written: a stranger may have changed settings of the drives, such as their limits.
    """

    def __init__(
        self,
        simulation: Simulation,
        drives: Sequence[EmulatedDrive],
        rng: random.Random,
        note: Callable[[str], None],
    ) -> None:
        self.strangers = 0
        self.written = False
        self._clock = simulation.clock
        self._wire = simulation.wire(LINK)
        self._drives = drives
        self._rng = rng
        self._note = note
        self._wire_faults: list[Tamper] = []
        self._episode = 0
        self._heard: deque[Frame] = deque(maxlen=64)
        recorder = simulation.bus(LINK, self._heard.append)
        recorder.start()

    def end(self) -> None:
        """Nothing is wrong any more with drives and bus."""
        self._episode += 1
        self._wire.tamper = self._wire.trouble = self._wire.missing = self._wire.stuck = None
        self._wire_faults.clear()
        self.strangers = 0
        for drive in self._drives:
            self._wire.fault(drive, FaultRequest(FaultKind.END))

    def switch_off_and_on(self) -> None:
        """Both drives start again with the settings that they have saved."""
        self.written = False
        for drive in self._drives:
            self._wire.fault(drive, FaultRequest(FaultKind.REBOOT))

    def of_a_drive(self) -> None:
        """One of the things that an emulated drive can have."""
        drive = self._rng.choice(self._drives)
        kind = self._rng.choice(sorted(drive.supports - {FaultKind.END}))
        duration = self._rng.choice((0.0, 0.0, 0.0, 0.05, 0.3))
        self._note(f"{kind.name.lower()} of drive {drive.node}{f' for {duration:g} s' if duration else ''}")
        self._wire.fault(drive, FaultRequest(kind, duration))

    def brown_out(self) -> None:
        """Both drives start again, perhaps several times."""
        times = self._rng.choice((1, 1, 3))
        self._note("a brown-out" if times == 1 else f"{times} brown-outs")
        for number in range(times):
            for drive in self._drives:
                self._later(number * 0.4, partial(self._wire.fault, drive, FaultRequest(FaultKind.REBOOT)))

    def lose(self) -> None:
        """Frames do not arrive."""
        share = self._rng.choice((0.05, 0.3, 0.7, 1.0))

        def lossy(frame: Frame, _: bool) -> list[tuple[float, Frame]]:
            return [] if self._rng.random() < share else [(0.0, frame)]

        self._tamper(f"{share:.0%} of frames lost", lossy)

    def delay(self) -> None:
        """Frames arrive late, and one after another that was sent later."""
        most = self._rng.choice((0.01, 0.1, 0.3))
        self._tamper(f"frames up to {most:g} s late", lambda frame, _: [(self._rng.uniform(0.0, most), frame)])

    def repeat(self) -> None:
        """Frames arrive several times."""
        times, late = self._rng.choice((1, 3)), self._rng.choice((0.0, 0.05, 0.2))
        self._tamper(
            f"frames repeated {times} times within {late:g} s",
            lambda frame, _: [(0.0, frame), *((self._rng.uniform(0.0, late), frame) for _ in range(times))],
        )

    def spoil(self) -> None:
        """Frames of drives are too short, or have a wrong bit."""
        share = self._rng.choice((0.02, 0.2, 1.0))

        def spoiled(frame: Frame, by_drive: bool) -> list[tuple[float, Frame]]:
            # The bus itself drops a frame that is damaged on its way (ISO 11898-1: a checksum): a drive sends it so.
            if not by_drive or self._rng.random() >= share or not frame.data:
                return [(0.0, frame)]
            if self._rng.random() < 0.5:
                shorter = frame.data[: self._rng.randrange(len(frame.data))]
                return [(0.0, replace(frame, data=shorter.ljust(fd_size(len(shorter)) if frame.fd else 0, b"\0")))]
            data = bytearray(frame.data)
            data[self._rng.randrange(len(data))] ^= 1 << self._rng.randrange(8)
            return [(0.0, replace(frame, data=bytes(data)))]

        self._tamper(f"{share:.0%} of the drives' frames malformed", spoiled)

    def _tamper(self, words: str, tamper: Tamper) -> None:
        """Let every frame pass through a fault of the bus, after those that there are."""
        seconds = self._rng.choice((0.1, 0.5, 1.5))
        self._note(f"{words} for {seconds:g} s")
        self._wire_faults.append(tamper)
        self._wire.tamper = self._tampered
        self._later(seconds, lambda: self._wire_faults.remove(tamper))

    def _tampered(self, frame: Frame, by_drive: bool) -> list[tuple[float, Frame]]:
        found = [(0.0, frame)]
        for fault in tuple(self._wire_faults):
            found = [(late + more, changed) for late, one in found for more, changed in fault(one, by_drive)]
        return found

    def strange_frames(self) -> None:
        """Frames that no protocol knows, or that look like one of them."""
        extended, fast = self._rng.random() < 0.5, self._rng.choice((1e-3, 0.02))
        self._note(f"strange frames every {fast:g} s")

        def strange() -> Frame:
            mask = EXTENDED_MASK if extended else STANDARD_MASK
            data = self._rng.randbytes(self._rng.randrange(9))
            return Frame(self._rng.randrange(mask + 1), data, self._rng.random() < 0.1, extended)

        self._stranger(strange, fast)

    def other_master(self) -> None:
        """Another node sends once more a frame that was on the bus before."""
        self._note("another master repeats what it heard")
        said = [frame for frame in self._heard if frame.data]
        if said:
            self._stranger(lambda: self._rng.choice(said), self._rng.choice((0.005, 0.05)))

    def _stranger(self, frame: Callable[[], Frame], period: float) -> None:
        self.strangers += 1
        self.written = True
        end = self._clock.now() + self._rng.choice((0.1, 0.5, 1.0))

        def speak() -> None:
            if self.strangers and self._clock.now() < end:
                self._wire.put(frame())
                self._later(period, speak)
            elif self.strangers:
                # A drive may follow it until its watchdog ends that.
                self._later(STOP_TIMEOUT, gone)

        def gone() -> None:
            self.strangers = max(0, self.strangers - 1)

        speak()

    def crowd(self) -> None:
        """Another node fills the bus."""
        seconds = self._rng.choice((0.1, 0.6))
        self._note(f"a full bus for {seconds:g} s")
        end = self._clock.now() + seconds

        def fill() -> None:
            while self._wire.put(Frame(EXTENDED_MASK, bytes(8), extended=True)):
                pass
            if self._clock.now() < end:
                self._later(2e-3, fill)

        fill()

    def trouble(self) -> None:
        """The controller is bus-off, or the adapter or the interface is gone, perhaps so that it cannot be opened."""
        words = self._rng.choice(("bus-off: too many errors", "the adapter was unplugged", "the interface is down"))
        seconds = self._rng.choice((0.05, 0.4, 1.5))
        self._note(f"{words} for {seconds:g} s")
        self._wire.trouble = words
        self._wire.missing, self._wire.stuck = self._rng.choice(((None, None), (words, None), (None, f"still {words}")))

        def over() -> None:
            self._wire.trouble = self._wire.missing = self._wire.stuck = None

        self._later(seconds, over)

    def _later(self, seconds: float, action: Callable[[], None]) -> None:
        """Let something happen, unless everything is well again before."""
        episode = self._episode
        self._clock.at(self._clock.now() + seconds, lambda: action() if episode == self._episode else None)
