"""When a Crazyflie takes off, flies, lands and is cut: a state machine of numbers, without a clock and without a radio.

It takes off and flies by set-points, which the firmware's watchdog guards, and lands by the high-level commander on
board, which goes on landing if this computer dies meanwhile. Only where its estimator has diverged it lands by
set-points, too: the high-level commander would hold a place that is wrong.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

from vrg.errors import RobotError
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.types import STILL, Twist
from vrg_crazyflie.report import LOW_POWER, Info, Motion, Status

CLIMB_SPEED, LAND_SPEED = 0.4, 0.2
"""The speeds in m/s at which it takes off and, on average, lands."""
LONGEST_LANDING: Final = 3.5
"""The time in s that a landing takes at most, from wherever: the launcher kills a process that takes 5 s to stop."""
CLIMB_TOLERANCE: Final = 0.08
"""The distance in m from its height within which it hovers there."""
LOWEST, LEAD, CLIMB_GAIN = 0.2, 0.14, 2.0
"""The height in m down to which it sinks by command, the most that it is led up or down, less than SINK_DEPTH in m, and
the speed in m/s with which the firmware follows one metre of it (crazyflie-firmware 2026.08, PID_POS_Z_KP)."""
CLIMB_PATIENCE, ARM_PATIENCE, LAND_PATIENCE = 2.0, 3.0, 3.0
"""The time in s by which a take-off, arming and a landing may take longer than planned."""
ASK_TIMEOUT: Final = 0.5
"""The time in s after which a take-off is broken off that nobody asks for any more."""
LIFT_TIME, LIFT_HEIGHT = 1.2, 0.05
"""The time in s after which it must have left the ground by so many m, or its motors are cut."""
BRAKE_TIME, BRAKE_SPEED = 0.8, 0.1
"""It hovers before it lands, until it is slower than this, m/s, for so many s at most."""
GROUND_HEIGHT: Final = 0.05
"""The height in m above where it took off below which it has landed."""
REPEAT: Final = 0.3
"""The time in s after which something that has not been done is ordered again."""
REACTION: Final = 0.1
"""The time in s after which a report tells what an order has brought about: the supervisor works at 25 Hz."""
REPORT_TIMEOUT, BLIND_TIMEOUT = 0.5, 1.5
"""The age of the newest report in s from which it hovers in place, and from which it lands."""
LOW_TIME: Final = 2.0
"""The time in s for which the battery must be low: a manoeuvre lowers the voltage for a moment."""
FASTEST, JUMP = 3.0, 0.2
"""The speed in m/s and the distance in m by which two estimated places may differ: what goes beyond is no motion."""
SINK_DEPTH, SINK_TIME = 0.15, 0.5
"""It sinks if it is so many m too low for so many s while its thrust is up."""
LIFTING_THRUST: Final = 20_000.0
"""The thrust, of 65535, above which its thrust is up: it hovers at some 36,000 (PID_VEL_THRUST_BASE)."""


@dataclass(frozen=True)
class Hover:
    """Fly at a velocity in the frame of the body, m/s and rad/s, at a height in m."""

    twist: Twist
    height: float


@dataclass(frozen=True)
class Land:
    """Plan to land where it is, within so many s, at a height of the estimator's in m."""

    duration: float
    height: float


@dataclass(frozen=True)
class Arming:
    """Arm it, or disarm it."""

    wanted: bool


Order = Enum("Order", "OFF CUT RECOVER YIELD")
"""What is ordered without numbers: the motors off, once it has landed; an emergency stop; recovery from a crash; and
that the high-level commander takes over, which outranks set-points only then, and cuts the motors if it has no plan."""
Command = Hover | Land | Arming | Order


Phase = Enum("Phase", "GROUND ARMING CLIMBING FLYING BRAKING LANDING")
"""What it is doing."""


