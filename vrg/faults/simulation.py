"""A match of simulated processes on simulated time, in one thread: each has a session, a pace and faults of its own.

The nodes, their pace (vrg.bus.pacing), the codec and the journal are those of a real match; simulated are the processes
around them, the bus (vrg.faults.network), and the time. A supervisor starts again what has ended, and an official
resumes play when it is halted. The same seed gives the same match.
"""

import heapq
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call, Clock, Official, OfficialAction, Poses, RefereeState, Stage
from vrg.bus.node import Node
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import JournalHeader
from vrg.errors import ConfigError
from vrg.faults.can import CanProcess
from vrg.faults.disk import Disk, FaultyJournal, tear
from vrg.faults.network import Network, SimulatedSession
from vrg.faults.plan import OF_CAN, REFEREE, WORLD, Fault, FaultKind, Streams
from vrg.faults.process import RESTART, Process, WorldProcess
from vrg.faults.wall import time_of_day
from vrg.hal.backends import BACKENDS
from vrg.hal.can.settings import CanSettings
from vrg.hal.sim.node import WorldNode
from vrg.launch.nodes import coordinator_node, player_node, world_node
from vrg.launch.run_folder import RunFolder

PATIENCE: Final = 2.0
"""The simulated real time in s of a halt after which the official resumes play, or lets robots recover."""
EPOCH: Final = 1.8e9
"""The time of day when a match begins, s since 1970."""


def emulated(setup: MatchSetup, name: str) -> CanSettings:
    """The buses and the emulated drives of a match.

    Args:
        name: a player whose robot is to have such drives.

    Raises:
        ConfigError: it is a real one.
    """
    player = setup.player(name)
    kind = BACKENDS.get(player.backend).settings
    table = None if kind is None else kind.model_validate(setup.backends.get(player.backend, {}))
    if isinstance(table, CanSettings) and table.emulate:
        return table
    raise ConfigError(
        f"{setup.origin}: {name}: expected a virtual robot, or emulated drives (`emulate = true` in [backends.can]), "
        "got a real robot, which no simulation may drive: take `backend` out of its table"
    )


def _nothing() -> None:
    """Do nothing: a drive ends its faults by itself."""


