"""The process executor: one node in an operating-system process of its own, paced by the match clock over the bus."""

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue

from vrg.bus.clock_tracker import ClockTracker
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Message, Pulse
from vrg.bus.node import Node, Tick
from vrg.bus.pacing import Pacer
from vrg.bus.session import Session
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Keys
from vrg.bus.transport import turn
from vrg.errors import BusError, DuplicateNodeError
from vrg.system import boot_time


class AutoResetEvent:
    """Wakes one waiting thread, and is reset by waking it. Any thread may set it, at any time.

    It wakes in half the time that a `threading.Condition` takes, because a `SimpleQueue` is written in C. Whatever a
    thread has done before `set` is seen by the thread whose `wait` returns after it.
    """

    def __init__(self) -> None:
        self._set: SimpleQueue[None] = SimpleQueue()

    def set(self) -> None:
        """Wake the thread that waits, or else let its next wait return at once."""
        if self._set.empty():
            self._set.put(None)

    def wait(self, timeout: float) -> bool:
        """Wait until the event is set, for at most `timeout` s, and reset it; return whether it was set."""
        try:
            self._set.get(timeout=timeout)
        except Empty:
            return False
        while not self._set.empty():
            self._set.get_nowait()
        return True


log = logging.getLogger(__name__)

STALLED_PERIOD = 0.1
"""The real time in s between a node's ticks while match time has stopped."""
TAKEOVER_TIMEOUT = 3.0
"""The real time in s that a restarted node waits until the token of its crashed predecessor is gone."""
ROUTER_TIMEOUT = 30.0
"""The real time in s for which it is asked again who is alive, where the router does not answer."""
CLAIM_SETTLES = 0.1
"""The real time in s that two tokens declared at the same moment need until both processes see both."""
PULSE_PERIOD = 0.5
"""The real time in s between a node's signs of life."""


@dataclass
class Statistics:
    """The statistics of a node's process.

    Args:
        ticks: the number of ticks done. missed: the number of ticks that were due but never done.
        cpu: processor time, wall: real time, both since the executor began, s.
        dropped: the number of bad messages, and of events that came faster than they were taken.
        refused: how many messages came under a wrong key, or from a sender that may not publish there, by key.
    """

    ticks: int = 0
    missed: int = 0
    cpu: float = 0.0
    wall: float = 0.0
    dropped: int = 0
    refused: dict[str, int] = field(default_factory=dict)


def claim(session: Session, keys: Keys, kind: str, name: str, stop: StopSignal) -> bool:
    """Declare that this node is alive. Only one node of a kind and name may be alive.

    A node that is alive already stays. If two come at the same moment, the one with the lower instance id stays.

    Returns:
        False if `stop` was set before.

    Raises:
        DuplicateNodeError: another such node is alive, and does not end within TAKEOVER_TIMEOUT.
        BusError: the router does not tell who is alive.
    """
    everyone = keys.alive(kind, name)
    deadline = time.monotonic() + TAKEOVER_TIMEOUT
    while _alive(session, everyone, stop):
        if time.monotonic() >= deadline:
            raise _duplicate(keys, kind, name)
        if stop.wait(0.1):
            return False
    if stop.is_set():
        return False
    own = keys.alive(kind, name, session.instance)
    session.declare_alive(own)
    stop.wait(CLAIM_SETTLES)
    if min(_alive(session, everyone, stop), default=own) < own:
        raise _duplicate(keys, kind, name)
    return not stop.is_set()


def _alive(session: Session, expression: str, stop: StopSignal) -> set[str]:
    """The nodes that are alive, as soon as that is known; none if `stop` is set. A node must not take a name before.

    Raises:
        BusError: it has not become known within ROUTER_TIMEOUT.
    """
    deadline = time.monotonic() + ROUTER_TIMEOUT
    while not stop.wait(0.0):
        try:
            return session.alive(expression)
        except BusError:
            if time.monotonic() >= deadline:
                raise
        stop.wait(0.1)
    return set()


def _duplicate(keys: Keys, kind: str, name: str) -> DuplicateNodeError:
    return DuplicateNodeError(
        f"match {keys.match!r} already has a {kind} named {name!r}: stop that process first, "
        "or start this one under another match name"
    )


