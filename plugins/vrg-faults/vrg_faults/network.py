"""A simulated bus: a router, and lines to it that are slow, lossy or cut.

A cut is noticed when zenoh's lease is over: what was sent meanwhile comes late where the cut was shorter, and else is
lost; see `vrg_faults.session`. No time passes here but that of the clock, and all chance comes from streams of the
lines' own.
"""

from collections.abc import Callable, Sequence
from random import Random
from typing import TYPE_CHECKING, Final

from vrg.bus.mailbox import Origin
from vrg.bus.topics import Qos
from vrg.hal.simulated_clock import SimulatedClock

if TYPE_CHECKING:
    from vrg_faults.session import SimulatedSession

LATENCY: Final = (0.0002, 0.002)
"""The least and the most time in s that a message takes over a good line."""
Payload = tuple[str, bytes, Qos, Origin]
"""A message on its way: its key, its bytes, its kind, and how it comes."""


class Line:
    """The line of one process to the router. It belongs to the machine, so a process that is started again keeps it.

    Args:
        network: to which it leads. name: of the process.

    Attributes:
        slow: more time in s that each message takes. loss: the share of LATEST messages that are lost.
        twice: the share of events that come twice. wrong: True if messages come under wrong keys.
        session: that of the process which runs now; None if none does.
    """

    def __init__(self, network: "Network", name: str) -> None:
        self.slow = self.loss = self.twice = 0.0
        self.wrong = False
        self.session: SimulatedSession | None = None
        self.random = network.stream(f"link of {name}")
        self._cuts = 0

    @property
    def cut(self) -> bool:
        """True while nothing comes through."""
        return self._cuts > 0

    def break_off(self, *, noticed: bool) -> None:
        """Let nothing through from now on.

        Args:
            noticed: True if both ends learn of it at once, as when the router ends; False if by the lease alone.
        """
        self._cuts += 1
        if self.session is not None:
            self.session.reach_changed()
            if noticed:
                self.session.reset()

    def mend(self) -> None:
        """Let everything through again, unless it was broken off more than once."""
        self._cuts -= 1
        if self.session is not None:
            self.session.reach_changed()

    def delay(self) -> float:
        """The time in s that its next message takes."""
        return self.random.uniform(*LATENCY) + self.slow

    def suffered(self, messages: Sequence[Payload]) -> list[Payload]:
        """What becomes of messages on the way over it."""
        if not (self.loss or self.twice):
            return list(messages)
        found = []
        for message in messages:
            kind = message[2]
            if kind is Qos.LATEST and self.random.random() < self.loss:
                continue
            found += [message] * (1 + (kind is Qos.EVENT and self.random.random() < self.twice))
        return found


class Network:
    """The router and all lines to it.

    Args:
        clock: the simulated real time. stream: returns the random numbers of something by its name.

    Attributes:
        sessions: those that are open. lines: by the name of the process.
    """

    def __init__(self, clock: SimulatedClock, stream: Callable[[str], Random]) -> None:
        self.clock, self.stream = clock, stream
        self.sessions: list[SimulatedSession] = []
        self.lines: dict[str, Line] = {}

    def line(self, name: str) -> Line:
        """The line of a process."""
        if name not in self.lines:
            self.lines[name] = Line(self, name)
        return self.lines[name]

    def after(self, delay: float, action: Callable[[], object]) -> None:
        """Let something happen after this many s."""
        self.clock.at(self.clock.now() + delay, action)

    def carry(self, sender: "SimulatedSession", messages: Sequence[Payload]) -> None:
        """Take messages of a session to all others, and to itself."""
        sent = sender.line.suffered(messages)
        for receiver in self.sessions:
            ends = receiver.ends
            wanted = [message for message in sent if ends[message[0]]]
            if wanted and receiver.routed:
                wanted = wanted if receiver is sender else receiver.line.suffered(wanted)
                self._send(sender, receiver, wanted, max(sender.line.delay(), receiver.line.delay()))

    def _send(
        self, sender: "SimulatedSession", receiver: "SimulatedSession", messages: list[Payload], delay: float
    ) -> None:
        now, of, to = self.clock.now(), sender.generation, receiver.generation
        # What one process sends another stays in its order, however its delay changes.
        at = receiver.free[sender] = max(receiver.free.get(sender, 0.0), now + delay)

        def arrive() -> None:
            # A link that is lost takes with it what is on its way to its process, and the last of what came from there.
            if to == receiver.generation and (of == sender.generation or now < sender.lost_since):
                receiver.deliver(messages)

        self.clock.at(at, arrive)

    def kept(self, matches: Callable[[str], bool], qos: Qos) -> list[tuple[str, bytes]]:
        """What the linked sessions keep of a kind of messages, key and payload, each in its sender's order."""
        return [
            (key, payload)
            for session in self.sessions
            if session.routed and session.reachable
            for key, (kind, kept) in session.kept.items()
            if kind is qos and matches(key)
            for _, payload in kept
        ]
