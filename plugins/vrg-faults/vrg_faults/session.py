"""The transport of one simulated process, and the fate of its link to the router.

What arrives is kept by `vrg.bus.arrivals`, as in a real session, and what was missed while the link was lost is
published and asked for once more, as by `vrg.bus.router_link`.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from vrg.bus.arrivals import Arrivals, Arrive
from vrg.bus.codec import encode
from vrg.bus.configuration import LEASE_MS
from vrg.bus.mailbox import Mailbox, Origin, Outgoing
from vrg.bus.router_link import CLOCK_CHECK_PERIOD, DOUBTFUL, EVENT_LIFESPAN, EVENTS_KEPT, RETRY
from vrg.bus.topics import Qos, key_matches
from vrg.bus.transport import OnArrival
from vrg_faults.machine import Machine
from vrg_faults.network import LATENCY, Network, Payload

LEASE: Final = LEASE_MS / 1000.0
"""The time in s of silence after which both ends of a link take it for lost."""


class _Ends(dict[str, list[Arrive]]):
    """The receivers of a session's messages, by key.

    Args:
        entries: of each subscription its key expression, and what takes in what it admits.
    """

    def __init__(self, entries: Sequence[tuple[str, Arrive]]) -> None:
        super().__init__()
        self._entries = entries

    def __missing__(self, key: str) -> list[Arrive]:
        found = [arrive for of, arrive in self._entries if key_matches(of, key)]
        self[key] = found
        return found


class SimulatedSession:
    """The transport of one simulated process.

    Args:
        network: to which it is linked. machine: that of the process. name: of the process.
        instance: distinguishes it from the processes of this name before it.

    Attributes:
        line: over which it is linked. arrivals: what has arrived.
        connected: True while the process takes itself for linked. routed: True while the router does.
        frozen: True while the process does not run: what comes waits.
        generation: counts its links. lost_since: what was sent from then on over the link before did not arrive, s.
        free: the time at which the last of what each other one has sent it arrives, s.
        kept: what it would publish once more, by key. ends: what takes in its messages, by key.
        delivered: called when something has been delivered. changed: called when the link has become another one.
    """

    def __init__(self, network: Network, machine: Machine, name: str, instance: int) -> None:
        self.line = network.line(name)
        self.line.session = self
        self.arrivals = Arrivals(machine.monotonic)
        self.connected = self.routed = True
        self.frozen = self.closed = False
        self.generation, self.lost_since = 0, math.inf
        self.free: dict[SimulatedSession, float] = {}
        self.kept: dict[str, tuple[Qos, deque[tuple[float, bytes]]]] = {}
        self.delivered: Callable[[], None] = lambda: None
        self.changed: Callable[[], None] = lambda: None
        self._network, self._machine, self._instance = network, machine, f"{name}.{instance}"
        self._random = network.stream(f"session {self._instance}")
        self._beats = deque([machine.monotonic()], maxlen=DOUBTFUL)
        self._silences = 0
        self._was_reachable = True
        self._inbox: list[list[Payload]] = []
        self._outbox: list[list[Payload]] = []
        self._entries: list[tuple[str, Arrive]] = []
        self.ends = _Ends(self._entries)
        network.sessions.append(self)
        network.after(CLOCK_CHECK_PERIOD, self._beat)

    @property
    def linked(self) -> bool:
        """True if what it publishes now gets through."""
        return self.reachable and self.routed and self.connected

    @property
    def reachable(self) -> bool:
        """True if the router and the process get to hear one another."""
        return not (self.line.cut or self.frozen or self.closed)

    def attach(self, mailbox: Mailbox, on_arrival: OnArrival | None = None) -> None:
        """Bring to a mailbox what it subscribes to, and the states that were published before."""
        for inlet, arrive in self.arrivals.attach(mailbox, on_arrival):
            self._entries.append((inlet.topic.key, arrive))
        self.ends.clear()
        states = [inlet.topic.key for inlet in mailbox.inlets if inlet.topic.qos is Qos.STATE]
        self._take(self._network.kept(lambda key: any(key_matches(of, key) for of in states), Qos.STATE))

    def deliver(self, messages: list[Payload]) -> None:
        """Bring messages to the process, or let them wait while it cannot be reached."""
        if not self.reachable:
            self._inbox.append(messages)
            return
        for sent, payload, _, origin in messages:
            key = sent
            if self.line.wrong:
                key = self.line.random.choice([known for known, ends in sorted(self.ends.items()) if ends])
            for arrive in self.ends[key]:
                arrive(key, lambda payload=payload: payload, origin)  # type: ignore[misc]
        self.delivered()

    def receive(self) -> None:
        """Pass what has arrived to the inlets."""
        self.arrivals.receive()

    def send(self, outgoing: Sequence[Outgoing]) -> None:
        """Publish messages. While the link is lost, only the newest states and the last events are kept."""
        messages = list[Payload]()
        for out in outgoing:
            key, qos = out.message.key, out.topic.qos
            payload = encode(out.message, f"{out.message.sender}/{self._instance}")
            if qos is not Qos.LATEST and not out.topic.perishable:
                longest = 1 if qos is Qos.STATE else EVENTS_KEPT
                kept = self.kept.setdefault(key, (qos, deque(maxlen=longest)))[1]
                kept.append((self._machine.monotonic(), payload))
            messages.append((key, payload, qos, Origin.LIVE))
        if not messages or not self.connected:
            return
        if not self.reachable:
            self._outbox.append(messages)
        elif self.routed:  # else the router has given it up, which it has not noticed yet
            self._network.carry(self, messages)

    def freeze(self, frozen: bool) -> None:
        """Let the process stop, or go on."""
        self.frozen = frozen
        self.reach_changed()

    def reach_changed(self) -> None:
        """Look whether the process can be reached. If it cannot for the length of a lease, the link is lost."""
        reachable = self.reachable
        if reachable is self._was_reachable:
            return
        self._was_reachable = reachable
        self._silences += 1
        if not reachable:
            self._network.after(LEASE, partial(self._expire, self._silences))
        elif self.routed:
            self._catch_on()
        else:
            if self.connected:  # it was frozen, and finds what came before the router gave it up
                self._catch_on()
                self._lose()
            self._network.after(RETRY * self._random.random() + LATENCY[1], partial(self._connect, self._silences))
        self.changed()

    def reset(self) -> None:
        """Lose the link at once, at both ends."""
        self._drop_link()
        if not self.frozen:
            self._lose()

    def close(self) -> None:
        """End it: what is on its way to it is lost, and the last of what it has sent may be."""
        self._drop_link()
        self.closed, self.connected = True, False
        self._silences += 1
        self._network.sessions.remove(self)
        if self.line.session is self:
            self.line.session = None

    def _expire(self, silence: int) -> None:
        """Lose the link because nothing was heard over it for the length of a lease."""
        if silence != self._silences or self.closed or not self.routed:
            return
        if self.line.cut:
            self._drop_link()
        self.routed = False
        if not self.frozen:
            self._lose()

    def _drop_link(self) -> None:
        """Lose what is on its way, and end the link at the router."""
        self.generation += 1
        self.lost_since = self._network.clock.now() - self._random.uniform(0.0, LATENCY[1])
        self._inbox.clear()
        self._outbox.clear()
        self.routed = False

    def _lose(self) -> None:
        """The process notices that its link is lost."""
        if self.connected:
            self.connected = False
            self._outbox.clear()
            self.arrivals.hold()

    def _catch_on(self) -> None:
        """Send and deliver what had to wait."""
        outbox, self._outbox = self._outbox, []
        inbox, self._inbox = self._inbox, []
        if self.routed:
            for messages in outbox:
                self._network.carry(self, messages)
        for messages in inbox:
            self.deliver(messages)

    def _connect(self, silence: int) -> None:
        """Link it again: it publishes once more what may not have arrived, and asks for what it may have missed."""
        if silence != self._silences or not self.reachable:
            return
        self.routed = self.connected = True
        oldest = max(self._beats[0], self._machine.monotonic() - EVENT_LIFESPAN)
        again = [
            (key, payload, qos, Origin.LIVE if qos is Qos.STATE else Origin.REPEATED)
            for key, (qos, kept) in self.kept.items()
            for at, payload in kept
            if qos is Qos.STATE or at >= oldest
        ]
        self._network.carry(self, again)
        self._take(self._network.kept(lambda key: bool(self.ends[key]), Qos.STATE))
        for number, alarms in enumerate((True, False), 1):
            delay = number * (2.0 * LATENCY[1] + self.line.slow)
            self._network.after(delay, partial(self._catch_up, alarms, self.generation))
        self.changed()

    def _catch_up(self, alarms: bool, generation: int) -> None:
        if generation != self.generation or not self.connected:
            return  # what was missed is asked for again when the link is back
        if not self.reachable:
            self._network.after(RETRY, partial(self._catch_up, alarms, generation))
        else:
            asked = self.arrivals.missable(alarms=alarms)
            kept = {of: self._network.kept(partial(key_matches, of), Qos.EVENT) for of in asked}
            self.arrivals.catch_up(kept, alarms=alarms)

    def _take(self, states: list[tuple[str, bytes]]) -> None:
        for key, payload in states:
            for arrive in self.ends[key]:
                arrive(key, lambda payload=payload: payload, Origin.LIVE)  # type: ignore[misc]

    def _beat(self) -> None:
        if not self.closed:
            if not self.frozen and self.connected:
                self._beats.append(self._machine.monotonic())
            self._network.after(CLOCK_CHECK_PERIOD, self._beat)
