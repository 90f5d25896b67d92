"""Meets the drives of a robot, step by step: each must identify itself before it is set up. Numbers alone.

A robot that is recovered meets them again: what was started again, or plugged in, may not be what it was.

Nothing is sent to drives that another program commands: to be asked and set up would disturb who does.
"""

import enum
from collections.abc import Sequence

from vrg.errors import RobotError
from vrg.hal.can.axis import NEVER, AxisReport

LISTEN = 0.4
"""s for which a newcomer only listens. A program that drives these drives sends several setpoints in that time."""
HEAR_TIMEOUT = 3.0
"""s in which nothing new has been heard of drives, after which a silent one is given up."""
IDENTIFY_TIMEOUT = 10.0
"""s in which nothing new has been heard, after which a drive that is heard but does not say who it is is given up."""
ANSWERS_SETTLE = 0.2
"""s more, for a second drive with the same id to answer too."""
ASK_PERIOD = 0.5
"""s from one question to a drive that has not answered to the next, and the most that is waited for an answer."""


class MeetingStep(enum.Enum):
    """The next step of a meeting."""

    WAIT = enum.auto()
    ASK = enum.auto()
    SET_UP = enum.auto()


class MissingError(RobotError):
    """A drive has not been heard, or has not answered who it is."""


class Meeting:
    """The steps by which a robot meets its drives. Times are monotonic, s.

    Args:
        protocol: the name of the drives' protocol, for messages. reports: what the drives report. now: it begins.
    """

    def __init__(self, protocol: str, reports: Sequence[AxisReport], now: float) -> None:
        self._protocol = protocol
        self._reports = reports
        self._began = self._news_at = now
        self._asked = NEVER
        self._known_at: float | None = None
        self._known = (0, 0)

    def step(self, now: float) -> MeetingStep:
        """The next step: listen, ask every drive who it is, and set it up.

        Raises:
            RobotError: a drive does not make sense, or cannot be used.
            MissingError: a drive has not been heard, or has not answered; its words say which.
        """
        if now - self._began < LISTEN:
            return MeetingStep.WAIT
        if self._asked == NEVER or self._known_at is not None:
            self._require([(report.node, report.implausible) for report in self._reports])
        if self._known_at is None:
            if not all(self._hears(report) and report.identified for report in self._reports):
                return self._ask(now)
            self._known_at = now
        if now - self._known_at < ANSWERS_SETTLE:
            return MeetingStep.WAIT
        self._require([(report.node, report.problem) for report in self._reports])
        return MeetingStep.SET_UP

    def _require(self, problems: list[tuple[int, str | None]]) -> None:
        if words := [f"node {node}: {problem}" for node, problem in problems if problem]:
            raise RobotError("; ".join(words))

    def _ask(self, now: float) -> MeetingStep:
        """Wait for what drives say of themselves, for as long as there is progress."""
        known = (sum(map(self._hears, self._reports)), sum(report.identified for report in self._reports))
        if known != self._known:
            self._known, self._news_at = known, now
        if now - max(self._news_at, self._began + LISTEN) >= self.patience:
            raise MissingError(self._missing())
        if now - self._asked <= ASK_PERIOD:
            return MeetingStep.WAIT
        self._asked = now
        return MeetingStep.ASK

    @property
    def patience(self) -> float:
        """The time in s without anything new for which the meeting waits for drives."""
        return IDENTIFY_TIMEOUT if all(map(self._hears, self._reports)) else HEAR_TIMEOUT

    def _hears(self, report: AxisReport) -> bool:
        """True if a drive has been heard since the meeting began."""
        return report.heard >= self._began

    def _missing(self) -> str:
        """The messages that have not been received, and the drives that they are missing from."""
        silent = [str(report.node) for report in self._reports if not self._hears(report)]
        mute = [str(report.node) for report in self._reports if self._hears(report) and not report.identified]
        which = f"node{'s' if len(silent or mute) > 1 else ''} {', '.join(silent or mute)}"
        return f"{'a heartbeat' if silent else 'an answer to who they are'} of {self._protocol} {which}"
