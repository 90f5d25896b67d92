"""The CAN side of a simulated match: the adapters of one process, and emulated drives and buses that fail."""

from collections.abc import Callable
from functools import partial
from random import Random
from typing import Final, TypeVar

from vrg.config.setup import MatchSetup
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.settings import CanSettings
from vrg.hal.can.workshop.emulated import EmulatedDrive
from vrg.hal.can.workshop.faults import FaultKind as DriveFault
from vrg.hal.can.workshop.faults import FaultRequest
from vrg.hal.can.workshop.simulation import Port, Simulation, Tamper, Wire
from vrg.hal.clock import MonotonicClock
from vrg.hal.simulated_clock import SimulatedClock, SimulatedTask
from vrg_faults.plan import Fault, FaultKind

T = TypeVar("T")

_THAWS: Final = 0.01
"""s between two looks of work in a frozen process whether it runs again."""
_REQUESTS: Final = {
    FaultKind.DRIVE_SILENT: DriveFault.SILENCE,
    FaultKind.DRIVE_FROZEN: DriveFault.FREEZE,
    FaultKind.DRIVE_RESTART: DriveFault.REBOOT,
}


class ProcessClock(MonotonicClock):
    """The time of one process, whose work does not go on while it is frozen.

    Attributes:
        frozen: True while the process does not run. tasks: the work that it has begun.
    """

    pause = SimulatedClock.pause

    def __init__(self, clock: SimulatedClock) -> None:
        self.frozen = False
        self.tasks: list[SimulatedTask] = []
        self._clock = clock

    def now(self) -> float:
        """Simulated time, s."""
        return self._clock.now()

    def sleep(self, seconds: float) -> None:
        """Let everything happen that is due within this time, and until the process runs."""
        self._clock.sleep(seconds)
        while self.frozen:
            self._clock.sleep(_THAWS)

    def spawn(self, work: Callable[[], None], name: str) -> SimulatedTask:
        """Let work go on beside the caller."""
        self.tasks.append(self._clock.spawn(work, name))
        return self.tasks[-1]


class ProcessMedium:
    """The CAN buses as one process reaches them. A `Medium`, which ends with the process.

    Attributes:
        clock: the time of the process.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.clock = ProcessClock(simulation.clock)
        self._simulation = simulation
        self._ports: list[Port] = []

    def bus(
        self,
        link: Link,
        on_frame: Callable[[Frame], None],
        on_trouble: Callable[[str], None] = lambda _: None,
        on_quiet: Callable[[float], None] = lambda _: None,
    ) -> Port:
        """Make a bus, which is not open yet; see `vrg.hal.can.bus.CanBus`."""
        self._ports.append(self._simulation.bus(link, on_frame, on_trouble, on_quiet))
        return self._ports[-1]

    def freeze(self, frozen: bool) -> None:
        """Let the process stop, or go on: it then finds the frames that have waited."""
        self.clock.frozen = frozen
        for port in self._ports:
            if frozen:
                port.freeze()
            else:
                port.thaw()

    def end(self) -> None:
        """End the process: it sends nothing more, and whatever it was about ends where it waits."""
        for port in self._ports:
            port.stop()
        self.clock.frozen = False
        for task in self.clock.tasks:
            if task.is_alive():
                task.end()


class CanRobots:
    """The emulated drives of a match, and what fails there.

    Args:
        setup: the match. simulation: has its drives. random: draws which frames are lost.

    Attributes:
        drives: by the name of the robot.
    """

    def __init__(self, setup: MatchSetup, simulation: Simulation, random: Random) -> None:
        self.simulation, self._random = simulation, random
        self.drives: dict[str, list[EmulatedDrive]] = {}
        self._wires: dict[str, Wire] = {}
        self._tampers: dict[Wire, list[Tamper]] = {}
        self._silent: dict[Wire, int] = {}
        self._drives_silent: dict[str, int] = {}
        settings = CanSettings.read("can", setup.backends.get("can", {}))
        for player in setup.players:
            if player.backend == "can":
                wire, nodes = simulation.wire(settings.link(player.name)), settings.robots[player.name].nodes
                self._wires[player.name] = wire
                self.drives[player.name] = [drive for drive in wire.drives if drive.node in nodes]

    def bus_silent(self, robot: str) -> bool:
        """True while no frame passes on the bus of a robot."""
        return self._silent.get(self._wires[robot], 0) > 0

    def silent(self, robot: str) -> bool:
        """True while nothing comes from one of the drives of a robot."""
        return self.bus_silent(robot) or self._drives_silent.get(robot, 0) > 0

    def break_(self, fault: Fault) -> Callable[[], None]:
        """Let a fault of a bus or a drive begin; return what ends it."""
        wire = self._wires[fault.process]
        if fault.kind in _REQUESTS:
            drive, length = self._random.choice(self.drives[fault.process]), max(0.01, fault.length)
            wire.fault(drive, FaultRequest(_REQUESTS[fault.kind], length))
            return self._counted(self._drives_silent, fault.process, fault.kind is not FaultKind.DRIVE_RESTART)
        over = self._counted(self._silent, wire, fault.kind in (FaultKind.BUS_SILENT, FaultKind.BUS_OFF))
        if fault.kind is FaultKind.BUS_OFF:
            wire.trouble = "bus-off: too many errors"

            def restart() -> None:
                wire.trouble = None
                over()

            return restart
        tamper = self._late(fault.size) if fault.kind is FaultKind.BUS_LATE else self._lossy(fault.size or 1.0)
        tampers = self._tampers.setdefault(wire, [])
        tampers.append(tamper)
        wire.tamper = partial(_tampered, tampers)

        def mend() -> None:
            tampers.remove(tamper)
            over()

        return mend

    @staticmethod
    def _counted(counts: dict[T, int], of: T, counts_now: bool) -> Callable[[], None]:
        """Count one more of something from now on; return what ends that."""
        counts[of] = counts.get(of, 0) + counts_now

        def over() -> None:
            counts[of] -= counts_now

        return over

    def _lossy(self, share: float) -> Tamper:
        return lambda frame, _: [] if self._random.random() < share else [(0.0, frame)]

    def _late(self, most: float) -> Tamper:
        return lambda frame, _: [(self._random.uniform(0.0, most), frame)]


def _tampered(tampers: list[Tamper], frame: Frame, by_drive: bool) -> list[tuple[float, Frame]]:
    found = [(0.0, frame)]
    for tamper in tampers:
        found = [(late + more, changed) for late, one in found for more, changed in tamper(one, by_drive)]
    return found
