"""A match of simulated processes on simulated time, in one thread: each has a session, a pace and faults of its own.

The nodes, their pace (vrg.bus.pacing), the codec and the journal are those of a real match; simulated are the processes
around them, the bus (vrg.faults.network), and the time. A supervisor starts again what has ended, and an official
resumes play when it is halted. The same seed gives the same match.
"""

import heapq
import logging
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from functools import partial
from random import Random
from typing import Final

from vrg.bus.codec import Received
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Call, Clock, Message, Official, OfficialAction, Poses, RefereeState, Stage
from vrg.bus.node import Node, Tick
from vrg.bus.pacing import Pacer
from vrg.bus.process import STALLED_PERIOD
from vrg.bus.transport import turn
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import Journal, JournalHeader
from vrg.errors import ConfigError, JournalError
from vrg.faults.network import Network, SimulatedSession
from vrg.faults.plan import REFEREE, WORLD, Fault, FaultKind
from vrg.hal.sim.node import WorldNode
from vrg.launch.nodes import coordinator_node, player_node, world_node
from vrg.launch.run_folder import RunFolder
from vrg.launch.serving import SNAPSHOT_PERIOD

log = logging.getLogger(__name__)

RESTART: Final = 0.3
"""The simulated real time in s that a process needs to be started again after its fault."""
PATIENCE: Final = 2.0
"""The simulated real time in s of a halt after which the official resumes play."""


class Streams:
    """Random numbers by a seed and a label, so that one more draw in one place does not disturb any other."""

    def __init__(self, seed: int) -> None:
        self._seed = seed

    def __call__(self, label: str) -> Random:
        """The numbers of a label."""
        return Random(f"{self._seed}:{label}")


class FaultyJournal(Journal):
    """A journal on a disk that can be full, or stalled."""

    full = False
    _stalled: list[tuple[Callable[[], None], "Future[None]"]] | None = None

    def stall(self, stalled: bool) -> None:
        """Let the disk do nothing from now on, or all that waits and go on."""
        if stalled:
            self._stalled = self._stalled or []
            return
        waiting, self._stalled = self._stalled or [], None
        for job, done in waiting:
            try:
                job()
                done.set_result(None)
            except JournalError as error:
                done.set_exception(error)

    def _do(self, job: Callable[[], None]) -> "Future[None]":
        if self._stalled is None:
            return super()._do(job)
        done: Future[None] = Future()
        self._stalled.append((job, done))
        return done

    def _write(self, at: int, data: bytes) -> None:
        if self.full:
            raise JournalError(f"{self.path}: cannot be written: no space left: free some space")
        super()._write(at, data)


