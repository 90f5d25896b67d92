"""The process executor: one node in an operating-system process of its own, paced by the match clock over the bus."""

import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Message
from vrg.bus.node import Node, Tick, due_index
from vrg.bus.session import Session
from vrg.bus.topics import Keys
from vrg.errors import DuplicateNodeError

log = logging.getLogger(__name__)

STALL = 0.5
"""s of real time without the world's clock after which a node is told that time has stopped."""
STALLED_PERIOD = 0.1
"""s of real time between a node's ticks while time has stopped."""
TAKEOVER_PATIENCE = 3.0
"""s of real time that a restarted node waits for the token of its crashed forerunner to go."""


@dataclass
class Statistics:
    """How a node's process has fared.

    Args:
        ticks: ticks done. missed: ticks that were due and never came.
        cpu: s of processor time, wall: s of real time, both since the executor began.
        dropped: bad messages, and events that came faster than they were taken.
    """

    ticks: int = 0
    missed: int = 0
    cpu: float = 0.0
    wall: float = 0.0
    dropped: int = 0


@contextmanager
def stop_on_signals() -> Iterator[threading.Event]:
    """An event that SIGINT and SIGTERM set; the handlers are put back at the end."""
    stop = threading.Event()

    def handle(number: int, _frame: FrameType | None) -> None:
        log.info("stopping: %s", signal.Signals(number).name)
        stop.set()

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def claim(session: Session, keys: Keys, kind: str, name: str) -> None:
    """Declare that this node is alive; only one of a kind and name may be.

    Raises:
        DuplicateNodeError: another process already is, and does not go away within TAKEOVER_PATIENCE.
    """
    key = keys.alive(kind, name)
    deadline = time.monotonic() + TAKEOVER_PATIENCE
    while session.alive(key):
        if time.monotonic() >= deadline:
            raise DuplicateNodeError(
                f"match {keys.match!r} already has a {kind} named {name!r}: stop that process first, "
                "or start this one under another match name"
            )
        time.sleep(0.1)
    session.declare_alive(key)


class _Pulse:
    """The newest clock message, waited for by the executor's thread."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._fresh = False

    def set(self) -> None:
        with self._condition:
            self._fresh = True
            self._condition.notify()

    def wait(self, timeout: float) -> bool:
        with self._condition:
            arrived = self._condition.wait_for(lambda: self._fresh, timeout)
            self._fresh = False
            return arrived


def run_node(
    node: Node,
    session: Session,
    keys: Keys,
    stop: threading.Event,
    *,
    finished: Callable[[], bool] = lambda: False,
    idle: float | None = None,
) -> Statistics:
    """Tick a node by the match clock on the bus until `stop` is set or it has `finished`.

    An exception of the node stops its robot, and goes on to the caller.

    Args:
        idle: s of real time after which a window is ticked also when it is not due, so that its keys work however slow
            match time is.

    Raises:
        DuplicateNodeError: a node of this kind and name is alive already.
    """
    clock = _HeardClock(session, keys)
    session.attach(node.mailbox)
    claim(session, keys, node.kind, node.name)
    statistics = Statistics(cpu=-time.process_time(), wall=-time.monotonic())
    last = -1
    called = time.monotonic()
    try:
        while not stop.is_set() and not finished():
            restarted = clock.wait(idle or STALLED_PERIOD)
            if restarted:
                last = -1
            session.receive()
            index = due_index(clock.now, node.period)
            if clock.stalled:
                _call(node, session, Tick(clock.now, live=False), statistics)
            elif clock.heard and index > last:
                statistics.missed += index - last - 1 if last >= 0 else 0
                last = index
                _call(node, session, Tick(clock.now), statistics)
            elif idle and time.monotonic() - called > idle:
                _call(node, session, Tick(clock.now), statistics)
            else:
                continue
            called = time.monotonic()
    finally:
        _finish(node, session, statistics)
    return statistics


class _HeardClock:
    """The world's clock as it is heard on the bus.

    Attributes:
        now: match time of the newest clock message, s.
        heard: there has been one.
        stalled: none has come for STALL seconds of real time, or the router is away and nobody is heard.
    """

    def __init__(self, session: Session, keys: Keys) -> None:
        self._session = session
        self._mailbox = Mailbox()
        self._inlet = self._mailbox.subscribe(keys.clock)
        self._arrived = threading.Condition()
        self._fresh = False
        self._epoch = 0
        self._heard_at = time.monotonic()
        self.now = 0.0
        self.heard = False
        self.stalled = False
        session.attach(self._mailbox, self._wake)

    def _wake(self, _inlet: Inlet[Message]) -> None:
        with self._arrived:
            self._fresh = True
            self._arrived.notify()

    def wait(self, timeout: float) -> bool:
        """Wait for the next message, `timeout` seconds at most; True if the world was restarted since the last."""
        with self._arrived:
            quiet = not self._arrived.wait_for(lambda: self._fresh, timeout)
            self._fresh = False
        self._session.receive()
        self._mailbox.handover(self.now)
        restarted = False
        for message in self._inlet.take():
            self.now, self._heard_at = message.stamp, time.monotonic()
            self.heard, self.stalled = True, False
            restarted = message.body.epoch != self._epoch
            self._epoch = message.body.epoch
        if not self.stalled:
            cut = quiet and not self._session.connected
            if cut or time.monotonic() - self._heard_at > STALL:
                self.stalled = True
                log.warning("%s at %.2f s", "the router is away" if cut else "the world's clock has stopped", self.now)
        return restarted


def run_world(
    node: Node,
    session: Session,
    keys: Keys,
    stop: threading.Event,
    *,
    first_tick: int,
    rate: float,
    after_tick: Callable[[int], None],
) -> Statistics:
    """Tick the node that owns time, `rate` match seconds a real second.

    A world that is late is not hurried: match time falls behind real time instead, and the ticks that did not come in
    their real time are counted as missed.

    Args:
        first_tick: number of the first tick.
        after_tick: called with each tick's number when it is over.

    Raises:
        DuplicateNodeError: the match has a world already.
    """
    session.attach(node.mailbox)
    claim(session, keys, node.kind, node.name)
    statistics = Statistics(cpu=-time.process_time(), wall=-time.monotonic())
    step = node.period / rate
    number, due = first_tick, time.monotonic()
    try:
        while not stop.is_set():
            session.receive()
            _call(node, session, Tick(number * node.period), statistics)
            after_tick(number)
            number += 1
            due += step
            pause = due - time.monotonic()
            if pause > 0:
                stop.wait(pause)
            elif pause < -step:
                statistics.missed += int(-pause / step)
                due = time.monotonic()
    finally:
        _finish(node, session, statistics)
    return statistics


def _call(node: Node, session: Session, tick: Tick, statistics: Statistics) -> None:
    node.mailbox.handover(tick.time)
    node.tick(tick)
    session.send(node.mailbox.collect())
    statistics.ticks += 1


def _finish(node: Node, session: Session, statistics: Statistics) -> None:
    """Leave the robots stopped, whatever has happened."""
    try:
        node.stop()
    finally:
        session.send(node.mailbox.collect())
        statistics.wall += time.monotonic()
        statistics.cpu += time.process_time()
        statistics.dropped = sum(inlet.dropped for inlet in node.mailbox.inlets) + session.dropped
