"""A match of simulated processes on simulated time, in one thread: each has a session, a pace and faults of its own.

The nodes, their pace (vrg.bus.pacing), the codec, what arrives (vrg.bus.arrivals) and the journal are those of a real
match; simulated are the processes around them (vrg_faults.process), the bus (vrg_faults.network), the disk
(vrg_faults.disk), clocks (vrg_faults.machine), and the time. A supervisor starts again what has ended, and an official
resumes play when it is halted. The same seed gives the same match.
"""

from collections.abc import Callable, Sequence
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Final

from vrg.bus.node import Node
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import JournalHeader
from vrg.errors import JournalError, RobotError
from vrg.hal.simulated_clock import SimulatedClock
from vrg.launch.nodes.player import player_node
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import coordinator_node
from vrg.launch.nodes.world import world_node
from vrg.playing.in_process import emulation
from vrg.runs.run_folder import RunFolder
from vrg_faults.disk import Disk, SimulatedJournal
from vrg_faults.machine import simulated_walls
from vrg_faults.network import Network
from vrg_faults.observer import Observer
from vrg_faults.plan import OF_CAN, RECORDER, REFEREE, WORLD, Fault, FaultKind, Streams
from vrg_faults.process import RESTART, Process, WorldProcess

if TYPE_CHECKING:
    from vrg.hal.can.workshop.simulation import Simulation
    from vrg_faults.can import CanRobots

LINGERS: Final = 1.0
"""The simulated real time in s for which a match goes on after its end, so that every node hears of it."""