def run_node(
    node: Node,
    session: Session,
    keys: Keys,
    stop: StopSignal,
    *,
    finished: Callable[[], bool] = lambda: False,
    idle: float | None = None,
) -> Statistics:
    """Claim the node's name, start it, and tick it by the match clock until `stop` is set or it has `finished`.

    If the node raises an exception, its robot is stopped and the exception goes on to the caller.

    Args:
        idle: the real time in s after which a window is ticked even if it is not due, so that its keys work however
            slow match time is.

    Raises:
        DuplicateNodeError: a node of this kind and name is alive already.
    """
    clock = _ClockInlet(session, keys, node.period)
    pacer = clock.pacer
    session.attach(node.mailbox)
    if not claim(session, keys, node.kind, node.name, stop):
        return Statistics()
    statistics = Statistics(cpu=-time.process_time(), wall=-time.monotonic())
    pulse = _Pulse(session, keys, node, pacer.tracker)
    try:
        node.start()
        called = time.monotonic()
        while not stop.is_set() and not finished():
            if clock.wait(idle or STALLED_PERIOD):
                # The world has stepped back in time, so older messages have later stamps than the new ones.
                node.mailbox.forget()
            session.receive()
            statistics.missed = pacer.missed
            pulse.beat(statistics)
            tick = pacer.tick()
            if tick is None and idle and time.monotonic() - called > idle:
                tick = Tick(pacer.time)
            if tick is not None:
                _turn(node, session, tick, statistics)
                called = time.monotonic()
    finally:
        statistics.missed = pacer.missed
        _finish(node, session, statistics)
    return statistics


class _ClockInlet:
    """The world's clock as a process hears it on the bus.

    Attributes:
        pacer: decides when the node is ticked.
    """

    def __init__(self, session: Session, keys: Keys, period: float) -> None:
        self._session = session
        self._mailbox = Mailbox()
        self._inlet = self._mailbox.subscribe(keys.clock)
        self._arrived = AutoResetEvent()
        self.pacer = Pacer(period, boot_time())
        session.attach(self._mailbox, self._wake)

    def _wake(self, _inlet: Inlet[Message]) -> None:
        self._arrived.set()

    def wait(self, timeout: float) -> bool:
        """Wait for the next message for at most `timeout` s; return whether the world was restarted since the last."""
        quiet = not self._arrived.wait(timeout)
        self._session.receive()
        self._mailbox.handover(self.pacer.time)
        cut = quiet and not self._session.connected
        return self.pacer.hear(self._inlet.take(), boot_time(), cut=cut)


def run_world(
    node: Node,
    session: Session,
    keys: Keys,
    stop: StopSignal,
    *,
    first_tick: int,
    rate: float,
    after_tick: Callable[[int], None],
) -> Statistics:
    """Tick the node that owns time, at `rate` match seconds per real second.

    A world that is late does not hurry. Match time falls behind real time instead, and the ticks that fell behind are
    counted as missed.

    Args:
        first_tick: the number of the first tick.
        rate: match seconds per real second, above 0.
        after_tick: called with each tick's number when it is over.

    Raises:
        DuplicateNodeError: the match has a world already.
        ValueError: the rate is not above 0. Only a match in one process can be as fast as the processor allows.
    """
    if rate <= 0.0:
        raise ValueError(f"rate: expected match seconds per real second above 0, got {rate}")
    session.attach(node.mailbox)
    if not claim(session, keys, node.kind, node.name, stop):
        return Statistics()
    statistics = Statistics(cpu=-time.process_time(), wall=-time.monotonic())
    pulse = _Pulse(session, keys, node)
    step = node.period / rate
    try:
        node.start()
        number, due = first_tick, time.monotonic()
        while not stop.is_set():
            session.receive()
            _turn(node, session, Tick(number * node.period), statistics)
            after_tick(number)
            pulse.beat(statistics)
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


class _Pulse:
    """Publishes at regular times that the thread that ticks a node is not stuck.

    Args:
        tracker: knows how the process' clock runs against the match clock; None in the world's own process.
    """

    def __init__(self, session: Session, keys: Keys, node: Node, tracker: ClockTracker | None = None) -> None:
        self._session = session
        self._tracker = tracker
        self._before = (time.monotonic(), 0)
        self._topic = keys.pulse(node.kind, node.name)
        self._mailbox = Mailbox(node.mailbox.sender)
        self._next = 0.0

    def beat(self, statistics: Statistics) -> None:
        now = time.monotonic()
        if now >= self._next:
            self._next = now + PULSE_PERIOD
            since, ticks = self._before
            self._before = (now, statistics.ticks)
            estimate = None if self._tracker is None else self._tracker.estimate()
            pulse = Pulse(
                ticks=statistics.ticks,
                missed=statistics.missed,
                frequency=(statistics.ticks - ticks) / max(now - since, 1e-3),
                late=None if estimate is None else estimate.late,
                drift=None if estimate is None else estimate.drift,
                refused=self._session.refused.total(),
            )
            self._mailbox.publish(self._topic, pulse)
            self._session.send(self._mailbox.collect())


def _turn(node: Node, session: Session, tick: Tick, statistics: Statistics) -> None:
    turn([node], tick, session)
    statistics.ticks += 1


def _finish(node: Node, session: Session, statistics: Statistics) -> None:
    """Stop the node, so that robots stand still whatever has happened, and complete the statistics."""
    try:
        node.stop()
    finally:
        session.send(node.mailbox.collect())
        statistics.wall += time.monotonic()
        statistics.cpu += time.process_time()
        statistics.dropped = sum(inlet.dropped for inlet in node.mailbox.inlets) + session.dropped
        statistics.refused = dict(session.refused)
