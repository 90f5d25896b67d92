"""An observer of a simulated match, who is also the official that stops play, and resumes it when it is halted."""

from collections.abc import Hashable
from typing import TYPE_CHECKING, Final

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import (
    Call,
    Clock,
    Estop,
    EstopRelease,
    Manual,
    Official,
    OfficialAction,
    Poses,
    RefereeState,
    Stage,
)
from vrg.bus.topics import name_in
from vrg_faults.machine import Machine
from vrg_faults.session import SimulatedSession

if TYPE_CHECKING:
    from vrg_faults.simulation import SimulatedMatch

PATIENCE: Final = 2.0
"""The simulated real time in s of a halt after which the official recovers robots and resumes play."""
COMMANDS: Final = 0.1
"""The simulated real time in s between two commands of a hand."""
LEASE: Final = 0.5
"""The match time in s for which each of them holds."""
OBSERVER: Final = "observer"
"""The name of the observer's line."""


class Observer:
    """Observes a simulated match, and is the official who stops and resumes play. Its process does not fail, and its
    line only as the router does.

    Args:
        match: which it observes.

    Attributes:
        calls: those that it has heard, in order.
        state: the last state that it has heard, and heard_at: when, simulated real time in s.
        poses, clock: what it has just heard of these.
        pressed: since when the emergency stop is engaged, match time in s; None if it is not.
        resumed: how often it has resumed play.
        driven: when it has last commanded a player by hand, match time in s, by its name.
        manual: the players that have last reported that a person drives them.
    """

    def __init__(self, match: "SimulatedMatch") -> None:
        self.calls: list[Call] = []
        self.state: RefereeState | None = None
        self.heard_at = 0.0
        self.poses: Received[Poses] | None = None
        self.clock: Clock | None = None
        self.pressed: float | None = None
        self.resumed = 0
        self.driven: dict[str, float] = {}
        self.manual: set[str] = set()
        self._hands: set[str] = set()
        self._match = match
        self._halted: float | None = None
        self._recovered = False
        self._watch, self._official = Mailbox("spectator/observer"), Mailbox("official/ann")
        keys = match.setup.keys
        self._events = self._watch.subscribe(keys.referee_event)
        self._states = self._watch.subscribe(keys.referee_state)
        self._bodies = self._watch.subscribe(keys.poses)
        self._clocks = self._watch.subscribe(keys.clock)
        self._reports = self._watch.subscribe(keys.report())
        machine = Machine(match.clock, match.network.stream("machine of observer"))
        self._session = SimulatedSession(match.network, machine, OBSERVER, 1)
        self._session.attach(self._watch)
        self._session.delivered = self._hear
        match.network.after(0.5, self._decide)
        match.network.after(COMMANDS, self._drive)

    @property
    def over(self) -> bool:
        """True if the game is over, as it has heard."""
        return self.state is not None and self.state.stage is Stage.GAME_OVER

    def press(self) -> None:
        """Press the emergency stop."""
        self.pressed = self._match.time if self.pressed is None else self.pressed
        self._official.publish(self._match.setup.keys.estop, Estop(by="ann"))
        self._session.send(self._official.collect())

    def release(self) -> None:
        """Release the emergency stop."""
        self.pressed = None
        self._official.publish(self._match.setup.keys.estop_release, EstopRelease(by="ann"))
        self._session.send(self._official.collect())

    def halt(self) -> None:
        """Call a HALT."""
        self._order(OfficialAction.HALT)

    def take(self, player: str) -> None:
        """Drive a player by hand from now on, backwards."""
        self._hands.add(player)

    def let_go(self, player: str) -> None:
        """Send no more commands to a player."""
        self._hands.discard(player)

    def _drive(self) -> None:
        for player in sorted(self._hands):
            self.driven[player] = self._match.time
            by_hand = Manual(forward=-1.0, turn=0.0, lease=LEASE)
            self._official.publish(self._match.setup.keys.manual(player), by_hand, stamp=self._match.time)
        self._session.send(self._official.collect())
        self._match.network.after(COMMANDS, self._drive)

    def _order(self, action: OfficialAction) -> None:
        self._official.publish(self._match.setup.keys.official, Official(action=action, by="ann"))
        self._session.send(self._official.collect())

    def _decide(self) -> None:
        """Resume what has been halted for a while, and release an emergency stop that has not heard of its release."""
        now, state = self._match.clock.now(), self.state
        halted = state is not None and state.halted is not None
        self._halted = None if not halted else now if self._halted is None else self._halted
        if state is not None and self._halted is not None and now - self._halted >= PATIENCE and self.pressed is None:
            if state.estop or self._match.can is not None:  # a drive that has got the order late asks for a release
                self.release()
            if self._match.can is not None and not self._recovered:
                # A robot that has latched a fault is recovered by a person, and then play is resumed.
                self._halted, self._recovered = now, True
                self._order(OfficialAction.RECOVER)
            else:
                self._halted, self._recovered = None, False
                self.resumed += 1
                self._order(OfficialAction.RESUME)
        self._match.network.after(0.5, self._decide)

    def _hear(self) -> None:
        """Take in what has arrived, and let it be checked."""
        self._session.receive()
        self._watch.handover(0.0)
        self.calls += [received.body for received in self._events.take()]
        states, poses, clocks = self._states.take(), self._bodies.take(), self._clocks.take()
        for report in self._reports.take():
            (self.manual.add if report.body.manual else self.manual.discard)(name_in(report.key))
        if states:
            self.state, self.heard_at = states[-1].body, self._match.clock.now()
        self.poses = poses[-1] if poses else None
        self.clock = clocks[-1].body if clocks else None
        if states or poses or clocks:
            self._match.heard()


class Spans:
    """For how long things have held, each by a name of its own."""

    def __init__(self) -> None:
        self._since: dict[Hashable, float] = {}

    def passed(self, what: Hashable, holds: bool, now: float) -> float:
        """The time in s for which something has held up to `now`; 0 if it does not hold."""
        if not holds:
            self._since.pop(what, None)
            return 0.0
        return now - self._since.setdefault(what, now)