class Flight:
    """The flight of one Crazyflie.

    Args:
        name: of the robot, for messages.
        height: above the ground, to which it takes off, m. ceiling: the greatest to which commands make it climb, m.
        battery_low: the voltage in V under load below which it lands.

    Attributes:
        engaged: True while the emergency stop holds it. latched: the fault that stays until `recover`; empty for none.
    """

    def __init__(self, name: str, height: float, ceiling: float | None, battery_low: float) -> None:
        self._name, self._height, self._ceiling, self._battery_low = name, height, ceiling, battery_low
        self.engaged = False
        self.forget()

    def forget(self) -> None:
        """Begin anew, on the ground, with a Crazyflie that has just been connected."""
        self.phase, self.latched = Phase.GROUND, ""
        self.motion: Motion | None = None
        self.status: Status | None = None
        self._wanted = self._off = False
        self._asked = -math.inf
        """The time at which it was asked last to take off, s."""
        self._since = self._ordered = -math.inf
        self._ground = 0.0
        """The height that the estimator reported before it took off, m."""
        self._level, self._climbs = 0.0, False
        """The height above the ground that it keeps, m, and whether it was last told to climb or to sink."""
        self._command, self._commanded = STILL, -math.inf
        self._landing, self._lost_place = 0.0, False
        """The time that the landing takes, s, and whether it does not know its place."""
        self._low: float | None = None
        self._sunk: float | None = None
        """The times since when the battery is low, and it is too low, s."""

    @property
    def armed(self) -> bool:
        """True if it hovers and obeys commands."""
        return self.phase is Phase.FLYING and not self.engaged

    @property
    def aloft(self) -> bool:
        """True if its motors turn, or may."""
        return self.phase not in (Phase.GROUND, Phase.ARMING)

    def arm(self, now: float) -> None:
        """Take off as soon as nothing is in the way.

        It is asked for again and again until it hovers: if that ceases, as in a HALT, the take-off is broken off.

        Raises:
            RobotError: the emergency stop is engaged, or a fault has latched.
        """
        if self.engaged:
            raise RobotError("the emergency stop is engaged: release it, then arm", self._name)
        if self.latched:
            raise RobotError(f"{self.latched}: recover it, then arm", self._name)
        self._wanted, self._asked = True, now

    def drive(self, twist: Twist, now: float) -> None:
        """Take a command, which holds for COMMAND_TIMEOUT.

        Raises:
            RobotError: it does not fly, or not any more.
        """
        if not self.armed:
            raise RobotError(f"{self.fault(now) or 'expected one that hovers'}: call arm() until it hovers", self._name)
        self._command, self._commanded = twist, now

    def stop(self) -> None:
        """Hover in place."""
        self._command = STILL

    def disarm(self, now: float) -> None:
        """Land."""
        self._wanted, self._command = False, STILL
        if self.phase is Phase.ARMING:
            self._off = True
            self._go(Phase.GROUND, now)
        elif self.phase in (Phase.CLIMBING, Phase.FLYING):
            self._go(Phase.BRAKING, now)

    def engage(self) -> None:
        """Cut the motors, until `release`."""
        self.engaged = True
        self._wanted, self.phase = False, Phase.GROUND

    def release(self) -> None:
        """Let go of the emergency stop."""
        self.engaged = False

    def hear(self, motion: Motion) -> None:
        """Take in a report of its motion."""
        before, self.motion = self.motion, motion
        if not self.aloft or before is None:
            return
        gap = math.dist((motion.x, motion.y, motion.z), (before.x, before.y, before.z))
        if not motion.is_finite or gap > JUMP + FASTEST * max(0.0, motion.heard - before.heard):
            self._lost_place = True
            what = f"has jumped by {gap:.2f} m" if motion.is_finite else "is no number"
            self._fail(f"its estimator has diverged: its place {what}", motion.heard)

    def hear_status(self, status: Status) -> None:
        """Take in a report of its state."""
        self.status = status
        now, info = status.heard, status.info
        if Info.LOCKED in info:
            self.lose("its firmware has locked the motors, after an emergency stop or without set-points: restart it")
        elif Info.CRASHED in info:
            self.lose("it has crashed: it has tumbled in flight: set it upright")
        elif self.aloft and Info.CAN_FLY not in info:
            self.lose("its firmware has switched the motors off in flight")
        is_low = status.volts < self._battery_low or status.power in LOW_POWER
        self._low = None if not is_low else now if self._low is None else self._low
        if self.aloft and self._low is not None and now - self._low >= LOW_TIME:
            self._fail(f"its battery is low, {status.volts:.2f} V: charge it", now)

    def fault(self, now: float) -> str:
        """What is wrong; empty if nothing is."""
        motion, status = self.motion, self.status
        if self.latched:
            return self.latched
        if motion is None or status is None:
            return "it has not reported yet"
        if (age := now - motion.heard) > REPORT_TIMEOUT:
            return f"it has not reported for {age:.1f} s"
        found = {
            "its estimator says what is no number: restart it": not motion.is_finite,
            "it still flies: wait until it has landed": status.flies,
            "it lies tilted or upside down: set it upright": Info.TUMBLED in status.info,
            "one of its decks reports a fault: look at it, then restart it": Info.DECK_FAULT in status.info,
            f"its battery is low, {status.volts:.2f} V: charge it": self._low is not None,
        }
        return "" if self.aloft else next((text for text, holds in found.items() if holds), "")

    def step(self, now: float) -> list[Command]:
        """What to send now. It must be called at least every 0.1 s."""
        motion, status = self.motion, self.status
        if self.engaged:
            return [] if status is not None and Info.LOCKED in status.info else [Order.CUT]
        if motion is None or status is None:
            return []
        if self.aloft and now - motion.heard > BLIND_TIMEOUT:
            self._fail(f"it has not reported for {BLIND_TIMEOUT:g} s", now)
        if self.phase in (Phase.ARMING, Phase.CLIMBING) and now - self._asked > ASK_TIMEOUT:
            self.disarm(now)
        steps = {
            Phase.GROUND: self._waiting, Phase.ARMING: self._arming, Phase.CLIMBING: self._climbing,
            Phase.FLYING: self._flying, Phase.BRAKING: self._braking, Phase.LANDING: self._land,
        }  # fmt: skip
        return steps[self.phase](now, motion, status)

    def _waiting(self, now: float, _motion: Motion, status: Status) -> list[Command]:
        if self._off:  # the firmware would obey the last set-point again as soon as it may
            self._off = False
            return [Order.OFF, Arming(False)]
        if self._wanted and not self.fault(now):
            self._go(Phase.ARMING, now)
        elif Info.FLYING in status.info and not status.flies:
            # It counts as flying for 2 s after it has landed, and its firmware locks the motors if nothing is sent.
            return self._again(now, Order.OFF)
        return []

    def _arming(self, now: float, motion: Motion, status: Status) -> list[Command]:
        is_new = status.heard > self._since + REACTION  # it may have been disarmed just before
        if is_new and Info.ARMED in status.info and Info.CAN_FLY in status.info:
            self._ground, self._sunk = motion.z, None
            self._go(Phase.CLIMBING, now)
            return [Hover(STILL, motion.z)]
        if now - self._since > ARM_PATIENCE:
            self.lose("its firmware refuses to arm: see its log in cfclient")
            return []
        return self._again(now, Arming(True))

    def _climbing(self, now: float, motion: Motion, _status: Status) -> list[Command]:
        passed = now - self._since
        risen, wanted = motion.z - self._ground, CLIMB_SPEED * passed
        if passed > LIFT_TIME and risen < LIFT_HEIGHT:
            self.lose("it does not leave the ground though its thrust is up: is a propeller blocked or a motor dead?")
            return []
        if wanted >= self._height and abs(risen - self._height) < CLIMB_TOLERANCE:
            self._go(Phase.FLYING, now)
        elif passed > self._height / CLIMB_SPEED + CLIMB_PATIENCE:
            self._fail(f"it does not reach its height of {self._height:g} m: it hovers at {risen:.2f} m", now)
        self._level = min(wanted, self._height)
        return [Hover(STILL, self._ground + self._level)]

    def _flying(self, now: float, motion: Motion, status: Status) -> list[Command]:
        risen = motion.z - self._ground
        is_low = risen < self._level - SINK_DEPTH and status.thrust > LIFTING_THRUST
        self._sunk = None if not is_low else now if self._sunk is None else self._sunk
        if self._sunk is not None and now - self._sunk >= SINK_TIME:
            self._fail("it sinks though its thrust is up: is a propeller damaged, or the load too heavy?", now)
        is_fresh = now - self._commanded <= COMMAND_TIMEOUT and now - motion.heard <= REPORT_TIMEOUT
        command = self._command if is_fresh else STILL
        if self._ceiling is not None and (command.climb or self._climbs):
            aim = risen + max(-LEAD, min(LEAD, command.climb / CLIMB_GAIN))
            # It keeps a level that it does not reach, or nobody would notice that it sinks.
            level = max(aim, self._level) if command.climb > 0.0 else min(aim, self._level) if command.climb else risen
            self._level, self._climbs = max(LOWEST, min(level, self._ceiling)), bool(command.climb)
        return [Hover(command, self._ground + self._level)]

    def _braking(self, now: float, motion: Motion, status: Status) -> list[Command]:
        if now - self._since < BRAKE_TIME and abs(motion.twist.speed) > BRAKE_SPEED:
            return [Hover(STILL, self._ground + self._level if self._lost_place else max(motion.z, self._ground))]
        height = motion.z - self._ground if not self._lost_place else self._level
        self._landing = min(max(0.5, height / LAND_SPEED), LONGEST_LANDING)
        self._go(Phase.LANDING, now)
        return self._land(now, motion, status)

    def _land(self, now: float, motion: Motion, _status: Status) -> list[Command]:
        passed = now - self._since
        is_down = passed >= self._landing and motion.z - self._ground < GROUND_HEIGHT
        if is_down or passed > self._landing + LAND_PATIENCE:
            self._go(Phase.GROUND, now)
            return [Order.OFF, Arming(False)]
        if self._lost_place:
            return [Hover(STILL, self._ground + self._level * (1.0 - passed / self._landing))]
        # The high-level commander must have planned before it takes over, so it does that a step later.
        return (self._again(now, Land(self._landing, self._ground)) or [Order.YIELD]) if passed < self._landing else []

    def _again(self, now: float, command: Command) -> list[Command]:
        """A command that is repeated until it is seen to be obeyed."""
        if now - self._ordered < REPEAT:
            return []
        self._ordered = now
        return [command]

    def _fail(self, why: str, now: float) -> None:
        """Latch a fault with which it can still land, and land."""
        if not self.latched:
            self.latched = f"{why}; it lands" if self.aloft else why
        self.disarm(now)

    def lose(self, why: str) -> None:
        """Latch a fault with which nobody can fly it any more, such as a lost link."""
        if not self.latched or self.aloft:
            self.latched = why
        self._wanted, self._off, self.phase = False, True, Phase.GROUND

    def _go(self, phase: Phase, now: float) -> None:
        self.phase, self._since, self._ordered, self._climbs = phase, now, -math.inf, False