class Process:
    """One simulated process.

    Args:
        match: to which it belongs. name: its own. make: makes its node.

    Attributes:
        node, session: its own; None while it does not run. frozen: True while it does not go on.
        woken: True if the clock has come since it looked last.
        unable: since when it can publish nothing, match time in s; None if it can.
    """

    def __init__(self, match: "SimulatedMatch", name: str, make: Callable[[], Node]) -> None:
        self.name = name
        self.node: Node | None = None
        self.session: SimulatedSession | None = None
        self.frozen = self.woken = False
        self.unable: float | None = 0.0
        self.failures: list[str] = []
        self._match, self._make = match, make
        self._starts = 0

    @property
    def runs(self) -> bool:
        """True if it is there and not frozen."""
        return self.node is not None and not self.frozen

    def start(self) -> None:
        """Start it, unless it runs."""
        if self.node is not None:
            return
        try:
            self.node = self._make()
            self._starts += 1
            self.session = SimulatedSession(self._match.network, f"{self.name}.{self._starts}")
            self._attach(self.session, self.node)
            self.node.start()
        except Exception as error:
            self._fail(error)
            return
        self.note()
        self._begin()

    def _attach(self, session: SimulatedSession, node: Node) -> None:
        self._clock = Mailbox()
        self._ticks = self._clock.subscribe(self._match.setup.keys.clock)
        self._pacer = Pacer(node.period, self._match.network.now)
        session.attach(node.mailbox)
        session.attach(self._clock, self._wake)

    def _wake(self, _inlet: Inlet[Message]) -> None:
        """The clock has come, which alone wakes the process."""
        self.woken = True

    def _begin(self) -> None:
        self._match.after(STALLED_PERIOD, self._wait_for(self.session))

    def _wait_for(self, session: SimulatedSession | None) -> Callable[[], None]:
        """Look at what has come again and again, as long as a session lasts."""

        def wait() -> None:
            if self.session is session:
                self.look(quiet=True)
                self._match.after(STALLED_PERIOD, wait)

        return wait

    def look(self, *, quiet: bool) -> None:
        """Take in what has come, and tick the node if it is due.

        Args:
            quiet: True if nothing has woken it.
        """
        node, session = self.node, self.session
        if node is None or session is None or self.frozen:
            return
        self.woken = False
        session.receive()
        self._clock.handover(self._pacer.time)
        if self._pacer.hear(self._ticks.take(), self._match.network.now, cut=quiet and session.cut):
            node.mailbox.forget()
        session.receive()
        tick = self._pacer.tick()
        if tick is not None:
            self._turn(node, session, tick)

    def _turn(self, node: Node, session: SimulatedSession, tick: Tick) -> None:
        try:
            turn([node], tick, session)
        except Exception as error:
            self._fail(error)

    def _fail(self, error: Exception) -> None:
        """A node has raised an exception: its process ends, and is started again."""
        self.failures.append(f"{self._match.network.now:.2f} s: {self.name}: {type(error).__name__}: {error}")
        self.end()
        self._match.after(RESTART, self.start)

    def freeze(self, frozen: bool) -> None:
        """Freeze it, or let it go on."""
        self.frozen = frozen and self.node is not None
        self.note()
        self.look(quiet=False)

    def change_link(self, change: Callable[[SimulatedSession], None]) -> Callable[[], None]:
        """What changes its link, if it runs then."""

        def act() -> None:
            if self.session is not None:
                change(self.session)
                self.note()

        return act

    def end(self) -> None:
        """End it at once. Its node learns nothing of it."""
        if self.session is not None:
            self.session.close()
        self.node = self.session = None
        self.frozen = False
        self.note()

    def note(self) -> None:
        """Note whether it can publish now."""
        able = self.runs and self.session is not None and not self.session.cut
        now = self._match.time
        self.unable = None if able else now if self.unable is None else min(now, self.unable)


def _setting(name: str, value: float) -> Callable[[SimulatedSession], None]:
    return lambda session: setattr(session, name, value)


class WorldProcess(Process):
    """The process of the world, which owns match time. It goes on from its newest snapshot."""

    _snapshot: bytes | None = None

    def _attach(self, session: SimulatedSession, node: Node) -> None:
        session.attach(node.mailbox)

    def _begin(self) -> None:
        assert isinstance(self.node, WorldNode)
        self._number = self.node.start_tick
        self._step(self.session)()

    def _step(self, session: SimulatedSession | None) -> Callable[[], None]:
        def step() -> None:
            node = self.node
            if self.session is not session or not isinstance(node, WorldNode) or session is None:
                return
            if not self.frozen:
                session.receive()
                self._match.time = self._number * node.period
                self._turn(node, session, Tick(self._match.time))
                if self.node is node and self._number % SNAPSHOT_PERIOD == 0:
                    self._snapshot = node.snapshot()
                self._number += 1
            self._match.after(node.period, step)

        return step

    def look(self, *, quiet: bool) -> None:
        """Do nothing: it waits for nothing."""

    def restored(self, node: WorldNode) -> WorldNode:
        """The node, as it goes on from the newest snapshot."""
        if self._snapshot is not None:
            node.restore(self._snapshot)
        return node