class SimulatedMatch:
    """A match of simulated processes on simulated time.

    Args:
        setup: the match, whose robots are virtual or have emulated drives. folder: for its journal and its recording.
        seed: of all that is drawn. faults: in the order of time.

    Raises:
        ConfigError: the match has real robots.

    Attributes:
        clock: the simulated real time. can: the CAN buses; None if there are none. network: the bus.
        disk: that of the journal. processes: by name. observer: hears all. time: the match time, s.
        heard: called whenever the observer has heard something.
    """

    def __init__(self, setup: MatchSetup, folder: RunFolder, seed: int, faults: Sequence[Fault]) -> None:
        self.setup, self.folder, self.faults = setup, folder, faults
        simulation, streams = emulation(setup, strict=True), Streams(seed)
        self.clock = SimulatedClock() if simulation is None else simulation.clock
        self.can = None if simulation is None else _can_robots(setup, simulation, streams("can"))
        self.network = Network(self.clock, streams)
        self.disk = Disk(self.clock, streams("disk"))
        self.time = 0.0
        self.heard: Callable[[], None] = lambda: None
        self._journal: SimulatedJournal | None = None
        self.processes: dict[str, Process] = {WORLD: WorldProcess(self, WORLD, self._world)}
        self.processes[REFEREE] = Process(self, REFEREE, self._referee)
        self.processes[RECORDER] = Process(self, RECORDER, lambda _medium: recorder_node(setup, folder))
        for player in setup.players:
            self.processes[player.name] = Process(self, player.name, partial(player_node, setup, player.name))
        self.observer = Observer(self)
        for process in self.processes.values():
            self.network.after(0.0, process.start)
        for fault in faults:
            self.network.after(fault.begin, partial(self._begin, fault))

    def run(self, seconds: float) -> None:
        """Play until the game is over, for so much simulated real time at most."""
        try:
            with simulated_walls():
                if self.clock.wait(lambda: self.observer.over, seconds):
                    self.clock.sleep(min(LINGERS, max(0.0, seconds - self.clock.now())))
        finally:
            self.clock.close()
            recorder = self.processes[RECORDER].node
            if recorder is not None:
                recorder.stop()
            if self._journal is not None:
                self._journal.close()

    def may_start(self, process: Process) -> bool:
        """Return whether a process can be started now: the referee's waits for a disk that stalls."""
        return process.name != REFEREE or not self.disk.stalled

    def excuses(self, process: Process, error: Exception) -> bool:
        """Return whether a process may end by an exception.

        A referee may that cannot begin a journal on a full disk, and a player that cannot be linked with its drives.
        """
        if process.name == REFEREE:
            return isinstance(error, JournalError) and self.disk.full
        return self.emulated_by(process.name) is not None and isinstance(error, RobotError)

    def emulated_by(self, player: str) -> "Simulation | None":
        """The CAN buses of a player whose robot has emulated drives; None for all others."""
        return None if self.can is None or player not in self.can.drives else self.can.simulation

    def end(self, process: Process, *, torn: bool = False) -> None:
        """End a process at once.

        Args:
            torn: True ends the referee's in the middle of a line of the journal.
        """
        if process.name == REFEREE and self._journal is not None:
            if process.frozen:
                self.disk.hold(False)
            self.disk.abandon()
            self._journal.close()
            self._journal = None
            if torn:
                for file, half in ((self.folder.journal, b'{"n":7,"time":1.2'), (self.folder.evidence, b"\x00\x00")):
                    with file.open("ab") as opened:
                        opened.write(half)
        process.end()

    def _begin(self, fault: Fault) -> None:
        """Let a fault begin, and end when it is over."""
        if fault.kind in (FaultKind.KILL, FaultKind.TORN, FaultKind.FREEZE):
            process = self.processes[fault.process]
            act = partial(self._freeze if fault.kind is FaultKind.FREEZE else self._kill, process, fault)
            if fault.size and process.runs:
                process.interrupt = act
            else:
                act()
            return
        begin, end = self._acts(fault)
        begin()
        self.network.after(fault.length, end)

    def _kill(self, process: Process, fault: Fault) -> None:
        self.end(process, torn=fault.kind is FaultKind.TORN)
        self.network.after(fault.length + RESTART, process.start)

    def _freeze(self, process: Process, fault: Fault) -> None:
        session = process.session
        if session is None or process.frozen:
            return
        process.freeze()
        if process.name == REFEREE:
            self.disk.hold(True)

        def thaw() -> None:
            if process.session is session:
                if process.name == REFEREE:
                    self.disk.hold(False)
                process.thaw()

        self.network.after(fault.length, thaw)

    def _acts(self, fault: Fault) -> tuple[Callable[[], object], Callable[[], object]]:
        """What begins a fault, and what ends it."""
        kind, disk, observer = fault.kind, self.disk, self.observer
        of_all: dict[FaultKind, tuple[Callable[[], object], Callable[[], object]]] = {
            FaultKind.ROUTER: (partial(self._route, False), partial(self._route, True)),
            FaultKind.ESTOP: (observer.press, observer.release),
            FaultKind.HALT: (observer.halt, lambda: None),
            FaultKind.HAND: (partial(observer.take, fault.process), partial(observer.let_go, fault.process)),
            FaultKind.FULL: (partial(setattr, disk, "full", True), partial(setattr, disk, "full", False)),
            FaultKind.STALLED: (partial(disk.hold, True), partial(disk.hold, False)),
        }
        if kind in of_all:
            return of_all[kind]
        if kind in OF_CAN:
            return self._break(fault)
        process = self.processes[fault.process]
        line = process.line
        if kind is FaultKind.CLOCK:
            return partial(process.machine.set_wall, fault.size), lambda: None
        if kind in (FaultKind.CUT, FaultKind.RESET):
            return partial(line.break_off, noticed=kind is FaultKind.RESET), line.mend
        name = {FaultKind.SLOW: "slow", FaultKind.LOSSY: "loss", FaultKind.DOUBLE: "twice", FaultKind.WRONG: "wrong"}[
            kind
        ]
        size = True if kind is FaultKind.WRONG else fault.size
        return partial(setattr, line, name, size), partial(setattr, line, name, type(size)(0))

    def _break(self, fault: Fault) -> tuple[Callable[[], object], Callable[[], object]]:
        """What begins a fault of CAN, and what ends it."""
        can, ends = self.can, list[Callable[[], None]]()
        assert can is not None

        def begin() -> None:
            ends.append(can.break_(fault))

        def end() -> None:
            ends.pop()()

        return begin, end

    def _route(self, routes: bool) -> None:
        """The router is there again, or has ended, which all notice at once."""
        for line in self.network.lines.values():
            if routes:
                line.mend()
            else:
                line.break_off(noticed=True)

    def _world(self, _medium: object) -> Node:
        process = self.processes[WORLD]
        assert isinstance(process, WorldProcess)
        return world_node(self.setup, process.snapshot)

    def _referee(self, _medium: object) -> Node:
        setup = self.setup
        header = JournalHeader(match=setup.name, game=setup.game, seed=setup.seed)
        self._journal = SimulatedJournal(self.folder.journal, header, self.disk)
        return coordinator_node(setup, self._journal)


def _can_robots(setup: MatchSetup, simulation: "Simulation", random: Random) -> "CanRobots":
    from vrg_faults.can import CanRobots  # noqa: PLC0415 - most matches have no CAN buses

    return CanRobots(setup, simulation, random)
