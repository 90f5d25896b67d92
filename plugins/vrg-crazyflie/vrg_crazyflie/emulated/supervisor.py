"""The supervisor of the firmware, which decides whether the motors may turn (crazyflie-firmware 2026.08, supervisor.c
and supervisor_state_machine.c), as on a Crazyflie 2.1, whose motors do not tell whether they turn."""

import math
from enum import Enum
from typing import Final

from vrg_crazyflie.report import Info

LEVEL_TIMEOUT, OFF_TIMEOUT = 0.5, 2.0
"""The age in s of a set-point from which the firmware levels the body, and switches the motors off for good
(COMMANDER_WDT_TIMEOUT_STABILIZE and _SHUTDOWN)."""
STOP_WATCHDOG: Final = 1.0
"""The time in s within which the emergency stop's watchdog must be notified again, once it was."""
FLYING_HYSTERESIS: Final = 2.0
"""The time in s without thrust after which it counts as landed (IS_FLYING_HYSTERESIS_THRESHOLD)."""
LANDING_TIMEOUT, PREFLIGHT_TIMEOUT = 3.0, 30.0
"""The time in s after a landing, and after arming without a take-off, after which it is disarmed."""
TILT_LIMIT, TILT_TIME = 0.5, 1.0
"""The acceleration along the body's z axis in g below which it is tilted, and for how many s it may be."""
UPSIDE_DOWN_LIMIT, UPSIDE_DOWN_TIME = -0.2, 0.1
"""The same of one that is upside down."""


State = Enum("State", "NOT_READY READY_TO_ARM READY_TO_FLY FLYING LANDED LEVELLING LOCKED CRASHED")
"""The states of the supervisor."""
ABLE: Final = frozenset({State.READY_TO_FLY, State.FLYING, State.LANDED, State.LEVELLING})
"""The states in which the motors may turn."""


class Supervisor:
    """The state machine. The times that it is given are s since the firmware started.

    Args:
        auto_arm: True for brushed motors, as those of the Crazyflie 2.1: it arms itself.
    """

    def __init__(self, *, auto_arm: bool = True) -> None:
        self.auto_arm = auto_arm
        self.state = State.NOT_READY
        self.armed = self.crashed = self.tumbled = self.emergency = False
        self._tilted: float | None = None
        self._thrust = -math.inf
        self._since = 0.0
        self._notified: float | None = None

    @property
    def able(self) -> bool:
        """True if the motors may turn."""
        return self.state in ABLE

    def info(self, planning: Info) -> Info:
        """The bits that it reports, with those of the high-level commander."""
        flying = self.state in (State.FLYING, State.LEVELLING)
        bits = (self.state is State.READY_TO_ARM, self.armed, self.auto_arm, self.able, flying, self.tumbled,
                self.state is State.LOCKED, self.crashed)  # fmt: skip
        return planning | Info(sum(1 << n for n, is_set in enumerate(bits) if is_set))

    def arm(self, wanted: bool) -> bool:
        """Arm or disarm; return whether that was granted."""
        if wanted and not self.armed and self.state is not State.READY_TO_ARM:
            return False
        self.armed = wanted
        return True

    def recover(self) -> bool:
        """Forget a crash, if it lies on its feet; return whether that was granted."""
        if self.crashed and self.tumbled:
            return False
        self.crashed = False
        return True

    def notify(self, now: float) -> None:
        """Whoever commands it is alive: from the first time on, this must come again within STOP_WATCHDOG."""
        self._notified = now

    def update(self, now: float, *, thrust: bool, up: float, age: float) -> None:
        """Judge the state again, as the firmware does 25 times a second.

        Args:
            thrust: whether a motor turns faster than idling. up: the acceleration along the body's z axis, g; 1 at
                rest. age: that of the newest set-point, s.
        """
        if thrust:
            self._thrust = now
        self._judge_tilt(now, up)
        stop = self.emergency or (self._notified is not None and now >= self._notified + STOP_WATCHDOG)
        before = self.state
        self.state = self._next(now, stop, age)
        if self.state is before:
            return
        self._since = now
        if self.state is State.CRASHED:
            self.crashed = True
        if not self.able:
            self.armed = self.auto_arm and self.state is State.READY_TO_ARM

    def _judge_tilt(self, now: float, up: float) -> None:
        if abs(up) < 0.1 or up >= TILT_LIMIT:  # in free fall, or on its feet
            self._tilted, self.tumbled = None, False
            return
        self._tilted = now if self._tilted is None else self._tilted
        limit = UPSIDE_DOWN_TIME if up < UPSIDE_DOWN_LIMIT else TILT_TIME
        self.tumbled = now - self._tilted > limit

    def _next(self, now: float, stop: bool, age: float) -> State:
        """The next state: the first one in the row of this one whose condition holds."""
        flying = now - self._thrust < FLYING_HYSTERESIS
        waited = now - self._since
        rows: dict[State, tuple[tuple[bool, State], ...]] = {
            State.NOT_READY: ((stop, State.LOCKED), (not self.tumbled, State.READY_TO_ARM)),
            State.READY_TO_ARM: (
                (stop, State.LOCKED), (self.tumbled, State.NOT_READY), (self.armed, State.READY_TO_FLY),
            ),
            State.READY_TO_FLY: (
                (stop, State.LOCKED), (self.tumbled or not self.armed or waited > PREFLIGHT_TIMEOUT, State.NOT_READY),
                (flying, State.FLYING),
            ),
            State.FLYING: (
                (stop or age > OFF_TIMEOUT, State.LOCKED), (self.tumbled, State.CRASHED),
                (not self.armed, State.NOT_READY), (age > LEVEL_TIMEOUT, State.LEVELLING), (not flying, State.LANDED),
            ),
            State.LEVELLING: (
                (stop or self.tumbled or age > OFF_TIMEOUT, State.LOCKED), (age <= LEVEL_TIMEOUT, State.FLYING),
            ),
            State.LANDED: (
                (not self.armed or waited > LANDING_TIMEOUT, State.NOT_READY), (flying, State.FLYING),
            ),
            State.CRASHED: ((not self.crashed and not self.tumbled, State.NOT_READY), (stop, State.LOCKED)),
            State.LOCKED: (),  # until it is switched off
        }  # fmt: skip
        return next((state for holds, state in rows[self.state] if holds), self.state)
