"""A simulated bus: sessions of simulated processes, linked by a router, with links that are slow, lossy or cut.

What a process hears is what it would hear over the bus: of states the newest, of events all in their order, after a
link was lost once more what may have been missed (see vrg.bus.link), and each message through the codec. No time passes
here but that of `now`, and all chance comes from streams of the links' own.
"""

import heapq
from collections import deque
from collections.abc import Callable, Sequence
from random import Random
from typing import Final

from vrg.bus.codec import Header, encode, header
from vrg.bus.link import CLOCK_CHECK_PERIOD, DOUBTFUL, EVENT_LIFESPAN, EVENTS_KEPT
from vrg.bus.mailbox import Inlet, Mailbox, Numbers, Origin, Outgoing
from vrg.bus.messages import Message
from vrg.bus.topics import Qos, key_matches
from vrg.bus.transport import OnArrival
from vrg.errors import MessageError

LATENCY: Final = (0.0002, 0.002)
"""The least and the most time in s that a message takes over a good link."""
_Payload = tuple[str, bytes, Qos, Origin]
"""A message on its way: its key, its bytes, its kind, and how it comes."""


class Network:
    """The router and all links to it.

    Args:
        stream: returns the random numbers of something by its name.

    Attributes:
        now: the simulated real time, s. sessions: those that are open.
    """

    def __init__(self, stream: Callable[[str], Random]) -> None:
        self.now = 0.0
        self.stream = stream
        self.sessions: list[SimulatedSession] = []
        self._waiting: list[tuple[float, int, SimulatedSession, list[_Payload]]] = []
        self._count = 0

    def carry(self, sender: "SimulatedSession", messages: Sequence[_Payload]) -> None:
        """Take messages of a session to all others, and to itself."""
        for receiver in self.sessions:
            wanted = [message for message in messages if receiver.wants(message[0])]
            if wanted and not receiver.cut:
                self._send(sender, receiver, receiver.suffered(wanted), max(sender.delay(), receiver.delay()))

    def _send(
        self, sender: "SimulatedSession", receiver: "SimulatedSession", messages: list[_Payload], delay: float
    ) -> None:
        # What one process sends another stays in its order, however its delay changes.
        at = receiver.free[sender] = max(receiver.free.get(sender, 0.0), self.now + delay)
        self._count += 1
        heapq.heappush(self._waiting, (at, self._count, receiver, messages))

    @property
    def next(self) -> float | None:
        """The time of the next arrival, s; None if nothing is on its way."""
        return self._waiting[0][0] if self._waiting else None

    def arrive(self) -> "SimulatedSession":
        """Let what comes next arrive, and return the session to which it has come."""
        self.now, _, receiver, messages = heapq.heappop(self._waiting)
        receiver.take(messages)
        return receiver

    def kept(self, matches: Callable[[str], bool], qos: Qos) -> list[_Payload]:
        """What the connected sessions keep of a kind of messages, each in its sender's order."""
        return [
            (key, payload, qos, Origin.ASKED)
            for session in self.sessions
            if not session.cut
            for key, (kind, kept) in session.kept.items()
            if kind is qos and matches(key)
            for _, payload in kept
        ]


class Link:
    """The link of one process, however often that is started again.

    Attributes:
        down: True while nothing passes it.
        slow: more time in s that each message takes. loss: the share of LATEST messages that are lost.
        twice: the share of events that come twice. wrong: True if messages come under wrong keys.
    """

    def __init__(self) -> None:
        self.down = self.wrong = False
        self.slow = self.loss = self.twice = 0.0


