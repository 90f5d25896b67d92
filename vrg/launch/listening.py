"""The launcher's subscriptions for its log of events: match time, and the orders to stop."""

import functools
import math
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from vrg.bus.codec import decode, header
from vrg.bus.messages import Clock, Estop, EstopRelease, MeasuredPose, at_rest
from vrg.bus.session import Session
from vrg.bus.topics import Keys, Qos, name_in
from vrg.errors import MessageError
from vrg.recording.stops import REST_TIME
from vrg.runs.events import REFEREE, WORLD, Event, EventKind, EventLog

CLOCK_TIMEOUT = 0.1
"""The real time in s without a clock after which the poses of physical robots are logged: match time stands."""
LATCHES = 1.0
"""The real time in s after an order of the emergency stop in which the world's latch tells its match time."""
LOGGING_TIMEOUT = 10.0
"""The real time in s without a clock after which they are not logged any more."""
SAMPLE = 0.01
"""The least real time in s between two poses of a robot in the log."""
SETTLED = REST_TIME + 0.001
"""The real time in s for which a robot is at rest in the log before it stands; the log rounds times."""


@dataclass
class _MatchTime:
    """The match time that was heard last, s, when, by monotonic time, and whether the world had latched the stop."""

    time: float | None = None
    at: float = 0.0
    estop: bool = False


@dataclass
class _Rolling:
    """The logged motion of a physical robot while match time stands: its times, and since when it has been at rest."""

    logged: float = -math.inf
    rests_since: float | None = None
    stands: bool = False

    @property
    def undecided(self) -> bool:
        """True if it is at rest, but not for long enough that it stands."""
        return self.rests_since is not None and not self.stands

    def take(self, at: float, rests: bool) -> bool:
        """Take in that it is measured at a monotonic time, s; return whether that belongs into the log."""
        if at - self.logged < SAMPLE or (rests and self.stands):
            return False
        self.logged = at
        if not rests:
            self.rests_since = None
        elif self.rests_since is None:
            self.rests_since = at
        self.stands = self.rests_since is not None and at - self.rests_since >= SETTLED
        return True


