"""What is heard on the bus of a match, in the order of its arrival."""

import threading
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from vrg.bus import messages as m
from vrg.bus.access import may_publish
from vrg.bus.codec import Received, decode
from vrg.bus.mailbox import Mailbox
from vrg.bus.session import Session
from vrg.bus.topics import Keys, name_in
from vrg.coordinator.attendance import ABSENCE_TIMEOUT as AWAY
from vrg.errors import MessageError

PATIENCE = 30.0
"""s of match time, at rate 1, while the clock goes on, and s of real time in which no clock is heard.

Both are far more than anything waited for takes. A machine that is slow makes match time slow, too."""
LONGEST = 10.0
"""How many times as long as that a wait may take in real time: a clock that hardly goes on may as well stand."""
ANSWER = 0.5
"""s of match time for the referee's answer to an official."""
STALLED = ("the world's clock has stopped", "the referee did not run")
"""Why the referee halts play on a machine that stands still for some seconds."""
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
    manuals: dict[str, list[Received[m.Manual]]] = field(default_factory=lambda: defaultdict(list))
    limits: dict[str, float] = field(default_factory=dict)
    pulses: Counter[str] = field(default_factory=Counter)
    """By `kind/name`."""
    releases: int = 0
    """Of the emergency stop."""
    estops: list[tuple[float, m.Estop]] = field(default_factory=list)
    """With the match time of the newest clock that had arrived before."""
    bad: int = 0
    misrouted: list[tuple[str, str]] = field(default_factory=list)
    """The sender and the key of each message that its sender does not publish."""


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
        self._mailbox = Mailbox("official/observer")
        self._arrivals: deque[tuple[str, bytes]] = deque()
        self._pause = threading.Event()
        self._asked: float | None = None
        self._by_name: dict[type[m.Message], dict[str, list[Any]]] = {
            m.Drive: self.heard.drives,
            m.Report: self.heard.reports,
            m.RobotState: self.heard.robots,
            m.Manual: self.heard.manuals,
        }
        topics = (
            keys.clock, keys.poses, keys.drive(), keys.robot_state(), keys.report(), keys.referee_state,
            keys.referee_event, keys.speed_limit(), keys.estop, keys.estop_release, keys.pulse(), keys.manual(),
        )  # fmt: skip
        for topic in topics:
            session.watch_raw(topic.key, lambda key, payload: self._arrivals.append((key, payload)))

    def look(self) -> None:
        """Take in what has arrived."""
        self._alert()
        while self._arrivals:
            self._hear(*self._arrivals.popleft())

    def _check(self, received: Received[Any]) -> None:
        if not may_publish(received.sender, received.key):
            self.heard.misrouted.append((received.sender, received.key))

    def _hear(self, key: str, payload: bytes) -> None:
        topic = self.keys.topic_of(key)
        assert topic is not None
        try:
            received: Received[Any] = decode(payload, topic.type, key)
        except MessageError:
            self.heard.bad += 1
            return
        self._check(received)
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
            case m.Drive() | m.Report() | m.RobotState() | m.Manual():
                self._by_name[type(received.body)][name_in(key)].append(received)
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
            AssertionError: it does not within `patience` seconds (see PATIENCE); tells what was heard last.
        """
        began = quiet_since = time.monotonic()
        clocks, before, played = len(self.heard.clocks), self.now, 0.0
        while True:
            self.look()
            if condition():
                return
            now = time.monotonic()
            if len(self.heard.clocks) > clocks:
                clocks, quiet_since = len(self.heard.clocks), now
                # A world that is started again may go back a little. One that joins late hears a running match.
                played += max(0.0, self.now - (before or self.now)) / self.heard.clocks[-1].body.rate
                before = self.now
            over = played > patience or now - quiet_since > patience or now - began > LONGEST * patience
            passed = f"{played:.0f} s of the clock, {now - began:.0f} s of real time"
            assert not over, f"waited {passed} for {what}; {self._situation()}"
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

    def called(self, text: str) -> bool:
        """Whether the referee has called this."""
        return any(call.text == text for call in self.heard.calls)

    def moving(self, *names: str) -> bool:
        """Whether all of these robots drive, by the newest poses."""
        return bool(self.heard.poses) and all(abs(self.body(name).twist.v) > 0.1 for name in names)

    def standing(self, *names: str) -> bool:
        """Whether all of these robots stand, by the newest poses."""
        return all(at_rest(self.body(name)) for name in names or [b.name for b in self.heard.poses[-1].body.bodies])

    def last_motion(self, name: str, since: int) -> float | None:
        """Match time of the last poses before a robot stood, of those from number `since` on; None = it drove on.

        When it came to stand is not known better: a busy machine may keep this process from hearing poses for seconds.
        """
        before = self.heard.poses[max(0, since - 1)]
        for poses in self.heard.poses[since:]:
            if at_rest(self.body(name, poses)):
                return before.stamp
            before = poses
        return None

    def stopped_at(self, name: str, since: int, before: str) -> float | None:
        """Match time from which a robot stood, or at which it was driven by another process than before.

        A player that was killed may be back before its robot stands.

        Args:
            since: the number of the first poses that count. before: who sent its drive commands.
        """
        began, drives = self.heard.poses[since - 1].stamp, self.heard.drives[name]
        taken_over = next((drive.stamp for drive in drives if drive.stamp >= began and drive.sender != before), None)
        found = (self.last_motion(name, since), taken_over)
        return min((at for at in found if at is not None), default=None)

    def time_passes(self, seconds: float, what: str) -> None:
        """Wait until that much match time has gone by."""
        until = self.now + seconds
        self.wait_until(lambda: self.now >= until, f"{seconds} s of match time: {what}", PATIENCE + seconds)

    def go_on(self) -> None:
        """Go on if play is halted, as an official does: what has latched is cleared first.

        On a small machine a robot's pose, its drives' heartbeats or the world's clock may come late, which halts play.
        """
        if self.state.halted and any("an official recovers" in why for why in self.state.waiting):
            self._ask(m.OfficialAction.RECOVER)
        self.resume()

    def resume(self) -> None:
        """Resume play if it is halted and nothing hinders that; called again and again until it goes on.

        What hinders it may come between the look and the decision, which is then refused.
        """
        if self.state.halted and not self.state.waiting:
            self._ask(m.OfficialAction.RESUME)

    def _ask(self, action: m.OfficialAction) -> None:
        """Decide this, unless the last decision may not be answered yet."""
        if self._asked is None or abs(self.now - self._asked) >= ANSWER:
            self._asked = self.now
            self.decide(action)

    def wait_moving(self, *names: str) -> None:
        """Wait until these robots drive in play, which is resumed whenever the world's clock has stopped."""

        def moving() -> bool:
            if self.stalled:
                self.resume()
            return self.playing and self.moving(*names)

        self.wait_until(moving, f"{', '.join(names)} to move" if names else "play to go on")

    def halts_nobody_else(self, name: str) -> bool:
        """Whether a player's failure has halted nobody: play goes on, or the player has been away for too long.

        Then the match must be one that is halted for that.
        """
        self.look()
        if self.playing or self.stalled:
            return True
        halt = next(state for state in reversed(self.heard.states) if state.body.halted is None).stamp
        reported = max(report.stamp for report in self.heard.reports[name] if report.stamp <= halt)
        away = f"{name} has not reported for {AWAY:g} s"
        return self.state.halted == away and halt - reported >= AWAY - 2 * ANSWER

    @property
    def stalled(self) -> bool:
        """Play is halted because the machine stood still, and for nothing else."""
        return bool(self.heard.states) and (self.state.halted or "").startswith(STALLED)

    def undisturbed(self, attempt: Callable[[], None], times: int = 3) -> None:
        """Do something during which the referee calls nothing; again where the machine stood still meanwhile.

        Raises:
            AssertionError: the referee called something else, or the world's clock stopped each time.
        """
        for _ in range(times):
            since = len(self.heard.calls)
            attempt()
            texts = [call.text for call in self.heard.calls[since:]]
            if not any(words in text for text in texts for words in STALLED):
                assert texts == [], "nothing was called, nobody was halted"
                return
            self.wait_moving()
        raise AssertionError(f"{STALLED[0]}, {times} times")

    def estop(self) -> None:
        """Engage the emergency stop."""
        self._mailbox.publish(self.keys.estop, m.Estop(by="observer"))
        self._session.send(self._mailbox.collect())

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
    return abs(body.twist.v) < AT_REST and abs(body.twist.w) < 2 * AT_REST