class SimulatedSession:
    """The transport of one simulated process.

    What cannot pass waits, as it does in a connection of TCP, until the link is given up or something passes again.

    Args:
        network: to which it is linked. name: of the process. link: that of the process.

    Attributes:
        held: True while nothing passes. cut: True once the link is given up. closed: True once the process has ended.
        holds: how often it has been held.
        free: the time at which the last of what each other one has sent it arrives, s.
        kept: what it would publish once more, by key.
    """

    def __init__(self, network: Network, name: str, link: Link | None = None) -> None:
        self.cut = self.closed = self.held = False
        self.holds = 0
        self._link = link or Link()
        self._unsent: list[_Payload] = []
        self._unheard: list[_Payload] = []
        self.free: dict[SimulatedSession, float] = {}
        self.kept: dict[str, tuple[Qos, deque[tuple[float, bytes]]]] = {}
        self._network, self._name = network, name
        self._random = network.stream(f"link of {name}")
        self._held_at = 0.0
        self._inlets: list[tuple[Inlet[Message], OnArrival | None, Numbers]] = []
        self._known: dict[str, list[tuple[Inlet[Message], OnArrival | None, Numbers]]] = {}
        self._events: deque[tuple[Inlet[Message], Header, Origin]] = deque()
        self._newest: dict[tuple[int, str], tuple[Inlet[Message], Header]] = {}
        network.sessions.append(self)

    def attach(self, mailbox: Mailbox, on_arrival: OnArrival | None = None) -> None:
        """Bring to a mailbox what it subscribes to, and the states that were published before."""
        for inlet in mailbox.inlets:
            self._inlets.append((inlet, on_arrival, Numbers()))
        self._known.clear()
        states = [inlet.topic.key for inlet in mailbox.inlets if inlet.topic.qos is Qos.STATE]
        for message in self._network.kept(lambda key: any(key_matches(of, key) for of in states), Qos.STATE):
            self.arrive(*message)

    def wants(self, key: str) -> bool:
        """True if it subscribes to a key."""
        return bool(self._ends(key))

    def delay(self) -> float:
        """The time in s that its next message takes."""
        return self._random.uniform(*LATENCY) + self._link.slow

    def suffered(self, messages: Sequence[_Payload]) -> list[_Payload]:
        """What becomes of messages on its link."""
        loss, twice = self._link.loss, self._link.twice
        if not (loss or twice):
            return list(messages)
        found = []
        for message in messages:
            kind = message[2]
            if kind is Qos.LATEST and self._random.random() < loss:
                continue
            found += [message] * (1 + (kind is Qos.EVENT and self._random.random() < twice))
        return found

    def take(self, messages: Sequence[_Payload]) -> None:
        """Let messages arrive, as far as its link is there."""
        if self.cut or self.closed:
            return
        if self.held:
            self._unheard += messages
            return
        for message in messages:
            self.arrive(*message)

    def arrive(self, key: str, payload: bytes, _qos: Qos, origin: Origin) -> None:
        """Put aside what has arrived, and sound alarms."""
        if self._link.wrong:
            others = [known for known, ends in sorted(self._known.items()) if ends]
            key = self._random.choice(others or [key])
        try:
            head = header(payload, key)
        except MessageError:  # also one that came under a wrong key
            return
        for inlet, on_arrival, alarms in self._ends(key):
            if inlet.alarm is not None and (alarms.is_new(head, origin) or origin is Origin.LIVE):
                inlet.sound(head)
            if inlet.topic.qos is Qos.EVENT:
                self._events.append((inlet, head, origin))
            else:
                self._newest[(id(inlet), key)] = (inlet, head)
            if on_arrival is not None:
                on_arrival(inlet)

    def receive(self) -> None:
        """Pass what has arrived to the inlets."""
        while self._events:
            inlet, head, origin = self._events.popleft()
            inlet.offer_header(head, origin)
        for inlet, head in self._newest.values():
            inlet.offer_header(head)
        self._newest.clear()

    def send(self, outgoing: Sequence[Outgoing]) -> None:
        """Publish messages. While the link is lost, only the newest states and the last events are kept."""
        now, messages = self._network.now, list[_Payload]()
        for out in outgoing:
            key, qos = out.message.key, out.topic.qos
            payload = encode(out.message, f"{out.message.sender}/{self._name}")
            if qos is not Qos.LATEST and not out.topic.perishable:
                longest = 1 if qos is Qos.STATE else EVENTS_KEPT
                self.kept.setdefault(key, (qos, deque(maxlen=longest)))[1].append((now, payload))
            messages.append((key, payload, qos, Origin.LIVE))
        if self.held and not self.cut:
            self._unsent += messages
        elif messages and not self.cut:
            self._network.carry(self, messages)

    def hold(self) -> None:
        """Let nothing pass from now on."""
        self.held, self._held_at = True, self._network.now
        self.holds += 1

    def give_up(self) -> None:
        """Lose the link, and what waits for it."""
        self.cut, self._unsent, self._unheard = True, [], []

    def go_on(self) -> None:
        """Let what waits pass, or link it again if the link was given up."""
        self.held = False
        if self.cut:
            self._link_again()
            return
        unsent, self._unsent = self._unsent, []
        unheard, self._unheard = self._unheard, []
        self.take(unheard)
        self._network.carry(self, unsent)

    def _link_again(self) -> None:
        """Publish once more what may not have arrived, and ask for what may have been missed."""
        self.cut = False
        oldest = max(self._held_at - DOUBTFUL * CLOCK_CHECK_PERIOD, self._network.now - EVENT_LIFESPAN)
        again = [
            (key, payload, qos, Origin.LIVE if qos is Qos.STATE else Origin.REPEATED)
            for key, (qos, kept) in self.kept.items()
            for at, payload in kept
            if qos is Qos.STATE or at >= oldest
        ]
        self._network.carry(self, again)
        waiting, self._events = self._events, deque()
        for qos in (Qos.EVENT, Qos.STATE):
            for message in self._network.kept(self.wants, qos):
                self.arrive(*message)
        self._events += waiting

    def close(self) -> None:
        """End it: what is on its way to it is lost."""
        self.closed = True
        self._network.sessions.remove(self)

    def _ends(self, key: str) -> list[tuple[Inlet[Message], OnArrival | None, Numbers]]:
        found = self._known.get(key)
        if found is None:
            found = [end for end in self._inlets if key_matches(end[0].topic.key, key) and end[0].admits(key)]
            self._known[key] = found
        return found