class SimulatedMatch:
    """See the module.

    Args:
        setup: the match, whose robots are virtual, or have emulated drives. folder: for its journal.
        seed: of all that is drawn. faults: in the order of time.

    Raises:
        ConfigError: a robot is a real one.

    Attributes:
        network: the bus, and the time. disk: that of the journal. processes: by name.
        calls: what an observer has heard, in order.
        state: the last state that it has heard, and heard_at: when, simulated real time in s.
        acting: the process whose node was ticked last.
        poses, clock: what it has just heard of these. time: the match time, s.
    """

    def __init__(self, setup: MatchSetup, folder: RunFolder, seed: int, faults: Sequence[Fault]) -> None:
        self.setup, self.folder, self.faults = setup, folder, faults
        self.network = Network(Streams(seed))
        self.calls: list[Call] = []
        self.state: RefereeState | None = None
        self.heard_at = 0.0
        self.time = 0.0
        self.acting: Process | None = None
        self.poses: Received[Poses] | None = None
        self.clock: Clock | None = None
        self._agenda: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0
        self.disk = Disk(self.after, self.network.stream("disk"))
        self._journal: FaultyJournal | None = None
        self.processes: dict[str, Process] = {WORLD: WorldProcess(self, WORLD, self._world)}
        self.processes[REFEREE] = Process(self, REFEREE, self._referee)
        for player in setup.players:
            self.processes[player.name] = self._player(player.name)
        self._buses = [process for process in self.processes.values() if isinstance(process, CanProcess)]
        self._observe()
        for process in self.processes.values():
            self.after(0.0, process.start)
        for fault in faults:
            self._plan(fault)

    def run(self, seconds: float, look: Callable[[], None]) -> None:
        """Play until the game is over, for so much simulated real time at most.

        Args:
            look: called after each message that the observer has heard.
        """
        linger = seconds
        with time_of_day(self._time_of_day):
            while self.network.now < min(seconds, linger):
                self._next()
                if self._hear():
                    look()
                if self.over and linger == seconds:
                    linger = self.network.now + 1.0
        self.close()

    @property
    def over(self) -> bool:
        """True if the game is over, as the observer has heard."""
        return self.state is not None and self.state.stage is Stage.GAME_OVER

    def after(self, delay: float, action: Callable[[], None]) -> None:
        """Do something later.

        Args:
            delay: simulated real time, s.
        """
        self._count += 1
        heapq.heappush(self._agenda, (self.network.now + delay, self._count, action))

    def close(self) -> None:
        """End what waits for drives, write what waits, and close the journal. Idempotent."""
        for process in self._buses:
            process.end()
        self.disk.finish()
        if self._journal is not None:
            self._journal.close()

    def _next(self) -> None:
        """Let happen what comes next."""
        arrival = self.network.next
        if arrival is not None and arrival <= self._agenda[0][0]:
            self.network.now = arrival
            self._let_buses_catch_up()
            session = self.network.arrive()
            for process in self.processes.values():
                if process.session is session and process.woken:
                    process.look(quiet=False)
            return
        self.network.now, _, action = heapq.heappop(self._agenda)
        self._let_buses_catch_up()
        action()

    def _let_buses_catch_up(self) -> None:
        for process in self._buses:
            process.catch_up()

    def _time_of_day(self) -> float:
        return EPOCH + self.network.now + (self.acting.ahead if self.acting else 0.0)

    def _plan(self, fault: Fault) -> None:
        process = self.processes[fault.process]
        begin, end = self._acts(fault, process)
        self.after(fault.begin, begin)
        self.after(fault.begin + fault.length, end)

    def _acts(self, fault: Fault, process: Process) -> tuple[Callable[[], None], Callable[[], None]]:
        """What begins a fault, and what ends it."""
        setting = partial(setattr, process.link)
        again = partial(self.after, RESTART, process.start)
        if isinstance(process, CanProcess) and fault.kind in OF_CAN:
            on_bus: dict[FaultKind, tuple[Callable[[], None], Callable[[], None]]] = {
                FaultKind.BUS: (partial(process.silence, True), partial(process.silence, False)),
                FaultKind.MUTE: (partial(process.mute, fault.length), _nothing),
                FaultKind.REBOOT: (process.reboot, _nothing),
            }
            return on_bus[fault.kind]
        return {
            FaultKind.CLOCK: (partial(setattr, process, "ahead", fault.size), partial(setattr, process, "ahead", 0.0)),
            FaultKind.KILL: (partial(self._end, process), again),
            FaultKind.TORN: (partial(self._end, process, torn=True), again),
            FaultKind.FREEZE: (partial(process.freeze, True), partial(process.freeze, False)),
            FaultKind.CUT: (partial(process.cut, True), partial(process.cut, False)),
            FaultKind.SLOW: (partial(setting, "slow", fault.size), partial(setting, "slow", 0.0)),
            FaultKind.LOSSY: (partial(setting, "loss", fault.size), partial(setting, "loss", 0.0)),
            FaultKind.DOUBLE: (partial(setting, "twice", fault.size), partial(setting, "twice", 0.0)),
            FaultKind.WRONG: (partial(setting, "wrong", True), partial(setting, "wrong", False)),
            FaultKind.FULL: (partial(setattr, self.disk, "full", True), partial(setattr, self.disk, "full", False)),
            FaultKind.STALLED: (partial(self.disk.stall, True), partial(self.disk.stall, False)),
        }[fault.kind]

    def _end(self, process: Process, *, torn: bool = False) -> None:
        """End a process.

        Args:
            torn: True ends the referee's in the middle of a line of the journal.
        """
        process.end()
        if process.name != REFEREE or self._journal is None:
            return
        self._journal.close()
        self._journal = None
        if torn:
            tear(self.folder.journal, self.folder.evidence)

    def _world(self) -> Node:
        process = self.processes[WORLD]
        assert isinstance(process, WorldProcess)
        node = world_node(self.setup)
        assert isinstance(node, WorldNode)
        return process.restored(node)

    def _referee(self) -> Node:
        setup = self.setup
        header = JournalHeader(match=setup.name, game=setup.game, seed=setup.seed)
        if self._journal is not None:
            self._journal.close()
        self._journal = FaultyJournal(self.folder.journal, header, self.disk)
        return coordinator_node(setup, self._journal)

    def _player(self, name: str) -> Process:
        if name in self.setup.physical:
            return CanProcess(self, name, emulated(self.setup, name))
        return Process(self, name, lambda: player_node(self.setup, name))

    def _observe(self) -> None:
        """Link an observer whose link is always good, and an official who resumes play."""
        keys = self.setup.keys
        self._watch, self._official = Mailbox("spectator/observer"), Mailbox("official/ann")
        self._events = self._watch.subscribe(keys.referee_event)
        self._states = self._watch.subscribe(keys.referee_state)
        self._bodies = self._watch.subscribe(keys.poses)
        self._clocks = self._watch.subscribe(keys.clock)
        self._session = SimulatedSession(self.network, "observer")
        self._session.attach(self._watch)
        self._halted: float | None = None
        self._recovered = False

        def decide() -> None:
            now, halted = self.network.now, self.state is not None and self.state.halted is not None
            self._halted = None if not halted else now if self._halted is None else self._halted
            if self._halted is not None and now - self._halted >= PATIENCE:
                # Robots with drives are recovered first, which takes a while.
                recovers = self._buses and not self._recovered
                action = OfficialAction.RECOVER if recovers else OfficialAction.RESUME
                self._halted, self._recovered = None, bool(recovers)
                self._official.publish(keys.official, Official(action=action, by="ann"))
                self._session.send(self._official.collect())
            self.after(0.5, decide)

        self.after(0.5, decide)

    def _hear(self) -> bool:
        """Take in what the observer has heard; return whether that was anything."""
        self._session.receive()
        self._watch.handover(0.0)
        self.calls += [received.body for received in self._events.take()]
        states, poses, clocks = self._states.take(), self._bodies.take(), self._clocks.take()
        if states:
            self.state, self.heard_at = states[-1].body, self.network.now
        self.poses = poses[-1] if poses else None
        self.clock = clocks[-1].body if clocks else None
        return bool(states or poses or clocks)