class SimulatedMatch:
    """See the module.

    Args:
        setup: the match, whose robots are virtual. folder: for its journal. seed: of all that is drawn.
        faults: in the order of time.

    Raises:
        ConfigError: the match has physical robots.

    Attributes:
        network: the bus, and the time. processes: by name. calls: what an observer has heard, in order.
        state: the last state that it has heard, and heard_at: when, simulated real time in s.
        poses, clock: what it has just heard of these. time: the match time, s.
    """

    def __init__(self, setup: MatchSetup, folder: RunFolder, seed: int, faults: Sequence[Fault]) -> None:
        if setup.physical:
            raise ConfigError(
                f"{setup.origin}: expected virtual robots, got physical ones ({', '.join(setup.physical)}), which no "
                "simulation may drive: take `backend` out of their tables"
            )
        self.setup, self.folder, self.faults = setup, folder, faults
        self.network = Network(Streams(seed))
        self.calls: list[Call] = []
        self.state: RefereeState | None = None
        self.heard_at = 0.0
        self.time = 0.0
        self.poses: Received[Poses] | None = None
        self.clock: Clock | None = None
        self._agenda: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0
        self._journal: FaultyJournal | None = None
        self.processes: dict[str, Process] = {WORLD: WorldProcess(self, WORLD, self._world)}
        self.processes[REFEREE] = Process(self, REFEREE, self._referee)
        for player in setup.players:
            self.processes[player.name] = Process(self, player.name, self._player(player.name))
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
        """Close the journal. Idempotent."""
        if self._journal is not None:
            self._journal.close()

    def _next(self) -> None:
        """Let happen what comes next."""
        arrival = self.network.next
        if arrival is not None and arrival <= self._agenda[0][0]:
            session = self.network.arrive()
            for process in self.processes.values():
                if process.session is session and process.woken:
                    process.look(quiet=False)
            return
        self.network.now, _, action = heapq.heappop(self._agenda)
        action()

    def _plan(self, fault: Fault) -> None:
        process = self.processes[fault.process]
        begin, end = self._acts(fault, process)
        self.after(fault.begin, begin)
        self.after(fault.begin + fault.length, end)

    def _acts(self, fault: Fault, process: Process) -> tuple[Callable[[], None], Callable[[], None]]:
        """What begins a fault, and what ends it."""
        lose, mend = SimulatedSession.lose, SimulatedSession.mend
        on_link = {
            FaultKind.CUT: (lose, mend),
            FaultKind.SLOW: (_setting("slow", fault.size), _setting("slow", 0.0)),
            FaultKind.LOSSY: (_setting("loss", fault.size), _setting("loss", 0.0)),
            FaultKind.DOUBLE: (_setting("twice", fault.size), _setting("twice", 0.0)),
            FaultKind.WRONG: (_setting("wrong", True), _setting("wrong", False)),
        }
        if fault.kind in on_link:
            begin, end = on_link[fault.kind]
            return process.change_link(begin), process.change_link(end)
        again = partial(self.after, RESTART, process.start)
        return {
            FaultKind.KILL: (partial(self._end, process), again),
            FaultKind.TORN: (partial(self._end, process, torn=True), again),
            FaultKind.FREEZE: (partial(process.freeze, True), partial(process.freeze, False)),
            FaultKind.FULL: (partial(self._fill_disk, True), partial(self._fill_disk, False)),
            FaultKind.STALLED: (partial(self._stall_disk, True), partial(self._stall_disk, False)),
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
            for file, half in ((self.folder.journal, b'{"n":7,"time":1.2'), (self.folder.evidence, b"\x00\x00")):
                with file.open("ab") as opened:
                    opened.write(half)

    def _fill_disk(self, full: bool) -> None:
        if self._journal is not None:
            self._journal.full = full

    def _stall_disk(self, stalled: bool) -> None:
        if self._journal is not None:
            self._journal.stall(stalled)

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
        self._journal = FaultyJournal(self.folder.journal, header)
        return coordinator_node(setup, self._journal)

    def _player(self, name: str) -> Callable[[], Node]:
        return lambda: player_node(self.setup, name)

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

        def decide() -> None:
            now, halted = self.network.now, self.state is not None and self.state.halted is not None
            self._halted = None if not halted else now if self._halted is None else self._halted
            if self._halted is not None and now - self._halted >= PATIENCE:
                self._halted = None
                order = Official(action=OfficialAction.RESUME, by="ann")
                self._official.publish(keys.official, order)
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
