"""Match time and real time: how the one becomes the other, and when a node is ticked. This module reads no clock."""

import logging
from collections.abc import Sequence
from typing import Final

from vrg.bus.clock_tracker import ClockTracker
from vrg.bus.codec import Received
from vrg.bus.messages import Clock
from vrg.bus.node import Tick, due_index

log = logging.getLogger(__name__)

FULL_SPEED_RATE: Final = 10.0
"""Match seconds per real second that are assumed where the world runs as fast as it can."""
LEASE: Final = 0.3
"""The real time in s that a command of a person, or of a ROS node, holds. Commands come at least ten times a second."""
MAX_LEASE: Final = 1.0
"""The longest lease that a message can ask for, s of match time."""
STALL = 0.5
"""The real time in s without the world's clock after which a node learns that time has stopped."""
FROZEN = 1.0
"""The real time in s after which a process that has not listened was stopped, or its computer slept: its node learns
that time has stopped before it hears of any other. No strategy takes so long."""


def match_speed(rate: float) -> float:
    """Return the match seconds per real second, at least 1. A rate of 0 means as fast as possible."""
    return max(1.0, rate if rate > 0 else FULL_SPEED_RATE)


def lease(rate: float) -> float:
    """The match time in s that a command holds, at `rate` match seconds per real second."""
    return min(MAX_LEASE, LEASE * match_speed(rate))


class Pacer:
    """Tells when a node is ticked, by the clock messages that its process hears.

    Args:
        period: that of the node, match time in s. now: the real time, s.

    Attributes:
        time: the match time of the newest clock message, s. heard: True if there has been such a message.
        stalled: True if none has arrived for STALL seconds of real time, or the router is away and nothing is heard.
        missed: the number of ticks that were due but never done.
        tracker: knows how the process' own clock runs against the match clock.
    """

    def __init__(self, period: float, now: float) -> None:
        self._period = period
        self._epoch = self._number = 0
        self._heard_at = self._looked_at = self._woke_at = now
        self._frozen = 0.0
        self._last = -1
        self.tracker = ClockTracker()
        self.time = 0.0
        self.heard = self.stalled = False
        self.missed = 0

    def hear(self, messages: Sequence[Received[Clock]], now: float, *, cut: bool) -> bool:
        """Take in clock messages; return whether the world was restarted since the last ones.

        Args:
            now: the real time, s. cut: True if nothing was received for a while, and the router is away.
        """
        restarted = False
        # A process that was frozen finds a message that was sent while it was, and must not take it for the next one.
        # It looks often: had the clock stopped while it ran, it would be stalled by now.
        slept, silence = now - self._looked_at, now - self._heard_at
        frozen = self.heard and not self.stalled and silence > FROZEN
        if messages or now - self._woke_at > STALL:
            self._frozen = 0.0  # from here on the world has been silent while this process ran
        for message in messages:
            self.time, self._heard_at = message.stamp, now
            self.tracker.heard(message.stamp, message.body.rate, now)
            self.heard, self.stalled = True, False
            restarted |= message.body.epoch != self._epoch or message.body.tick < self._number
            self._epoch, self._number = message.body.epoch, message.body.tick
        if not self.stalled and (cut or frozen or now - self._heard_at > STALL):
            self.stalled = True
            if frozen or (self.heard and not cut and slept > silence / 2):
                self._frozen, self._woke_at = slept, now
                log.warning("this process did not run for %.1f s at %.2f s", self._frozen, self.time)
            elif cut or self.heard:
                log.warning("%s at %.2f s", "the router is away" if cut else "the world's clock has stopped", self.time)
            else:
                log.info("waiting for the world's clock")
        self._looked_at = now
        if restarted:
            self._last = -1
        return restarted

    def tick(self) -> Tick | None:
        """The tick that is due now; None if there is none."""
        if self.stalled:
            return Tick(self.time, live=False, frozen=self._frozen)
        index = due_index(self.time, self._period)
        if not self.heard or index <= self._last:
            return None
        self.missed += index - self._last - 1 if self._last >= 0 else 0
        self._last = index
        return Tick(self.time)
