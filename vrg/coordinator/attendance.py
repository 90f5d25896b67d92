"""The attendance of players, and the reasons outside the rules of any game that keep them and their robots from
playing."""

from collections.abc import Container, Sequence

from vrg.bus.codec import Received
from vrg.bus.flood import MAX_MESSAGE_RATE
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Report
from vrg.bus.node import Tick, is_fresh
from vrg.bus.topics import Keys
from vrg.coordinator.match import MAX_REASON_LENGTH
from vrg.types import few

REPORT_TIMEOUT = 1.0
"""The match time in s without a report after which a player counts as absent."""
ABSENCE_TIMEOUT = 5.0
"""The time in s for which a player in play may be silent, while the match goes on, before something is done about it.

At a higher rate it is so many times longer in match time, because it takes real time to start a process again.
"""
_STEP = 0.2
"""The longest match time in s that one tick adds to a player's silence: while the bus stalls, no report arrives."""
POSE_TIMEOUT = 0.5
"""The age in s of a physical robot's pose above which a match in play is halted."""
_ENDED = 0.3
"""The match time in s without a report, together with a lost pose, after which a player's process has likely ended."""
_READMISSION_DELAY = 0.5
"""The match time in s after a player was taken out from which on a report must be of a process that works again."""


class Attendance:
    """The attendance of the players of a match. `lost` is set by the caller, who looks at the field.

    Args:
        mailbox: the coordinator's mailbox. keys: the keys of the match. names: the players.

    Attributes:
        lost: the physical robots whose poses are too old.
    """

    def __init__(self, mailbox: Mailbox, keys: Keys, names: Sequence[str]) -> None:
        self._names = names
        self._mailbox = mailbox
        self._keys = {name: keys.report(name).key for name in names}
        self._own = {name: {keys.bid(name).key, keys.sightings(name).key, self._keys[name]} for name in names}
        self._reports = mailbox.subscribe(keys.report(), only=self._keys.values())
        self._out_since: dict[str, float] = {}
        self._silence: dict[str, float] = dict.fromkeys(names, 0.0)
        self.lost: list[str] = []
        self._well: Tick | None = None
        """The tick in which all players report, and lack nothing."""

    def report(self, name: str) -> Received[Report] | None:
        """The newest report of a player."""
        return self._reports.by_key.get(self._keys[name])

    def reports_now(self, name: str, tick: Tick) -> bool:
        """True if a player reports."""
        return self._age_below(name, tick, REPORT_TIMEOUT)

    def estop_holders(self, tick: Tick) -> list[str]:
        """The players whose robots have latched the emergency stop."""
        if self._is_well(tick):
            return []
        # Without a clock, after a restart, the age of a report is not known: it may be true.
        return [
            name
            for name in self._names
            if (report := self.report(name)) is not None
            and report.body.estop
            and (self.reports_now(name, tick) or not tick.live)
        ]

    def absent(self, tick: Tick, out: Container[str], *, estop: bool) -> tuple[list[str], list[str]]:
        """The reasons why play cannot go on: those that a person must do something about, and those that may pass.

        Args:
            out: the players that are disqualified, which are not waited for.
            estop: the emergency stop is engaged, from which follow the faults of robots that have not latched.
        """
        if self._is_well(tick):
            return [], []
        reasons, passing, starting = [], [], list[str]()
        for name in self._names:
            report = self.report(name)
            # A robot whose player is out, but still runs, may yet have a fault that a person must look at.
            if name in out and not (report is not None and report.body.latched and self.reports_now(name, tick)):
                continue
            if report is None:
                starting.append(name)
            elif not self.reports_now(name, tick):
                passing.append(f"{name} does not report")
            elif fault := _fault(name, report.body):
                if report.body.latched and not report.body.pressed:
                    reasons.append(f"{fault} (an official recovers the robot)")
                elif not estop:
                    passing.append(fault)
        if starting:
            ready = f"{len(self._names) - len(starting)} of {len(self._names)} players are ready"
            passing.insert(0, f"starting: {few(starting)} ({ready})")
        passing += [_lost(name) for name in self.lost if name not in out and name not in starting]
        return reasons, passing

    def listen(self, tick: Tick, dt: float) -> None:
        """Count for how long each player has been silent; called once a tick.

        Args:
            dt: the match time since the last tick, s.
        """
        if self._is_well(tick):
            self._silence = dict.fromkeys(self._names, 0.0)
            return
        for name in self._names:
            now = self.report(name) is None or self.reports_now(name, tick)
            self._silence[name] = 0.0 if now else self._silence[name] + min(dt, _STEP)

    def failing(
        self, tick: Tick, out: Container[str], *, rate: float, patient: bool
    ) -> tuple[dict[str, str], list[str]]:
        """The players that cannot go on.

        Args:
            out: the players that are disqualified already.
            rate: match seconds per real second.
            patient: wait for a player whose process has likely ended, also if its robot is a physical one: its drives'
                own watchdogs stop that robot, so that it is where it was last.

        Returns:
            the players that have fallen silent, each with what it does not do; and the reasons why a match must be
            halted, because a physical robot needs a person.
        """
        if self._is_well(tick):
            return {}, []
        silent, halts = {}, []
        for name in self._names:
            report = self.report(name)
            if report is None or (name in out and not self.reports_now(name, tick)):
                continue
            if REPORT_TIMEOUT + self._silence[name] > ABSENCE_TIMEOUT * max(1.0, rate):
                silent[name] = f"has not reported for {ABSENCE_TIMEOUT:g} s"
            elif report.body.latched and (fault := _fault(name, report.body)):
                halts.append(fault)
            elif name in self.lost and not (patient and not self._age_below(name, tick, _ENDED)):
                halts.append(_lost(name))
        return silent, halts

    def flooding(self, out: Container[str]) -> dict[str, str]:
        """The players that flood the bus and are not yet out, each with what it does."""
        if not (flooded := self._mailbox.flooded):
            return {}
        what = f"floods the bus with more than {MAX_MESSAGE_RATE} messages a second"
        return {name: what for name in self._names if name not in out and flooded & self._own[name]}

    def back(self, tick: Tick, out: Sequence[str]) -> list[str]:
        """The players that are out and report again.

        Args:
            out: the players that may come back by reporting.
        """
        self._out_since = {name: self._out_since.get(name, tick.time) for name in out}
        return [
            name
            for name, since in self._out_since.items()
            if (report := self.report(name)) is not None
            and report.stamp > since + _READMISSION_DELAY
            and self.reports_now(name, tick)
            and name not in self.lost
        ]

    def _is_well(self, tick: Tick) -> bool:
        """True if all players report, no robot has a fault or holds the emergency stop, and none is lost.

        Nothing is then absent, failing or held: that is found out at a glance, as it is so in nearly every tick.
        """
        if self._well is not tick:
            reports = map(self._reports.by_key.get, self._keys.values())
            well = not self.lost and all(
                report is not None
                and is_fresh(report.stamp, tick.time, REPORT_TIMEOUT)
                and report.body.fault is None
                and not (report.body.latched or report.body.estop)
                for report in reports
            )
            self._well = tick if well else None
        return self._well is tick

    def _age_below(self, name: str, tick: Tick, limit: float) -> bool:
        report = self.report(name)
        return report is not None and is_fresh(report.stamp, tick.time, limit)


def _lost(name: str) -> str:
    return f"{name}: it has not been located for {POSE_TIMEOUT:g} s"


def _fault(name: str, report: Report) -> str | None:
    """The fault that a player reports, with its name, cut so that it fits into a call; None if there is none."""
    fault = report.fault or ("its robot has latched a fault" if report.latched else None)
    if fault is None:
        return None
    return f"{name}: {fault}"[:MAX_REASON_LENGTH]