class Listening:
    """Hears for the launcher's log of events what the match does. Threads of zenoh's take messages in, with the time of
    their arrival; `look` works on them.

    Args:
        keys: the keys of the match. log: where events are written. players: the players.
    """

    def __init__(self, keys: Keys, log: EventLog, players: Sequence[str]) -> None:
        self._players = players
        self._keys = keys
        self._log = log
        self._arrivals: deque[tuple[str, str, bytes, float]] = deque()
        self._clock = _MatchTime()
        self._newest: dict[str, float] = {}
        self._rolling: dict[str, _Rolling] = {}
        self._waiting: list[tuple[EventKind, str]] = []
        self._order: tuple[float, float | None, str] | None = None
        self._engaged = False
        self._ignored = 0

    def attach(self, session: Session) -> None:
        """Listen on a session from now on."""
        keys = self._keys
        topics = {
            "clock": keys.clock, "state": keys.referee_state, "pose": keys.robot_pose(), "report": keys.report(),
            "estop": keys.estop, "release": keys.estop_release,
        }  # fmt: skip
        # All in one queue, so that each message has its own time and its place among the others.
        for kind, topic in topics.items():
            only = {topic.key}
            if kind in ("pose", "report"):
                only = {(keys.robot_pose(name) if kind == "pose" else keys.report(name)).key for name in self._players}
            arrived = functools.partial(self._arrived, kind)
            session.watch_raw(topic.key, arrived, history=topic.qos is Qos.STATE, only=only)

    def _arrived(self, kind: str, key: str, payload: bytes) -> None:
        self._arrivals.append((kind, key, payload, time.monotonic()))

    def look(self) -> None:
        """Take in what has arrived, and log what belongs into the log."""
        self._hear_until(math.inf)

    def note_at_next_clock(self, what: EventKind, process: str) -> None:
        """Log an event as soon as the world's clock is heard again, so that its match time is known."""
        self._waiting.append((what, process))

    def note(self, what: EventKind, process: str | None = None, text: str = "", *, status: int | None = None) -> None:
        """Log an event that happens now, with the match time and what was heard of each sender until then."""
        now = time.monotonic()
        self._hear_until(now)
        self._write(now, what, process, text, status=status)

    def _write(
        self, at: float, what: EventKind, process: str | None = None, text: str = "", *, status: int | None = None
    ) -> None:
        self._write_order()
        clock = self._clock
        event = Event(
            what=what, process=process, monotonic=round(at, 4), time=clock.time, clock=round(clock.at, 4), text=text,
            status=status, newest=dict(sorted(self._newest.items())),
        )  # fmt: skip
        self._log.write(event)

    def _write_order(self) -> None:
        """Log an order of the emergency stop that waits for its match time."""
        if self._order is not None:
            (at, stamp, text), self._order = self._order, None
            self._log.write(Event(what=EventKind.ESTOP, monotonic=round(at, 4), time=stamp, text=text))

    def _hear_until(self, at: float) -> None:
        """Take in what arrived before a monotonic time, s."""
        while self._arrivals and self._arrivals[0][3] <= at:
            self._hear(*self._arrivals.popleft())
        if self._order is not None and min(at, time.monotonic()) - self._order[0] > LATCHES:
            self._write_order()

    def _hear(self, kind: str, key: str, payload: bytes, at: float) -> None:
        try:
            head = header(payload, key)
            stamp = head.stamp
            if kind == "clock":
                self._ticked(stamp, decode(payload, Clock, key).body, at)
            elif kind == "pose":
                self._measured(name_in(key), decode(payload, MeasuredPose, key).body, at)
            elif kind == "estop":
                self._ordered(decode(payload, Estop, key).body, at)
            elif kind == "release":
                self._ordered(decode(payload, EstopRelease, key).body, at)
        except MessageError:
            return
        if kind not in ("clock", "state", "report"):
            return
        name = {"clock": WORLD, "state": REFEREE}.get(kind) or name_in(key)
        self._newest[name] = stamp

    def _ticked(self, stamp: float, clock: Clock, at: float) -> None:
        before, self._clock = self._clock, _MatchTime(stamp, at, clock.estop)
        if self._order is not None and clock.estop:
            # The order may have overtaken clocks that were on the way; the world knows when it arrived.
            self._order = (self._order[0], stamp, self._order[2])
            self._write_order()
        if before.estop and not clock.estop:
            self._engaged = False  # even if the order that released it was not heard
        if before.time is not None and stamp < before.time:
            self._write(at, EventKind.STEPPED_BACK, WORLD, f"from {before.time:.2f} s to {stamp:.2f} s of match time")
        waiting, self._waiting = self._waiting, []
        for what, process in waiting:
            self._write(at, what, process)

    def _ordered(self, order: Estop | EstopRelease, at: float) -> None:
        """Log an order of the emergency stop that changes something. Every seat may give any number of others."""
        engages = isinstance(order, Estop)
        if engages == self._engaged:
            self._ignored += engages
            return
        self._engaged = engages
        text = f"by {order.by}{f': {order.reason}' if order.reason else ''}"
        if self._ignored:
            text += f" ({self._ignored} more orders to engage it changed nothing)"
            self._ignored = 0
        if engages:
            self._write_order()
            self._order = (at, self._clock.time, text)
        else:
            self._write(at, EventKind.RELEASE, text=text)

    def _measured(self, robot: str, measured: MeasuredPose, at: float) -> None:
        """Log where a physical robot is measured while match time stands, but not while it goes on standing.

        When match time goes on it is still logged until it is known whether its last rest was more than a moment.
        """
        timeless = self._clock.time is not None and CLOCK_TIMEOUT < at - self._clock.at <= LOGGING_TIMEOUT
        rolling = self._rolling.setdefault(robot, _Rolling())
        if not timeless and not rolling.undecided:
            del self._rolling[robot]
            return
        if not rolling.take(at, at_rest(measured.twist)):
            return
        pose = measured.pose
        event = Event(
            what=EventKind.MEASURED, process=robot, monotonic=round(at, 4), time=self._clock.time, x=pose.x, y=pose.y,
            v=measured.twist.v, w=measured.twist.w, side=measured.twist.side,
        )  # fmt: skip
        self._log.write(event)
