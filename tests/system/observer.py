"""What is heard on the bus of a match, in the order of its arrival."""

import threading
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from vrg.bus import messages as m
from vrg.bus.codec import Received, decode
from vrg.bus.mailbox import Mailbox
from vrg.bus.session import Session
from vrg.bus.topics import Keys, name_in
from vrg.errors import MessageError

PATIENCE = 30.0
"""s of real time: far more than anything waited for takes, also on a busy machine."""
AT_REST = 0.02
"""m/s below which a robot stands; twice that in rad/s."""


@dataclass
class Heard:
    """Everything that was heard, in the order of its arrival."""

    clocks: list[Received[m.Clock]] = field(default_factory=list)
    poses: list[Received[m.Poses]] = field(default_factory=list)
    states: list[Received[m.RefereeState]] = field(default_factory=list)
    calls: list[m.Call] = field(default_factory=list)
    drives: dict[str, list[Received[m.Drive]]] = field(default_factory=lambda: defaultdict(list))
    reports: dict[str, list[Received[m.Report]]] = field(default_factory=lambda: defaultdict(list))
    robots: dict[str, list[Received[m.RobotState]]] = field(default_factory=lambda: defaultdict(list))
    limits: dict[str, float] = field(default_factory=dict)
    pulses: Counter[str] = field(default_factory=Counter)
    """By `kind/name`."""
    releases: int = 0
    """Of the emergency stop."""
    estops: list[tuple[float, m.Estop]] = field(default_factory=list)
    """With the match time of the newest clock that had arrived before."""
    bad: int = 0


class Observer:
    """Hears a match as any other process of it does; speaks as an official.

    Args:
        session: open. keys: of the match.
        alert: called at each look; raises where waiting has become useless.
    """

    def __init__(self, session: Session, keys: Keys, alert: Callable[[], None] = lambda: None) -> None:
        self.keys = keys
        self.heard = Heard()
        self._session = session
        self._alert = alert
        self._mailbox = Mailbox()
        self._arrivals: deque[tuple[str, bytes]] = deque()
        self._pause = threading.Event()
        topics = (
            keys.clock, keys.poses, keys.drive(), keys.robot_state(), keys.report(), keys.referee_state,
            keys.referee_event, keys.speed_limit(), keys.estop, keys.estop_release, keys.pulse(),
        )  # fmt: skip
        for topic in topics:
            session.watch_raw(topic.key, lambda key, payload: self._arrivals.append((key, payload)))

    def look(self) -> None:
        """Take in what has arrived."""
        self._alert()
        while self._arrivals:
            self._hear(*self._arrivals.popleft())

    def _hear(self, key: str, payload: bytes) -> None:
        topic = self.keys.topic_of(key)
        assert topic is not None
        try:
            received: Received[Any] = decode(payload, topic.type, key)
        except MessageError:
            self.heard.bad += 1
            return
        heard = self.heard
        match received.body:
            case m.Clock():
                heard.clocks.append(received)
            case m.Poses():
                heard.poses.append(received)
            case m.RefereeState():
                heard.states.append(received)
            case m.Call() as call:
                heard.calls.append(call)
            case m.Drive():
                heard.drives[name_in(key)].append(received)
            case m.Report():
                heard.reports[name_in(key)].append(received)
            case m.RobotState():
                heard.robots[name_in(key)].append(received)
            case m.Pulse():
                heard.pulses["/".join(key.split("/")[3:])] += 1
            case m.SpeedLimit() as limit:
                heard.limits[name_in(key)] = limit.v_max
            case m.EstopRelease():
                heard.releases += 1
            case m.Estop() as estop:
                heard.estops.append((self.now, estop))

    def wait_until(self, condition: Callable[[], object], what: str, patience: float = PATIENCE) -> None:
        """Look until the condition holds.

        Raises:
            AssertionError: it does not within `patience` seconds of real time; tells what was heard last.
        """
        deadline = time.monotonic() + patience
        while True:
            self.look()
            if condition():
                return
            assert time.monotonic() < deadline, f"waited {patience:g} s for {what}; {self._situation()}"
            self._pause.wait(0.01)

    def _situation(self) -> str:
        state = self.heard.states[-1].body if self.heard.states else None
        modes = {name: reports[-1].body.mode for name, reports in self.heard.reports.items()}
        words = "no referee" if state is None else f"{state.stage}, halted: {state.halted}, waiting: {state.waiting}"
        return (
            f"match time {self.now:.2f}, {words}, modes {modes}, last calls {[c.text for c in self.heard.calls[-3:]]}"
        )

    @property
    def now(self) -> float:
        """Match time of the newest clock, s."""
        return self.heard.clocks[-1].stamp if self.heard.clocks else 0.0

    @property
    def epoch(self) -> int:
        """Of the world."""
        return self.heard.clocks[-1].body.epoch

    @property
    def state(self) -> m.RefereeState:
        """The referee's newest."""
        return self.heard.states[-1].body

    @property
    def playing(self) -> bool:
        """Play goes on."""
        return bool(self.heard.states) and self.state.stage is m.Stage.PLAY_ROUND and self.state.halted is None

    def mode(self, player: str) -> str:
        """What a player last reported to do."""
        return self.heard.reports[player][-1].body.mode

    def body(self, name: str, poses: Received[m.Poses] | None = None) -> m.Body:
        """A robot in the newest poses, or in the given ones."""
        return next(b for b in (poses or self.heard.poses[-1]).body.bodies if b.name == name)

    def moving(self, *names: str) -> bool:
        """Whether all of these robots drive, by the newest poses."""
        return bool(self.heard.poses) and all(abs(self.body(name).v) > 0.1 for name in names)

    def standing(self, *names: str) -> bool:
        """Whether all of these robots stand, by the newest poses."""
        return all(at_rest(self.body(name)) for name in names or [b.name for b in self.heard.poses[-1].body.bodies])

    def first_rest(self, name: str, since: int) -> float | None:
        """Match time from which a robot stood, among the poses heard from number `since` on; None = it drove on."""
        for poses in self.heard.poses[since:]:
            if at_rest(self.body(name, poses)):
                return poses.stamp
        return None

    def time_passes(self, seconds: float, what: str) -> None:
        """Wait until that much match time has gone by."""
        until = self.now + seconds
        self.wait_until(lambda: self.now >= until, f"{seconds} s of match time: {what}")

    def go_on(self) -> None:
        """Go on if play is halted, as an official does: what has latched is cleared first.

        On a small machine a robot's pose, its drives' heartbeats or the world's clock may come late, which halts play.
        """
        if self.state.halted and any("vrg official recover" in why for why in self.state.waiting):
            self.decide(m.OfficialAction.RECOVER)
            self.time_passes(0.5, "the robots' answer")
        if self.state.halted and not self.state.waiting:
            self.decide(m.OfficialAction.RESUME)
            self.time_passes(0.5, "the referee's answer")

    def decide(self, action: m.OfficialAction, subject: str | None = None, value: str | None = None) -> None:
        """Speak as an official."""
        self._mailbox.publish(
            self.keys.official, m.Official(action=action, by="observer", subject=subject, value=value)
        )
        out = self._mailbox.collect()
        assert self._session.wait_for_listener(self.keys.official.key, self.keys.official.qos, PATIENCE)
        self._session.send(out)


def at_rest(body: m.Body) -> bool:
    """Whether a robot stands."""
    return abs(body.v) < AT_REST and abs(body.w) < 2 * AT_REST
