"""The simulated processes of a match: each has a session, a pace, and a link that outlives it."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Final

from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Message
from vrg.bus.node import Node, Tick
from vrg.bus.pacing import Pacer
from vrg.bus.process import STALLED_PERIOD
from vrg.bus.transport import turn
from vrg.errors import JournalError, RobotError
from vrg.faults.network import Link, SimulatedSession
from vrg.hal.sim.node import WorldNode
from vrg.launch.serving import SNAPSHOT_PERIOD

if TYPE_CHECKING:
    from vrg.faults.simulation import SimulatedMatch

RESTART: Final = 0.3
"""The simulated real time in s that a process needs to be started again after its fault."""
LEASE: Final = (0.75, 1.3)
"""The least and the most simulated real time in s after which a link is given up on which nothing comes: zenoh's lease
as vrg.bus.configuration sets it."""


class Process:
    """One simulated process.

    Args:
        match: to which it belongs. name: its own. make: makes its node.

    Attributes:
        link: its own, which stays as it is when it is started again.
        ahead: by how much its time of day has been set ahead, s.
        node, session: its own; None while it does not run. frozen: True while it does not go on.
        woken: True if the clock has come since it looked last.
        unable: since when it can publish nothing, match time in s; None if it can.
    """

    def __init__(self, match: "SimulatedMatch", name: str, make: Callable[[], Node]) -> None:
        self.name = name
        self.link = Link()
        self.ahead = 0.0
        self.node: Node | None = None
        self.session: SimulatedSession | None = None
        self.frozen = self.woken = False
        self.unable: float | None = 0.0
        self.failures: list[str] = []
        self._match, self._make = match, make
        self._starts = 0
        self._lease = match.network.stream(f"lease of {name}")

    @property
    def runs(self) -> bool:
        """True if it is there and not frozen."""
        return self.node is not None and not self.frozen

    def start(self) -> None:
        """Start it, unless it runs. It waits for its link.

        It ends, and is started again, if the journal cannot be opened, or the drives do not answer.
        """
        if self.node is not None:
            return
        if self.link.down:
            self._match.after(RESTART, self.start)
            return
        try:
            self.node = self._make()
            self._starts += 1
            self.session = SimulatedSession(self._match.network, f"{self.name}.{self._starts}", self.link)
            self._attach(self.session, self.node)
            self.node.start()
        except (JournalError, RobotError):
            self.end()
            self._match.after(RESTART, self.start)
            return
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
        self._match.acting = self
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
        self._pass()
        self.look(quiet=False)

    def cut(self, down: bool) -> None:
        """Cut its link, or mend it. Neither end notices before the lease is over."""
        self.link.down = down
        self._pass()

    def _pass(self) -> None:
        """Let messages pass, or wait: a frozen process hears nothing either, alarms least of all."""
        self.note()
        session, held = self.session, self.frozen or self.link.down
        if session is None or session.held is held:
            return
        if not held:
            session.go_on()
            return
        session.hold()
        self._match.after(self._lease.uniform(*LEASE), partial(self._give_up, session, session.holds))

    def _give_up(self, session: SimulatedSession, number: int) -> None:
        """The lease of a link that was held for the time of that number is over."""
        if session.held and session.holds == number:
            session.give_up()

    def end(self) -> None:
        """End it at once. Its node learns nothing of it."""
        if self.session is not None:
            self.session.close()
        self.node = self.session = None
        self.frozen = False
        self.note()

    def note(self) -> None:
        """Note whether it can publish now."""
        able = self.runs and not self.link.down
        now = self._match.time
        self.unable = None if able else now if self.unable is None else min(now, self.unable)


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
