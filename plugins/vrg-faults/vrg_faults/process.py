"""A simulated process of a match: its node, its session, its pace, and what stops it."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Message
from vrg.bus.node import Node, Tick
from vrg.bus.pacing import Pacer
from vrg.bus.process import STALLED_PERIOD
from vrg.bus.transport import turn
from vrg.hal.sim.node import WorldNode
from vrg.hal.simulated_clock import SimulatedTask
from vrg.launch.nodes.world import SNAPSHOT_PERIOD
from vrg_faults.machine import Machine
from vrg_faults.session import SimulatedSession

if TYPE_CHECKING:
    from vrg_faults.can import ProcessMedium
    from vrg_faults.simulation import SimulatedMatch

RESTART: Final = 0.3
"""The simulated real time in s that a process needs to be started again after its fault."""
WAITING: Final = 0.1
"""The simulated real time in s after which a process that cannot be started is tried again."""


class Process:
    """One simulated process.

    Args:
        match: to which it belongs. name: its own. make: makes its node.

    Attributes:
        machine, line: on which it runs, and over which it is linked; both outlive it.
        node, session: its own; None while it does not run. frozen: True while it does not go on.
        interrupt: None, or what happens to it in its next tick, before anything of that is sent.
        unable: since when it can publish nothing, match time in s; None if it can. able_since: since when it can.
        starts: how often it was started. failures: the exceptions of its nodes, in words.
    """

    def __init__(self, match: "SimulatedMatch", name: str, make: Callable[["ProcessMedium | None"], Node]) -> None:
        self.name = name
        self.machine = Machine(match.clock, match.network.stream(f"machine of {name}"))
        self.line = match.network.line(name)
        self.node: Node | None = None
        self.session: SimulatedSession | None = None
        self.frozen = False
        self.interrupt: Callable[[], None] | None = None
        self.unable: float | None = 0.0
        self.able_since = 0.0
        self.failures: list[str] = []
        self._match, self._make = match, make
        self._woken = False
        self._random = match.network.stream(f"process {name}")
        self.starts = 0
        self._medium: ProcessMedium | None = None
        self._starting: SimulatedTask | None = None
        self._started = False

    @property
    def runs(self) -> bool:
        """True if it is there and not frozen."""
        return self._started and not self.frozen

    def start(self) -> None:
        """Start it, unless it runs, as soon as it can be linked."""
        if self.session is not None or self._starting is not None:
            return
        if self.line.cut or not self._match.may_start(self):
            self._match.network.after(WAITING, self.start)
            return
        simulation = self._match.emulated_by(self.name)
        if simulation is None:
            self._start()
        else:
            # Its drives are met while time passes.
            from vrg_faults.can import ProcessMedium  # noqa: PLC0415 - most matches have no CAN buses

            self._medium = ProcessMedium(simulation)
            self._starting = self._match.clock.spawn(self._start, f"start {self.name}")

    def _start(self) -> None:
        try:
            with self.machine.runs():
                self.starts += 1
                session = SimulatedSession(self._match.network, self.machine, self.name, self.starts)
                self.session, session.changed = session, self.note
                self.node = self._make(self._medium)
                self._attach(session, self.node)
                self.node.start()
        except Exception as error:
            self._starting = None
            self._fail(error)
            return
        self._starting, self._started = None, True
        self.note()
        self._begin()

    def freeze(self) -> None:
        """Freeze it. Its messages wait, and so do its alarms and everything else that it would notice."""
        if self.session is not None:
            self.frozen = True
            self.session.freeze(True)
            if self._medium is not None:
                self._medium.freeze(True)
            self.note()

    def thaw(self) -> None:
        """Let it go on. Its own thread runs before those that bring what has waited, or after them."""
        if self.session is None:
            return
        self.frozen = False
        if self._medium is not None:
            self._medium.freeze(False)
        if self._random.random() < 0.5:
            self.look(quiet=True)
        if self.session is not None:
            self.session.freeze(False)
        self.look(quiet=False)
        self.note()

    def end(self) -> None:
        """End it at once. Its node learns nothing of it."""
        if self.session is not None:
            self.session.close()
        starting, medium = self._starting, self._medium
        self.node = self.session = self.interrupt = self._starting = self._medium = None
        self.frozen = self._started = False
        if medium is not None:
            medium.end()
        if starting is not None:
            starting.end()
        self.note()

    def look(self, *, quiet: bool) -> None:
        """Take in what has arrived, and tick the node if it is due.

        Args:
            quiet: True if nothing has woken it.
        """
        node, session = self.node, self.session
        if node is None or session is None or not self.runs:
            return
        self._woken = False
        with self.machine.runs():
            session.receive()
            self._clock.handover(self._pacer.time)
            cut = quiet and not session.connected
            if self._pacer.hear(self._ticks.take(), self.machine.monotonic(), cut=cut):
                node.mailbox.forget()
            session.receive()
            tick = self._pacer.tick()
            if tick is not None:
                self._turn(node, session, tick)

    def note(self) -> None:
        """Note whether it can publish now."""
        able = self.runs and self.session is not None and self.session.linked
        now = self._match.time
        if able and self.unable is not None:
            self.able_since = now
        self.unable = None if able else now if self.unable is None else min(now, self.unable)

    def _attach(self, session: SimulatedSession, node: Node) -> None:
        self._clock = Mailbox()
        self._ticks = self._clock.subscribe(self._match.setup.keys.clock)
        self._pacer = Pacer(node.period, self.machine.monotonic())
        session.attach(node.mailbox)
        session.attach(self._clock, self._wake)
        session.delivered = self._delivered

    def _wake(self, _inlet: Inlet[Message]) -> None:
        """The clock has arrived, which alone wakes the process."""
        self._woken = True

    def _delivered(self) -> None:
        if self._woken:
            self.look(quiet=False)

    def _begin(self) -> None:
        self._match.network.after(STALLED_PERIOD, self._wait_for(self.session))

    def _wait_for(self, session: SimulatedSession | None) -> Callable[[], None]:
        """Look at what has arrived again and again, as long as a session lasts."""

        def wait() -> None:
            if self.session is session:
                self.look(quiet=True)
                self._match.network.after(STALLED_PERIOD, wait)

        return wait

    def _turn(self, node: Node, session: SimulatedSession, tick: Tick) -> None:
        interrupt, self.interrupt = self.interrupt, None
        if interrupt is not None:
            session.freeze(True)
        try:
            turn([node], tick, session)
        except Exception as error:
            self._fail(error)
        if interrupt is not None:
            interrupt()

    def _fail(self, error: Exception) -> None:
        """A node has raised an exception: its process ends, and is started again."""
        if not self._match.excuses(self, error):
            self.failures.append(f"{self._match.clock.now():.2f} s: {self.name}: {type(error).__name__}: {error}")
        self._match.end(self)
        self._match.network.after(RESTART, self.start)


class WorldProcess(Process):
    """The process of the world, which owns match time. It continues from its newest snapshot."""

    snapshot: bytes | None = None

    def look(self, *, quiet: bool) -> None:
        """Do nothing: it waits for nothing."""

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
                with self.machine.runs():
                    self._turn(node, session, Tick(self._match.time))
                if self.node is node and self._number % SNAPSHOT_PERIOD == 0:
                    self.snapshot = node.snapshot()
                self._number += 1
            self._match.network.after(node.period / self.machine.pace, step)

        return step
